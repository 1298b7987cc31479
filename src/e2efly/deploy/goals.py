"""Goals: where a policy is to fly, as it saw it in training. Pure functions on frozen dataclasses, in NumPy.

Positions are in the room: the world of the pose source, ENU, m. Times are seconds on the monotonic clock.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from e2efly.courses.gates import Gates
from e2efly.courses.references import POINTS, SPACING, Polynomials, Spline
from e2efly.deploy.odometry import Odometry

_AHEAD = SPACING * np.arange(POINTS)
_NEAR = 1e-9
"""Product of two distances to a plane, m^2, above which they surely have the same sign."""


class Goal(Protocol):
    """What the observation's first field is made of."""

    @property
    def field(self) -> str:
        """Name of the observation field that shows it."""
        ...

    @property
    def size(self) -> int:
        """Numbers of that field: three a target."""
        ...

    @property
    def fence(self) -> float:
        """Farther than this from `position` an episode of the training ends, m."""
        ...

    def start(self, odometry: Odometry, time: float) -> Any:
        """The goal's own state as the policy takes over at `time`."""
        ...

    def advance(self, state: Any, before: Odometry, after: Odometry, time: float) -> Any:
        """The state after the vehicle went from `before` to `after`, at `time`."""
        ...

    def targets(self, state: Any, time: float) -> np.ndarray:
        """(k, 3) the positions that the policy is shown; the first is `position`."""
        ...

    def position(self, state: Any, time: float) -> np.ndarray:
        """(3,) where to be now."""
        ...

    def done(self, state: Any) -> bool:
        """Whether it is reached, for those that come to an end."""
        ...

    def failed(self, state: Any) -> str:
        """Why it can no longer be reached; empty while it can."""
        ...


@dataclass(frozen=True)
class HoverGoal:
    """A point to fly to and stay at; it has no state and no end."""

    target: np.ndarray
    """(3,)."""
    fence: float

    field = "position_error"
    size = 3

    def start(self, odometry: Odometry, time: float) -> None:
        """Nothing to remember."""

    def advance(self, state: None, before: Odometry, after: Odometry, time: float) -> None:
        """Nothing to remember."""

    def targets(self, state: None, time: float) -> np.ndarray:
        """(1, 3) the point."""
        return self.target[None]

    def position(self, state: None, time: float) -> np.ndarray:
        """(3,) the point."""
        return self.target

    def done(self, state: None) -> bool:
        """Never."""
        return False

    def failed(self, state: None) -> str:
        """Never."""
        return ""


@dataclass(frozen=True)
class LandGoal:
    """A pad to stand on. Its state is whether the feet have been at the pad's height or under it."""

    pad: np.ndarray
    """(3,) a point of the ground."""
    feet_height: float
    """Height of the centre of mass over the feet, m."""
    fence: float

    field = "position_error"
    size = 3

    def start(self, odometry: Odometry, time: float) -> bool:
        """Whether it stands there already."""
        return self._touches(odometry)

    def advance(self, state: bool, before: Odometry, after: Odometry, time: float) -> bool:
        """The first touch counts: what bounces off again has landed."""
        return state or self._touches(after)

    def targets(self, state: bool, time: float) -> np.ndarray:
        """(1, 3) the centre of mass of a vehicle that stands on the pad."""
        return self.position(state, time)[None]

    def position(self, state: bool, time: float) -> np.ndarray:
        """(3,) the same."""
        return self.pad + np.array([0.0, 0.0, self.feet_height])

    def done(self, state: bool) -> bool:
        """Whether the feet have touched."""
        return state

    def failed(self, state: bool) -> str:
        """Never: there is always the ground."""
        return ""

    def _touches(self, odometry: Odometry) -> bool:
        return bool(odometry.position[2] <= self.pad[2] + self.feet_height)


@dataclass(frozen=True)
class ReferenceState:
    """How far along the reference it is time to be."""

    started: float
    """When it began, s on the monotonic clock."""
    elapsed: float
    """Seconds since then."""


