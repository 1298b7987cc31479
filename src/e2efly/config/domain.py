"""The domain of a policy: the ranges of the courses and worlds that it was trained for. Imports no JAX."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

PLACING = 0.1
"""A quantity of `PLACED` may lie outside its range by this, in its unit: gates are set up and measured no better."""
PLACED = frozenset({"gate_distance", "gate_rise", "gate_altitude", "gate_bearing", "gate_turn", "start_distance"})
FIRST = 0.2 - np.pi
"""Smallest angle, rad. About as much as a half turn is a positive angle, whichever way gates are placed."""
_BESIDE = 1e-6
"""Relative rounding error within which a number still counts as inside its range."""
_OVER = 1.0
"""A bearing counts if the next gate is farther than this horizontally, m. Nearer, it lies above or below."""


@dataclass(frozen=True)
class Extent:
    """The range of a quantity of courses or worlds."""

    name: str
    """A word, such as gate_width."""
    unit: str
    low: float
    """Smallest value."""
    high: float
    """Largest value."""

    def __str__(self) -> str:
        """Name, range and unit."""
        return f"{self.name} {self.range}"

    @property
    def range(self) -> str:
        """The range with its unit, as text."""
        ends = dict.fromkeys(f"{x:.4g}" for x in (self.low, self.high))
        return f"{' to '.join(ends)} {self.unit}".removesuffix(" 1")

    def holds(self, other: "Extent") -> bool:
        """Whether another range of the same quantity lies inside this one."""
        least, most = (abs(x) * _BESIDE + (PLACING if self.name in PLACED else 0.0) for x in (self.low, self.high))
        return self.low - least <= other.low and other.high <= self.high + most


Domain = tuple[Extent, ...]
"""The ranges of several quantities, each of another name."""


def extent(name: str, unit: str, values: Any) -> Extent:
    """The range from the smallest to the largest of some values, rounded to 10^-6."""
    return Extent(name, unit, round(float(np.min(values)), 6), round(float(np.max(values)), 6))


def outside(trained: Domain, flown: Domain) -> tuple[str, ...]:
    """The quantities of the courses to be flown that lie outside those of the training, as text. Empty: none."""
    known = {part.name: part for part in trained}
    return tuple(
        f"{part.name} is {part.range}; trained for {known[part.name].range}"
        for part in flown
        if part.name in known and not known[part.name].holds(part)
    )


def union(domains: Iterable[Domain]) -> Domain:
    """The smallest domain that contains all of these."""
    found: dict[str, Extent] = {}
    for part in (part for domain in domains for part in domain):
        other = found.get(part.name, part)
        found[part.name] = Extent(part.name, part.unit, min(other.low, part.low), max(other.high, part.high))
    return tuple(found.values())


def track_domain(track: Any) -> Domain:
    """The quantities of a `RaceTrack`: its gates, and what lies between one and the next.

    A closed track also leads from the last gate to the first. The bearing of the next gate and the turn to its heading
    are measured from the heading of the gate before, about the up axis.
    """
    position, yaw = np.asarray(track.position, float), np.asarray(track.yaw, float)
    there = np.roll(np.arange(len(yaw)), -1)[: None if track.closed else -1]
    here = np.arange(len(there))
    leg, turn = position[there] - position[here], yaw[there] - yaw[here]
    bearing = np.arctan2(leg[:, 1], leg[:, 0]) - yaw[here]
    bearing = np.where(np.hypot(leg[:, 0], leg[:, 1]) > _OVER, bearing, 0.0)
    turn, bearing = ((x - FIRST) % (2 * np.pi) + FIRST for x in (turn, bearing))
    return (
        extent("gates", "1", len(yaw)),
        extent("gate_width", "m", track.opening[:, 0]),
        extent("gate_height", "m", track.opening[:, 1]),
        extent("gate_altitude", "m", position[:, 2]),
        extent("gate_distance", "m", np.linalg.norm(leg, axis=1)),
        extent("gate_rise", "m", leg[:, 2]),
        extent("gate_bearing", "rad", bearing),
        extent("gate_turn", "rad", turn),
        extent("start_distance", "m", np.linalg.norm(position[0] - track.start)),
    )


def displaced(tracks: Domain, moved: float, turned: float) -> Domain:
    """The quantities of tracks whose gates are displaced by up to so much, m per axis, and turned, rad."""
    nearest = next(part.low for part in tracks if part.name == "gate_distance")
    aside = math.asin(min(2 * math.sqrt(2) * moved / nearest, 1.0))  # by which the way to the next gate turns
    more = {
        "gate_altitude": moved, "gate_rise": 2 * moved, "gate_distance": 2 * math.sqrt(3) * moved,
        "start_distance": math.sqrt(3) * moved, "gate_turn": 2 * turned, "gate_bearing": turned + aside,
    }  # fmt: skip
    return tuple(
        Extent(part.name, part.unit, round(part.low - wider, 6), round(part.high + wider, 6))
        for part in tracks
        for wider in (more.get(part.name, 0.0),)
    )
