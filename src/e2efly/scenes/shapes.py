"""The shapes of solids, each in its own frame: where a ray enters it, and how far a point is from it.

A ray is `origin + t direction`; its parts come component by component, as arrays that broadcast, so that XLA
vectorises over the rays (see `control.vectors`). A point inside a solid is hit at once, at t = 0. Distances are signed,
negative inside, exact outside, and have gradient everywhere but on the medial axis, where it is that of one side.
"""

from collections.abc import Callable
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from e2efly.control.vectors import safe_sqrt

FAR = 1e9
"""Parameter of a ray that meets nothing."""
DISC, SQUARE, TRIANGLE = 0, 1, 2
"""Outlines of a pad."""
_TINY = 1e-9

Components = tuple[Array, Array, Array]
Interval = tuple[Array, Array, Components]
"""Where a ray is inside a convex part: from, to, and the outward normal where it enters."""


@dataclass(frozen=True)
class Shape:
    """One kind of solid. `size` has `SIZES` entries, of which a shape reads those that it names."""

    names: tuple[str, ...]
    """What the entries of `size` are, m unless said."""
    enter: Callable[[Array, Components, Components], tuple[Array, Components]]
    """(size (4,), ray's origin, ray's direction) -> parameter of the first point inside, `FAR` for none, and the
    outward normal there. All in the solid's frame."""
    distance: Callable[[Float[Array, "*n 4"], Float[Array, "*n 3"]], Float[Array, "*n"]]
    """(size, point) -> signed distance of a point of the solid's frame, m."""
    reach: Callable[[Float[Array, "*n 4"]], Float[Array, "*n"]]
    """size -> radius of a ball about the centre that holds it, m."""


SIZES = 4
"""Entries of `size`."""


def _slab(o: Array, d: Array, half: Array, axis: int) -> Interval:
    """Between two planes at +-half across an axis."""
    inverse = 1.0 / jnp.where(jnp.abs(d) < _TINY, _TINY, d)
    middle, width = -o * inverse, jnp.abs(half * inverse)
    side = -jnp.sign(d)
    zero = jnp.zeros_like(d)
    return middle - width, middle + width, tuple(side if i == axis else zero for i in range(3))  # pyright: ignore


def _plane(o: Components, d: Components, normal: tuple[float, float], offset: Array) -> Interval:
    """On the inner side of a plane that stands upright, `normal . (x, y) <= offset`."""
    speed = normal[0] * d[0] + normal[1] * d[1]
    t = (offset - normal[0] * o[0] - normal[1] * o[1]) / jnp.where(jnp.abs(speed) < _TINY, _TINY, speed)
    entering = speed < 0
    zero = jnp.zeros_like(d[0])
    return jnp.where(entering, t, -FAR), jnp.where(entering, FAR, t), (zero + normal[0], zero + normal[1], zero)


def _round(o: Components, d: Components, radius: Array, axes: tuple[int, ...]) -> Interval:
    """Within a radius of the origin, counting only `axes`: a ball of three, an endless cylinder of two."""
    a = sum(d[i] * d[i] for i in axes) + 1e-12
    b = sum(o[i] * d[i] for i in axes)
    c = sum(o[i] * o[i] for i in axes) - radius * radius
    square = b * b - a * c
    root, inverse = jnp.sqrt(jnp.maximum(square, 0.0)), 1.0 / a
    enter = jnp.where(square > 0, (-b - root) * inverse, FAR)
    leave = jnp.where(square > 0, (root - b) * inverse, -FAR)
    zero = jnp.zeros_like(a)
    normal = tuple((o[i] + enter * d[i]) / radius if i in axes else zero for i in range(3))
    return enter, leave, normal  # pyright: ignore


def _common(*parts: Interval) -> Interval:
    """Inside all of them."""
    enter, leave, normal = parts[0]
    for e, end, n in parts[1:]:
        later = e > enter
        normal = tuple(jnp.where(later, new, old) for new, old in zip(n, normal, strict=True))
        enter, leave = jnp.maximum(enter, e), jnp.minimum(leave, end)
    return enter, leave, normal  # pyright: ignore


def _first(part: Interval) -> tuple[Array, Components]:
    """Where a ray that begins at t = 0 is first inside."""
    enter, leave, normal = part
    return jnp.where((enter <= leave) & (leave > 0), jnp.maximum(enter, 0.0), FAR), normal


def _nearer(a: tuple[Array, Components], b: tuple[Array, Components]) -> tuple[Array, Components]:
    first = a[0] <= b[0]
    return jnp.minimum(a[0], b[0]), tuple(jnp.where(first, m, n) for m, n in zip(a[1], b[1], strict=True))  # pyright: ignore


def _length(*parts: Array) -> Array:
    return safe_sqrt(sum(part * part for part in parts))


def _outside(*excess: Array) -> Array:
    """Signed distance to a box-like solid, of the excess over its faces along independent directions."""
    return _length(*(jnp.maximum(x, 0.0) for x in excess)) + jnp.minimum(_largest(*excess), 0.0)


def _largest(*values: Array) -> Array:
    result = values[0]
    for value in values[1:]:
        result = jnp.maximum(result, value)
    return result


def _box_enter(size: Array, o: Components, d: Components) -> tuple[Array, Components]:
    return _first(_common(*(_slab(o[i], d[i], size[i], i) for i in range(3))))


def _box_distance(size: Array, p: Array) -> Array:
    return _outside(*(jnp.abs(p[..., i]) - size[..., i] for i in range(3)))


def _sphere_enter(size: Array, o: Components, d: Components) -> tuple[Array, Components]:
    return _first(_round(o, d, size[0], (0, 1, 2)))


def _sphere_distance(size: Array, p: Array) -> Array:
    return _length(p[..., 0], p[..., 1], p[..., 2]) - size[..., 0]


