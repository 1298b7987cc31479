"""The faces of solids, for plots, viewers, and all other drawings of worlds that do not use their cameras. NumPy."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float

from e2efly.courses.solids import CLASSES, DISC, SQUARE
from e2efly.simulation.physics.rotation import to_matrix
from e2efly.simulation.scenes.scene import VEHICLE, WALL, Scene

Quads = Float[np.ndarray, "f 4 3"]

_SIDES = 20
"""Number of sides with which a circle is drawn."""
_SHOWN = 2.0
"""Longest part of the way of what is thrown that is drawn, s."""


@dataclass(frozen=True)
class FacesBody:
    """A solid in the form in which it is drawn."""

    quads: Quads
    """Its faces, world, m. A triangle repeats a corner."""
    colour: Float[np.ndarray, "3"]
    """RGB in [0, 1]."""
    path: Float[np.ndarray, "m 3"] | None
    """Path of its centre during one round, world, m. None: it does not move."""
    rate: float = 0.0
    """Angular rate on this path, rad/s."""
    label: str = "obstacle"
    """Its semantic class, a name of `solids.CLASSES`."""
    velocity: Float[np.ndarray, "3"] = field(default_factory=lambda: np.zeros(3))
    """Velocity at time 0, beside the path, world, m/s."""
    acceleration: Float[np.ndarray, "3"] = field(default_factory=lambda: np.zeros(3))
    """Acceleration beside the path, world, m/s^2."""
    since: float = -np.inf
    """Time before which it is not present, s."""
    until: float = np.inf
    """Time after which what is thrown is under the ground, s."""
    drawn: float = 0.0
    """Time at which what is thrown has these faces, s."""

    @property
    def moves(self) -> bool:
        """Whether it moves, or comes only later."""
        return self.path is not None or self.since > 0 or self._is_thrown

    @property
    def _is_thrown(self) -> bool:
        return bool(np.any([self.velocity, self.acceleration]))

    def visible(self, time: float) -> bool:
        """Whether it is present and over the ground at a time, s."""
        return self.since <= time <= self.until

    @property
    def way(self) -> Float[np.ndarray, "m 3"] | None:
        """The way of its centre, world, m: its path, or where it is thrown. None: it does not move."""
        if self.path is not None or not self._is_thrown:
            return self.path
        first = max(self.since, 0.0)
        times = np.linspace(first, min(self.until, first + _SHOWN), 33)
        return self.quads.reshape(-1, 3).mean(axis=0) + np.array([self.moved(time) for time in times])

    def _thrown(self, time: float) -> Float[np.ndarray, "3"]:
        return time * (self.velocity + time / 2 * self.acceleration)

    def moved(self, time: float) -> Float[np.ndarray, "3"]:
        """Displacement since time 0 (of what is thrown: since `drawn`), m, at a time, s."""
        thrown = self._thrown(time) - self._thrown(self.drawn)
        if self.path is None:
            return thrown
        quarter, half = len(self.path) // 4, len(self.path) // 2
        middle = (self.path[0] + self.path[half]) / 2
        cosine, sine, angle = self.path[0] - middle, self.path[quarter] - middle, self.rate * time
        return thrown + cosine * (np.cos(angle) - 1) + sine * np.sin(angle)

    @property
    def outline(self) -> Float[np.ndarray, "k 2"]:
        """Its outline from above: the convex hull, m."""
        from scipy.spatial import ConvexHull  # its import takes a third of a second; only plots of obstacles need it

        points = self.quads[..., :2].reshape(-1, 2)
        return points[ConvexHull(points).vertices]


def bodies(scene: Scene, world: int = 0, time: float = 0.0, ceilings: bool = False) -> list[FacesBody]:
    """The solids of one world at a time, s. Other vehicles are left out: whoever draws them has their flights.

    Args:
        scene: the worlds.
        world: index of the world.
        time: time at which moving solids are drawn, s. What is thrown is drawn where it begins, if this is earlier,
            and where it lands, if this is later.
        ceilings: whether to include horizontal walls, which hide everything from above.
    """
    found = []
    for kind in scene.kinds:
        s = scene.solids[kind]
        turned = np.asarray(to_matrix(s.quaternion[world]), float)
        centre, cosine, sine, rate, size, colour, velocity, acceleration, since = (
            np.asarray(x[world], float)
            for x in (s.centre, s.cosine, s.sine, s.rate, s.size, s.colour, s.velocity, s.acceleration, s.since)
        )
        label = np.asarray(s.label[world])
        for i in np.flatnonzero(np.asarray(s.active[world]) & (label != VEHICLE)):
            quads = _quads(kind, size[i]) @ turned[i].T
            low = quads.reshape(-1, 3).min(axis=0)
            if label[i] == WALL and not ceilings and low[2] == low.max():
                continue
            angle = np.append(rate[i] * time, np.linspace(0, 2 * np.pi, 49))[:, None]
            way = centre[i] + cosine[i] * np.cos(angle) + sine[i] * np.sin(angle)
            moves = rate[i] != 0 and bool(np.ptp(way, axis=0).any())
            path = way[1:] if moves else None
            begins, ground = float(since[i]), float(scene.ground[world])
            lands = _landing(centre[i], velocity[i], acceleration[i], ground)
            then = float(np.clip(time, max(begins, 0.0), lands))
            at = way[0] + then * (velocity[i] + then / 2 * acceleration[i])
            found.append(
                FacesBody(
                    quads + at, colour[i], path, float(rate[i]), CLASSES[label[i]], velocity[i], acceleration[i],
                    begins, lands, then,
                )
            )  # fmt: skip
    return found


def _landing(centre: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray, ground: float) -> float:
    """Time at which the centre of what falls comes to the ground, s. Infinite if it does not fall."""
    height, up, fall = centre[2] - ground, velocity[2], -acceleration[2]
    if fall <= 0:
        return np.inf
    return float(up + np.sqrt(max(up**2 + 2 * fall * height, 0.0))) / fall


def _quads(kind: str, size: np.ndarray) -> Quads:
    """The faces of a solid in its own frame, m."""
    match kind:
        case "box":
            return box(size[:3])
        case "sphere":
            return _capsule(size[0], 0.0)
        case "capsule":
            return _capsule(size[0], size[1])
        case "cylinder":
            return cylinder(size[0], size[1])
        case "gate":
            width, height, bar, half = size
            upright, across = box([half, bar / 2, height + bar]), box([half, width, bar / 2])
            aside, above = np.array([0, width + bar / 2, 0]), np.array([0, 0, height + bar / 2])
            return np.concatenate([upright + aside, upright - aside, across + above, across - above])
        case _:
            half, height, outline = size[:3]
            if outline == DISC:
                return cylinder(half, height)
            if outline == SQUARE:
                return box([half, half, height])
            corners = half * np.array([[-1.0, -1.0], [1.0, -1.0], [0.0, 2.0]]) * [1.0, 1.0 / np.sqrt(3.0)]
            return _prism(corners, height)


def box(half: Any) -> Quads:
    """(6, 4, 3) faces of a box about the origin, from half of its sides (3,), m."""
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return _prism(corners * np.asarray(half)[:2], half[2])


def cylinder(radius: float, half: float) -> Quads:
    """(f, 4, 3) faces of an upright cylinder about the origin, from its radius and half of its height, m."""
    return _turned(np.array([[0.0, -half], [radius, -half], [radius, half], [0.0, half]]))


def _capsule(radius: float, half: float) -> Quads:
    angle = np.linspace(-np.pi / 2, np.pi / 2, 9)
    up = radius * np.sin(angle)
    rising = np.append(up[:5] - half, up[4:] + half)
    across = radius * np.cos(angle)
    return _turned(np.stack([np.append(across[:5], across[4:]), rising], axis=1))


def _turned(profile: Float[np.ndarray, "k 2"]) -> Quads:
    """The faces of a body of revolution about z, from its profile (radius, height)."""
    angle = np.linspace(0, 2 * np.pi, _SIDES + 1)
    rings = np.stack([profile[:, :1] * np.cos(angle), profile[:, :1] * np.sin(angle), profile[:, 1:] + 0 * angle], -1)
    return np.stack([rings[:-1, :-1], rings[:-1, 1:], rings[1:, 1:], rings[1:, :-1]], axis=2).reshape(-1, 4, 3)


def _prism(corners: Float[np.ndarray, "k 2"], half: float) -> Quads:
    """The faces of a prism between z = -half and z = half, over 3 or 4 corners."""
    low, high = (np.column_stack([corners, np.full(len(corners), z)]) for z in (-half, half))
    sides = [np.stack([low[i - 1], low[i], high[i], high[i - 1]]) for i in range(len(corners))]
    ends = [np.concatenate([end, end[-1:]])[:4] for end in (low, high)]
    return np.stack([*sides, *ends])
