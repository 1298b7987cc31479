"""What a task is to the environment."""

from dataclasses import dataclass, field
from functools import partial
from typing import Any, Protocol

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.config import (
    AvoidConfig,
    ClutterConfig,
    ForestConfig,
    GapConfig,
    HoverAwareConfig,
    HoverConfig,
    LandConfig,
    LandVisualConfig,
    RaceClutterConfig,
    RaceConfig,
    TrackConfig,
)
from e2efly.observation import Field
from e2efly.physics import State
from e2efly.scenes.scene import Scene, gaps

for _config, _static in (
    (HoverConfig, ()),
    (LandConfig, ()),
    (LandVisualConfig, ()),
    (TrackConfig, ("reference",)),
    (RaceConfig, ("track",)),
    (ForestConfig, ("room",)),
    (ClutterConfig, ("room",)),
    (RaceClutterConfig, ("track",)),
    (AvoidConfig, ()),
    (GapConfig, ()),
    (HoverAwareConfig, ()),
):
    jax.tree_util.register_dataclass(
        _config,
        data_fields=[name for name in _config.__dataclass_fields__ if name not in _static],
        meta_fields=list(_static),
    )


@partial(jax.tree_util.register_dataclass, data_fields=["feet_height", "radius"], meta_fields=[])
@dataclass(frozen=True)
class Shape:
    """What of the vehicle can touch things."""

    feet_height: float | Array
    """Height of the centre of mass over the feet, m."""
    radius: float | Array
    """Radius of the sphere that holds it, m."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Outcome:
    """What a control step came to, each of shape (n,)."""

    terminated: Bool[Array, " n"]
    """The episode is over, for good or ill."""
    success: Bool[Array, " n"]
    """The episode is over and met the task's criterion."""
    arrived: Bool[Array, " n"]
    """A goal was reached in this step."""
    crashed: Bool[Array, " n"]
    """The vehicle hit something or left the fence in this step."""
    error: Float[Array, " n"]
    """The task's error now, m."""
    signals: dict[str, Array] = field(default_factory=dict)
    """What the task offers to the terms of the reward, beside what every environment does."""


class Task(Protocol):
    """A task: pure functions on a frozen dataclass whose numbers are leaves. All batched over one leading axis."""

    @property
    def name(self) -> str:
        """The task's name."""
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


def offsets(targets: Float[Array, "n k 3"], state: State) -> Float[Array, "n 3k"]:
    """Positions minus the vehicle's, world, m, target after target."""
    return (targets - state.position[:, None]).reshape(targets.shape[0], -1)


def touches_ground(shape: Shape, state: State) -> Bool[Array, " n"]:
    """Touching: the feet, `feet_height` below the centre of mass, at or under the ground z = 0."""
    return state.position[:, 2] <= shape.feet_height


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
    """Points of the cube [-1, 1]^3 drawn into the unit ball: those outside it onto its surface."""
    length = jnp.linalg.norm(cube, axis=-1, keepdims=True)
    return cube / jnp.maximum(length, 1.0)


def at_rest(position: Float[Array, "n 3"]) -> State:
    """Level and still at `position`, heading along world x; rotor speeds are left to the environment."""
    zero = jnp.zeros_like(position)
    level = jnp.broadcast_to(jnp.array([1.0, 0.0, 0.0, 0.0], position.dtype), (position.shape[0], 4))
    return State(position, zero, level, zero, jnp.zeros_like(level))
