"""The zoo's policies as C: microseconds of a step, size, and how near to the exact value of the policy.onnx.

    python benchmarks/c_export.py [--policies any/hover vis_r/race] [--json FILE]

All of the zoo without --policies. Plain: cc -O2. Native: cc -O3 -march=native. The time is that of `NAME_network`,
taken around each of many steps on observations and images by chance, on one core, scheduled as the bridge's policy is
where that is allowed. Differences are the largest of the actions
on the same inputs: of the C, plain, and of ONNX Runtime, from the exact value, in double precision.
"""

import ctypes
import os
import subprocess
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from common import arguments, table, write

from e2efly.flight.flight_loop import POLICY_PRIORITY
from e2efly.policy.c_export.exact import Exact
from e2efly.policy.c_export.header import Precision, Sizes
from e2efly.policy.c_export.write import write_c
from e2efly.policy.loader import Policy, load_policy
from e2efly.policy.random_inputs import random_images, random_observations
from e2efly.policy.zoo import contents, policy_file

STEPS, ROUNDS = 200, 100
"""Inputs by chance, and how often they are gone through for the time."""
FLAGS = {"plain": ("-O2",), "native": ("-O3", "-march=native")}
TIMER = """
#define _POSIX_C_SOURCE 199309L
#include "policy.h"
#include <time.h>

/* Seconds of each step, past the first round, whose actions it keeps. */
void measure(policy_state *state, const float *observation, const float *memory, const float *const *image,
             const int *size, int steps, int rounds, float *action, double *seconds)
{
    for (int k = 0; k < steps * rounds; k++) {
        struct timespec a, b;
        const int row = k % steps;
        (void)image; (void)size; (void)memory;
#if POLICY_MEMORY_SIZE > 0
        for (int i = 0; i < POLICY_MEMORY_SIZE; i++) state->memory[i] = memory[row * POLICY_MEMORY_SIZE + i];
#endif
        clock_gettime(CLOCK_MONOTONIC, &a);
        policy_network(state, observation + row * POLICY_OBSERVATION_SIZE, IMAGES action + 4 * row);
        clock_gettime(CLOCK_MONOTONIC, &b);
        seconds[k] = (double)(b.tv_sec - a.tv_sec) + 1e-9 * (double)(b.tv_nsec - a.tv_nsec);
    }
}
"""
"""Around a policy; IMAGES: the arguments of its images."""
Inputs = tuple[np.ndarray, list[np.ndarray], np.ndarray]


def inputs(policy: Policy) -> Inputs:
    """Observations, images and memories by chance."""
    c, rng = policy.contract, np.random.default_rng(0)
    memory = rng.uniform(-1, 1, (STEPS, c.memory_size)).astype(np.float32)
    return random_observations(rng, c.observation, STEPS), [random_images(rng, i, STEPS) for i in c.images], memory


def built(folder: Path, flags: tuple[str, ...], images: int) -> Path:
    """The library of a policy and the timer."""
    given = "".join(f"image[{i}] + row * size[{i}], " for i in range(images))
    (folder / "timer.c").write_text(TIMER.replace("IMAGES ", given))
    library = folder / f"{'_'.join(flags)}.so"
    files = [folder / "policy.c", folder / "timer.c"]
    subprocess.run(["cc", "-std=c99", *flags, "-shared", "-fPIC", *files, "-lm", "-o", library], check=True)
    return library


def measured(library: Path, needs: Sizes, given: Inputs) -> tuple[np.ndarray, np.ndarray]:
    """Actions, and the seconds of each step but those of the first round."""
    observation, images, memory = given
    state, action = np.zeros(needs.state // 8 + 1), np.empty((STEPS, 4), np.float32)
    seconds = np.empty(STEPS * ROUNDS)
    flat = [np.ascontiguousarray(x) for x in images]
    pointers = (ctypes.c_void_p * max(len(flat), 1))(*(x.ctypes.data for x in flat))
    sizes = (ctypes.c_int * max(len(flat), 1))(*(x[0].size for x in flat))

    def at(x: np.ndarray) -> ctypes.c_void_p:
        return ctypes.c_void_p(x.ctypes.data)

    measure = ctypes.CDLL(str(library)).measure
    with suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(POLICY_PRIORITY))
    measure(at(state), at(observation), at(memory), pointers, sizes, STEPS, ROUNDS, at(action), at(seconds))
    with suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    return action, seconds[STEPS:]


def code(folder: Path) -> int:
    """Bytes of the code, plain."""
    subprocess.run(["cc", "-std=c99", "-O2", "-c", "policy.c", "-o", "policy.o"], cwd=folder, check=True)
    told = subprocess.run(["size", "-A", "policy.o"], cwd=folder, check=True, capture_output=True, text=True).stdout
    return sum(int(line.split()[1]) for line in told.splitlines() if line.startswith(".text"))


def row(name: str) -> dict[str, Any]:
    """All figures of a policy."""
    file = policy_file(name)
    policy = load_policy(file)
    given = inputs(policy)
    exact, _ = Exact(policy.contract, file.read_bytes()).act(*given)
    out: dict[str, Any] = {"policy": name, "images": len(policy.contract.images)}
    out["onnxruntime_difference"] = float(np.abs(policy.act(*given)[0] - exact).max())
    precisions: tuple[Precision, ...] = ("double", "float")
    for precision in precisions:
        with tempfile.TemporaryDirectory() as folder:
            where = Path(folder)
            needs = write_c(where, file, "policy", precision)
            about: dict[str, Any] = {"state_bytes": needs.state, "image_bytes": needs.images, "code_bytes": code(where)}
            for label, flags in FLAGS.items():
                action, seconds = measured(built(where, flags, len(policy.contract.images)), needs, given)
                p50, p99 = np.quantile(1e6 * seconds, (0.5, 0.99))
                about[label] = {"us_p50": float(p50), "us_p99": float(p99)}
                about[label]["difference"] = float(np.abs(action - exact).max())
            out |= {precision: about, "constant_bytes": needs.constants}
    return out


def shown(found: dict[str, Any]) -> dict[str, str]:
    """A row of the table."""
    out = {"policy": found["policy"], "sees": "images" if found["images"] else "state"}
    for precision in ("double", "float"):
        about = found[precision]
        for label in FLAGS:
            p50, p99 = about[label]["us_p50"], about[label]["us_p99"]
            out[f"{precision}, {label}: us, p50 / p99"] = f"{p50:.1f} / {p99:.1f}"
        out[f"{precision}: difference"] = f"{about['plain']['difference']:.1e}"
    out["ONNX Runtime: difference"] = f"{found['onnxruntime_difference']:.1e}"
    for what in ("state", "code"):
        both = (found[precision][f"{what}_bytes"] / 1024 for precision in ("double", "float"))
        out[f"{what}, KiB, double / float"] = " / ".join(f"{size:.1f}" for size in both)
    out["weights, KiB"] = f"{found['constant_bytes'] / 1024:.0f}"
    return out


def main() -> None:
    """Measure, print a table, write JSON."""
    options = arguments(__doc__ or "", policies=[""])
    names = [name for name in options.policies if name] or [
        f"{v}/{t}" for v, tasks in contents().items() for t in tasks
    ]
    compiler = subprocess.run(["cc", "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]
    rows = [row(name) for name in names]
    rows.sort(key=lambda found: found["images"])
    write("c_export", options.json, {"compiler": compiler, "table": [shown(x) for x in rows], "policies": rows})
    print(table([shown(x) for x in rows]))


if __name__ == "__main__":
    main()