@dataclass(frozen=True)
class ReferenceGoal:
    """A reference to follow by the clock, seen a second ahead; its end is held."""

    spline: Spline
    """Of NumPy arrays, one vehicle: knots (1, m, 3, 3)."""
    fence: float

    field = "reference"
    size = 3 * POINTS

    def start(self, odometry: Odometry, time: float) -> ReferenceState:
        """At its first point."""
        return ReferenceState(time, 0.0)

    def advance(self, state: ReferenceState, before: Odometry, after: Odometry, time: float) -> ReferenceState:
        """It moves on with the clock, wherever the vehicle is."""
        return ReferenceState(state.started, time - state.started)

    def targets(self, state: ReferenceState, time: float) -> np.ndarray:
        """(10, 3) for now and each tenth of a second after."""
        return self._path.position(time - state.started + _AHEAD)

    def position(self, state: ReferenceState, time: float) -> np.ndarray:
        """(3,) for now."""
        return self._path.position(np.array([time - state.started]))[0]

    def done(self, state: ReferenceState) -> bool:
        """Whether it is at its end."""
        return state.elapsed >= self.spline.duration

    def failed(self, state: ReferenceState) -> str:
        """Never: how far off is too far is the fence's to say."""
        return ""

    @cached_property
    def _path(self) -> Polynomials:
        return Polynomials.of(self.spline)


@dataclass(frozen=True)
class GatesState:
    """How the race goes."""

    passed: int
    """Gates passed, over all laps."""
    failure: str
    """The first gate that was missed or struck; empty: none."""


@dataclass(frozen=True)
class GatesGoal:
    """Gates to fly through in order, judged as in training; see `courses/gates.py`."""

    gates: Gates
    """Of NumPy arrays."""
    closed: bool
    """Whether the first gate follows the last."""
    laps: int
    """Laps to fly; 0: on and on. A closed track is shown on after them: the policy was trained on laps without end."""
    radius: float
    """Of the vehicle's sphere, m."""
    fence: float

    field = "gates"
    size = 6

    def start(self, odometry: Odometry, time: float) -> GatesState:
        """Before the first gate."""
        return GatesState(0, "")

    def advance(self, state: GatesState, before: Odometry, after: Odometry, time: float) -> GatesState:
        """Judge the straight line between the two: a gate counts when nothing is missed or struck on the way."""
        if self._behind_the_last(state):
            return state
        normal, offset = self._planes
        if (((normal @ before.position - offset) * (normal @ after.position - offset)) > _NEAR).all():
            return state  # no plane was crossed: spares most steps the rest
        index = state.passed % self.gates.count
        verdict = self.gates.judge(np.array([index]), before.position[None], after.position[None], self.radius)
        passed, missed, struck = (bool(part[0]) for part in verdict)
        if not (passed or missed or struck):
            return state
        where = f"gate {index + 1} of lap {state.passed // self.gates.count + 1}"
        failure = f"{where} missed" if missed else f"frame struck on the way to {where}" if struck else ""
        return GatesState(state.passed + (not failure), state.failure or failure)

    def targets(self, state: GatesState, time: float) -> np.ndarray:
        """(2, 3) centres of the next two gates; the point straight on, where there is none."""
        if self._behind_the_last(state):
            return self.gates.position[[-1, -1]]
        index = state.passed % self.gates.count
        return self.gates.position[index : index + 2]

    def position(self, state: GatesState, time: float) -> np.ndarray:
        """(3,) the centre of the next gate."""
        return self.targets(state, time)[0]

    def done(self, state: GatesState) -> bool:
        """Whether the last gate of the last lap is passed."""
        return self.laps > 0 and state.passed >= self.laps * self.gates.count

    def failed(self, state: GatesState) -> str:
        """The first gate that was missed or struck."""
        return state.failure

    @cached_property
    def _planes(self) -> tuple[np.ndarray, np.ndarray]:
        """Unit normals (g, 3) and offsets (g,), m, of the gates' planes: normal . point = offset."""
        gates = self.gates
        normal = np.stack([gates.cos, gates.sin, 0 * gates.cos], axis=-1).astype(np.float64)
        return normal, np.sum(normal * gates.position[:-1], axis=-1)

    def _behind_the_last(self, state: GatesState) -> bool:
        return not self.closed and state.passed >= self.gates.count
