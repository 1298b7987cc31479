"""Racing: the goal, and the route of a flight. `courses/gates.py` defines what passing a gate is. Imports no JAX."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from e2efly.config import number
from e2efly.config.domain import Domain, track_domain
from e2efly.config.numbers import SPEED
from e2efly.config.tables import LARGEST
from e2efly.control.place import Place
from e2efly.control.vectors import Array, Vec3, namespace
from e2efly.courses import defaults
from e2efly.courses.gates import Gates, Tracks
from e2efly.courses.tracks import RaceTrack, load_track
from e2efly.policy.contract import Contract
from e2efly.policy.goal import Course, Goal, Outcome, Shape
from e2efly.policy.observation import Field
from e2efly.tasks.race import RaceConfig
from e2efly.tasks.race.any_goal import AnyRaceGoal, AnyRaceMemory
from e2efly.tasks.race.racing import Racing
from e2efly.tasks.race.swinging import SwingingMemory, after_step, gates_at, passed_by, rows
from e2efly.tasks.route import Route
from e2efly.tasks.verdicts import offsets

CRUISE = 3.0
"""Speed of a controller that is not a policy, m/s."""


@dataclass(frozen=True)
class RaceGoal(Racing):
    """Fly through gates in order. The task's state is the number of gates passed, (n,), or a `SwingingMemory`."""

    config: RaceConfig
    shape: Shape
    gates: Gates
    closed: bool
    """Whether the first gate follows the last."""

    @classmethod
    def showing(cls, names: Sequence[str]) -> type[Goal]:
        """`AnyRaceGoal` if the observation contains the axes of gates, otherwise this class."""
        return AnyRaceGoal if "gate_axes" in names else cls

    @property
    def count(self) -> int:
        """Number of gates of the track."""
        return self.gates.count

    def place(self, memory: Any) -> tuple[int, int]:
        """See `Racing.place`."""
        passed = int(passed_by(memory)[0])
        return passed % self.count + 1, passed // self.count + 1

    def goal(self, memory: Any, time: Array) -> Array:
        """The next gate's centre."""
        return rows(self.centres(memory, time), passed_by(memory) % self.count)

    def targets(self, memory: Any, time: Array) -> Array:
        """(n, 2, 3) the centres of the next two gates, world, m."""
        index = passed_by(memory) % self.count
        return rows(self.centres(memory, time), namespace(index).stack([index, index + 1], axis=-1))

    def centres(self, memory: Any, time: Array | None = None) -> Array:
        """(g + 1, 3), or for gates that swing (n, g + 1, 3): see `Gates.position`. Without a time, see `gates_at`."""
        return namespace(passed_by(memory)).asarray(gates_at(self.gates, memory, self.closed, time).position)

    def target_offsets(self, memory: Any, time: Array, body: Any) -> Array:
        """The same centres minus position."""
        return offsets(self.targets(memory, time), body)

    @classmethod
    def aim(cls, shown: Mapping[str, Array]) -> Place:
        """Straight to the next gate's centre at `CRUISE`, wherever this centre is."""
        way = shown["gates"][..., :3]
        far = namespace(way).linalg.norm(way, axis=-1, keepdims=True)
        return Place(Vec3.of(0.0 * way), Vec3.of(way / (far + 1e-6)) * CRUISE)

    observation = (
        (Field("gates", 6, "world", "m", 4.0, "centres of the next two gates minus vehicle position"), target_offsets),
    )

    def advance(self, memory: Any, before: Any, after: Any, time: Array, timed_out: Array) -> tuple[Any, Outcome]:
        """Judge a step. Success: the last gate of the last lap is passed.

        Crossings are judged on the straight line of the step.
        """
        laps = self.config.laps if self.closed else 1
        done = passed_by(memory)
        end = (laps > 0) & (done + 1 >= laps * self.count)
        gates = gates_at(self.gates, memory, self.closed, time)
        passed, outcome = self.verdict(memory, before, after, time, gates, done % self.count, end, self.config.fence)
        return after_step(memory, passed, time), outcome

    def drawn(self, memory: Any) -> dict[str, Array]:
        """How the gates swing, if they do: see `SwingingMemory`."""
        swings = ("cosine", "sine", "rate") if isinstance(memory, SwingingMemory) else ()
        return {name: getattr(memory, name) for name in swings}

    def told(self, arrivals: Sequence[float], mean_error: float, final_error: float, speed: float) -> str:
        """The number of laps and the mean lap time, as text."""
        laps = len(arrivals) // self.count
        each = f", {arrivals[laps * self.count - 1] / laps:.2f} s each" if laps else ""
        return f"{len(arrivals) / self.count:g} laps{each}"


@dataclass(frozen=True)
class GatesRoute(Route):
    """The track to race on."""

    height: ClassVar = "track"
    longest_s: ClassVar = 40.0
    whole: ClassVar = {"laps": 3, "origin": (0.0, 0.0, 0.5)}
    """Higher than the track: at full speed the guard would end a flight that dives towards a gate near the floor."""

    track: str = defaults.TRACK
    """A shipped track (`e2efly list` has their names), or the path of a .toml file."""
    laps: int = number(1, high=LARGEST)
    """Number of laps to fly. 0: without end."""

    def domain(self) -> Domain:
        """The track."""
        return track_domain(self._track())

    def _track(self) -> RaceTrack:
        track = load_track(self.track)
        if self.laps > 1 and not track.closed:
            raise ValueError(f"goal.laps is {self.laps}; accepted: 0 or 1, as track {track.name!r} is not closed")
        return track

    def _placed(self, goal: Racing, memory: Any, track: RaceTrack) -> Course:
        start, heading = track.start.astype(np.float32).astype(np.float64), float(track.start_yaw)
        return Course(goal, memory, start, heading=heading, points=track.corners, clearance=0.0)


@dataclass(frozen=True)
class RaceRoute(GatesRoute):
    """The track to race on, as fast as the vehicle can."""

    speed: float | None = number(None, above=0, high=SPEED)
    """Commanded speed, m/s. If it is given, the zoo's race_speed flies in place of race, which flies as fast as it
    can."""

    @property
    def instead(self) -> str | None:
        """The policy that obeys a commanded speed."""
        return None if self.speed is None else "race_speed"

    def course(self, shape: Shape, control_period: float) -> Course:
        """The course along the track, from its start and with its heading."""
        track = self._track()
        gates = Gates.of(track)
        return self._placed(RaceGoal(self._options(), shape, gates, track.closed), np.zeros(1, int), track)

    def course_of(self, contract: Contract, shape: Shape) -> Course:
        """The same course, also for a policy whose observation describes any track."""
        if "gate_axes" not in (field.name for field in contract.observation):
            return super().course_of(contract, shape)
        track = self._track()
        return self._placed(
            AnyRaceGoal(self._options(), shape), AnyRaceMemory(Tracks.of(track), np.zeros(1, int)), track
        )

    def _options(self) -> RaceConfig:
        if self.speed is not None:
            raise ValueError(
                f"goal.speed is {self.speed:g}; accepted: None, as this policy flies as fast as it can; race_speed of "
                "the zoo, and what `e2efly train race_speed` gives, obey a speed"
            )
        return dataclasses.replace(RaceConfig(), laps=self.laps)
