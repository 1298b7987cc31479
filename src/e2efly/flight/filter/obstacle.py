"""The obstacles that the filter avoids: the fence's boxes, and the solids of its scene file, as convex bodies.

A body is a box with a disc and a ball added to it (a Minkowski sum). A cylinder is a line with a disc, and a capsule is
a line with a ball. One formula therefore gives the nearest point of each body. The whole body lies behind the plane
through that point that is perpendicular to the direction to it.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from e2efly.control import Quat, Vec3
from e2efly.courses.solids import SQUARE, TRIANGLE, Solid, read_solids
from e2efly.flight.settings import Fence


class Plane(NamedTuple):
    """The nearest side of an obstacle."""

    x: float
    """Direction to it, world."""
    y: float
    z: float
    gap: float
    """Distance to it, m. Negative inside the obstacle."""
    name: str
    """Name of the obstacle."""


@dataclass(frozen=True)
class Obstacle:
    """A convex body that does not move."""

    name: str
    """Name, for people."""
    centre: tuple[float, float, float]
    """Centre, world, m."""
    axes: tuple[float, ...]
    """Its x, y and z axes in the world, nine numbers."""
    half: tuple[float, float, float]
    """Half lengths of the box, m."""
    disc: float = 0.0
    """Radius of the disc perpendicular to z, m."""
    ball: float = 0.0
    """Radius of the ball, m."""

    @cached_property
    def reach(self) -> float:
        """Radius of a ball about its centre that contains it, m."""
        x, y, z = self.half
        return math.hypot(math.hypot(x, y) + self.disc, z) + self.ball

    def plane(self, x: float, y: float, z: float, within: float) -> Plane | None:
        """The nearest side, seen from a position, world, m. None: it is farther away than `within`, m."""
        x, y, z = x - self.centre[0], y - self.centre[1], z - self.centre[2]
        if math.sqrt(x * x + y * y + z * z) > within + self.reach:
            return None
        xx, xy, xz, yx, yy, yz, zx, zy, zz = self.axes
        u, v, w = x * xx + y * xy + z * xz, x * yx + y * yy + z * yz, x * zx + y * zy + z * zz
        a, b, c = (p - min(max(p, -h), h) for p, h in zip((u, v, w), self.half, strict=True))
        across = math.hypot(a, b)
        left = max(across - self.disc, 0.0) / across if across else 0.0
        a, b = a * left, b * left
        away = math.sqrt(a * a + b * b + c * c)
        if away == 0.0:
            gap, (a, b, c) = self._inside(u, v, w)
        else:
            gap, a, b, c = away - self.ball, -a / away, -b / away, -c / away
        if gap > within:
            return None
        return Plane(a * xx + b * yx + c * zx, a * xy + b * yy + c * zy, a * xz + b * yz + c * zz, gap, self.name)

    def _inside(self, u: float, v: float, w: float) -> tuple[float, tuple[float, float, float]]:
        """How deep a position in the body's own frame is inside the box and disc, as a negative gap, and the direction
        inwards from there: the opposite of the shortest way out.
        """
        (x, y, z), round_ = self.half, self.disc + self.ball
        sides = [(z + self.ball - abs(w), (0.0, 0.0, -math.copysign(1.0, w)))]
        if self.disc:
            across = math.hypot(u, v)
            sides.append((round_ - across, (-u / across, -v / across, 0.0) if across else (-1.0, 0.0, 0.0)))
        else:
            sides.append((x + self.ball - abs(u), (-math.copysign(1.0, u), 0.0, 0.0)))
            sides.append((y + self.ball - abs(v), (0.0, -math.copysign(1.0, v), 0.0)))
        depth, inwards = min(sides)
        return -depth, inwards


def obstacles(fence: Fence) -> tuple[Obstacle, ...]:
    """The obstacles of a fence: its boxes, named `solid 1` and so on, and the solids of its scene file, `solids[0]` and
    so on.

    Raises:
        ValueError: naming the file, the key, the value and what is accepted. Also for a solid that moves.
    """
    upright = Quat(1.0, 0.0, 0.0, 0.0)
    found = [
        _placed(f"solid {i + 1}", [(a + b) / 2 for a, b in zip(box[:3], box[3:], strict=True)], upright,
                half=[(b - a) / 2 for a, b in zip(box[:3], box[3:], strict=True)])
        for i, box in enumerate(fence.solids)
    ]  # fmt: skip
    if fence.scene is not None:
        for i, solid in enumerate(read_solids(Path(fence.scene))[1]):
            if solid.path is not None and solid.path.rate != 0:
                said = f"{fence.scene}: solids[{i}].path.rate is {solid.path.rate:g} rad/s"
                raise ValueError(f"flight.fence.scene: {said}; accepted: solids that stand")
            found += _bodies(f"solids[{i}]", solid)
    return tuple(found)


def _bodies(name: str, solid: Solid) -> Iterator[Obstacle]:
    """A solid as convex bodies. A gate gives its four bars. A triangular pad gives its circumscribed disc."""
    turn = Quat.of_euler(*solid.angles)
    centre, size = solid.centre.tolist(), solid.size.tolist()
    if solid.path is not None:  # at rest, at the beginning of its path
        centre = (solid.centre + solid.path.cosine).tolist()
    match solid.kind:
        case "box":
            yield _placed(name, centre, turn, half=size)
        case "sphere":
            yield _placed(name, centre, turn, ball=size[0])
        case "cylinder":
            yield _placed(name, centre, turn, half=[0.0, 0.0, size[1]], disc=size[0])
        case "capsule":
            yield _placed(name, centre, turn, half=[0.0, 0.0, size[1]], ball=size[0])
        case "gate":
            width, height, bar, depth = size
            for y, z, half in (
                (width + bar / 2, 0.0, [depth, bar / 2, height + bar]), (0.0, height + bar / 2, [depth, width, bar / 2])
            ):  # fmt: skip
                for sign in (-1.0, 1.0):
                    yield _placed(name, centre, turn, half=half, at=(0.0, sign * y, sign * z))
        case "pad":
            half, height, outline = size
            if outline == SQUARE:
                yield _placed(name, centre, turn, half=[half, half, height])
            else:
                disc = half * (2 / math.sqrt(3) if outline == TRIANGLE else 1.0)
                yield _placed(name, centre, turn, half=[0.0, 0.0, height], disc=disc)
        case _:
            raise AssertionError(solid.kind)


def _placed(
    name: str, centre: list[float], turn: Quat, half: list[float] | None = None, disc: float = 0.0, ball: float = 0.0,
    at: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Obstacle:  # fmt: skip
    """A body whose middle is offset from the centre by `at`, m, in the turned frame."""
    axes = [turn.rotate(Vec3(*axis)) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    middle, (a, b, c) = Vec3(*centre) + turn.rotate(Vec3(*at)), half or (0.0, 0.0, 0.0)
    numbers = tuple(float(n) for axis in axes for n in (axis.x, axis.y, axis.z))
    return Obstacle(name, (float(middle.x), float(middle.y), float(middle.z)), numbers, (a, b, c), disc, ball)
