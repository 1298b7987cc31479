"""Random race tracks: one pure function of uniform numbers, the same arithmetic for NumPy arrays and JAX arrays.

Half of the tracks are open: a chain of pieces, each of which leads from one gate to the next. A piece gives the turn of
the heading, the bearing of the next gate from the old heading, its distance, and its rise:

| piece | share | turn, rad | bearing, rad | distance | rise |
| --- | --- | --- | --- | --- | --- |
| straight, slalom | 30 % | within 0.35 | within 0.45 | leg | gentle or steep |
| turn | 38 % | 0.4 to 2.1, to either side | half the turn, within 0.35 | leg | gentle or steep |
| hairpin | 16 % | 2.2 to pi, to either side | half the turn, within 0.35 | 0.6 legs, 3 m at least | gentle or steep |
| split-S, ladder | 16 % | pi - 0.4 to pi, to either side | 0 | up to 1 m | 2 to 4 m down, or up |

A leg is 0.7 to 1.3 times the leg of the track, which is 3.5 to 18 m (logarithmically uniform). Such tracks are flown
at 8 to 20 m/s. A rise is gentle (within 0.12 of the distance) or, with a probability of one third, a climb or a dive
(0.2 to 0.6 of the distance). Heights are reflected at the ground and at the top of the track (4 to 8 m). So a split-S
that would end under the ground becomes a step of a ladder, and the reverse.

The other tracks are closed: gates around an ellipse (axes up to 3 : 1) or a figure of eight. Each gate is up to 0.3 of
a step early or late, up to a fifth nearer or farther, turned by up to 0.5 rad from the curve, and up to half a leg
(2.5 m) higher or lower than the middle height.

Openings are 0.6 to 1.5 m wide and high, half of them square. A race starts 2.5 to 6 m before the first gate, up to
0.8 rad beside its axis and 1 m above or below, heading within 0.4 rad of it. Of `CANDIDATES` tracks, the first is used
whose gates are at least `CLEAR` away from the straight lines between other gates. If there is none, the track that
comes nearest to this is used.

These are the numbers of `RACING`. Another `TrackStyle` has others, and may have straight pieces and turns alone.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.config.domain import FIRST, Domain, Extent
from e2efly.courses.gates import BURIED, Gates, Tracks

ANY = "any"
"""The track name that gives a different track in every episode."""
FEWEST = 3
"""Smallest number of gates of a track."""
CLEAR = 1.6
"""Smallest distance between a gate's centre and the straight line between two other gates, and between two gates, m."""
CLOSED = 0.4
"""Share of the candidates that are closed. Of the tracks it is about a half, because more closed candidates are
kept."""
HAIRPINS = 0.68
"""Pieces whose number is smaller are straight ones and turns."""
CANDIDATES = 4
"""Number of candidates that are drawn for each track."""
HEAD, EACH = 11, 8
"""Uniform numbers per candidate, and per gate of a candidate."""
FAR = 1e6
"""Squared distance of gates that do not count, m^2."""
LOWEST = 0.3
"""Smallest height of the lower edge of an opening above the ground, m."""


@dataclass(frozen=True)
class TrackStyle:
    """What random tracks are like."""

    most: int
    """Largest number of gates."""
    leg: tuple[float, float]
    """Range of the distance from gate to gate, m. Each track has its own distance."""
    opening: tuple[float, float]
    """Range of the width and height of an opening, m."""
    top: tuple[float, float]
    """Range of the height of the track's top, m."""
    pieces: float
    """Pieces of open tracks have a number below this."""
    farthest: float
    """Largest distance, m, of ..."""
    rise: float
    """... largest rise, m, of ..."""
    bearing: float
    """... and largest bearing, rad, of the next gate, of some 100 000 tracks."""

    @property
    def domain(self) -> Domain:
        """The domain of a policy of such tracks. Of a thousand gates, one is nearer to the next one than `CLEAR`."""
        low = self.opening[0] / 2
        return (
            Extent("gates", "1", FEWEST, self.most),
            Extent("gate_width", "m", *self.opening),
            Extent("gate_height", "m", *self.opening),
            Extent("gate_altitude", "m", LOWEST + low, self.top[1] - low),
            Extent("gate_distance", "m", CLEAR, self.farthest),
            Extent("gate_rise", "m", -self.rise, self.rise),
            Extent("gate_bearing", "rad", -self.bearing, self.bearing),
            Extent("gate_turn", "rad", FIRST, FIRST + 2 * math.pi),
            Extent("start_distance", "m", 2.5, 6.1),
        )

    def numbers(self, room: int = 0) -> tuple[int, int]:
        """The shape of the uniform numbers for a track, in arrays for `room` gates, or for as many as it may have."""
        return CANDIDATES, HEAD + EACH * max(room, self.most)


