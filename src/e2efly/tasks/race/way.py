"""Signals for rewards in flight through gates: the distance left to fly, and how well the vehicle fits the opening."""

from dataclasses import dataclass

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from e2efly.policy.goal import Shape
from e2efly.simulation.physics import State
from e2efly.simulation.rewards import norm
from e2efly.simulation.scenes.shapes import FAR

AROUND = 1.5
"""Largest distance in front of a gate of the point through which the way from behind the gate leads, m."""
DETOUR = 0.5
"""Distance of this point in front of the gate per metre that the vehicle is behind it."""
SHORTEST = 0.01
"""Lower limit of the length of a step that crosses a gate's plane, m. It keeps the gradient of the crossing point
finite."""
LOW = 0.2
"""Height of the feet above the ground below which a vehicle counts as too low, m."""


@dataclass(frozen=True)
class NextGates:
    """For each of n vehicles, the next gate and the gate after it."""

    centre: tuple[Float[Array, "n 3"], Float[Array, "n 3"]]
    """Centres, world, m."""
    axis: tuple[Float[Array, "n 3"], Float[Array, "n 3"]]
    """Unit vectors in the direction of flight through the gates, world."""
    half: Float[Array, "n 2"]
    """Half of the width and height of the next gate, m."""

    def signals(
        self, shape: Shape, before: State, after: State, arrived: Bool[Array, " n"]
    ) -> dict[str, Float[Array, "..."]]:
        """`way`, `previous_way` and `overhang` of a step, for the terms `progway`, `fit` and `fitlog`.

        The columns of `overhang` are how far the vehicle extends outside the opening, sideways and upwards, and how far
        it is below the lowest allowed height.

        The way is the distance left to fly to the next gate. In the step that passes this gate, it is minus the
        distance already flown from there towards the gate after it. So no step is penalised for passing a gate fast.
        """
        (here, there), (along, onward) = self.centre, self.axis
        was, now = (_local(s.position - here, along) for s in (before, after))
        beyond = _way(_local(after.position - there, onward)) - _way(_local(here - there, onward))
        low = shape.feet_height + LOW - after.position[:, 2:]
        out = jnp.concatenate([self._overhang(shape, was, now), low], axis=-1)
        return {"way": jnp.where(arrived, beyond, _way(now)), "previous_way": _way(was), "overhang": out}

    def _overhang(self, shape: Shape, was: Float[Array, "n 3"], now: Float[Array, "n 3"]) -> Float[Array, "n 2"]:
        """How far the vehicle's sphere extends outside the opening, sideways and upwards, m.

        It is taken where the step crosses the gate's plane forward, and is `-FAR` in steps that do not cross it.
        """
        crossing = (was[:, 0] < 0) & (now[:, 0] >= 0)
        step = jnp.where(crossing, jnp.minimum(was[:, 0] - now[:, 0], -SHORTEST), -1.0)
        share = jnp.where(crossing, was[:, 0], -1.0) / step
        there = was[:, 1:] + share[:, None] * (now[:, 1:] - was[:, 1:])
        return jnp.where(crossing[:, None], jnp.abs(there) - self.half + shape.radius, -FAR)


def _local(d: Float[Array, "n 3"], axis: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """Offsets from a gate in the gate's frame: along its axis, to the left, up."""
    x = d[:, 0] * axis[:, 0] + d[:, 1] * axis[:, 1]
    return jnp.stack([x, d[:, 1] * axis[:, 0] - d[:, 0] * axis[:, 1], d[:, 2]], axis=-1)


def _way(local: Float[Array, "n 3"]) -> Float[Array, " n"]:
    """Distance left to fly to a gate's centre, to cross it forward, m: straight from the front, and around from behind.

    The way around leads through a point in front of the gate. The farther the vehicle is behind the gate, the farther
    this point is in front of it.
    """
    back = jnp.clip(DETOUR * local[:, 0], 0.0, AROUND)
    return norm(local.at[:, 0].add(back)) + back
