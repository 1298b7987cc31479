"""Corners of the openings of gates, found in a mask.

The background behind the bars of gates has corners wherever two bars meet. Each side of such a corner is a straight
edge of many pixels, so the corner, where the two fitted lines meet, is known to a fraction of a pixel, and a gate that
is half out of the image still gives the corners that are inside. Needs OpenCV.
"""

import math
from typing import Any

import numpy as np

from e2efly.flight.pose.gates.lens import NO_CORNERS, Corners
from e2efly.flight.sight.segment import opencv

BORDER = 2.5
"""Vertices this near to the border of the image are where the border cuts a gate, pixels."""
SHORTEST = 5.0
"""A side shorter than this does not give a line, pixels."""
COARSE = 5.0
"""Largest distance of an outline from the polygon that stands for it, pixels."""
STRAIGHT = math.radians(30)
"""The sides of a corner differ from a straight line, and from a spike, by at least this angle."""
BLUNT = 30.0
"""A side shorter than this between two that are twice as long, and form a corner, is one that was rounded, pixels."""
CROOKED = 2.0
"""Root mean square of the distances of a side's pixels from its line above which it is not straight, pixels."""


def gate_corners(mask: np.ndarray) -> Corners:
    """The corners of all openings.

    Args:
        mask: (h, w), 1 or 255 where a gate is seen, 0 elsewhere; uint8 or floating point.

    Raises:
        ValueError: if OpenCV is not installed.
    """
    cv2 = opencv()
    background = np.asarray(mask <= mask.max(initial=0) / 2 if mask.any() else np.ones_like(mask, bool), np.uint8)
    outlines, family = cv2.findContours(background, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    if not len(outlines):
        return NO_CORNERS
    found = [
        corner
        for outline, parent in zip(outlines, family[0, :, 3], strict=True)
        for corner in _of_outline(cv2, outline[:, 0].astype(float), mask.shape, around=parent >= 0)
    ]
    if not found:
        return NO_CORNERS
    pixel, inward = (np.array(part) for part in zip(*found, strict=True))
    return Corners(pixel, inward)


def _of_outline(
    cv2: Any, outline: np.ndarray, shape: tuple[int, ...], *, around: bool
) -> list[tuple[np.ndarray, np.ndarray]]:
    """The corners of a closed outline (m, 2) of background pixels. `around`: the background lies around it."""
    if len(outline) < 4 * SHORTEST:
        return []
    vertices = cv2.approxPolyDP(outline[:, None].astype(np.float32), COARSE, True)[:, 0]
    count = len(vertices)
    if count < 3:
        return []
    at = [int(np.argmin(np.abs(outline - vertex).sum(axis=1))) for vertex in vertices]
    ends = _sharpened([(at[i], at[(i + 1) % count]) for i in range(count)], outline)
    inside = 1.0 if (_area(vertices) > 0) != around else -1.0  # on which side of the outline the background lies
    sides = [_line(outline, begin, end, inside) for begin, end in ends]
    limit = np.array(shape[1::-1]) - 1 - BORDER
    corners = []
    for i, (begin, _) in enumerate(ends):
        before, after = sides[i - 1], sides[i]
        vertex, other = outline[begin], outline[ends[i - 1][1]]  # two, where a blunt corner was
        near, far = np.minimum(vertex, other), np.maximum(vertex, other)
        if before is None or after is None or np.any(near < BORDER) or np.any(far > limit):
            continue
        (a, u), (b, v) = before, after
        turn = u[0] * v[1] - u[1] * v[0]
        if turn * inside < math.sin(STRAIGHT):  # straight on, a spike, or a corner of the background outside of a gate
            continue
        point = a + u * ((b - a)[0] * v[1] - (b - a)[1] * v[0]) / turn
        if np.any(point < near - 2 * COARSE) or np.any(point > far + 2 * COARSE):
            continue
        inward = v - u
        corners.append((point + 0.5, inward / np.linalg.norm(inward)))
    return corners


def _sharpened(sides: list[tuple[int, int]], outline: np.ndarray) -> list[tuple[int, int]]:
    """Sides from one pixel of the outline to another, without those that only cut a corner off: a network rounds the
    corners of its masks.
    """
    while len(sides) > 3:
        way = np.array([outline[end] - outline[begin] for begin, end in sides])
        length = np.linalg.norm(way, axis=1)
        before, after = np.roll(way, 1, axis=0), np.roll(way, -1, axis=0)
        around = np.roll(length, 1), np.roll(length, -1)
        corner = np.abs((before * after).sum(axis=1)) < math.cos(STRAIGHT) * around[0] * around[1]
        cut = corner & (length < BLUNT) & (2 * length < np.minimum(*around))
        if not cut.any():
            break
        sides.pop(int(np.argmin(np.where(cut, length, np.inf))))
    return sides


def _line(outline: np.ndarray, begin: int, end: int, inside: float) -> tuple[np.ndarray, np.ndarray] | None:
    """A point of a side and its direction along the outline. None: it is too short or not straight.

    The outline runs through the centres of the outermost background pixels. The edge is half a pixel further out.
    """
    count = (end - begin) % len(outline)
    trim = max(1, count // 10)  # pixels near a vertex belong to both sides
    points = outline[(begin + trim + np.arange(max(count - 2 * trim, 0))) % len(outline)]
    if len(points) < SHORTEST:
        return None
    middle = points.mean(axis=0)
    (xx, xy), (_, yy) = np.cov(points.T)
    angle = 0.5 * math.atan2(2 * xy, xx - yy)
    along = np.array([math.cos(angle), math.sin(angle)])
    way = points[-1] - points[0]
    along = along if along @ way > 0 else -along
    across = np.array([along[1], -along[0]]) * inside  # away from the background
    if np.sqrt(np.mean(((points - middle) @ across) ** 2)) > CROOKED:
        return None
    return middle + 0.5 * across * max(abs(across)), along


def _area(polygon: np.ndarray) -> float:
    x, y = polygon[:, 0], polygon[:, 1]
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2)
