"""The programs of trainings, compiled for a GPU on a machine without one: kernels, launches, seconds of compilation.

    python benchmarks/gpu_programs.py [--tasks hover] [--algos ppo bptt] [--json FILE]

It needs JAX's packages for CUDA (e2efly[cuda]), but neither a GPU nor its driver. The chunk of updates of the preset
nominal, in its sizes for a GPU, is compiled for an H200. Seconds are those of all cores together. The search for the
fastest kernels, which needs the card, is left out, as `fast_compile` does. Launches are counted in the optimised
program: each operation that is a kernel or a copy, as many times as the loops around it run, in both branches of a
condition.
"""

import dataclasses
import re
import resource
import time
from contextlib import suppress
from typing import Any

from common import arguments, table, write

from e2efly.simulation.device import FAST_COMPILE, prepare

prepare("cpu")

import jax  # noqa: E402
import numpy as np  # noqa: E402
from jax.experimental import topologies  # noqa: E402
from jax.sharding import AxisType, Mesh  # noqa: E402

from e2efly.environment import random_key  # noqa: E402
from e2efly.learning import devices, programs  # noqa: E402
from e2efly.learning.setup import Setup  # noqa: E402
from e2efly.runs import presets  # noqa: E402

H200 = """
gpu_device_info {
  cuda_compute_capability { major: 9 feature_extension: ACCELERATED_FEATURES }
  core_count: 132 fpus_per_core: 128 threads_per_warp: 32 threads_per_block_limit: 1024 threads_per_core_limit: 2048
  thread_dim_limit_x: 1024 thread_dim_limit_y: 1024 thread_dim_limit_z: 64
  block_dim_limit_x: 2147483647 block_dim_limit_y: 65535 block_dim_limit_z: 65535
  shared_memory_per_block: 49152 shared_memory_per_core: 233472 shared_memory_per_block_optin: 232448
  registers_per_core_limit: 65536 registers_per_block_limit: 65536 device_address_bits: 64
  memory_bandwidth: 4800000000000 l2_cache_size: 52428800 clock_rate_ghz: 1.98 device_memory_size: 151397597184
  name: "NVIDIA H200" device_vendor: "NVIDIA Corporation" platform_version: "Compute Capability 9.0a"
  driver_version: "13.0.0" runtime_version: "12.8.0" compile_time_toolkit_version: "12.8.0" dnn_version: "9.10.0"
}
platform_name: "CUDA"
dnn_version_info { major: 9 minor: 10 }
"""
"""The card, as XLA wants to be told of it."""
FREE = ("get-tuple-element", "tuple", "bitcast", "parameter", "constant")
"""Operations that launch nothing."""


def launches(program: str) -> float:
    """Kernels and copies that one run of an optimised program launches."""
    bodies: dict[str, list[str]] = {}
    entry, name = "", ""
    for line in program.splitlines():
        if begun := re.match(r"(ENTRY )?%?([\w.-]+) .*\{$", line):
            name = begun[2]
            bodies[name] = []
            entry = name if begun[1] else entry
        elif name and line.startswith("  "):
            bodies[name].append(line)

    def of(body: str) -> float:
        total = 0.0
        for line in bodies[body]:
            operation = re.search(r"[\]})] ([a-z][\w-]*)\(", line)
            called = re.findall(r"(?:body|to_apply|_computation)=%?([\w.-]+)|branch_computations={([^}]*)}", line)
            inner = [x.strip(" %") for one, many in called for x in (one, *many.split(",")) if x.strip(" %")]
            times = re.search(r'known_trip_count":\{"n":"(\d+)"', line)
            if operation and operation[1] in ("while", "call", "conditional"):
                total += float(times[1] if times else 1) * sum(of(x) for x in inner)
            elif operation and operation[1] not in FREE:
                total += 1
        return total

    return of(entry)


def seconds() -> float:
    """Processor seconds of this process and of those that it has started."""
    return time.process_time() + sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])


def row(task: str, algo: str, card: Any) -> dict[str, Any]:
    """What the chunk of updates of a training is on a card."""
    config = presets.starting(task, algo, presets.NOMINAL, device="gpu")
    setup = Setup.of(dataclasses.replace(config, devices=1))
    parameters = setup.parameters()
    state = jax.eval_shape(programs.start_program(setup), setup.env, parameters, random_key(0))
    state = jax.tree.map(lambda x: jax.ShapeDtypeStruct(x.shape, x.dtype), state)  # not yet on any device
    usual, backend = devices.mesh, jax.default_backend
    devices.mesh = lambda count, axis=devices.AXIS: Mesh(np.array([card]), (axis,), axis_types=(AxisType.Auto,))
    jax.default_backend = lambda: "gpu"
    try:
        same, own = devices.SAME, devices.OWN
        program = devices.on_each(programs._chunk(setup), 1, (same, same, own, same, same), (own, same))
        begun = seconds()
        traced = program.trace(setup.env, config.algo, state, 0, setup.updates).lower(lowering_platforms=("cuda",))
        lowered = seconds()
        compiled = traced.compile(compiler_options=FAST_COMPILE["gpu"]).as_text()
        ended = seconds()
    finally:
        devices.mesh, jax.default_backend = usual, backend
    return {
        "training": f"{task} by {algo.upper()}, {config.algo.envs:,} environments",
        "StableHLO operations": traced.as_text().count(" stablehlo."),
        "loops": len(re.findall(r" while\(", compiled)),
        "kernels": len(re.findall(r" (?:fusion|custom-call)\(", compiled)),
        "launches per update": round(launches(compiled) / config.chunk),
        "tracing, s": f"{lowered - begun:.1f}",
        "compiling, s": f"{ended - lowered:.1f}",
    }


def main() -> None:
    """Compile, print the table, write JSON."""
    options = arguments(__doc__ or "", tasks=["hover"], algos=["ppo", "bptt"])
    jax.config.update("jax_enable_compilation_cache", False)
    with suppress(RuntimeError):  # CUDA's plug-in is there, but finds no GPU
        jax.devices("cuda")
    (card,) = topologies.get_topology_desc("h200", "cuda", target_config=H200, topology="1x1x1").devices
    rows = [row(task, algo, card) for task in options.tasks for algo in options.algos]
    print(table(rows))
    write("gpu_programs", options.json, {"table": rows, "card": "NVIDIA H200"})


if __name__ == "__main__":
    main()