RACING = TrackStyle(
    most=12, leg=(3.5, 18.0), opening=(0.6, 1.5), top=(4.0, 8.0), pieces=1.0, farthest=50.0, rise=6.7, bearing=2.85
)
"""Tracks to race on as fast as one can."""
CLUTTERED = TrackStyle(
    most=6, leg=(5.0, 12.0), opening=(1.0, 1.0), top=(2.5, 4.0), pieces=HAIRPINS, farthest=30.0, rise=2.7, bearing=2.9
)
"""Tracks on which there is room for obstacles between the gates."""


def random_tracks(u: Any, style: TrackStyle = RACING) -> Tracks:
    """Random tracks for n worlds. `u` is (n, *style.numbers()), uniform in [0, 1)."""
    xp = u.__array_namespace__()
    candidates = _candidates(u, style)
    best = xp.argmax(xp.minimum(_clearance(candidates), CLEAR), axis=1)

    def chosen(x: Any) -> Any:
        return xp.take_along_axis(x, best.reshape(-1, *(1,) * (x.ndim - 1)), axis=1)[:, 0]

    g = candidates.gates
    parts = (chosen(x).astype("float32") for x in (g.start, g.start_yaw, g.position, g.cos, g.sin, g.half))
    return Tracks(Gates(*parts), chosen(candidates.count), chosen(candidates.closed))


def _candidates(u: Any, style: TrackStyle) -> Tracks:
    """All candidates, with the leading axes (n, CANDIDATES)."""
    xp = u.__array_namespace__()
    head = [u[..., i] for i in range(HEAD)]
    each = u[..., HEAD:].reshape(*u.shape[:-1], -1, EACH)
    kind, stretch, lie, bend, climb, steep, wide, high = (each[..., i] for i in range(EACH))
    count = FEWEST + (head[0] * (style.most - FEWEST + 1)).astype("int32")
    closed = head[1] < CLOSED
    shortest, longest = style.leg
    leg = (shortest * (longest / shortest) ** head[2])[..., None]
    width = _between(style.opening, wide)
    height = xp.where(high < 0.5, width, _between(style.opening, 2 * high - 1))
    low = height / 2 + LOWEST
    top = _between(style.top, head[3])[..., None] - height / 2
    chain = _chain(leg, style.pieces * kind, stretch, lie, bend, climb, steep)
    around = _around(leg, count[..., None], [x[..., None] for x in head[4:7]], stretch, lie, bend, climb)
    x, y, z, yaw = (xp.where(closed[..., None], b, a) for a, b in zip(chain, around, strict=True))
    z = _reflected(z + _between((1.0, 3.0), head[7])[..., None], low, top)
    there = xp.arange(each.shape[-2]) < count[..., None]
    position = xp.stack([x, y, xp.where(there, z, BURIED)], axis=-1)
    cos, sin = xp.cos(yaw), xp.sin(yaw)
    away, beside = _between((2.5, 6.0), head[8]), 1.6 * (head[9] - 0.5)
    way = yaw[..., 0] + beside
    start = xp.stack(
        [x[..., 0] - away * xp.cos(way), y[..., 0] - away * xp.sin(way), xp.maximum(z[..., 0] + 2 * head[10] - 1, 0.8)],
        axis=-1,
    )
    start_yaw = way + 0.8 * (lie[..., 0] - 0.5)
    half = xp.stack([width, height], axis=-1) / 2
    position = xp.concatenate([position, position[..., :1, :]], axis=-2)
    return Tracks(Gates(start, start_yaw, position, cos, sin, half), count, closed)


def _between(bounds: tuple[float, float], u: Any) -> Any:
    return bounds[0] + (bounds[1] - bounds[0]) * u


def _reflected(z: Any, low: Any, high: Any) -> Any:
    """Heights that are reflected at both bounds."""
    room = high - low
    return low + room - z.__array_namespace__().abs((z - low) % (2 * room) - room)


