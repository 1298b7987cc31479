"""Crazyflow's physics steps/s, run by an interpreter that has it: `python crazyflow_rate.py WORLDS`.

`first_principles` dynamics, `body_rate` control, 500 Hz, 10 physics steps a call. Its compiled step is called in a
Python loop and, when it can be, scanned inside one compiled program; both of its cheap integrators are tried. The
best of all is printed, so that the comparison favours it.
"""

import sys
import time
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from crazyflow.control import Control
from crazyflow.dynamics import Dynamics
from crazyflow.sim import Sim
from crazyflow.sim.integration import Integrator

CALLS = 50


def rate(worlds: int, integrator: str) -> float:
    """The best rate of the two ways to call it."""
    sim = Sim(
        n_worlds=worlds, n_drones=1, dynamics=Dynamics.first_principles, control=Control("body_rate"),
        integrator=Integrator(integrator), freq=500,
    )  # fmt: skip
    step = sim.build_step_fn()
    command = np.zeros((worlds, 1, 4), np.float32)
    command[..., :3] = 0.5 * np.random.default_rng(0).normal(size=(worlds, 1, 3))
    command[..., 3] = float(sim.data.params.mass[0]) * 9.81 * 1.05
    sim.body_rate_control(jnp.asarray(command))

    def loop(data: Any) -> Any:
        for _ in range(CALLS):
            data = step(data, n_steps=10)
        return data

    scan = jax.jit(lambda data: jax.lax.scan(lambda d, _: (step(d, n_steps=10), None), data, length=CALLS)[0])
    return max(timed(worlds, f, sim.data) for f in (loop, scan))


def timed(worlds: int, f: Callable[[Any], Any], data: Any) -> float:
    """Physics steps/s of the best of five runs; 0 when it cannot be called so."""
    try:
        jax.block_until_ready(f(data))
    except (TypeError, ValueError):
        return 0.0
    times = []
    for _ in range(5):
        start = time.perf_counter()
        jax.block_until_ready(f(data))
        times.append(time.perf_counter() - start)
    return worlds * CALLS * 10 / min(times)


if __name__ == "__main__":
    print(max(rate(int(sys.argv[1]), name) for name in ("euler", "symplectic_euler")))
