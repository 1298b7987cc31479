"""Racing: the goal, and where it is flown. What passing a gate is: `courses/gates.py`. Imports no JAX."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from e2efly.config import number
from e2efly.control.vectors import Array, namespace
from e2efly.courses import defaults
from e2efly.courses.gates import Gates
from e2efly.courses.tracks import load_track
from e2efly.goal import Course, Goal, Outcome, Shape
from e2efly.observation import Field
from e2efly.tasks.race import RaceConfig
from e2efly.tasks.route import Route
from e2efly.tasks.verdicts import distance, offsets, touches_ground
from e2efly.vehicles.tables import LARGEST


@dataclass(frozen=True)
class RaceGoal(Goal):
    """Gates to fly through in order. The task's state is the number of gates passed, (n,)."""

    config: RaceConfig
    shape: Shape
    gates: Gates
    closed: bool
    """Whether the first gate follows the last."""

    @property
    def count(self) -> int:
        """Gates of the track."""
        return self.gates.count

    def goal(self, memory: Array, time: Array) -> Array:
        """The next gate's centre."""
        del time
        return namespace(memory).asarray(self.gates.position)[memory % self.count]

    def targets(self, memory: Array, time: Array) -> Array:
        """(n, 2, 3) the centres of the next two gates, world, m."""
        del time
        xp, index = namespace(memory), memory % self.count
        return xp.asarray(self.gates.position)[xp.stack([index, index + 1], axis=-1)]

    def target_offsets(self, memory: Array, time: Array, body: Any) -> Array:
        """The same, minus position."""
        return offsets(self.targets(memory, time), body)

    observation = (
        (Field("gates", 6, "world", "m", 4.0, "centres of the next two gates minus vehicle position"), target_offsets),
    )

    def advance(self, memory: Array, before: Any, after: Any, time: Array, timed_out: Array) -> tuple[Array, Outcome]:
        """Success: the last gate of the last lap passed. Crossings are judged on the straight line of the step."""
        del timed_out
        passed, missed, struck = self.gates.judge(
            memory % self.count, before.position, after.position, self.shape.radius
        )
        error = distance(after.position, self.goal(memory, time))
        crashed = missed | struck | (error > self.config.fence) | touches_ground(self.shape, after)
        passed = passed & ~crashed
        memory = memory + passed
        laps = self.config.laps if self.closed else 1
        finished = passed & (laps > 0) & (memory >= laps * self.count)
        return memory, Outcome(
            terminated=crashed | finished, success=finished, arrived=passed, crashed=crashed, error=error,
            signals={"missed": missed, "struck": struck},
        )  # fmt: skip

    def told(self, arrivals: Sequence[float], mean_error: float, final_error: float, speed: float) -> str:
        """Laps, and the mean time of one."""
        del mean_error, final_error, speed
        laps = len(arrivals) // self.count
        each = f", {arrivals[laps * self.count - 1] / laps:.2f} s each" if laps else ""
        return f"{len(arrivals) / self.count:g} laps{each}"

    def failure(self, memory: Array, outcome: Outcome) -> str:
        """Which gate was missed or struck, if that is why."""
        where = f"gate {int(memory[0]) % self.count + 1} of lap {int(memory[0]) // self.count + 1}"
        if outcome.signals["missed"][0]:
            return f"{where} missed"
        if outcome.signals["struck"][0]:
            return f"frame struck on the way to {where}"
        return f"{super().failure(memory, outcome)}, {where}"


@dataclass(frozen=True)
class RaceRoute(Route):
    """What to race through."""

    height: ClassVar = "track"
    longest_s: ClassVar = 40.0
    whole: ClassVar = {"laps": 3}

    track: str = defaults.TRACK
    """four_gates, s_shaped, circle_3d, j_shaped, or the path of a .toml file."""
    laps: int = number(1, high=LARGEST)
    """Laps to fly; 0: on and on."""

    def course(self, shape: Shape, control_period: float) -> Course:
        """The track, from its start in its heading."""
        del control_period
        track = load_track(self.track)
        if self.laps > 1 and not track.closed:
            raise ValueError(f"goal.laps is {self.laps}; accepted: 0 or 1, as track {track.name!r} is not closed")
        gates, config = Gates.of(track), dataclasses.replace(RaceConfig(), laps=self.laps)
        lowest = float((track.position[:, 2] - track.opening[:, 1] / 2).min())
        return Course(
            RaceGoal(config, shape, gates, track.closed), np.zeros(1, int), np.asarray(gates.start, np.float64),
            heading=float(gates.start_yaw), lowest=lowest, clearance=0.0,
        )  # fmt: skip