def _chain(leg: Any, kind: Any, stretch: Any, lie: Any, bend: Any, climb: Any, steep: Any) -> tuple[Any, ...]:
    """x, y, z and yaw of the gates of an open track, piece by piece, from numbers (..., gates) for each."""
    xp = leg.__array_namespace__()
    side, bend = xp.where(bend < 0.5, -1.0, 1.0), (2 * bend) % 1
    curve, hairpin, stacked = kind >= 0.30, kind >= HAIRPINS, kind >= 0.84
    turn = xp.where(curve, side * _between((0.4, 2.1), bend), side * 0.35 * bend)
    turn = xp.where(hairpin, side * _between((2.2, math.pi), bend), turn)
    turn = xp.where(stacked, side * _between((math.pi - 0.4, math.pi), bend), turn)
    aside = 2 * lie - 1
    bearing = xp.where(stacked, 0.0, xp.where(curve, turn / 2 + 0.35 * aside, 0.45 * aside))
    distance = leg * _between((0.7, 1.3), stretch)
    distance = xp.where(hairpin, xp.maximum(0.6 * distance, 3.0), distance)
    slope = 2 * climb - 1
    sign = xp.where(slope < 0, -1.0, 1.0)
    slope = xp.where(steep < 1 / 3, sign * _between((0.2, 0.6), xp.abs(slope)), 0.12 * slope)
    rise = xp.where(stacked, sign * _between((2.0, 4.0), stretch), slope * distance)
    distance = xp.where(stacked, lie, distance)
    heading = xp.cumsum(turn, axis=-1)
    before = heading - turn  # the first piece leads from nowhere to the first gate, and is as good as any
    way = before + bearing
    x, y, z = (xp.cumsum(step, axis=-1) for step in (distance * xp.cos(way), distance * xp.sin(way), rise))
    return x, y, z, heading


def _around(leg: Any, count: Any, whole: list[Any], stretch: Any, lie: Any, bend: Any, climb: Any) -> tuple[Any, ...]:
    """The same for a closed track: an ellipse or, with a probability of 2/5, a figure of eight."""
    xp = leg.__array_namespace__()
    shape, aspect, side = whole
    mirrored = xp.where(side < 0.5, -1.0, 1.0)
    radius, narrow = leg * count / (2 * math.pi), xp.sqrt(_between((1.0, 3.0), aspect))
    angle = 2 * math.pi * (xp.arange(stretch.shape[-1]) + 0.3 * (2 * stretch - 1)) / count
    cos, sin = xp.cos(angle), xp.sin(angle)
    eight = (shape < 0.4) & (count >= 6)
    a, b = radius * narrow, radius / narrow
    near = 1 + 0.2 * (2 * lie - 1)
    x = xp.where(eight, 1.1 * radius * sin, a * cos) * near
    y = xp.where(eight, 0.65 * radius * xp.sin(2 * angle), b * sin) * near
    dx = xp.where(eight, 1.1 * radius * cos, -a * sin)
    dy = xp.where(eight, 1.3 * radius * xp.cos(2 * angle), b * cos)
    yaw = xp.arctan2(mirrored * dy, dx) + 0.5 * (2 * bend - 1)
    return x, mirrored * y, xp.minimum(leg / 2, 2.5) * (2 * climb - 1), yaw


def _clearance(tracks: Tracks) -> Any:
    """(n, CANDIDATES) smallest distance of a gate from a line between others, and between consecutive gates, m."""
    g, most = tracks.gates, tracks.gates.count
    lines, index = np.arange(most + 1)[:, None], np.arange(most)
    xp, count = g.position.__array_namespace__(), tracks.count[..., None]
    homeward = tracks.closed[..., None] & (index == count - 1)  # the last line begins at this gate
    leads = xp.concatenate([index < count, tracks.closed[..., None]], axis=-1)
    square: Any = 0.0
    product: Any = 0.0
    length: Any = 0.0
    for k in range(3):  # component by component, which a CPU does several times as fast as rows of three
        gates = g.position[..., :-1, k]
        last = xp.where(homeward, gates, 0.0).sum(axis=-1, keepdims=True)
        begins = xp.concatenate([g.start[..., k : k + 1], gates[..., :-1], last], axis=-1)
        ends = xp.concatenate([gates, gates[..., :1]], axis=-1)
        along, away = ends - begins, gates[..., None, :] - begins[..., None]  # (..., lines, gates)
        square, product = square + away * away, product + away * along[..., None]
        length = length + along * along
    share = xp.clip(product / xp.maximum(length, 1e-6)[..., None], 0.0, 1.0)
    gap = square - 2 * share * product + share * share * length[..., None]
    own = (index == lines) | ((index == lines - 1) & (lines < most)) | ((lines == most) & (index == 0))
    counts = leads[..., None] & (index < count)[..., None, :] & ~own & ~((lines == most) & homeward[..., None, :])
    clear = xp.where(counts, gap, FAR).min(axis=(-1, -2))
    return xp.sqrt(xp.maximum(xp.minimum(clear, xp.where(leads, length, FAR).min(axis=-1)), 0.0))
