"""What a task shows to a policy, and how it judges it: the same code in training (JAX) and in flight (NumPy)."""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Protocol

import numpy as np

from e2efly.control.place import Place
from e2efly.control.vectors import Array, namespace
from e2efly.courses.origin import Origin
from e2efly.policy.observation import Company, Field
from e2efly.policy.others import Others


class Body(Protocol):
    """The motion of n vehicles, in the task's world."""

    @property
    def position(self) -> Array:
        """(n, 3) centre of mass, world, m."""
        ...

    @property
    def velocity(self) -> Array:
        """(n, 3) world, m/s."""
        ...

    @property
    def quaternion(self) -> Array:
        """(n, 4) wxyz, body to world."""
        ...

    @property
    def body_rate(self) -> Array:
        """(n, 3) about body x, y, z, rad/s."""
        ...


@dataclass(frozen=True)
class Shape:
    """Collision shape of the vehicle."""

    feet_height: float | Array
    """Height of the centre of mass above the feet, m."""
    radius: float | Array
    """Radius of the sphere that encloses it, m."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """The result of a control step; each field has shape (n,)."""

    terminated: Array
    """The episode is over, with success or failure."""
    success: Array
    """The episode is over and met the task's criterion."""
    arrived: Array
    """A goal was reached in this step."""
    crashed: Array
    """The vehicle hit something or left the fence in this step."""
    error: Array
    """The task's error now, m."""
    signals: dict[str, Array] = field(default_factory=dict)
    """Values that the task provides for the terms of the reward, in addition to those of every environment."""


Observed = tuple[Field, Callable[[Any, Any, Array, Any], Array]]
"""A field of the observation, and the method (goal, task state, time, body) -> (n, size) that computes it."""


