"""What a task is to the environment."""

import dataclasses
from functools import cache
from typing import Any, Protocol, runtime_checkable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.config import TaskConfig
from e2efly.goal import Outcome, Shape
from e2efly.numbers import SHAPE
from e2efly.observation import Field
from e2efly.physics import State
from e2efly.registry import load, origin
from e2efly.scenes.scene import Scene, gaps
from e2efly.tasks.registry import TASKS

jax.tree_util.register_dataclass(Shape)
jax.tree_util.register_dataclass(Outcome)


class Task(Protocol):
    """A task: pure functions on a frozen dataclass whose numbers are leaves. All batched over one leading axis."""

    @classmethod
    def of(cls, config: Any, shape: Shape, control_period: float, substeps: int) -> "Task":
        """The task of some options; see `make_task`."""
        ...

    @property
    def shape(self) -> Shape:
        """What of the vehicle can touch things."""
        ...

    @property
    def fields(self) -> tuple[Field, ...]:
        """The task's own observation fields."""
        ...

    @property
    def episode_s(self) -> float | Array:
        """Time limit of an episode, s."""
        ...

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, Any]:
        """Draw `n` starts: states (rotor speeds are set by the environment) and the task's own state."""
        ...

    def goal(self, memory: Any, time: Float[Array, " n"]) -> Float[Array, "n 3"]:
        """Where to be now, world, m."""
        ...

    def observe(self, memory: Any, time: Float[Array, " n"], state: State) -> Float[Array, "n o"]:
        """The task's own observation fields, of the state as the policy is told it."""
        ...

    def scene(self, memory: Any) -> Scene:
        """The worlds that the vehicles fly in: what their cameras see, and what the terms of avoidance keep off."""
        ...

    def desired_yaw(self, memory: Any, state: State) -> Float[Array, " n"]:
        """The wanted heading, rad, for the orientation terms of the reward."""
        ...

    def advance(
        self, memory: Any, before: State, after: State, time: Float[Array, " n"], timed_out: Bool[Array, " n"]
    ) -> tuple[Any, Outcome]:
        """Judge the control step that ended at `time` and move the task's own state on."""
        ...


@runtime_checkable
class Guided(Protocol):
    """A task that one who knows the whole world can fly: what the reward term `imitate` needs."""

    def expert(
        self, memory: Any, position: Float[Array, "n 3"], velocity: Float[Array, "n 3"]
    ) -> tuple[Float[Array, "n 3"], Float[Array, " n"]]:
        """The velocity to fly at, world, m/s, and the yaw, rad."""
        ...


METHODS = ("of", "start", "goal", "observe", "scene", "desired_yaw", "advance", "fields", "episode_s")
"""What a task must have beside its options."""


def make_task(config: TaskConfig, shape: Shape, control_period: float, substeps: int = 1) -> Task:
    """The task of its options, for a vehicle of this shape, at this control period in s.

    Collisions with obstacles are checked `substeps` times per control step.

    Raises:
        ValueError: when the options name something that does not exist or is broken; when their `world` is no task,
            naming its file and what it lacks.
    """
    world = world_of(type(config))
    if lacking := [name for name in METHODS if not hasattr(world, name)]:
        raise ValueError(f"{origin(world)} has no {', '.join(lacking)}; accepted: all of {', '.join(METHODS)}")
    register_options(type(config))
    return world.of(config, shape, control_period, substeps)


def world_of(options: type[TaskConfig]) -> Any:
    """The class that flies a task.

    Raises:
        ValueError: when `world` leads nowhere.
    """
    return load(options.world) if isinstance(options.world, str) else options.world


@cache
def register_options(options: type) -> None:
    """Make a class of options, and those of its parts, a pytree whose leaves are all that sets no shapes."""
    static = []
    for option in dataclasses.fields(options):
        if option.metadata.get(SHAPE) or isinstance(option.default, str):
            static.append(option.name)
        if dataclasses.is_dataclass(option.default):
            register_options(type(option.default))
    numbers = [option.name for option in dataclasses.fields(options) if option.name not in static]
    jax.tree_util.register_dataclass(options, data_fields=numbers, meta_fields=static)


for _options in TASKS.values():
    register_options(_options)


def struck(
    scene: Scene,
    before: State,
    after: State,
    time: Float[Array, " n"],
    period: float,
    checks: int,
    radius: float | Array,
) -> Bool[Array, " n"]:
    """Whether a vehicle's sphere touched a solid or the ground during a control step.

    Checked `checks` times, on the cubic through positions and velocities at both ends, without gradient.
    """
    s = (1 + jnp.arange(checks)) / checks
    h = jnp.stack([(1 + 2 * s) * (1 - s) ** 2, period * s * (1 - s) ** 2, s**2 * (3 - 2 * s), period * s**2 * (s - 1)])
    ends = jnp.stack([before.position, before.velocity, after.position, after.velocity])
    path = jnp.einsum("hs,hni->sni", h, jax.lax.stop_gradient(ends))
    nearest = jax.vmap(lambda p, t: jnp.min(gaps(scene, p, t), axis=1))(path, time - period + period * s[:, None])
    return jnp.any(nearest < radius, axis=0)


def uniform(key: PRNGKeyArray, n: int, size: int) -> Float[Array, "n size"]:
    """Uniform in [-1, 1]."""
    return jax.random.uniform(key, (n, size), minval=-1.0, maxval=1.0)


def into_ball(cube: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """Uniform points of the unit ball, from uniform points of the cube [-1, 1]^3."""
    u, z, turn = cube[:, 0], cube[:, 1], jnp.pi * cube[:, 2]
    radius, flat = jnp.cbrt((u + 1) / 2), jnp.sqrt(1 - z**2)
    return radius[:, None] * jnp.stack([flat * jnp.cos(turn), flat * jnp.sin(turn), z], axis=-1)


def at_rest(position: Float[Array, "n 3"]) -> State:
    """Level and still at `position`, heading along world x; rotor speeds are left to the environment."""
    zero = jnp.zeros_like(position)
    level = jnp.broadcast_to(jnp.array([1.0, 0.0, 0.0, 0.0], position.dtype), (position.shape[0], 4))
    return State(position, zero, level, zero, jnp.zeros_like(level))
