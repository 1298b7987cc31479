"""Code shared by the critics: their inputs, and estimates of the reward that follows."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from e2efly.environment import Env
from e2efly.learning.networks import Actor, Layers, init_mlp, mlp


def init_critic(rng: np.random.Generator, actor: Actor, env: Env) -> Layers:
    """A fresh value network with the same hidden layers as the policy, made with NumPy."""
    return init_mlp(rng, (actor.features.state_size + env.privileged_size, *actor.network.hidden, 1), 1.0)


def critic_input(actor: Actor, observation: Float[Array, "n o"], privileged: Float[Array, "n p"]) -> Array:
    """The features of an observation and, with cameras, the true scene (`Env.privileged`): (n, c)."""
    seen = actor.features.of_state(observation)
    return jnp.concatenate([seen, privileged], axis=-1) if privileged.shape[-1] else seen


def value(actor: Actor, critic: Layers, features: Float[Array, "*n c"]) -> Float[Array, "*n"]:
    """The critic's estimate of the discounted reward that follows."""
    return mlp(critic, features, actor.network.activation)[..., 0]


def gae(
    reward: Float[Array, "t n"],
    value: Float[Array, "t n"],
    next_value: Float[Array, "t n"],
    terminated: Float[Array, "t n"] | Bool[Array, "t n"],
    done: Float[Array, "t n"] | Bool[Array, "t n"],
    gamma: float | Array,
    lam: float | Array,
) -> Float[Array, "t n"]:
    """Generalised advantage estimate (Schulman et al. 2016). The estimate plus `value` is the TD(lambda) return.

    Args:
        reward: reward of each step.
        value: value of the observation before the step.
        next_value: value of the observation after the step, before any new start.
        terminated: whether the step terminated the episode. No reward follows.
        done: whether the step ended the episode, by termination or by time-out. The sum over later steps stops. After a
            time-out, the bootstrap with `next_value` remains.
        gamma: discount.
        lam: lambda.
    """
    delta = reward + gamma * (1.0 - terminated) * next_value - value

    def backward(carry: Array, x: tuple[Array, Array]) -> tuple[Array, Array]:
        step_delta, step_done = x
        carry = step_delta + gamma * lam * (1.0 - step_done) * carry
        return carry, carry

    return jax.lax.scan(backward, jnp.zeros_like(delta[0]), (delta, done), reverse=True)[1]
