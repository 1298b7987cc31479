"""Delays of a real number of seconds, through which gradients flow."""

import dataclasses
import math

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from e2efly.physics import State
from e2efly.physics.rotation import normalize


def frames(latency: float, period: float) -> int:
    """Whole control periods that a latency touches: the past samples that must be kept."""
    return math.ceil(latency / period - 1e-6)


def acting_commands(
    queue: Float[Array, "n k 4"], latency: Float[Array, " n"], period: float
) -> tuple[Float[Array, "n 4"], Float[Array, "n 4"], Float[Array, " n"]]:
    """The two commands that act during the coming control period, and the time at which the second takes over.

    Args:
        queue: commands, the newest (just issued) first.
        latency: seconds from issue to effect, at most (k - 1) periods.
        period: the control period, s.

    Returns:
        The command acting at first, the one that follows it, and the time of the switch in [0, period], s.
    """
    late = latency / period
    whole = jnp.clip(jnp.ceil(late) - 1, 0, queue.shape[1] - 2)
    # sums over a short queue: the gradient of a gather is a scatter, which is slow on a CPU
    new = jax.nn.one_hot(whole.astype(jnp.int32), queue.shape[1], dtype=queue.dtype)
    old = jnp.roll(new, 1, axis=-1)
    before, after = jnp.sum(old[..., None] * queue, axis=1), jnp.sum(new[..., None] * queue, axis=1)
    return before, after, (late - whole) * period


def delayed_state(past: State, latency: Float[Array, " n"], period: float) -> State:
    """The state `latency` seconds ago, linear between control steps.

    Args:
        past: states with a second axis of samples, the newest first: position (n, k, 3).
        latency: age, s, at most (k - 1) periods.
        period: the control period, s.
    """
    age = latency[:, None] / period - jnp.arange(past.position.shape[1])
    weight = jnp.maximum(1.0 - jnp.abs(age), 0.0)[..., None]
    mixed = jax.tree.map(lambda x: jnp.sum(weight * x, axis=1), past)
    return dataclasses.replace(mixed, quaternion=normalize(mixed.quaternion))
