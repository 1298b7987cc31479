"""Signals for rewards on the way through gates: how far it is, and how well the vehicle fits the opening."""

from dataclasses import dataclass

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from e2efly.goal import Shape
from e2efly.physics import State
from e2efly.rewards import norm
from e2efly.scenes.shapes import FAR

AROUND = 1.5
"""The way to a gate from behind it leads through a point at most so far before it, m ..."""
DETOUR = 0.5
"""... and so far for each metre that the vehicle is behind it."""
SHORTEST = 0.01
"""Keeps the gradient of where a gate's plane is crossed finite, m: a step that crosses it is longer than this."""
LOW = 0.2
"""With the feet lower than this over the ground a vehicle stands out of where it should be, m."""


@dataclass(frozen=True)
class NextGates:
    """The gate that each of n vehicles flies to, and the one after it."""

    centre: tuple[Float[Array, "n 3"], Float[Array, "n 3"]]
    """World, m."""
    axis: tuple[Float[Array, "n 3"], Float[Array, "n 3"]]
    """Along which they are flown through, unit vectors, world."""
    half: Float[Array, "n 2"]
    """Half of the first one's width and height, m."""

    def signals(
        self, shape: Shape, before: State, after: State, arrived: Bool[Array, " n"]
    ) -> dict[str, Float[Array, "..."]]:
        """`way`, `previous_way` and `overhang` of a step, for the terms `progway`, `fit` and `fitlog`.

        What stands out of an opening, sideways and up, is followed by what is too near to the ground.

        The way is that to the next gate. In the step that passes it, it is what was flown of the way from there to the
        gate after it, negative: so that no step charges for being fast through a gate.
        """
        (here, there), (along, onward) = self.centre, self.axis
        was, now = (_local(s.position - here, along) for s in (before, after))
        beyond = _way(_local(after.position - there, onward)) - _way(_local(here - there, onward))
        low = shape.feet_height + LOW - after.position[:, 2:]
        out = jnp.concatenate([self._overhang(shape, was, now), low], axis=-1)
        return {"way": jnp.where(arrived, beyond, _way(now)), "previous_way": _way(was), "overhang": out}

    def _overhang(self, shape: Shape, was: Float[Array, "n 3"], now: Float[Array, "n 3"]) -> Float[Array, "n 2"]:
        """How far the vehicle's sphere stands out of the opening, sideways and up, where it crosses its plane forward,
        m; `-FAR` in steps that do not cross it.
        """
        crossing = (was[:, 0] < 0) & (now[:, 0] >= 0)
        step = jnp.where(crossing, jnp.minimum(was[:, 0] - now[:, 0], -SHORTEST), -1.0)
        share = jnp.where(crossing, was[:, 0], -1.0) / step
        there = was[:, 1:] + share[:, None] * (now[:, 1:] - was[:, 1:])
        return jnp.where(crossing[:, None], jnp.abs(there) - self.half + shape.radius, -FAR)


def _local(d: Float[Array, "n 3"], axis: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """Offsets from a gate in its frame: along its axis, to the left, up."""
    x = d[:, 0] * axis[:, 0] + d[:, 1] * axis[:, 1]
    return jnp.stack([x, d[:, 1] * axis[:, 0] - d[:, 0] * axis[:, 1], d[:, 2]], axis=-1)


def _way(local: Float[Array, "n 3"]) -> Float[Array, " n"]:
    """How far it is to fly to a gate's centre and through it forward, m: before it straight, from behind it around.

    The way around leads by a point before the gate, the farther before it the farther behind it the vehicle is.
    """
    back = jnp.clip(DETOUR * local[:, 0], 0.0, AROUND)
    return norm(local.at[:, 0].add(back)) + back
