"""The shapes of solids, each in its own frame: where a ray enters it, and its distance from a point.

A ray is `origin + t direction`. Its components are separate arrays that broadcast, so that XLA vectorises over the rays
(see `control.vectors`). A ray that begins inside a solid hits it at once, at t = 0. Distances are signed: negative
inside, and exact outside. They have a gradient everywhere. On the medial axis it is the gradient of one side.
"""

from collections.abc import Callable
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from e2efly.control.vectors import safe_sqrt
from e2efly.courses.solids import DISC, SQUARE, TRIANGLE

FAR = 1e9
"""Parameter of a ray without a hit."""
_TINY = 1e-9

Components = tuple[Array, Array, Array]
Interval = tuple[Array, Array]
"""Part of a ray inside a convex part: from, to."""


@dataclass(frozen=True)
class SolidShape:
    """One kind of solid. `size` has `ROOM` entries. A shape reads those that `solids.SIZES` names."""

    enter: Callable[[Array, Components, Components], Array]
    """(size (4,), ray's origin, ray's direction) -> parameter of the first point inside, `FAR` without a hit. In the
    solid's frame."""
    normal: Callable[[Array, Components], Components]
    """(size (4,), point on the surface) -> outward normal."""
    distance: Callable[[Float[Array, "*n 4"], Float[Array, "*n 3"]], Float[Array, "*n"]]
    """(size, point) -> signed distance of a point of the solid's frame, m."""
    reach: Callable[[Float[Array, "*n 4"]], Float[Array, "*n"]]
    """size -> radius of a ball about the centre that encloses the solid, m."""


ROOM = 4
"""Number of entries of `size`."""


def _slab(o: Array, d: Array, half: Array) -> Interval:
    """Part of a ray between two planes at +-half across an axis, from the ray's components along this axis."""
    inverse = 1.0 / jnp.where(jnp.abs(d) < _TINY, _TINY, d)
    middle, width = -o * inverse, jnp.abs(half * inverse)
    return middle - width, middle + width


def _plane(o: Components, d: Components, normal: tuple[float, float], offset: Array) -> Interval:
    """Part of a ray on the inner side of an upright plane, `normal . (x, y) <= offset`."""
    speed = normal[0] * d[0] + normal[1] * d[1]
    t = (offset - normal[0] * o[0] - normal[1] * o[1]) / jnp.where(jnp.abs(speed) < _TINY, _TINY, speed)
    return jnp.where(speed < 0, t, -FAR), jnp.where(speed < 0, FAR, t)


def _round(radius: Array, *along: tuple[Array, Array]) -> Interval:
    """Part of a ray within a radius of the origin.

    With three components (o, d) this is a ball, with two an infinite cylinder. The computation starts from the ray's
    point nearest to the origin, for precision in float32: Haines, Günther, Akenine-Möller, "Precision improvements for
    ray/sphere intersection" (Ray Tracing Gems, 2019).
    """
    inverse = 1.0 / (sum(d * d for _, d in along) + 1e-12)
    middle = -sum(o * d for o, d in along) * inverse
    square = radius * radius - sum((o + middle * d) ** 2 for o, d in along)
    root = jnp.sqrt(jnp.maximum(square, 0.0) * inverse)
    return jnp.where(square > 0, middle - root, FAR), jnp.where(square > 0, middle + root, -FAR)


def _common(*parts: Interval) -> Interval:
    """Part of a ray inside all of the parts."""
    enter, leave = zip(*parts, strict=True)
    return _largest(*enter), -_largest(*(-end for end in leave))


def _first(part: Interval) -> Array:
    """First point inside, for a ray that begins at t = 0."""
    enter, leave = part
    return jnp.where((enter <= leave) & (leave > 0), jnp.maximum(enter, 0.0), FAR)


def _facing(*faces: tuple[Array, Components]) -> Components:
    """The normal of the face on which a point is, from faces given as (distance to its plane, normal)."""
    nearest, normal = faces[0]
    for distance, other in faces[1:]:
        nearer = jnp.abs(distance) < jnp.abs(nearest)
        nearest = jnp.where(nearer, distance, nearest)
        normal = tuple(jnp.where(nearer, new, old) for new, old in zip(other, normal, strict=True))
    return normal  # pyright: ignore


def _along(axis: int, value: Array) -> Components:
    return tuple(value if i == axis else jnp.zeros_like(value) for i in range(3))  # pyright: ignore


def _face(p: Array, half: Array, axis: int) -> tuple[Array, Components]:
    """The plane at +-half across an axis that is on the point's side."""
    return jnp.abs(p) - half, _along(axis, jnp.sign(p))


