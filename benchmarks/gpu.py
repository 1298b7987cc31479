"""What a GPU does with this package: rates of physics, environment, training and images, and trainings to criterion.

    python benchmarks/gpu.py [--parts physics images ...] [--device cpu] [--short] [--json FILE]

At most eight minutes, with e2efly[mesh-cuda]. Each part is a process of its own, which ends when its seconds are
over; what it did not measure until then, or cannot measure here, is named. Without a GPU, nothing is measured or
written, and the exit status is 1.
`--device cpu --short` runs every part in small, to see that it works: its figures are printed, never published.
"""

import json
import math
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from common import arguments, table, write

from e2efly.simulation.device import device_kind

GOALS = {
    "hover": "train hover --preset nominal --stop-at 0.99",
    "hover_ppo": "train hover --algo ppo --preset nominal --stop-at 0.99",
    "land": "train land --preset nominal --stop-at 0.99",
    "track": "train track --preset nominal --stop-at 0.99",
    "race": "train race --preset nominal --stop-at 0.95",
    "avoid": "train avoid --preset nominal --stop-at 0.95",
}
"""Trainings to a criterion, by the name of their part; the last one by sight."""
Row = tuple[str, float, str]
"""What is measured, its value, and the unit."""


def card(short: bool, device: str) -> Iterator[Row]:
    """The names of the devices, with JAX's platform, as `what` and unit."""
    import jax

    found = jax.devices()
    yield f"{len(found)} x {found[0].device_kind}", 0.0, found[0].client.platform_version.split("\n")[0]


def physics(short: bool, device: str) -> Iterator[Row]:
    """Sub-steps of the default integrator."""
    from variants import own_parameters

    from e2efly.learning.step_rates import physics_substeps

    sizes = (64, 256) if short else (1024, 65_536, 1_048_576)
    for n in sizes:
        yield f"physics sub-steps, {n:,} vehicles", physics_substeps(n), "/s"
    what = f"physics sub-steps, {sizes[-1]:,} vehicles, each with its own parameters"
    yield what, physics_substeps(sizes[-1], own_parameters(sizes[-1])), "/s"


def environment(short: bool, device: str) -> Iterator[Row]:
    """Environment steps of hover, everything included."""
    from e2efly.learning.step_rates import environment_steps

    for n in (64, 256) if short else (1024, 65_536, 524_288):
        yield f"environment steps, hover, {n:,} environments", environment_steps("hover", n), "/s"


def training(short: bool, device: str) -> Iterator[Row]:
    """Steps of training, with the sizes for the device and with those for a CPU."""
    from e2efly.learning.step_rates import training_steps
    from e2efly.runs import presets

    for sized in dict.fromkeys((device, "cpu")):
        for algo in ("ppo", "bptt"):
            config = presets.starting("hover", algo, presets.NOMINAL, device=sized)
            what = f"{algo.upper()} training steps, hover, {config.algo.envs:,} environments"
            yield what, training_steps(config), "/s"


def images(short: bool, device: str) -> Iterator[Row]:
    """Images of the clutter scene, a world for each camera."""
    import numpy as np
    from mesh_rendering import config, rates
    from rendering import clutter, ours, poses

    for channels in (("depth",), ("depth", "label", "rgb")):
        for n in (4,) if short else (100, 1024, 8192):
            scene, look = clutter(n, np.random.default_rng(0)), config(64)
            call = ours(scene, look, channels, *poses(scene, look, np.random.default_rng(1)))
            what = f"images 64x64, {', '.join(channels)}, {n:,} cameras"
            yield what, rates({what: call}, n, ROUNDS)[what], "/s"


def meshes(short: bool, device: str) -> Iterator[Row]:
    """Images of mesh scenes, by the kernels for the device."""
    import numpy as np
    from mesh_rendering import load_mesh_scene, mesh_scene_names, ours, poses, rates

    n = 4 if short else 1024
    for name in mesh_scene_names():
        scene = load_mesh_scene(name)
        pose = poses(scene, 64, n, np.random.default_rng(0))
        for channel in ("depth", "rgb"):
            what = f"images 64x64 of the mesh scene {name}, {channel}, {n:,} cameras"
            yield what, rates({what: ours(scene, 64, (channel,), pose)}, n, ROUNDS)[what], "/s"


def goal(command: str, short: bool, device: str) -> Iterator[Row]:
    """A training to its criterion, in a process as a user starts it: first with an empty cache of programs."""
    from time_to_criterion import run

    command += " --steps 8192" if short else ""
    with tempfile.TemporaryDirectory() as cache:
        for when in ("empty cache",) if short else ("empty cache", "programs in the cache"):
            yield f"`e2efly {command}`, {when}", run(command, 0, Path(cache), device)["seconds"], "s"


