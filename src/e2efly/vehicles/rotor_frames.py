"""The law that draws frames of several rotors, tilted and somewhat lopsided, for a family. Imports no JAX.

Like the laws of `e2efly.vehicles.family`, it computes in the library of the uniform numbers. Lengths are in arms,
forces in weights. Every frame has `MOST` rotors. Those that a vehicle does not have come last, and their axis is zero:
they neither push nor turn the vehicle.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

Range = tuple[float, float]
MOST = 8
"""Number of rotors of every frame, with those that are absent."""
DRAWN = 7 + 5 * MOST
"""Number of uniform random numbers that define a frame."""
MARGIN = 0.1
"""Torque that a frame must have to spare in hover about each axis and in both directions: of roll and pitch divided by
weight times arm, of yaw divided by weight times `torque_ratio`."""
IDLE = 0.03
"""Thrust of an idle rotor divided by its largest thrust, at most."""
_STRAIGHTER = 0.75, 0.5, 0.25, 0.0
"""Shares of what was drawn that are tried after the whole."""


@dataclass(frozen=True)
class RotorFrame:
    """The rotors of a vehicle, with leading axes of the batch."""

    place: Any
    """Places of the rotors relative to the centre of mass, body axes, in arms, the farthest at 1; (*n, `MOST`, 3)."""
    axis: Any
    """Directions in which they push, body axes; zero: absent, (*n, `MOST`, 3)."""
    spin: Any
    """Signs of their reaction torques, (*n, `MOST`)."""

    def turns(self, torque_ratio: Any) -> list[Any]:
        """Torque about body x, y and z of each newton that a rotor pushes, in arms, each (*n, `MOST`)."""
        (x, y, z), (a, b, c) = ([v[..., i] for i in range(3)] for v in (self.place, self.axis))
        reaction = self.spin * torque_ratio[..., None]
        return [y * c - z * b + reaction * a, z * a - x * c + reaction * b, x * b - y * a + reaction * c]


def draw(
    xp: Any, u: Any, rotors: Range, tilt: Range, lopsided: Range, hovers: Callable[[RotorFrame], Any] | None
) -> RotorFrame:
    """The frame that belongs to given uniform numbers.

    A regular polygon, turned by any angle, is drawn; rotors turn in alternation. Each rotor is moved by up to
    `lopsided` arms along each axis relative to the others, and all together by as much, which moves the centre of mass
    off the middle; each axis is tilted by up to `tilt`, to any side. Of all this the largest of five shares is taken
    with which the frame `hovers`, and none if it does not with any.

    Args:
        xp: the library of the numbers.
        u: uniform numbers, (*n, `DRAWN`).
        rotors: smallest and largest number of rotors.
        tilt: smallest and largest value of a vehicle's largest tilt, rad.
        lopsided: smallest and largest value of how far its rotors are moved, in arms.
        hovers: which frames hover, (*n,). None: all are left as they are drawn.
    """
    low, high = rotors
    count = xp.floor(low + (high - low + 1) * u[..., 0])
    index = xp.arange(MOST)
    present = 1.0 * (index < count[..., None])
    spin = 1.0 - 2.0 * (index % 2) + 0.0 * present
    bearing = 2 * math.pi * (index + u[..., 1, None]) / count[..., None]
    far, most = (ends[0] + (ends[1] - ends[0]) * u[..., i] for i, ends in ((2, lopsided), (3, tilt)))
    off, moved, leaning, side = (
        u[..., 4:7], u[..., 7 : 7 + 3 * MOST], u[..., 7 + 3 * MOST : 7 + 4 * MOST], u[..., 7 + 4 * MOST :]
    )  # fmt: skip
    moved = (2 * moved.reshape(*moved.shape[:-1], MOST, 3) - 1) * present[..., None]
    moved = moved + (2 * off - 1 - moved.sum(-2) / count[..., None])[..., None, :]
    regular = xp.stack([xp.cos(bearing), xp.sin(bearing), 0 * bearing], axis=-1)

    def straightened(share: float) -> RotorFrame:
        place = (regular + share * far[..., None, None] * moved) * present[..., None]
        place = place / xp.sqrt(xp.sum(place**2, axis=-1)).max(-1)[..., None, None]
        lean, way = share * most[..., None] * leaning, 2 * math.pi * side
        axis = xp.stack([xp.sin(lean) * xp.cos(way), xp.sin(lean) * xp.sin(way), xp.cos(lean)], axis=-1)
        return RotorFrame(place, axis * present[..., None], spin)

    chosen = straightened(1.0)
    if hovers is None:
        return chosen
    for share in _STRAIGHTER:
        good, other = hovers(chosen)[..., None, None], straightened(share)
        chosen = RotorFrame(xp.where(good, chosen.place, other.place), xp.where(good, chosen.axis, other.axis), spin)
    return chosen


def hovers(xp: Any, frame: RotorFrame, strength: Any, torque_ratio: Any) -> Any:
    """Whether the thrusts of smallest norm hover and leave each rotor room for `MARGIN` of torque about an axis, (*n,).

    A linear programme says so of more frames: it need not take the smallest norm.

    Args:
        xp: the library of the numbers.
        frame: the frame.
        strength: largest collective thrust divided by the weight, (*n,).
        torque_ratio: reaction torque divided by thrust and arm, (*n,).
    """
    lift = frame.axis[..., 2]
    thrust, roll, pitch, yaw = smallest_norm([lift, *frame.turns(torque_ratio)])
    spare = xp.maximum(xp.maximum(abs(roll), abs(pitch)), abs(yaw) * torque_ratio[..., None]) * MARGIN
    top = (strength / lift.sum(-1))[..., None]
    fits = (thrust - spare >= IDLE * top) & (thrust + spare <= top)
    return xp.all(fits | (lift == 0), axis=-1)


def smallest_norm(rows: Sequence[Any]) -> list[Any]:
    """The right inverse of four rows, each (*n, N): its four columns, each (*n, N).

    A column times a number is the vector of smallest norm whose product with its row is that number, and with the
    others zero. The inverse of the rows' products is by the sweep operator (A. Beaton, 1964), entry by entry: for a
    batch of small matrices faster than a library's factorisation.
    """
    products = [[(a * b).sum(-1) for b in rows] for a in rows]
    for k in range(len(rows)):
        products = [[_swept(products, i, j, k) for j in range(len(rows))] for i in range(len(rows))]
    return [sum(-products[i][j][..., None] * row for i, row in enumerate(rows)) for j in range(len(rows))]


def _swept(m: list[list[Any]], i: int, j: int, k: int) -> Any:
    """The entry of a symmetric matrix after its row and column k are swept."""
    if i == k and j == k:
        return -1 / m[k][k]
    if i == k or j == k:
        return m[i][j] / m[k][k]
    return m[i][j] - m[i][k] * m[k][j] / m[k][k]


def present(axis: np.ndarray) -> np.ndarray:
    """Which of the rotors of a drawn vehicle it has, from their axes, (N, 3)."""
    return np.any(axis != 0, axis=-1)