def _mantle(p: Components, radius: Array) -> tuple[Array, Components]:
    """The curved side of an upright cylinder."""
    x, y = p[0] / radius, p[1] / radius
    return (x * x + y * y - 1.0) * radius / 2.0, (x, y, jnp.zeros_like(x))


def _length(*parts: Array) -> Array:
    return safe_sqrt(sum(part * part for part in parts))


def _outside(*excess: Array) -> Array:
    """Signed distance to a box-like solid, from the excess over its faces along independent directions."""
    return _length(*(jnp.maximum(x, 0.0) for x in excess)) + jnp.minimum(_largest(*excess), 0.0)


def _largest(*values: Array) -> Array:
    result = values[0]
    for value in values[1:]:
        result = jnp.maximum(result, value)
    return result


def _box_enter(size: Array, o: Components, d: Components) -> Array:
    return _first(_common(*(_slab(o[i], d[i], size[i]) for i in range(3))))


def _box_normal(size: Array, p: Components) -> Components:
    return _facing(*(_face(p[i], size[i], i) for i in range(3)))


def _box_distance(size: Array, p: Array) -> Array:
    return _outside(*(jnp.abs(p[..., i]) - size[..., i] for i in range(3)))


def _sphere_enter(size: Array, o: Components, d: Components) -> Array:
    return _first(_round(size[0], *zip(o, d, strict=True)))


def _sphere_normal(size: Array, p: Components) -> Components:
    return p[0] / size[0], p[1] / size[0], p[2] / size[0]


def _sphere_distance(size: Array, p: Array) -> Array:
    return _length(p[..., 0], p[..., 1], p[..., 2]) - size[..., 0]


def _cylinder_enter(size: Array, o: Components, d: Components) -> Array:
    return _first(_common(_round(size[0], (o[0], d[0]), (o[1], d[1])), _slab(o[2], d[2], size[1])))


def _cylinder_normal(size: Array, p: Components) -> Components:
    return _facing(_mantle(p, size[0]), _face(p[2], size[1], 2))


def _cylinder_distance(size: Array, p: Array) -> Array:
    return _outside(_length(p[..., 0], p[..., 1]) - size[..., 0], jnp.abs(p[..., 2]) - size[..., 1])


def _capsule_enter(size: Array, o: Components, d: Components) -> Array:
    """The side, if the ray enters the infinite cylinder between the ends, otherwise the ball at that end."""
    radius, half = size[0], size[1]
    side, _ = _round(radius, (o[0], d[0]), (o[1], d[1]))
    height = o[2] + side * d[2]
    end, _ = _round(radius, (o[0], d[0]), (o[1], d[1]), (o[2] - jnp.where(height > 0, half, -half), d[2]))
    enter = jnp.where((jnp.abs(height) <= half) | (side == FAR), side, end)
    inside = o[0] ** 2 + o[1] ** 2 + jnp.maximum(jnp.abs(o[2]) - half, 0.0) ** 2 < radius**2
    return jnp.where(enter > 0, enter, jnp.where(inside, 0.0, FAR))


def _capsule_normal(size: Array, p: Components) -> Components:
    beyond = p[2] - jnp.clip(p[2], -size[1], size[1])
    return p[0] / size[0], p[1] / size[0], beyond / size[0]


def _capsule_distance(size: Array, p: Array) -> Array:
    beyond = p[..., 2] - jnp.clip(p[..., 2], -size[..., 1], size[..., 1])
    return _length(p[..., 0], p[..., 1], beyond) - size[..., 0]


def _gate_enter(size: Array, o: Components, d: Components) -> Array:
    """The frame is a box without its opening. A ray that enters through the opening hits the frame's inner side."""
    width, height, bar, depth = size
    opened, closed = _common(_slab(o[1], d[1], width), _slab(o[2], d[2], height))
    enter, leave = _common(_slab(o[0], d[0], depth), _slab(o[1], d[1], width + bar), _slab(o[2], d[2], height + bar))
    start = jnp.maximum(enter, 0.0)
    t = jnp.where((opened < start) & (start < closed), closed, start)
    return jnp.where((enter <= leave) & (t < leave), t, FAR)


def _gate_normal(size: Array, p: Components) -> Components:
    width, height, bar, depth = size
    outer = (_face(p[0], depth, 0), _face(p[1], width + bar, 1), _face(p[2], height + bar, 2))
    (y, side), (z, end) = _face(-p[1], width, 1), _face(-p[2], height, 2)
    return _facing(*outer, (jnp.where(z < 0, y, FAR), side), (jnp.where(y < 0, z, FAR), end))