Part = Callable[[bool, str], Iterator[Row]]
PARTS: dict[str, tuple[float, Part]] = {
    "physics": (45, physics),
    "environment": (45, environment),
    "training": (75, training),
    "images": (35, images),
    "meshes": (35, meshes),
} | {
    name: (seconds, partial(goal, GOALS[name]))
    for name, seconds in {"hover": 30, "hover_ppo": 25, "land": 25, "track": 25, "race": 35, "avoid": 90}.items()
}
"""The parts, and the seconds that each may take. What a part leaves over is there for those that follow."""
START = 15.0
"""Seconds within which the card must be found. With those of the parts: eight minutes."""
ROUNDS = 15
"""Calls of which a rate of images is the median."""
PATIENCE = 3600.0
"""Seconds for a part where there is no GPU."""


def inside(part: str, short: bool, device: str) -> None:
    """Run a part in this process, and print each row as it is measured."""
    if part not in GOALS:  # those compute in a process of their own, and a card has no memory for two
        from e2efly.simulation.device import prepare

        prepare(device)
    for row in card(short, device) if part == "card" else PARTS[part][1](short, device):
        print(json.dumps(row), flush=True)


def measured(part: str, short: bool, device: str, seconds: float) -> tuple[list[Row], str]:
    """The rows that a part measured within its seconds, and why others are missing, if any."""
    command = [sys.executable, __file__, "--inside", part, "--device", device, *(["--short"] if short else [])]
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as errors:
        process = subprocess.Popen(command, stdout=out, stderr=errors, start_new_session=True)
        why = ""
        try:
            if process.wait(seconds):
                errors.seek(0)
                why = (errors.read().strip().splitlines() or ["it failed without a word"])[-1]
        except subprocess.TimeoutExpired:
            why = f"its {seconds:.0f} s were over"
            os.killpg(process.pid, signal.SIGKILL)  # with the processes that it started
            process.wait()
        out.seek(0)
        return [tuple(json.loads(line)) for line in out.read().splitlines() if line.startswith("[")], why


def main() -> None:
    """Measure, print, and write JSON."""
    options = arguments(__doc__ or "", parts=list(PARTS), device="gpu", short=False, inside=None)
    if options.inside:
        inside(options.inside, options.short, options.device)
        return
    if unknown := [part for part in options.parts if part not in PARTS]:
        sys.exit(f"--parts has {', '.join(unknown)}; accepted: {', '.join(PARTS)}")
    on_gpu = options.device == "gpu"
    if on_gpu and device_kind() != "gpu":
        sys.exit("there is no GPU here that JAX could use: nothing was measured, nothing was written")
    began = time.monotonic()
    found, why = measured("card", options.short, options.device, START if on_gpu else PATIENCE)
    if why:
        sys.exit(f"the device could not be used ({why}): nothing was measured, nothing was written")
    name, _, platform = found[0]
    print(f"{name}, {platform}", flush=True)
    rows, missing, given = [], [], START
    for part in options.parts:
        given += PARTS[part][0]
        left = given - (time.monotonic() - began) if on_gpu else PATIENCE
        found, why = measured(part, options.short, options.device, left)
        rows += [{"what": what, "value": shown(value, unit)} for what, value, unit in found]
        missing += [f"{part}: {why}"] if why else []
        print(*(f"{row['what']}: {row['value']}" for row in rows[len(rows) - len(found) :]), sep="\n", flush=True)
        print(*([f"not measured: {missing[-1]}"] if why else []), sep="\n", flush=True)
    print(table(rows) if rows else "nothing was measured", f"{time.monotonic() - began:.0f} s", sep="\n")
    if options.json or (on_gpu and not options.short and options.parts == list(PARTS)):
        about = {"card": name, "platform": platform, "by": "benchmarks/gpu.py", "not_measured": missing}
        write("gpu", options.json, {**about, "table": rows})


def shown(value: float, unit: str) -> str:
    """A figure for the table."""
    if math.isnan(value):
        return "not reached"
    size, letter = next(((s, x) for s, x in ((1e9, "G"), (1e6, "M"), (1e3, "k")) if value >= s), (1.0, ""))
    return f"{value:.1f} s" if unit == "s" else f"{value / size:.3g} {letter}{unit}"


if __name__ == "__main__":
    main()
