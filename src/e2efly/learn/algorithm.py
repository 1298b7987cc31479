"""What every algorithm is to the runner, and what they share."""

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import jax
import jax.numpy as jnp
import optax
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.config import ALGORITHMS, AlgorithmConfig
from e2efly.env import Env, EnvState
from e2efly.episodes import part_of
from e2efly.learn.devices import AXIS
from e2efly.learn.networks import Actor
from e2efly.registry import load, origin


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
    """Recurrent state of the policy."""
    key: PRNGKeyArray
    replay: Any = None
    """What an off-policy method keeps of earlier steps."""


@dataclass(frozen=True)
class Algorithm(ABC):
    """A learning algorithm on the shapes of one environment. Its numbers come in with `config` at every call.

    Whatever an update draws, flies and learns is in the `TrainState` that it takes and returns.
    """

    actor: Actor
    """The policy that learns."""

    @abstractmethod
    def init(self, env: Env, config: Any, seed: int) -> Any:
        """Fresh parameters, a registered dataclass with at least `policy`; made by NumPy: nothing to compile."""

    @abstractmethod
    def update(
        self, env: Env, config: Any, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """One update, on each device, on its own environments, inside `e2efly.learn.devices.on_each`.

        Args:
            env: the environment.
            config: numbers of the algorithm.
            state: where the last update ended.
            progress: share of the run that is done, in [0, 1]: sets the learning rate.

        Returns:
            The new state, and scalar metrics of this update.
        """

    def optimizer(self, config: Any, parameters: Any) -> Any:
        """The optimiser's initial state: Adam's, of all parameters."""
        return adam_state(config, parameters)

    def replay(self, env: Env, config: Any, state: EnvState, observation: Float[Array, "n o"]) -> Any:
        """What an off-policy method keeps of earlier steps, as it is at first; None: nothing."""
        return None


def adam(max_grad_norm: float | Array) -> optax.GradientTransformation:
    """Adam's direction of the norm-clipped gradient."""
    return optax.chain(optax.clip_by_global_norm(max_grad_norm), optax.scale_by_adam())


def adam_state(config: AlgorithmConfig, parameters: Any) -> Any:
    """Adam's initial state."""
    return adam(config.max_grad_norm).init(ravel_pytree(parameters)[0])


def begin(algorithm: Algorithm, env: Env, config: AlgorithmConfig, parameters: Any, key: PRNGKeyArray) -> TrainState:
    """A device's first state of a run: its part of the environments as started, the optimiser's initial state.

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


def epochs(
    config: Any,
    rate: Float[Array, ""],
    loss: Callable[[Any, Any], tuple[Array, dict[str, Array]]],
    parameters: Any,
    optimizer: Any,
    samples: Any,
    key: PRNGKeyArray,
) -> tuple[Any, Any, dict[str, Array]]:
    """`config.epochs` passes over samples in minibatches, a step of Adam each.

    Args:
        config: of the algorithm: envs, horizon, minibatch, epochs, max_grad_norm.
        rate: of Adam's steps.
        loss: (parameters, minibatch) -> what to descend, and losses by name.
        parameters: at first.
        optimizer: state of Adam at first.
        samples: a tree whose leaves are (steps, n, ...).
        key: decides the order.

    Returns:
        New parameters and optimiser, and the means of the losses and of the gradient's norm, `loss/NAME`.
    """
    steps, n = jax.tree.leaves(samples)[0].shape[:2]
    size, count = steps * n, config.envs * config.horizon // config.minibatch
    # one sort of random bits: sorting is slow on a CPU, so that all epochs share the order
    order = jnp.argsort(jax.random.bits(key, (size,)))
    flat = jax.tree.map(lambda x: x.reshape(size, *x.shape[2:])[order], samples)
    batches = jax.tree.map(lambda x: x.reshape(count, size // count, *x.shape[1:]), flat)

    def minibatch(carry: tuple[Any, Any], batch: Any) -> tuple[tuple[Any, Any], dict[str, Array]]:
        parameters, optimizer = carry
        grads, losses = jax.grad(loss, has_aux=True)(parameters, batch)
        parameters, optimizer, norm = descend(config, rate, parameters, optimizer, grads)
        return (parameters, optimizer), {**losses, "gradient_norm": norm}

    def epoch(carry: tuple[Any, Any], _: None) -> tuple[Any, dict[str, Array]]:
        return jax.lax.scan(minibatch, carry, batches)

    (parameters, optimizer), losses = jax.lax.scan(epoch, (parameters, optimizer), None, length=config.epochs)
    return parameters, optimizer, {f"loss/{name}": jnp.mean(x) for name, x in losses.items()}


def followed(target: Any, source: Any, share: float | Array) -> Any:
    """A slow copy of parameters, after it went `share` of the way to them."""
    return jax.tree.map(lambda old, new: old + share * (new - old), target, source)


def gradient_per_term(
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


def gradient_cuts(config: Any, progress: Float[Array, ""]) -> Bool[Array, " h"]:
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


def annealed(config: Any, progress: Float[Array, ""]) -> Float[Array, ""]:
    """The learning rate, exponential from `learning_rate` to `learning_rate_end`."""
    return config.learning_rate * (config.learning_rate_end / config.learning_rate) ** progress


METHODS = ("init", "update", "optimizer", "replay")
"""What the program of an algorithm must have; `Algorithm` has the last two."""


def make_algorithm(config: AlgorithmConfig, actor: Actor) -> Algorithm:
    """The algorithm of a configuration.

    Raises:
        ValueError: when `program` leads nowhere or to something that lacks a method, naming its file.
    """
    program = load(config.program) if isinstance(config.program, str) else config.program
    if lacking := [name for name in METHODS if not hasattr(program, name)]:
        raise ValueError(f"{origin(program)} has no {', '.join(lacking)}; accepted: all of {', '.join(METHODS)}")
    if getattr(program, "__abstractmethods__", None):
        left = ", ".join(sorted(program.__abstractmethods__))
        raise ValueError(f"{origin(program)} has no {left}; accepted: all of {', '.join(METHODS)}")
    register_options(type(config))
    return program(actor)


@cache
def register_options(options: type) -> None:
    """Make a class of options a pytree whose leaves are its numbers of type float."""
    fields = dataclasses.fields(options)
    numbers = [field.name for field in fields if field.type is float]
    others = [field.name for field in fields if field.type is not float]
    jax.tree_util.register_dataclass(options, data_fields=numbers, meta_fields=others)


for _options in ALGORITHMS.values():
    register_options(_options)
