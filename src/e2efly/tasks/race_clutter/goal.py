"""Racing in clutter: the goal, and where it is flown. Imports no JAX."""

import dataclasses
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from e2efly.config import number
from e2efly.control.vectors import Array, namespace
from e2efly.courses.gates import STRAIGHT_ON, Tracks
from e2efly.courses.tracks import RaceTrack, load_track
from e2efly.goal import Course, Goal, Outcome, Shape
from e2efly.observation import Field
from e2efly.tasks.race_clutter import RaceClutterConfig
from e2efly.tasks.route import Route
from e2efly.tasks.verdicts import distance, offsets
from e2efly.vehicles.tables import LARGEST


@dataclass(frozen=True)
class Memory:
    """The track of each vehicle, and how far it is."""

    tracks: Tracks
    passed: Array
    """(n,) gates."""
    speed: Array
    """(n,) commanded, m/s."""

    @property
    def index(self) -> Array:
        """(n,) the next gate, counted from 0 within a lap."""
        return self.passed % self.tracks.count


@dataclass(frozen=True)
class RaceClutterGoal(Goal):
    """Gates to fly through in order, at a commanded speed."""

    config: RaceClutterConfig
    shape: Shape
    control_period: float
    checks: int
    """How often a control step is checked for collisions."""

    @classmethod
    def state(cls, memory: Any) -> Memory:
        """Without what only cameras see."""
        return Memory(**{part.name: getattr(memory, part.name) for part in dataclasses.fields(Memory)})

    def targets(self, memory: Memory) -> Array:
        """(n, 2, 3) the centres of the next two gates; behind the last of an open track, a point straight on."""
        return self._next_two(memory)[0]

    def goal(self, memory: Memory, time: Array) -> Array:
        """The next gate's centre."""
        del time
        return self.targets(memory)[:, 0]

    def axes(self, memory: Memory) -> Array:
        """(n, 2, 3) directions of the next two gates; behind the last of an open track, the last one's."""
        return self._next_two(memory)[1]

    def _next_two(self, memory: Memory) -> tuple[Array, Array]:
        tracks, index = memory.tracks, memory.index
        g, xp = tracks.gates, namespace(index)
        after = xp.where(index + 1 < tracks.count, index + 1, xp.where(tracks.closed, 0, index))
        two = xp.stack([index, after], axis=-1)
        axes = rows(xp.stack([g.cos, g.sin, 0 * g.cos], axis=-1), two)
        beyond = STRAIGHT_ON * ((index + 1 >= tracks.count) & ~tracks.closed)[:, None] * axes[:, 1]
        centres = rows(g.position[:, :-1], two)
        return xp.stack([centres[:, 0], centres[:, 1] + beyond], axis=1), axes

    def target_offsets(self, memory: Memory, time: Array, body: Any) -> Array:
        """The next two gates minus position."""
        del time
        return offsets(self.targets(memory), body)

    def flat_axes(self, memory: Memory, time: Array, body: Any) -> Array:
        """Their directions."""
        del time
        return self.axes(memory).reshape(body.position.shape[0], 6)

    def desired_speed(self, memory: Memory, time: Array, body: Any) -> Array:
        """The commanded speed."""
        del time, body
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
        """The verdict of one that cannot know what stands in the way."""
        del timed_out
        return self.verdict(memory, before, after, time, False)

    def verdict(self, memory: Any, before: Any, after: Any, time: Array, hit: Array | bool) -> tuple[Any, Outcome]:
        """Success: the last gate of the lap passed without touching anything; `hit`: gate, obstacle or ground."""
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

    def failure(self, memory: Memory, outcome: Outcome) -> str:
        """Which gate was missed, if that is why."""
        where = f"gate {int(memory.index[0]) + 1} of lap {int(memory.passed[0] // memory.tracks.count[0]) + 1}"
        return f"{where} missed" if outcome.signals["missed"][0] else f"{super().failure(memory, outcome)}, {where}"


@dataclass(frozen=True)
class RaceClutterRoute(Route):
    """What to race through, and how fast."""

    height: ClassVar = "track"
    longest_s: ClassVar = 40.0

    track: str = "s_shaped"
    """four_gates, s_shaped, circle_3d, j_shaped, or the path of a .toml file; drawn twice as large on the ground."""
    laps: int = number(1, high=LARGEST)
    """Laps to fly; 0: on and on."""
    speed: float = number(6.0, above=0)
    """Commanded speed, m/s."""

    def course(self, shape: Shape, control_period: float) -> Course:
        """The track, from its start in its heading."""
        config = dataclasses.replace(RaceClutterConfig(), laps=self.laps)
        track = drawn_larger(load_track(self.track), config.scale)
        memory = Memory(Tracks.of(track), np.zeros(1, int), np.array([self.speed]))
        lowest = float((track.position[:, 2] - track.opening[:, 1] / 2).min())
        return Course(
            RaceClutterGoal(config, shape, control_period, 1), memory,
            np.asarray(track.start, np.float64), heading=float(track.start_yaw), lowest=lowest, clearance=0.0,
        )  # fmt: skip


def drawn_larger(track: RaceTrack, scale: float) -> RaceTrack:
    """The track with its ground plan `scale` times as large; heights and openings stay."""
    size = np.array([scale, scale, 1.0])
    return dataclasses.replace(track, start=track.start * size, position=track.position * size)


def rows(table: Array, index: Array) -> Array:
    """(n, k, 3) rows (n, k) of each world's table (n, g, 3); as a product, whose gradient is no scatter."""
    chosen = index[..., None] == np.arange(table.shape[1])
    return chosen.astype(table.dtype) @ table
