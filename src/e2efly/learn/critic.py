"""What critics share: what they are fed, and estimates of what follows."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from e2efly.env import Env
from e2efly.learn.networks import Actor, Layers, init_mlp, mlp


def init_critic(rng: np.random.Generator, actor: Actor, env: Env) -> Layers:
    """A fresh value network of the policy's hidden layers, made by NumPy."""
    return init_mlp(rng, (actor.features.state_size + env.privileged_size, *actor.network.hidden, 1), 1.0)


def critic_input(actor: Actor, observation: Float[Array, "n o"], privileged: Float[Array, "n p"]) -> Array:
    """The features of an observation and, where there are cameras, of the true scene (`Env.privileged`): (n, c)."""
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
    """Generalised advantage estimate (Schulman et al. 2016); plus `value` it is the TD(lambda) return.

    Args:
        reward: of each step.
        value: of the observation acted on.
        next_value: of the observation reached, before any new start.
        terminated: the step ended the episode for good: nothing follows.
        done: the step ended the episode, also by time-out: the sum stops, the bootstrap stays.
        gamma: discount.
        lam: lambda.
    """
    delta = reward + gamma * (1.0 - terminated) * next_value - value

    def backward(carry: Array, x: tuple[Array, Array]) -> tuple[Array, Array]:
        step_delta, step_done = x
        carry = step_delta + gamma * lam * (1.0 - step_done) * carry
        return carry, carry

    return jax.lax.scan(backward, jnp.zeros_like(delta[0]), (delta, done), reverse=True)[1]