def _cylinder_enter(size: Array, o: Components, d: Components) -> tuple[Array, Components]:
    return _first(_common(_round(o, d, size[0], (0, 1)), _slab(o[2], d[2], size[1], 2)))


def _cylinder_distance(size: Array, p: Array) -> Array:
    return _outside(_length(p[..., 0], p[..., 1]) - size[..., 0], jnp.abs(p[..., 2]) - size[..., 1])


def _capsule_enter(size: Array, o: Components, d: Components) -> tuple[Array, Components]:
    best = _first(_common(_round(o, d, size[0], (0, 1)), _slab(o[2], d[2], size[1], 2)))
    for end in (-size[1], size[1]):
        best = _nearer(best, _first(_round((o[0], o[1], o[2] - end), d, size[0], (0, 1, 2))))
    return best


def _capsule_distance(size: Array, p: Array) -> Array:
    beyond = p[..., 2] - jnp.clip(p[..., 2], -size[..., 1], size[..., 1])
    return _length(p[..., 0], p[..., 1], beyond) - size[..., 0]


def _gate_enter(size: Array, o: Components, d: Components) -> tuple[Array, Components]:
    """The frame is a box without the opening through it: a ray that enters in the opening meets its inner side."""
    enter, leave, normal = _common(
        _slab(o[0], d[0], size[3], 0), _slab(o[1], d[1], size[0] + size[2], 1), _slab(o[2], d[2], size[1] + size[2], 2)
    )
    (y0, y1, _), (z0, z1, _) = _slab(o[1], d[1], size[0], 1), _slab(o[2], d[2], size[1], 2)
    start = jnp.maximum(enter, 0.0)
    opened, closed = jnp.maximum(y0, z0), jnp.minimum(y1, z1)
    through = (opened < start) & (start < closed)
    t = jnp.where(through, closed, start)
    zero = jnp.zeros_like(t)
    inner = (zero, jnp.where(y1 <= z1, -jnp.sign(d[1]), 0.0), jnp.where(y1 <= z1, 0.0, -jnp.sign(d[2])))
    normal = tuple(jnp.where(through, m, n) for m, n in zip(inner, normal, strict=True))
    return jnp.where((enter <= leave) & (t < leave), t, FAR), normal  # pyright: ignore


def _gate_distance(size: Array, p: Array) -> Array:
    """Of the nearest of four bars; two by symmetry."""
    x, y, z = (jnp.abs(p[..., i]) for i in range(3))
    width, height, bar, half = (size[..., i] for i in range(4))
    upright = _outside(x - half, jnp.abs(y - width - bar / 2) - bar / 2, z - height - bar)
    across = _outside(x - half, y - width - bar, jnp.abs(z - height - bar / 2) - bar / 2)
    return jnp.minimum(upright, across)


_CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [0.0, 2.0]]) * [1.0, 1.0 / np.sqrt(3.0)]
"""Of the pad's triangle about its centre, in units of half its side."""
_EDGES = tuple((tuple(_CORNERS[i]), tuple(_CORNERS[(i + 1) % 3])) for i in range(3))


def _outward(edge: tuple[tuple[float, float], tuple[float, float]]) -> tuple[float, float]:
    (ax, ay), (bx, by) = edge
    return (by - ay) / 2.0, (ax - bx) / 2.0


def _pad_enter(size: Array, o: Components, d: Components) -> tuple[Array, Components]:
    half, outline = size[0], size[2]
    disc = _round(o, d, half, (0, 1))
    square = _common(_slab(o[0], d[0], half, 0), _slab(o[1], d[1], half, 1))
    inner = half / np.sqrt(3.0)
    triangle = _common(*(_plane(o, d, _outward(edge), inner) for edge in _EDGES))
    side = _chosen(outline, disc, _chosen(outline - 1, square, triangle))
    return _first(_common(side, _slab(o[2], d[2], size[1], 2)))


def _chosen(outline: Array, first: Interval, other: Interval) -> Interval:
    """`first` where the outline is 0."""
    is_first = outline < 0.5
    normal = tuple(jnp.where(is_first, m, n) for m, n in zip(first[2], other[2], strict=True))
    return jnp.where(is_first, first[0], other[0]), jnp.where(is_first, first[1], other[1]), normal  # pyright: ignore


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
    flat = jnp.where(outline < 0.5, disc, jnp.where(outline < 1.5, square, triangle))
    return _outside(flat, jnp.abs(p[..., 2]) - size[..., 1])


SHAPES: dict[str, Shape] = {
    "box": Shape(
        ("half x", "half y", "half z"), _box_enter, _box_distance, lambda s: _length(s[..., 0], s[..., 1], s[..., 2])
    ),
    "sphere": Shape(("radius",), _sphere_enter, _sphere_distance, lambda s: s[..., 0]),
    "cylinder": Shape(
        ("radius", "half length"), _cylinder_enter, _cylinder_distance, lambda s: _length(s[..., 0], s[..., 1])
    ),
    "capsule": Shape(("radius", "half length"), _capsule_enter, _capsule_distance, lambda s: s[..., 0] + s[..., 1]),
    "gate": Shape(
        ("half width of the opening", "half height of the opening", "width of the bars", "half depth of the bars"),
        _gate_enter,
        _gate_distance,
        lambda s: _length(s[..., 0] + s[..., 2], s[..., 1] + s[..., 2], s[..., 3]),
    ),
    "pad": Shape(
        ("half width", "half height", "outline: 0 disc, 1 square, 2 triangle"),
        _pad_enter,
        _pad_distance,
        lambda s: _length(np.sqrt(2.0) * s[..., 0], s[..., 1]),
    ),
}
"""Shapes by name. Lengths run along the local z axis; a gate is flown through along its x axis."""
