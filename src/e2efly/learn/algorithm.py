"""What every algorithm is to the runner, and what they share."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import jax
import jax.numpy as jnp
import optax
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.config import ABPTConfig, AlgorithmConfig, BPTTConfig, FOPPOConfig, PPOConfig, SHACConfig
from e2efly.env import Env, EnvState
from e2efly.evaluate import part_of
from e2efly.learn.devices import AXIS
from e2efly.learn.networks import Actor

for _config in (PPOConfig, BPTTConfig, SHACConfig, ABPTConfig, FOPPOConfig):
    _fields = dataclasses.fields(_config)
    jax.tree_util.register_dataclass(
        _config,
        data_fields=[field.name for field in _fields if field.type is float],
        meta_fields=[field.name for field in _fields if field.type is not float],
    )


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class TrainState:
    """Everything that an update changes on one device: what a checkpoint holds of each."""

    parameters: Any
    """What is learned: a dataclass with at least `policy`."""
    optimizer: Any
    env: EnvState
    observation: Float[Array, "n o"]
    memory: Float[Array, "n k"]
    """Of the policy's GRU."""
    key: PRNGKeyArray
    replay: Any = None
    """What an off-policy method keeps of earlier steps."""


class Algorithm(Protocol):
    """A learning algorithm on the shapes of one environment."""

    @property
    def actor(self) -> Actor:
        """The policy that learns."""
        ...

    def init(self, env: Env, config: Any, seed: int) -> Any:
        """Fresh parameters, made by NumPy: nothing to compile."""
        ...

    def optimizer(self, config: Any, parameters: Any) -> Any:
        """The optimiser's first state."""
        ...

    def replay(self, env: Env, config: Any, state: EnvState, observation: Float[Array, "n o"]) -> Any:
        """What an off-policy method keeps of earlier steps, as it is at first; None: nothing."""
        ...

    def update(
        self, env: Env, config: Any, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """One update at `progress` in [0, 1] of the run: the new state, and scalar metrics.

        Runs on each device, on its own environments, inside `e2efly.learn.devices.on_each`.
        """
        ...


def adam(max_grad_norm: float | Array) -> optax.GradientTransformation:
    """Adam's direction of the norm-clipped gradient."""
    return optax.chain(optax.clip_by_global_norm(max_grad_norm), optax.scale_by_adam())


def at_rest(config: AlgorithmConfig, parameters: Any) -> Any:
    """Adam's state before its first step on these parameters."""
    return adam(config.max_grad_norm).init(ravel_pytree(parameters)[0])


def begin(algorithm: Algorithm, env: Env, config: AlgorithmConfig, parameters: Any, key: PRNGKeyArray) -> TrainState:
    """A device's first state of a run: its part of the environments as started, the optimiser at rest.

    All devices together start the same environments, however many they are.
    """
    part = jax.lax.axis_index(AXIS), jax.lax.axis_size(AXIS)
    env_state, observation = part_of(*env.reset(jax.random.fold_in(key, 0), config.envs), part)
    key = jax.random.fold_in(key, 1 + part[0])
    optimizer, memory = algorithm.optimizer(config, parameters), algorithm.actor.memory(observation.shape[0])
    replay = algorithm.replay(env, config, env_state, observation)
    return TrainState(parameters, optimizer, env_state, observation, memory, key, replay)


def descend(
    config: AlgorithmConfig, rate: Float[Array, ""], parameters: Any, optimizer: Any, gradient: Any
) -> tuple[Any, Any, Float[Array, ""]]:
    """A step of Adam against the mean gradient of all devices.

    Works on all parameters as one vector: a dozen small arrays take longer to compile, to add up over the devices and
    to step than the rest of an update.

    Returns:
        The new parameters, the new state of the optimiser, and the gradient's norm.
    """
    flat, shaped = ravel_pytree(gradient)
    flat = jax.lax.pmean(flat, AXIS)
    direction, optimizer = adam(config.max_grad_norm).update(flat, optimizer)
    parameters = jax.tree.map(lambda p, d: p - rate * d, parameters, shaped(jnp.asarray(direction)))
    return parameters, optimizer, jnp.linalg.norm(flat)


def damped(tree: Any, keep: Array) -> Any:
    """The same values; their gradient scaled by `keep`."""

    def damp(x: Array) -> Array:
        return keep * x + jax.lax.stop_gradient((1 - keep) * x) if jnp.issubdtype(x.dtype, jnp.floating) else x

    return jax.tree.map(damp, tree)


def ascended(
    parts: Callable[[Any], tuple[dict[str, Array], Any]], parameters: Any, apart: bool
) -> tuple[Any, Any, dict[str, Array]]:
    """The gradient of minus the sum of an objective's parts.

    Args:
        parts: parameters -> the parts by name, scalars, and what else comes of it.
        parameters: where.
        apart: whether to go back for each part by itself, which takes as many times as long.

    Returns:
        The gradient; what else came; and, apart, the norm of each part's gradient on this device, `gradient/NAME`.
    """

    def loss(parameters: Any) -> tuple[Array, Any]:
        found, more = parts(parameters)
        return -sum(found.values(), start=jnp.float32(0.0)), more

    if not apart:
        grads, more = jax.grad(loss, has_aux=True)(parameters)
        return grads, more, {}
    found, pull, more = jax.vjp(parts, parameters, has_aux=True)
    each = jax.vmap(lambda one: pull(dict(zip(found, -one, strict=True)))[0])(jnp.eye(len(found)))
    flat = jax.vmap(lambda tree: ravel_pytree(tree)[0])(each)
    norms = {f"gradient/{name}": norm for name, norm in zip(found, jnp.linalg.norm(flat, axis=1), strict=True)}
    return jax.tree.map(lambda x: jnp.sum(x, axis=0), each), more, norms


def ends(config: Any, progress: Float[Array, ""]) -> Bool[Array, " h"]:
    """Before which steps of a window the gradient is cut: every `horizon_start` at first, nowhere at last; in between
    the pieces grow exponentially. Without `horizon_start` it is cut nowhere.
    """
    step = jnp.arange(config.horizon)
    start = config.horizon_start or config.horizon
    piece = jnp.round(start * (config.horizon / start) ** progress).astype(jnp.int32)
    return (step % piece == 0) & (step > 0)


def episode_metrics(done: Array, success: Array) -> dict[str, Array]:
    """How many episodes ended on all devices, and the share of them that met the criterion."""
    episodes, successes = jax.lax.psum((jnp.sum(done), jnp.sum(success)), AXIS)
    return {"episodes": episodes, "train_success": successes / jnp.maximum(episodes, 1)}


def annealed(config: AlgorithmConfig, progress: Float[Array, ""]) -> Float[Array, ""]:
    """The learning rate, exponential from `learning_rate` to `learning_rate_end`."""
    return config.learning_rate * (config.learning_rate_end / config.learning_rate) ** progress


def make_algorithm(config: AlgorithmConfig, actor: Actor) -> Algorithm:
    """The algorithm of a configuration."""
    from e2efly.learn.abpt import ABPT
    from e2efly.learn.bptt import BPTT
    from e2efly.learn.foppo import FOPPO
    from e2efly.learn.ppo import PPO
    from e2efly.learn.shac import SHAC

    makers: dict[type, type] = {
        PPOConfig: PPO, BPTTConfig: BPTT, SHACConfig: SHAC, ABPTConfig: ABPT, FOPPOConfig: FOPPO
    }  # fmt: skip
    return makers[type(config)](actor)
