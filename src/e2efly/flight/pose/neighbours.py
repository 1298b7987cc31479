"""The other vehicles of a flight, each by a pose source of its own. One that is lost grows, and never vanishes."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from e2efly.flight.pose.conditions import Checks
from e2efly.flight.pose.pace import Pace, paced
from e2efly.flight.pose.pose_source import PoseSource
from e2efly.flight.pose.tracking import PoseTrack, track
from e2efly.policy.observation import Company
from e2efly.policy.odometry import Odometry
from e2efly.policy.others import USUAL, Others, nobody

AGILE = 30.0
"""Largest acceleration of another vehicle, m/s^2."""
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

    def __init__(self, sources: Sequence[PoseSource], max_age: float, needs: Company = USUAL) -> None:
        """Create it for one source for each other vehicle.

        Args:
            sources: the sources. One that does not see everywhere says how far it does, m: `range_m`.
            max_age: age of a pose up to which it is usual, s, if the policy needs no younger ones.
            needs: what the policy needs.

        Raises:
            ValueError: for a source that does not see as far as the policy needs.
        """
        self.sources, self.max_age, self.needs = tuple(sources), min(max_age, needs.max_age_s), needs
        for source in self.sources:
            if (reach := getattr(source, "range_m", math.inf)) < needs.range_m < math.inf:
                raise ValueError(
                    f"another vehicle, by {source.describe()}, is seen up to range_m {reach:g} m; accepted: "
                    f"{needs.range_m:.3g} m or more, as the policy's contract says (others.range_m)"
                )
        self._checks = Checks(max_age=max_age)
        self._tracks, self._paces = [PoseTrack() for _ in self.sources], [Pace() for _ in self.sources]

    def read(self, now: float) -> None:
        """Read all sources. `now` is the time on the monotonic clock, s."""
        for i, source in enumerate(self.sources):
            for sample in source.read(now):
                self._tracks[i], odometry, _ = track(self._checks, self._tracks[i], sample)
                if odometry is not None:
                    self._paces[i] = paced(self._paces[i], odometry.time, sample.received)
                if (
                    self._tracks[i].fault is not None
                ):  # a lasting fault: what comes is judged anew, what was known stays
                    self._tracks[i] = PoseTrack(odometry=self._tracks[i].odometry)

    def problem(self, now: float, here: np.ndarray | None = None, begins: bool = False) -> str | None:
        """Why a policy must not fly among them. None: it may.

        Args:
            now: the time on the monotonic clock, s.
            here: (3,) where the vehicle is, m. One that is lost, but surely farther than must be seen, is no problem.
            begins: whether the policy's flight is yet to begin. It does not among those that are seen too rarely.
        """
        for source, known, pace in zip(self.sources, self._tracks, self._paces, strict=True):
            who, age = f"another vehicle, by {source.describe()},", math.inf
            if known.odometry is not None:
                age = now - known.odometry.time
            if not age <= LOST_S and not self._far(known, now, here):
                told = "never seen" if age == math.inf else f"not seen for {age:.1f} s"
                why = "" if source.problem is None else f" ({source.problem})"
                return f"{who} was {told}{why}; accepted: seen within {LOST_S:g} s"
            if begins and pace.hole is not None and pace.hole > self.max_age:
                return f"{who} is seen every {pace.hole:.2g} s; accepted: {self.needs.told} (others.max_age_s)"
        return None

    def _far(self, known: PoseTrack, now: float, here: np.ndarray | None) -> bool:
        if known.odometry is None or here is None:
            return False
        other = self._ball(known.odometry, now)
        return math.dist(other.position, here) - other.ball > self.needs.range_m

    def balls(self, now: float) -> tuple[OtherVehicle, ...]:
        """All that have been seen, where they are now.

        They have flown on with their velocity. One that has not been seen for longer than usual is a ball that contains
        it, if it accelerates by at most `AGILE` and is no faster than the policy's contract says.
        """
        return tuple(self._ball(known.odometry, now) for known in self._tracks if known.odometry is not None)

    def _ball(self, motion: Odometry, now: float) -> OtherVehicle:
        age = max(now - motion.time, 0.0)
        lost, usual = max(age - self.max_age, 0.0), min(age, self.max_age)
        speed = max(self.needs.speed_m_s, float(np.linalg.norm(motion.velocity)))
        ball = speed * lost + AGILE / 2 * usual**2 if lost else 0.0
        place = motion.position + usual * motion.velocity
        return OtherVehicle(tuple(place.tolist()), tuple(motion.velocity.tolist()), ball)

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
