"""e2efly's physics sub-steps/s: `python e2efly_rate.py VEHICLES...`, or numbers on the standard input, one a line.

VIS-R, CTBR commands, the default integrator, float32, 10 sub-steps of 5 ms a call, calls scanned inside one compiled
program. Over several devices the vehicles are distributed by JAX. `--randomised`: every parameter of every vehicle is
an array of its own.
"""

import sys
import time
from collections.abc import Callable
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import AxisType, NamedSharding, PartitionSpec

from e2efly.physics import Physics, State, step
from e2efly.vehicles import Vehicle, load_vehicle

CALLS = 50
ROUNDS = 20


@cache
def compiled(vehicles: int, randomised: bool) -> Callable[[], State]:
    """`CALLS` calls as one program."""
    loaded = load_vehicle("vis_r")
    physics = Physics.of(loaded, command_mode="ctbr", control_rate=20.0, dtype=np.float32)
    rng = np.random.default_rng(0)
    command = 0.5 * rng.normal(size=(vehicles, 4)) + np.array([9.81, 0, 0, 0])

    def spread(x: np.ndarray) -> np.ndarray:
        return (x * rng.uniform(0.9, 1.1, (vehicles, *x.shape))).astype(np.float32)

    plant = jax.tree.map(spread, physics.nominal) if randomised else None
    state = State.hovering(loaded, jnp.zeros((vehicles, 3), jnp.float32))
    mesh = jax.make_mesh((len(jax.devices()),), ("vehicles",), axis_types=(AxisType.Auto,))
    batch = (plant, state, command.astype(np.float32))
    batch = jax.device_put(batch, NamedSharding(mesh, PartitionSpec("vehicles")))

    @jax.jit
    def run(plant: Vehicle | None, state: State, command: jax.Array) -> State:
        def call(state: State, _: None) -> tuple[State, None]:
            return step(physics, plant or physics.nominal, state, command), None

        return jax.lax.scan(call, state, None, length=CALLS)[0]

    end = jax.block_until_ready(run(*batch))
    if not all(bool(jnp.all(jnp.isfinite(x))) for x in jax.tree.leaves(end)):
        raise SystemExit("e2efly's vehicles left the finite numbers")
    return lambda: run(*batch)


def rate(vehicles: int, randomised: bool = False) -> float:
    """Physics sub-steps/s of the fastest run."""
    run, times = compiled(vehicles, randomised), []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        jax.block_until_ready(run())
        times.append(time.perf_counter() - start)
    return vehicles * CALLS * 10 / min(times)


def main(arguments: list[str]) -> None:
    """Answer each number with a rate."""
    randomised = "--randomised" in arguments
    for size in [a for a in arguments if a.isdigit()] or sys.stdin:
        print(rate(int(size), randomised), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
