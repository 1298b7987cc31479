"""Racing in clutter: the goal, and the route of a flight. Imports no JAX."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from e2efly.config import number
from e2efly.config.domain import Domain, extent, track_domain
from e2efly.config.numbers import SPEED
from e2efly.config.storage import write_atomically
from e2efly.config.tables import LARGEST
from e2efly.control.vectors import Array, namespace
from e2efly.courses.gates import Tracks
from e2efly.courses.tracks import load_track, track_text
from e2efly.policy.goal import Course, Goal, Outcome, Shape
from e2efly.policy.observation import Field
from e2efly.tasks.race.any_goal import Ahead, AnyRaceMemory
from e2efly.tasks.race_clutter import RaceClutterConfig
from e2efly.tasks.route import Route
from e2efly.tasks.verdicts import distance, offsets


@dataclass(frozen=True)
class RaceClutterGoal(Goal):
    """Fly through gates in order, at a commanded speed."""

    config: RaceClutterConfig
    shape: Shape
    control_period: float
    checks: int
    """Number of collision checks per control step."""

    @classmethod
    def state(cls, memory: Any) -> AnyRaceMemory:
        """The state without what only cameras see."""
        return AnyRaceMemory(**{part.name: getattr(memory, part.name) for part in dataclasses.fields(AnyRaceMemory)})

    def goal(self, memory: AnyRaceMemory, time: Array) -> Array:
        """The next gate's centre."""
        return Ahead.of(memory).centre[:, 0]

    def target_offsets(self, memory: AnyRaceMemory, time: Array, body: Any) -> Array:
        """The centres of the next two gates minus position."""
        return offsets(Ahead.of(memory).centre[:, :2], body)

    def flat_axes(self, memory: AnyRaceMemory, time: Array, body: Any) -> Array:
        """The directions of flight through the next two gates."""
        return Ahead.of(memory).axis[:, :2].reshape(body.position.shape[0], 6)

    def desired_speed(self, memory: AnyRaceMemory, time: Array, body: Any) -> Array:
        """The commanded speed."""
        return memory.speed[:, None]

    observation = (
        (Field("gates", 6, "world", "m", 4.0, "centres of the next two gates minus vehicle position"), target_offsets),
        (
            Field("gate_axes", 6, "world", "1", 1.0, "unit vectors along which the next two gates are flown through"),
            flat_axes,
        ),
        (Field("desired_speed", 1, "none", "m/s", 8.0, "speed to fly at"), desired_speed),
    )

    def advance(self, memory: Any, before: Any, after: Any, time: Array, timed_out: Array) -> tuple[Any, Outcome]:
        """The verdict without knowledge of the obstacles."""
        return self.verdict(memory, before, after, time, False)

    def verdict(self, memory: Any, before: Any, after: Any, time: Array, hit: Array | bool) -> tuple[Any, Outcome]:
        """Success: the last gate of the lap is passed without touching anything.

        `hit`: a gate, an obstacle or the ground.
        """
        c = self.config
        tracks, xp = memory.tracks, namespace(memory.passed)
        passed, missed, _ = tracks.gates.judge(memory.index, before.position, after.position, self.shape.radius)
        error = distance(after.position, self.goal(memory, time))
        lost = missed | (error > c.fence) | (after.position[:, 2] < self.shape.feet_height)
        crashed = lost | hit
        passed = passed & ~lost
        moved = dataclasses.replace(memory, passed=memory.passed + passed)
        laps = xp.where(tracks.closed, c.laps, 1)
        finished = passed & (laps > 0) & (moved.passed >= laps * tracks.count)
        ends = lost | finished | (hit & (c.collisions_end > 0))
        return moved, Outcome(
            terminated=ends, success=finished & ~crashed, arrived=passed, crashed=crashed, error=error,
            signals={"missed": missed},
        )  # fmt: skip

    def told(self, arrivals: Sequence[float], mean_error: float, final_error: float, speed: float) -> str:
        """The number of gates passed and the time of the last one, as text."""
        return f"{len(arrivals)} gates in {arrivals[-1]:.2f} s" if arrivals else "no gate"

    def failure(self, memory: AnyRaceMemory, outcome: Outcome) -> str:
        """The gate that was missed, if this is the reason."""
        where = f"gate {int(memory.index[0]) + 1} of lap {int(memory.passed[0] // memory.tracks.count[0]) + 1}"
        return f"{where} missed" if outcome.signals["missed"][0] else f"{super().failure(memory, outcome)}, {where}"


@dataclass(frozen=True)
class RaceClutterRoute(Route):
    """The track to race on, and the speed."""

    height: ClassVar = "track"
    longest_s: ClassVar = 40.0

    track: str = "s_shaped"
    """four_gates, s_shaped, circle_3d, j_shaped, or the path of a .toml file."""
    scale: float = number(2.0, above=0)
    """Factor by which the ground plan of the track is enlarged."""
    laps: int = number(1, high=LARGEST)
    """Number of laps to fly. 0: without end."""
    speed: float = number(6.0, above=0, high=SPEED)
    """Commanded speed, m/s."""

    @classmethod
    def drawn(cls, course: Course, file: Path) -> "RaceClutterRoute":
        """The route with the gates that were drawn, written to a file, and with the speed that was drawn."""
        memory: AnyRaceMemory = course.memory
        file.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(file, track_text(memory.tracks.track(0)).encode())
        return cls(track=str(file), scale=1.0, laps=int(course.goal.config.laps), speed=float(memory.speed[0]))

    def domain(self) -> Domain:
        """The track, and the commanded speed."""
        return *track_domain(load_track(self.track).enlarged(self.scale)), extent("speed", "m/s", self.speed)

    def course(self, shape: Shape, control_period: float) -> Course:
        """The course along the track, from its start and with its heading."""
        config = dataclasses.replace(RaceClutterConfig(), laps=self.laps)
        track = load_track(self.track).enlarged(self.scale)
        memory = AnyRaceMemory(Tracks.of(track), np.zeros(1, int), np.array([self.speed]))
        return Course(
            RaceClutterGoal(config, shape, control_period, 1), memory,
            np.asarray(track.start, np.float64), heading=float(track.start_yaw), points=track.corners, clearance=0.0,
        )  # fmt: skip


@dataclass(frozen=True)
class RaceClutterRoomRoute(RaceClutterRoute):
    """The track in the room to race on, and the speed."""

    track: str = "room_6"
    """room_6, or the path of a .toml file."""
    scale: float = number(1.0, above=0)
    """Factor by which the ground plan of the track is enlarged."""
    speed: float = number(2.0, above=0, high=SPEED)
    """Commanded speed, m/s."""
