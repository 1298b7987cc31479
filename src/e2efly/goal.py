"""What a task shows a policy and how it judges it: the same code in training (JAX) and in flight (NumPy)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Protocol

import numpy as np

from e2efly.control.place import Place
from e2efly.control.vectors import Array, namespace
from e2efly.courses.origin import Origin
from e2efly.observation import Field


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
    """Height of the centre of mass over the feet, m."""
    radius: float | Array
    """Radius of the sphere that holds it, m."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What a control step came to, each of shape (n,)."""

    terminated: Array
    """The episode is over, for good or ill."""
    success: Array
    """The episode is over and met the task's criterion."""
    arrived: Array
    """A goal was reached in this step."""
    crashed: Array
    """The vehicle hit something or left the fence in this step."""
    error: Array
    """The task's error now, m."""
    signals: dict[str, Array] = field(default_factory=dict)
    """What the task offers to the terms of the reward, beside what every environment does."""


Observed = tuple[Field, Callable[[Any, Any, Array, Any], Array]]
"""A field of the observation, and the method (goal, task state, time, body) -> (n, size) that computes it."""


class Goal:
    """What a policy is to do: where to be, what it is shown, and when it has done it.

    A subclass is a frozen dataclass with the methods below. `memory` is the state of the task, the time is that of the
    episode in s, and all arrays have a leading axis of n vehicles. The arrays are JAX's in training and NumPy's in
    flight, where n is 1: so a method computes in the library of its arguments (`e2efly.control.vectors.namespace`).
    """

    observation: ClassVar[tuple[Observed, ...]] = ()
    """The task's own fields, in order."""
    lands: ClassVar[bool] = False
    """Whether the policy ends on the ground, where nobody may take off again by himself."""

    config: Any
    """The options of the task."""

    @property
    def episode_s(self) -> Any:
        """Time limit of an episode, s."""
        return self.config.episode_s

    @classmethod
    def showing(cls, names: Sequence[str]) -> "type[Goal]":
        """The class whose fields of the observation have these names among them, where the task has several."""
        del names
        return cls

    @property
    def fields(self) -> tuple[Field, ...]:
        """The task's own fields of the observation."""
        return tuple(shown for shown, _ in self.observation)

    def observe(self, memory: Any, time: Array, state: Any) -> Array:
        """(n, o) the task's own fields of the observation, of the body as the policy is told it."""
        parts = [value(self, memory, time, state) for _, value in self.observation]
        return parts[0] if len(parts) == 1 else namespace(*parts).concatenate(parts, axis=-1)

    @classmethod
    def state(cls, memory: Any) -> Any:
        """Of the task's state in training, what flight knows."""
        return memory

    def goal(self, memory: Any, time: Array) -> Array:
        """(n, 3) where to be now, world, m."""
        raise NotImplementedError

    @classmethod
    def aim(cls, shown: Mapping[str, Array]) -> Place:
        """Where a controller that is no policy is to be, by what a policy is shown.

        Args:
            shown: the task's own fields of the observation by name, each (..., size).

        Returns:
            The place, its position relative to the vehicle's.

        Raises:
            NotImplementedError: for a task that no such place does.
        """
        raise NotImplementedError(f"{cls.__name__} names no place to fly to")

    def advance(self, memory: Any, before: Any, after: Any, time: Array, timed_out: Array) -> tuple[Any, Outcome]:
        """Judge the control step that ended at `time`; the task's state after it, and its outcome."""
        raise NotImplementedError

    def drawn(self, memory: Any) -> dict[str, Array]:
        """What an episode draws beside where the vehicle starts, for reports: columns (n, ...) by name.

        With `TaskConfig.course` it is enough to make again what was to be flown.
        """
        del memory
        return {}

    def done(self, outcome: Outcome) -> bool:
        """Whether the task of a single flight (n = 1) is over, and not for having failed in the air."""
        return bool(outcome.success[0])

    def told(self, arrivals: Sequence[float], mean_error: float, final_error: float, speed: float) -> str:
        """How a whole flight of the policy went, in words.

        Args:
            arrivals: when goals were reached, s from its start.
            mean_error: over its second half, m.
            final_error: at its end, m.
            speed: at its end, m/s.
        """
        del arrivals, final_error, speed
        return f"{100 * mean_error:.1f} cm off"

    def failure(self, memory: Any, outcome: Outcome) -> str:
        """Why a single flight (n = 1) has failed, in words.

        Args:
            memory: the task's state before the step that failed.
            outcome: of that step.
        """
        del memory
        return f"the task has failed, {float(outcome.error[0]):.2f} m from its goal"


@dataclass(frozen=True)
class Course:
    """A goal and where it lies in the room (the world of the pose source)."""

    goal: Any
    """A `Goal` of NumPy arrays."""
    memory: Any
    """The task's state at the start, each leaf (1, ...)."""
    start: np.ndarray
    """(3,) where the policy is to take over, in the task's world, m."""
    heading: float | None = None
    """In which heading it is to take over, in the task's world, rad; None: in any, and anywhere near its goal."""
    duration: float = np.inf
    """Seconds after which the task is over."""
    lowest: float = np.inf
    """Lowest height that the course asks for, in the task's world, m."""
    clearance: float | None = None
    """What must lie between there and the ground, m; None: the height of the centre of mass over the feet."""
    origin: Origin = Origin()
    """Of the task's world, in the room."""
