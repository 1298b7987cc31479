"""The interface between tasks and the environment."""

import dataclasses
from dataclasses import dataclass
from functools import cache
from typing import Any, Protocol, runtime_checkable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.config import TaskConfig
from e2efly.config.numbers import SHAPE
from e2efly.config.registry import check_methods, load
from e2efly.policy.goal import Outcome, Shape
from e2efly.policy.observation import Field
from e2efly.simulation.physics import State
from e2efly.simulation.scenes.scene import Scene, gaps
from e2efly.tasks.registry import TASKS

jax.tree_util.register_dataclass(Shape)
jax.tree_util.register_dataclass(Outcome)


class Task(Protocol):
    """A task: pure functions on a frozen dataclass whose numbers are leaves. All are batched over one leading axis."""

    @classmethod
    def of(cls, config: Any, shape: Shape, control_period: float, substeps: int) -> "Task":
        """Make the task from its options; see `make_task`."""
        ...

    @property
    def shape(self) -> Shape:
        """The collision shape of the vehicle."""
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
        """Draw `n` starts: vehicle states and the task's own state. The environment sets the rotor speeds."""
        ...

    def goal(self, memory: Any, time: Float[Array, " n"]) -> Float[Array, "n 3"]:
        """The position to be at now, world, m."""
        ...

    def observe(self, memory: Any, time: Float[Array, " n"], state: State) -> Float[Array, "n o"]:
        """The task's own observation fields, computed from the state that the policy is given."""
        ...

    def scene(self, memory: Any) -> Scene:
        """The worlds in which the vehicles fly. Cameras see them, and the obstacle terms of the reward use them."""
        ...

    def desired_yaw(self, memory: Any, state: State) -> Float[Array, " n"]:
        """The wanted heading, rad, for the orientation terms of the reward."""
        ...

    def advance(
        self, memory: Any, before: State, after: State, time: Float[Array, " n"], timed_out: Bool[Array, " n"]
    ) -> tuple[Any, Outcome]:
        """Judge the control step that ended at `time`, and update the task's own state."""
        ...


AGILE, LAG = 14.0, 0.12
"""Largest level acceleration of a usual vehicle, m/s^2, and the lag of its acceleration, s."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Flier:
    """The motion from which an expert flies on, and how agile its vehicle is."""

    position: Float[Array, "n 3"]
    """World, m."""
    velocity: Float[Array, "n 3"]
    """World, m/s."""
    acceleration: Float[Array, "n 2"]
    """Level acceleration that the present attitude gives, m/s^2."""
    acceleration_max: Float[Array, " n"]
    """Largest level acceleration, m/s^2."""
    lag: Float[Array, " n"]
    """Lag of the acceleration behind the commanded one, s."""
    time: Float[Array, " n"]
    """Time in the episode at which it moves so, s."""
    yaw: Float[Array, " n"]
    """Its yaw, rad."""

    @staticmethod
    def usual(position: Float[Array, "n 3"], velocity: Float[Array, "n 3"], time: float | Array = 0.0) -> "Flier":
        """A vehicle of usual agility, whose attitude is level, and its yaw 0."""
        n = position.shape[0]
        agile, lag, time = jnp.full(n, AGILE), jnp.full(n, LAG), jnp.broadcast_to(time, (n,))
        return Flier(position, velocity, jnp.zeros((n, 2)), agile, lag, time, jnp.zeros(n))


@runtime_checkable
class Guided(Protocol):
    """A task that an expert with knowledge of the whole world can fly. The reward term `imitate` needs it."""

    def expert(self, memory: Any, flier: Flier) -> tuple[Float[Array, "n 3"], Float[Array, " n"]]:
        """The expert's velocity, world, m/s, and yaw, rad."""
        ...


METHODS = ("of", "start", "goal", "observe", "scene", "desired_yaw", "advance", "fields", "episode_s")
"""What a task must have in addition to its options."""


def make_task(config: TaskConfig, shape: Shape, control_period: float, substeps: int = 1) -> Task:
    """Make a task from its options, for a vehicle of this shape, with this control period in s.

    Collisions with obstacles are checked `substeps` times per control step.

    Raises:
        ValueError: when the options name something that does not exist or is broken; or when their `world` is not a
            task, naming its file and what it lacks.
    """
    world: Any = load(config.world) if isinstance(config.world, str) else config.world
    check_methods(world, METHODS)
    register_options(type(config))
    return world.of(config, shape, control_period, substeps)


@cache
def register_options(options: type) -> None:
    """Register an options class, and the classes of its parts, as a pytree.

    Its leaves are all fields that set no shapes.
    """
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

    It is checked `checks` times, on the cubic through positions and velocities at both ends of the step, without
    gradient.
    """
    path, share = path_within(before, after, period, checks)
    nearest = jax.vmap(lambda p, t: jnp.min(gaps(scene, p, t), axis=1))(path, time + period * (share[:, None] - 1))
    return jnp.any(nearest < radius, axis=0)


def path_within(
    before: State, after: State, period: float, checks: int
) -> tuple[Float[Array, "s n 3"], Float[Array, " s"]]:
    """Positions on the cubic through positions and velocities at both ends of a control step, without gradient, and the
    share of the step at which each is.
    """
    s = (1 + jnp.arange(checks)) / checks
    h = jnp.stack([(1 + 2 * s) * (1 - s) ** 2, period * s * (1 - s) ** 2, s**2 * (3 - 2 * s), period * s**2 * (s - 1)])
    ends = jnp.stack([before.position, before.velocity, after.position, after.velocity])
    return jnp.einsum("hs,hni->sni", h, jax.lax.stop_gradient(ends)), s


def uniform(key: PRNGKeyArray, n: int, size: int) -> Float[Array, "n size"]:
    """Uniform random numbers in [-1, 1]."""
    return jax.random.uniform(key, (n, size), minval=-1.0, maxval=1.0)


def between(ends: tuple[Any, Any], u: Float[Array, " n"]) -> Float[Array, " n"]:
    """Uniform numbers in [-1, 1] as uniform numbers between two ends."""
    low, high = ends
    return (low + high) / 2 + (high - low) / 2 * u


def into_ball(cube: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """Map uniform points of the cube [-1, 1]^3 to uniform points of the unit ball."""
    u, z, turn = cube[:, 0], cube[:, 1], jnp.pi * cube[:, 2]
    radius, flat = jnp.cbrt((u + 1) / 2), jnp.sqrt(1 - z**2)
    return radius[:, None] * jnp.stack([flat * jnp.cos(turn), flat * jnp.sin(turn), z], axis=-1)


def at_rest(position: Float[Array, "n 3"]) -> State:
    """Level and still at `position`, heading along world x. The environment sets the rotor speeds."""
    zero = jnp.zeros_like(position)
    level = jnp.broadcast_to(jnp.array([1.0, 0.0, 0.0, 0.0], position.dtype), (position.shape[0], 4))
    return State(position, zero, level, zero, jnp.zeros_like(level))