def _gate_distance(size: Array, p: Array) -> Array:
    """Distance to the nearest of four bars, of which two are computed, by symmetry."""
    x, y, z = (jnp.abs(p[..., i]) for i in range(3))
    width, height, bar, half = (size[..., i] for i in range(4))
    upright = _outside(x - half, jnp.abs(y - width - bar / 2) - bar / 2, z - height - bar)
    across = _outside(x - half, y - width - bar, jnp.abs(z - height - bar / 2) - bar / 2)
    return jnp.minimum(upright, across)


_CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [0.0, 2.0]]) * [1.0, 1.0 / np.sqrt(3.0)]
"""Corners of the pad's triangle about its centre, in units of half its side."""
_EDGES = tuple((tuple(_CORNERS[i]), tuple(_CORNERS[(i + 1) % 3])) for i in range(3))


def _outward(edge: tuple[tuple[float, float], tuple[float, float]]) -> tuple[float, float]:
    (ax, ay), (bx, by) = edge
    return (by - ay) / 2.0, (ax - bx) / 2.0


def _pad_enter(size: Array, o: Components, d: Components) -> Array:
    half, outline = size[0], size[2]
    disc = _round(half, (o[0], d[0]), (o[1], d[1]))
    square = _common(_slab(o[0], d[0], half), _slab(o[1], d[1], half))
    triangle = _common(*(_plane(o, d, _outward(edge), half / np.sqrt(3.0)) for edge in _EDGES))
    side = [
        jnp.where(outline == DISC, a, jnp.where(outline == SQUARE, b, c))
        for a, b, c in zip(disc, square, triangle, strict=True)
    ]
    return _first(_common((side[0], side[1]), _slab(o[2], d[2], size[1])))


def _pad_normal(size: Array, p: Components) -> Components:
    half, outline = size[0], size[2]
    edges = [(_outward(edge), jnp.zeros_like(p[0])) for edge in _EDGES]
    triangle = [
        (n[0] * p[0] + n[1] * p[1] - half / np.sqrt(3.0), (zero + n[0], zero + n[1], zero)) for n, zero in edges
    ]
    sides = [
        (DISC, [_mantle(p, half)]), (SQUARE, [_face(p[0], half, 0), _face(p[1], half, 1)]), (TRIANGLE, triangle)
    ]  # fmt: skip
    faces = [(jnp.where(outline == which, d, FAR), normal) for which, side in sides for d, normal in side]
    return _facing(_face(p[2], size[1], 2), *faces)


def _pad_distance(size: Array, p: Array) -> Array:
    x, y, half = p[..., 0], p[..., 1], size[..., 0]
    disc = _length(x, y) - half
    square = _outside(jnp.abs(x) - half, jnp.abs(y) - half)
    inside = _largest(*(nx * x + ny * y - half / np.sqrt(3.0) for nx, ny in map(_outward, _EDGES)))
    away = []
    for (ax, ay), (bx, by) in _EDGES:
        ex, ey = bx - ax, by - ay
        along = jnp.clip(((x - ax * half) * ex + (y - ay * half) * ey) / (4.0 * half), 0.0, 1.0)
        away.append(_length(x - (ax + along * ex) * half, y - (ay + along * ey) * half))
    triangle = jnp.where(inside > 0, -_largest(*(-length for length in away)), inside)
    outline = size[..., 2]
    flat = jnp.where(outline == DISC, disc, jnp.where(outline == SQUARE, square, triangle))
    return _outside(flat, jnp.abs(p[..., 2]) - size[..., 1])


SHAPES: dict[str, SolidShape] = {
    "box": SolidShape(_box_enter, _box_normal, _box_distance, lambda s: _length(s[..., 0], s[..., 1], s[..., 2])),
    "sphere": SolidShape(_sphere_enter, _sphere_normal, _sphere_distance, lambda s: s[..., 0]),
    "cylinder": SolidShape(
        _cylinder_enter, _cylinder_normal, _cylinder_distance, lambda s: _length(s[..., 0], s[..., 1])
    ),
    "capsule": SolidShape(_capsule_enter, _capsule_normal, _capsule_distance, lambda s: s[..., 0] + s[..., 1]),
    "gate": SolidShape(
        _gate_enter, _gate_normal, _gate_distance,
        lambda s: _length(s[..., 0] + s[..., 2], s[..., 1] + s[..., 2], s[..., 3]),
    ),
    "pad": SolidShape(_pad_enter, _pad_normal, _pad_distance, lambda s: _length(np.sqrt(2.0) * s[..., 0], s[..., 1])),
}  # fmt: skip
"""Shapes by name."""
