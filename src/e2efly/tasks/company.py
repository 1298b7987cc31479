"""Several vehicles in one world: the rows of a batch that are next to each other.

With a agents, rows 0 to a - 1 are the first world, rows a to 2 a - 1 the second, and so on. The physics needs no axis
for this. Pairs are computed by components, (worlds, a, a) each, which is faster than vectors of three.
"""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from e2efly.policy.others import FAR, Others, nobody
from e2efly.simulation.physics import State
from e2efly.simulation.scenes.scene import VEHICLE, Solids
from e2efly.tasks.task import path_within

jax.tree_util.register_dataclass(Others)
AHEAD = 1.0
"""Time within which the closest approach of two vehicles counts, s."""


def pairs(x: Float[Array, "n 3"], agents: int) -> tuple[Float[Array, "w a a"], ...]:
    """The components of x_j - x_i at [world, i, j]."""
    by_world = x.reshape(-1, agents, 3)
    return tuple(by_world[:, None, :, c] - by_world[:, :, None, c] for c in range(3))


def squared_distances(position: Float[Array, "n 3"], agents: int) -> Float[Array, "w a a"]:
    """Squared distances between the vehicles of each world, m^2. That of a vehicle to itself is infinite."""
    x, y, z = pairs(position, agents)
    return jnp.where(jnp.eye(agents, dtype=bool), jnp.inf, x * x + y * y + z * z)


def nearest(body: Any, agents: int, count: int) -> Others:
    """The nearest others of each vehicle, the nearest first.

    Args:
        body: the motion of n vehicles, with `position` and `velocity`.
        agents: number of vehicles in a world.
        count: how many to choose. If there are fewer others, the rest is `nobody`.
    """
    n, there = body.position.shape[0], min(count, agents - 1)
    away = jax.lax.stop_gradient(squared_distances(body.position, agents))
    motion = jnp.concatenate([body.position, body.velocity], axis=-1).reshape(-1, agents, 6)
    found = []
    for _ in range(there):
        chosen = jax.nn.one_hot(jnp.argmin(away, axis=-1), agents, dtype=body.position.dtype)
        found.append(jnp.einsum("wij,wjc->wic", chosen, motion).reshape(n, 1, 6))
        away = jnp.where(chosen > 0, jnp.inf, away)
    absent = nobody(body.position, count - there)
    both = jnp.concatenate([*found, jnp.concatenate([absent.position, absent.velocity], axis=-1)], axis=1)
    return Others(both[..., :3], both[..., 3:])


def misses(body: Any, agents: int, reach: float | Array) -> Float[Array, "n a"]:
    """Gap between each vehicle and each of its world at the closest approach within `AHEAD`, m, for the reward
    term `apart`. They touch at a distance of `reach`, m. For a vehicle and itself it is large.
    """
    (x, y, z), (vx, vy, vz) = pairs(body.position, agents), pairs(body.velocity, agents)
    when = jnp.clip(-(x * vx + y * vy + z * vz) / (vx * vx + vy * vy + vz * vz + 1e-9), 0.0, AHEAD)
    away = (x + when * vx) ** 2 + (y + when * vy) ** 2 + (z + when * vz) ** 2
    own = jnp.eye(agents, dtype=bool)
    return jnp.where(own, FAR, jnp.sqrt(jnp.where(own, 1.0, away) + 1e-8) - reach).reshape(-1, agents)


def all_others(body: Any, agents: int) -> Others:
    """All others of each vehicle, in the order of the rows."""
    index = jnp.asarray([[j for j in range(agents) if j != i] for i in range(agents)])

    def of(x: Float[Array, "n 3"]) -> Float[Array, "n k 3"]:
        return x.reshape(-1, agents, 3)[:, index].reshape(x.shape[0], agents - 1, 3)

    return Others(of(body.position), of(body.velocity))


def collided(
    before: State, after: State, period: float, checks: int, agents: int, reach: float | Array
) -> Bool[Array, " n"]:
    """Whether the spheres of two vehicles of a world touched during a control step.

    Both are at the same moments where the cubics through positions and velocities at both ends of the step are. Two
    racers at 11 m/s close 0.7 m within a step at 30 Hz.

    Args:
        before: the states at the beginning of the step.
        after: the states at its end.
        period: duration of the step, s.
        checks: number of moments that are checked.
        agents: number of vehicles in a world.
        reach: distance between two centres at which they touch, m.
    """
    path, _ = path_within(before, after, period, checks)
    near = jax.vmap(lambda p: jnp.min(squared_distances(p, agents), axis=-1))(path)
    return jnp.any(near < reach**2, axis=0).reshape(-1)


def any_of_world(flag: Bool[Array, " n"], agents: int) -> Bool[Array, " n"]:
    """Whether it holds for one vehicle or more of the same world."""
    return jnp.repeat(jnp.any(flag.reshape(-1, agents), axis=1), agents)


def all_of_world(flag: Bool[Array, " n"], agents: int) -> Bool[Array, " n"]:
    """Whether it holds for every vehicle of the same world."""
    return jnp.repeat(jnp.all(flag.reshape(-1, agents), axis=1), agents)


def spheres(others: Others, time: Float[Array, " n"], radius: float | Array) -> Solids:
    """Others as solids, for cameras and for distances.

    They fly straight on from where they are at `time`, s: a camera sees them where they were when it looked.
    """
    n, k, _ = others.position.shape
    begun = others.position - time[:, None, None] * others.velocity
    solids = Solids.of("sphere", begun, jnp.broadcast_to(jnp.asarray(radius), (n, k))[..., None], label=VEHICLE)
    return dataclasses.replace(solids, velocity=others.velocity)
