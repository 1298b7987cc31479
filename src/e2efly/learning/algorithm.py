"""The interface between the algorithms and the runner, and the code that the algorithms share."""

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
from e2efly.config.registry import load, origin
from e2efly.environment import Env, EnvState
from e2efly.environment.episodes import part_of
from e2efly.learning.devices import AXIS
from e2efly.learning.networks import Actor


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class TrainState:
    """Everything that an update changes on one device. A checkpoint holds this for each device."""

    parameters: Any
    """What is learned: a dataclass that has at least the field `policy`."""
    optimizer: Any
    env: EnvState
    observation: Float[Array, "n o"]
    memory: Float[Array, "n k"]
    """Recurrent state of the policy."""
    key: PRNGKeyArray
    replay: Any = None
    """The data of earlier steps that an off-policy method keeps."""


@dataclass(frozen=True)
class Algorithm(ABC):
    """A learning algorithm for the shapes of one environment. Its numbers are passed in `config` at every call.

    Everything that an update samples, flies and learns is in the `TrainState` that it takes and returns.
    """

    actor: Actor
    """The policy that learns."""

    @abstractmethod
    def init(self, env: Env, config: Any, seed: int) -> Any:
        """Fresh parameters: a registered dataclass with at least the field `policy`. Made with NumPy, so that nothing
        has to be compiled.
        """

    @abstractmethod
    def update(
        self, env: Env, config: Any, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """One update. Each device runs it on its own environments, inside `e2efly.learning.devices.on_each`.

        Args:
            env: the environment.
            config: numbers of the algorithm.
            state: the state at the end of the last update.
            progress: the completed fraction of the run, in [0, 1]. It sets the learning rate.

        Returns:
            The new state, and scalar metrics of this update.
        """

    def optimizer(self, config: Any, parameters: Any) -> Any:
        """The initial state of the optimiser. By default, that of Adam for all parameters."""
        return adam_state(config, parameters)

    def replay(self, env: Env, config: Any, state: EnvState, observation: Float[Array, "n o"]) -> Any:
        """The initial value of the data that an off-policy method keeps of earlier steps. None: it keeps nothing."""
        return None


def adam(max_grad_norm: float | Array) -> optax.GradientTransformation:
    """Adam's update direction, from the gradient after clipping by its norm."""
    return optax.chain(optax.clip_by_global_norm(max_grad_norm), optax.scale_by_adam())


def adam_state(config: AlgorithmConfig, parameters: Any) -> Any:
    """Adam's initial state."""
    return adam(config.max_grad_norm).init(ravel_pytree(parameters)[0])


def begin(algorithm: Algorithm, env: Env, config: AlgorithmConfig, parameters: Any, key: PRNGKeyArray) -> TrainState:
    """The first state of a run on one device: its part of the fresh environments, and the optimiser's initial state.

    All devices together start the same environments, whatever the number of devices.
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
    """One step of Adam along the negative mean gradient of all devices.

    It treats all parameters as one vector. With a dozen small arrays, the compilation, the sum over the devices and the
    step itself would take longer than the rest of an update.

    Returns:
        The new parameters, the new state of the optimiser, and the norm of the gradient.
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
    """`config.epochs` passes over the samples in minibatches, with one step of Adam per minibatch.

    Args:
        config: options of the algorithm: envs, horizon, minibatch, epochs, max_grad_norm.
        rate: the learning rate of Adam.
        loss: (parameters, minibatch) -> the loss to minimise, and its parts by name.
        parameters: the initial parameters.
        optimizer: the initial state of Adam.
        samples: a tree whose leaves are (steps, n, ...).
        key: random key that decides the order of the samples.

    Returns:
        The new parameters, the new state of the optimiser, and the means of the losses and of the gradient norm, as
        `loss/NAME`.
    """
    steps, n = jax.tree.leaves(samples)[0].shape[:2]
    size, count = steps * n, config.envs * config.horizon // config.minibatch
    # only one sort of random bits: sorting is slow on a CPU, so all epochs share the same order
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
    """A slow copy of parameters (`target`), moved by the fraction `share` towards the parameters (`source`)."""
    return jax.tree.map(lambda old, new: old + share * (new - old), target, source)


def gradient_per_term(
    parts: Callable[[Any], tuple[dict[str, Array], Any]], parameters: Any, apart: bool
) -> tuple[Any, Any, dict[str, Array]]:
    """The gradient of the negative sum of an objective's parts.

    Args:
        parts: parameters -> the parts by name (scalars), and other results.
        parameters: where the gradient is evaluated.
        apart: whether to differentiate each part separately. The backward pass then takes as many times as long as
            there are parts.

    Returns:
        The gradient, the other results of `parts`, and, with `apart`, the norm of each part's gradient on this device,
        as `gradient/NAME`.
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
    """The steps of a window before which the gradient is cut. At the start of a run it is cut every `horizon_start`
    steps, at the end of the run nowhere. In between, the pieces grow exponentially. Without `horizon_start` it is never
    cut.
    """
    step = jnp.arange(config.horizon)
    start = config.horizon_start or config.horizon
    piece = jnp.round(start * (config.horizon / start) ** progress).astype(jnp.int32)
    return (step % piece == 0) & (step > 0)


def episode_metrics(done: Array, success: Array) -> dict[str, Array]:
    """The number of episodes that ended on all devices, and the fraction of them that met the criterion."""
    episodes, successes = jax.lax.psum((jnp.sum(done), jnp.sum(success)), AXIS)
    return {"episodes": episodes, "train_success": successes / jnp.maximum(episodes, 1)}


def annealed(config: Any, progress: Float[Array, ""]) -> Float[Array, ""]:
    """The learning rate, which changes from `learning_rate` to `learning_rate_end` as `decay` says: exponentially,
    unless the options have it otherwise.
    """
    first, last = config.learning_rate, config.learning_rate_end
    if getattr(config, "decay", "exponential") == "linear":
        return first + (last - first) * progress
    return first * (last / first) ** progress


METHODS = ("init", "update", "optimizer", "replay")
"""The methods that the program of an algorithm must have. `Algorithm` provides the last two."""


def make_algorithm(config: AlgorithmConfig, actor: Actor) -> Algorithm:
    """The algorithm of a configuration.

    Raises:
        ValueError: when nothing is found at `program`, or when what is found lacks a method, naming its file.
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
    """Register a class of options as a pytree whose leaves are its fields of type float."""
    fields = dataclasses.fields(options)
    numbers = [field.name for field in fields if field.type is float]
    others = [field.name for field in fields if field.type is not float]
    jax.tree_util.register_dataclass(options, data_fields=numbers, meta_fields=others)


for _options in ALGORITHMS.values():
    register_options(_options)
