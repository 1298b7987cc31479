"""Crazyflow's physics steps/s, run by an interpreter that has it: `python crazyflow_rate.py WORLDS...`.

`first_principles` dynamics, `body_rate` control, 500 Hz, 10 physics steps a call. Its compiled step is called in a
Python loop and scanned inside one compiled program, with both of its cheap integrators, and the best of the four is
printed, so that the comparison favours it. Over several devices its worlds are distributed by its own `world_mesh`.
Without numbers on the command line they are read from the standard input, one a line: one answer each, compiled once.
"""

import sys
import time
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from crazyflow.control import Control
from crazyflow.dynamics import Dynamics
from crazyflow.sim import Sim
from crazyflow.sim.integration import Integrator
from crazyflow.sim.sharding import world_mesh

CALLS = 50
ROUNDS = 5


@cache
def runs(worlds: int) -> tuple[Callable[[], Any], ...]:
    """Every way to run `CALLS` calls, compiled."""
    return tuple(run for integrator in ("euler", "symplectic_euler") for run in _runs(worlds, integrator))


def _runs(worlds: int, integrator: str) -> Iterator[Callable[[], Any]]:
    devices = jax.devices()
    sim = Sim(
        n_worlds=worlds, n_drones=1, dynamics=Dynamics.first_principles, control=Control("body_rate"),
        integrator=Integrator(integrator), freq=500, mesh=world_mesh(devices) if len(devices) > 1 else None,
    )  # fmt: skip
    step = sim.build_step_fn()
    command = np.zeros((worlds, 1, 4), np.float32)
    command[..., :3] = 0.5 * np.random.default_rng(0).normal(size=(worlds, 1, 3))
    command[..., 3] = float(sim.data.params.mass[0]) * 9.81 * 1.05
    sim.body_rate_control(jnp.asarray(command))
    data = sim.data if sim.mesh is None else sim.shard(sim.mesh)

    def loop(data: Any) -> Any:
        for _ in range(CALLS):
            data = step(data, n_steps=10)
        return data

    scan = jax.jit(lambda data: jax.lax.scan(lambda d, _: (step(d, n_steps=10), None), data, length=CALLS)[0])
    for run in (loop, scan):
        end = jax.block_until_ready(run(data))
        if not bool(jnp.all(jnp.isfinite(end.states.pos))):
            raise SystemExit("Crazyflow's vehicles left the finite numbers")
        yield lambda run=run: run(data)


def rate(worlds: int) -> float:
    """Physics steps/s of the fastest run of the fastest way."""
    times = []
    for run in runs(worlds):
        for _ in range(ROUNDS):
            start = time.perf_counter()
            jax.block_until_ready(run())
            times.append(time.perf_counter() - start)
    return worlds * CALLS * 10 / min(times)


if __name__ == "__main__":
    for size in sys.argv[1:] or sys.stdin:
        print(rate(int(size)), flush=True)
