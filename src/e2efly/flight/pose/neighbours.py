"""The other vehicles of a flight, each by a pose source of its own. One that is lost grows, and never vanishes."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from e2efly.flight.pose.conditions import Checks
from e2efly.flight.pose.pose_source import PoseSource
from e2efly.flight.pose.tracking import PoseTrack, track
from e2efly.policy.odometry import Odometry
from e2efly.policy.others import Others, nobody

FASTEST = 5.0
"""Speed with which a vehicle that is not seen may come nearer, m/s."""
LOST_S = 1.0
"""A policy's flight ends when one of the others has not been seen for this time, s."""
LEAST = 0.05
"""Smallest distance at which another vehicle is shown, m: a direction stays."""


class OtherVehicle(NamedTuple):
    """Another vehicle now."""

    position: tuple[float, float, float]
    """World, m."""
    velocity: tuple[float, float, float]
    """World, m/s."""
    ball: float = 0.0
    """Radius of a ball about this position that surely contains its centre, m."""


class Neighbours:
    """What is known of the other vehicles."""

    def __init__(self, sources: Sequence[PoseSource], max_age: float) -> None:
        """Create it for one source for each other vehicle. An age of its pose up to `max_age` s is usual."""
        self.sources, self.max_age = tuple(sources), max_age
        self._checks = Checks(max_age=max_age)
        self._tracks = [PoseTrack() for _ in self.sources]

    def read(self, now: float) -> None:
        """Read all sources. `now` is the time on the monotonic clock, s."""
        for i, source in enumerate(self.sources):
            for sample in source.read(now):
                self._tracks[i], _, _ = track(self._checks, self._tracks[i], sample)
                if (
                    self._tracks[i].fault is not None
                ):  # a lasting fault: what comes is judged anew, what was known stays
                    self._tracks[i] = PoseTrack(odometry=self._tracks[i].odometry)

    def problem(self, now: float) -> str | None:
        """Why a policy must not fly among them. None: it may."""
        for source, known in zip(self.sources, self._tracks, strict=True):
            age = math.inf if known.odometry is None else now - known.odometry.time
            if not age <= LOST_S:
                told = "never seen" if age == math.inf else f"not seen for {age:.1f} s"
                why = "" if source.problem is None else f" ({source.problem})"
                return f"another vehicle, by {source.describe()}, was {told}{why}; accepted: seen within {LOST_S:g} s"
        return None

    def balls(self, now: float) -> tuple[OtherVehicle, ...]:
        """All that have been seen, where they are now. They have flown on with their velocity. One that has not been
        seen for longer than usual is a ball, whose radius grows by `FASTEST`.
        """
        found = []
        for known in self._tracks:
            if known.odometry is not None:
                age, motion = max(now - known.odometry.time, 0.0), known.odometry
                place = motion.position + min(age, self.max_age) * motion.velocity
                ball = FASTEST * max(age - self.max_age, 0.0)
                found.append(OtherVehicle(tuple(place.tolist()), tuple(motion.velocity.tolist()), ball))
        return tuple(found)

    def nearest(self, odometry: Odometry, now: float, count: int) -> Others:
        """The `count` nearest others, for one vehicle, in the axes of its odometry.

        Of a ball, the point that is nearest to the vehicle is shown: see `balls`.
        """
        found = []
        for other in self.balls(now):
            offset = np.array(other.position) - odometry.position
            away = float(np.linalg.norm(offset))
            shown = max(away - other.ball, min(away, LEAST))
            found.append((shown, offset * (shown / max(away, 1e-9)), other.velocity))
        found.sort(key=lambda one: one[0])
        others = nobody(odometry.position[None], count)
        for i, (_, offset, speed) in enumerate(found[:count]):
            others.position[0, i], others.velocity[0, i] = odometry.position + offset, speed
        return others

    def close(self) -> None:
        """Close all sources."""
        for source in self.sources:
            source.close()
