"""Delays of a real number of seconds, through which gradients flow."""

import dataclasses
import math

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import normalize


def frames(latency: float, period: float) -> int:
    """Number of past samples, one per control period, that a latency requires."""
    return math.ceil(latency / period - 1e-6)


def acting_commands(
    queue: Float[Array, "n k c"], latency: Float[Array, " n"], period: float
) -> tuple[Float[Array, "n c"], Float[Array, "n c"], Float[Array, " n"]]:
    """The two commands that act during the coming control period, and the time at which the second replaces the first.

    Args:
        queue: the commands, newest (just issued) first.
        latency: time from issue to effect, s, at most (k - 1) periods.
        period: the control period, s.

    Returns:
        The first command, the command that follows it, and the time of the switch in [0, period], s.
    """
    late = latency / period
    whole = jnp.clip(jnp.ceil(late) - 1, 0, queue.shape[1] - 2)
    # sums over a short queue, because the gradient of a gather is a scatter, which is slow on a CPU
    new = jax.nn.one_hot(whole.astype(jnp.int32), queue.shape[1], dtype=queue.dtype)
    old = jnp.roll(new, 1, axis=-1)
    before, after = jnp.sum(old[..., None] * queue, axis=1), jnp.sum(new[..., None] * queue, axis=1)
    return before, after, (late - whole) * period


def delayed_state(past: State, latency: Float[Array, " n"], period: float) -> State:
    """The state `latency` seconds ago, interpolated linearly between control steps.

    Args:
        past: states with a second axis of samples, newest first: position (n, k, 3).
        latency: age, s, at most (k - 1) periods.
        period: the control period, s.
    """
    age = latency[:, None] / period - jnp.arange(past.position.shape[1])
    weight = jnp.maximum(1.0 - jnp.abs(age), 0.0)[..., None]
    mixed = jax.tree.map(lambda x: jnp.sum(weight * x, axis=1), past)
    return dataclasses.replace(mixed, quaternion=normalize(mixed.quaternion))