class Goal:
    """The goal of a policy: where to be, what the policy observes, and when the task is done.

    A subclass is a frozen dataclass with the methods below. `memory` is the state of the task, `time` is the time in
    the episode in s, and all arrays have a leading axis of n vehicles. The arrays are JAX arrays in training, and NumPy
    arrays in flight, where n is 1. A method therefore computes in the library of its arguments
    (`e2efly.control.vectors.namespace`).
    """

    observation: ClassVar[tuple[Observed, ...]] = ()
    """The task's own observation fields, in order."""
    lands: ClassVar[bool] = False
    """Whether the policy ends on the ground. Then the vehicle must not take off again by itself."""

    config: Any
    """The options of the task."""

    @classmethod
    def of(cls, config: Any, shape: "Shape", control_period: float, checks: int = 1) -> Any:
        """Make the goal from its options, with those of the other arguments for which it has a field.

        Args:
            config: the options of the task.
            shape: the collision shape of the vehicle.
            control_period: control period, s.
            checks: number of collision checks per control step.
        """
        given = {"config": config, "shape": shape, "control_period": control_period, "checks": checks}
        return cls(**{name: given[name] for f in dataclasses.fields(cls) if (name := f.name) in given})  # type: ignore[arg-type]

    @property
    def episode_s(self) -> Any:
        """Time limit of an episode, s."""
        return self.config.episode_s

    @classmethod
    def showing(cls, names: Sequence[str]) -> "type[Goal]":
        """The class whose observation fields include these names, if the task has several classes."""
        del names
        return cls

    def shown_to(self, names: Sequence[str]) -> Any:
        """The same goal, which shows a policy only its fields of these names, whatever its options say."""
        options = dataclasses.replace(self.config.showing(names), observes=tuple(names))
        return dataclasses.replace(self, config=options)  # type: ignore[type-var]

    @property
    def observable(self) -> tuple[Observed, ...]:
        """The task's own observation fields that there are. A task overrides it if its options decide on them."""
        return self.observation

    @property
    def shown(self) -> tuple[Observed, ...]:
        """Those that its options show."""
        shows = getattr(self.config, "shows", None)
        return tuple(row for row in self.observable if shows is None or shows(row[0].name))

    @property
    def fields(self) -> tuple[Field, ...]:
        """The task's own fields of the observation."""
        return tuple(field for field, _ in self.shown)

    def observe(self, memory: Any, time: Array, state: Any) -> Array:
        """(n, o) the task's own observation fields, for the body state that the policy is given."""
        parts = [value(self, memory, time, state) for _, value in self.shown]
        if not parts:
            return state.position[..., :0]
        return parts[0] if len(parts) == 1 else namespace(*parts).concatenate(parts, axis=-1)

    @property
    def neighbours(self) -> int:
        """Number of the nearest other vehicles that the policy observes."""
        return 0

    @property
    def company(self) -> Company | None:
        """What the policy needs to know of the others, for its contract. None: not declared."""
        return None

    def among(self, memory: Any, others: Others) -> Any:
        """The task's state with what is known of the others, for a goal that has `neighbours`."""
        raise NotImplementedError(f"{type(self).__name__} observes no other vehicles")

    @classmethod
    def state(cls, memory: Any) -> Any:
        """The part of the task's state in training that is known in flight."""
        return memory

    def goal(self, memory: Any, time: Array) -> Array:
        """(n, 3) position to be at now, world, m."""
        raise NotImplementedError

    def position_error(self, memory: Any, time: Array, body: Any) -> Array:
        """(n, 3) the position to be at now minus that of the body, world, m: a field of many tasks."""
        return self.goal(memory, time) - body.position

    def fence(self, memory: Any) -> Any:
        """Distance from the goal at which an episode ends, m, a number or (n,). Infinite: at none."""
        del memory
        return getattr(self.config, "fence", math.inf)

    @classmethod
    def aim(cls, shown: Mapping[str, Array]) -> Place:
        """The place at which a controller that is not a policy is to be, from a policy's observation.

        Args:
            shown: the task's own observation fields by name, each (..., size).

        Returns:
            The place, with its position relative to the vehicle.

        Raises:
            NotImplementedError: for a task that is not described by such a place.
        """
        raise NotImplementedError(f"{cls.__name__} names no place to fly to")

    def advance(self, memory: Any, before: Any, after: Any, time: Array, timed_out: Array) -> tuple[Any, Outcome]:
        """Judge the control step that ended at `time`. Returns the task's state after it, and its outcome."""
        raise NotImplementedError

    def drawn(self, memory: Any) -> dict[str, Array]:
        """Values that an episode draws in addition to the start of the vehicle, for reports: columns (n, ...) by name.

        Together with `TaskConfig.course` they are enough to construct the course again.
        """
        del memory
        return {}

    def done(self, outcome: Outcome) -> bool:
        """Whether the task of a single flight (n = 1) is over, but not because of a failure in the air."""
        return bool(outcome.success[0])

    def told(self, arrivals: Sequence[float], mean_error: float, final_error: float, speed: float) -> str:
        """How a whole flight of the policy went, as text.

        Args:
            arrivals: times at which goals were reached, s from the start of the policy's flight.
            mean_error: mean error over the second half of this flight, m.
            final_error: error at its end, m.
            speed: speed at its end, m/s.
        """
        del arrivals, final_error, speed
        return f"{100 * mean_error:.1f} cm off"

    def failure(self, memory: Any, outcome: Outcome) -> str:
        """Why a single flight (n = 1) has failed, as text. `memory` is the task's state before the step with this
        outcome.
        """
        del memory
        return f"the task has failed, {float(outcome.error[0]):.2f} m from its goal"


@dataclass(frozen=True)
class Course:
    """A goal and its place in the room (the world of the pose source)."""

    goal: Any
    """A `Goal` of NumPy arrays."""
    memory: Any
    """The task's state at the start, each leaf (1, ...)."""
    start: np.ndarray
    """(3,) position at which the policy is to take over, in the task's world, m."""
    heading: float | None = None
    """Heading at which it is to take over, in the task's world, rad. None: at any heading, and anywhere near its
    goal."""
    duration: float = np.inf
    """Time after which the task is over, s."""
    points: Any = ()
    """(..., 3) points that the vehicle has to come to, in the task's world, m: targets, and corners of gates."""
    clearance: float | None = None
    """Smallest height required of the points above the ground, m. None: the height of the centre of mass above the
    feet."""
    origin: Origin = Origin()
    """Origin of the task's world in the room."""

    @property
    def box(self) -> np.ndarray:
        """(2, 3) smallest and largest x, y, z in the room, m, of the points and of the start."""
        inside = self.origin.points(np.concatenate([np.reshape(self.start, (1, 3)), np.reshape(self.points, (-1, 3))]))
        return np.stack([inside.min(0), inside.max(0)])

    @property
    def needs(self) -> str:
        """The size of the box, and where it lies in the room, as text."""
        low, high = self.box
        size = " x ".join(f"{length:.1f}" for length in high - low)
        return f"{size} m, " + ", ".join(f"{k} {a:.2f} to {b:.2f}" for k, a, b in zip("xyz", low, high, strict=True))
