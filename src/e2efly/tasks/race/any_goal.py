"""Racing on any track: the goal of policies whose observation describes the gates fully. Imports no JAX."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from e2efly.control.vectors import Array, namespace
from e2efly.courses.gates import STRAIGHT_ON, Tracks
from e2efly.policy.goal import Outcome, Shape
from e2efly.policy.observation import Field
from e2efly.tasks.race.racing import Racing
from e2efly.tasks.verdicts import distance, offsets

SHOWN = 3
"""Number of gates that the policy observes."""
BEHIND = 0.3
"""Distance behind a gate of the point to which a commanded velocity is directed, m."""
HIGHEST = 3.0
"""Limit of the observed height above the ground, m."""


@dataclass(frozen=True)
class AnyRaceMemory:
    """The track of each vehicle, the number of gates that it has passed, and its commanded speed."""

    tracks: Tracks
    passed: Array
    """(n,) gates passed."""
    speed: Any = math.inf
    """(n,) commanded speed, m/s. Infinite: as fast as it can."""

    @property
    def index(self) -> Array:
        """(n,) the next gate, counted from 0 within a lap."""
        return self.passed % self.tracks.count


@dataclass(frozen=True)
class Ahead:
    """The next `SHOWN` gates of n vehicles.

    After the last gate of an open track, further gates follow straight on.
    """

    centre: Array
    """(n, s, 3) centres, world, m."""
    axis: Array
    """(n, s, 3) unit vectors in the direction of flight through the gates, world."""
    half: Array
    """(n, s, 2) half of the width and height of the openings, m."""

    @staticmethod
    def of(memory: AnyRaceMemory) -> "Ahead":
        """The gates that follow the gates passed."""
        tracks, index = memory.tracks, memory.index
        g, xp = tracks.gates, namespace(memory.passed)
        count, closed = tracks.count[:, None], tracks.closed[:, None]
        onward = index[:, None] + xp.arange(SHOWN)
        row = xp.where(closed, onward % count, xp.minimum(onward, count - 1))
        beyond = xp.where(closed, 0, onward - row)
        table = xp.concatenate([g.position[:, :-1], g.cos[..., None], g.sin[..., None], g.half], axis=-1)
        found = xp.take_along_axis(table, row[..., None], axis=1)
        axis = xp.concatenate([found[..., 3:5], xp.zeros_like(found[..., :1])], axis=-1)
        return Ahead(found[..., :3] + STRAIGHT_ON * beyond[..., None] * axis, axis, found[..., 5:])


def towards(memory: AnyRaceMemory, body: Any, speed: Array) -> Array:
    """(n, 3) a velocity, world, m/s, to a point close behind the next gate, at a speed (n,).

    In the middle of the gate it still points straight through.
    """
    ahead = Ahead.of(memory)
    away = ahead.centre[:, 0] + BEHIND * ahead.axis[:, 0] - body.position
    return speed[:, None] * away / (namespace(away).linalg.norm(away, axis=-1, keepdims=True) + 1e-3)


@dataclass(frozen=True)
class AnyRaceGoal(Racing):
    """Fly through gates in order, on a separate track for each vehicle."""

    config: Any
    shape: Shape

    def place(self, memory: AnyRaceMemory) -> tuple[int, int]:
        """See `Racing.place`."""
        return int(memory.index[0]) + 1, int(memory.passed[0] // memory.tracks.count[0]) + 1

    def goal(self, memory: AnyRaceMemory, time: Array) -> Array:
        """The next gate's centre."""
        return Ahead.of(memory).centre[:, 0]

    def target_offsets(self, memory: AnyRaceMemory, time: Array, body: Any) -> Array:
        """The centres of the next gates minus position."""
        return offsets(Ahead.of(memory).centre, body)

    def axes(self, memory: AnyRaceMemory, time: Array, body: Any) -> Array:
        """The directions of the next gates."""
        return Ahead.of(memory).axis.reshape(body.position.shape[0], -1)

    def openings(self, memory: AnyRaceMemory, time: Array, body: Any) -> Array:
        """Width and height of the next gates."""
        return 2 * Ahead.of(memory).half.reshape(body.position.shape[0], -1)

    def height(self, memory: AnyRaceMemory, time: Array, body: Any) -> Array:
        """Height above the ground, limited to `HIGHEST`."""
        return namespace(body.position).clip(body.position[:, 2:], 0.0, HIGHEST)

    observation = (
        (
            Field("gates", 3 * SHOWN, "world", "m", 4.0, "centres of the next three gates minus vehicle position"),
            target_offsets,
        ),
        (
            Field(
                "gate_axes", 3 * SHOWN, "world", "1", 1.0,
                "unit vectors along which the next three gates are flown through",
            ),
            axes,
        ),
        (
            Field("gate_openings", 2 * SHOWN, "none", "m", 1.0, "inner width and height of the next three gates"),
            openings,
        ),
        (Field("height", 1, "none", "m", 2.0, "height over the ground, 3 where it is more"), height),
    )  # fmt: skip

    def fence(self, memory: AnyRaceMemory) -> Array:
        """(n,) largest allowed distance from the next gate, m.

        It is the fence plus the distance between the last gate, or the start, and the next gate.
        """
        g, index, xp = memory.tracks.gates, memory.index, namespace(memory.passed)
        before = (index - 1) % memory.tracks.count
        here, there = (xp.take_along_axis(g.position, i[:, None, None], axis=1)[:, 0] for i in (before, index))
        here = xp.where(memory.passed[:, None] == 0, g.start, here)
        return self.config.fence + distance(here, there)

    def advance(
        self, memory: AnyRaceMemory, before: Any, after: Any, time: Array, timed_out: Array
    ) -> tuple[AnyRaceMemory, Outcome]:
        """Judge a step. Success: the last gate of the last lap is passed.

        Crossings are judged on the straight line of the step.
        """
        tracks, xp = memory.tracks, namespace(memory.passed)
        laps = xp.where(tracks.closed, self.config.laps, 1)
        end = (laps > 0) & (memory.passed + 1 >= laps * tracks.count)
        passed, outcome = self.verdict(memory, before, after, time, tracks.gates, memory.index, end, self.fence(memory))
        return dataclasses.replace(memory, passed=memory.passed + passed), outcome

    def drawn(self, memory: AnyRaceMemory) -> dict[str, Array]:
        """The track: its start, its gates (rows beyond `count` are unused), and whether it is closed."""
        t = memory.tracks
        yaw = namespace(memory.passed).arctan2(t.gates.sin, t.gates.cos)
        return {
            "start": t.gates.start, "start_yaw": t.gates.start_yaw, "position": t.gates.position[:, :-1], "yaw": yaw,
            "opening": 2 * t.gates.half, "count": t.count, "closed": t.closed,
        }  # fmt: skip

    def told(self, arrivals: Sequence[float], mean_error: float, final_error: float, speed: float) -> str:
        """The number of gates passed and the time of the last one, as text."""
        return f"{len(arrivals)} gates" + (f" in {arrivals[-1]:.2f} s" if arrivals else "")
