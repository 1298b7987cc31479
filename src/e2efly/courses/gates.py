"""Gates, and the definition of passing one: the same arithmetic for NumPy arrays and JAX arrays.

A gate's frame has x along its yaw, in the direction of flight through it, y to the left, and z up. A gate is passed
when the centre of mass crosses its plane forward while the vehicle's sphere is inside the opening. Crossing the next
gate's plane forward anywhere else is a failure. Touching the frame of any gate, in either direction, is a failure, too.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.courses.tracks import RaceTrack

FRAME = 0.1
"""Width of a gate's frame around its opening, m."""
HALF_DEPTH = 0.05
"""Half the depth of a gate's bars, m."""
STRAIGHT_ON = 3.0
"""Distance of the point after the last gate of an open track, straight on, m."""
BURIED = -1000.0
"""Height of gates that a track with fewer gates does not have, m. No vehicle meets them there."""


@dataclass(frozen=True)
class Gates:
    """The gates of a track as arrays."""

    start: Any
    """(3,), or (n, 3) with one row per world: start of a race, world, m."""
    start_yaw: Any
    """Heading at the start, rad; a number or (n,)."""
    position: Any
    """(g + 1, 3), or (n, g + 1, 3) with one track per world: centres, world, m. The last row is the point that the
    policy observes after the last gate."""
    cos: Any
    """(g,) or (n, g) cosine of each yaw."""
    sin: Any
    """(g,) or (n, g) sine of each yaw."""
    half: Any
    """(g, 2) or (n, g, 2) half of the opening's width and height, m."""
    moved: Any = None
    """(n, g + 1, 3) by how much the centres have moved in the step that is judged, world, m. None: not at all."""

    @staticmethod
    def of(track: RaceTrack) -> "Gates":
        """The arrays of a loaded track. After the last gate comes the first gate again, or a point 3 m straight on."""
        cos, sin = np.cos(track.yaw), np.sin(track.yaw)
        straight_on = track.position[-1] + STRAIGHT_ON * np.array([cos[-1], sin[-1], 0.0])
        position = np.vstack([track.position, track.position[0] if track.closed else straight_on])
        start, opening = track.start.astype(np.float32), track.opening.astype(np.float32)
        p, c, s = (x.astype(np.float32) for x in (position, cos, sin))
        return Gates(start, track.start_yaw, p, c, s, opening / 2)

    @property
    def count(self) -> int:
        """Number of gates of the track."""
        return self.cos.shape[-1]

    def local(self, point: Any, moved: Any = None) -> tuple[Any, Any, Any]:
        """Coordinates of points (n, 3) in every gate's frame, each (n, g), before the gates have moved by so much."""
        xp = point.__array_namespace__()
        d = point[:, None] - self.position[..., :-1, :]
        d = d if moved is None else d + moved[:, :-1]
        x, y, cos, sin = d[..., 0], d[..., 1], xp.asarray(self.cos), xp.asarray(self.sin)
        return cos * x + sin * y, cos * y - sin * x, d[..., 2]

    def judge(self, index: Any, before: Any, after: Any, radius: Any) -> tuple[Any, Any, Any]:
        """Judge steps along straight lines. Gates that have moved did so along straight lines, too.

        Args:
            index: (n,) the next gate of each vehicle, counted from 0 within a lap.
            before: (n, 3) centres of mass at the start of the step, world, m.
            after: (n, 3) centres of mass at the end of the step, world, m.
            radius: of the vehicle's sphere, m.

        Returns:
            Booleans (n,): the next gate was passed; its plane was crossed forward elsewhere; a frame was touched.
        """
        xp = before.__array_namespace__()
        x0, y0, z0 = self.local(before, self.moved)
        x1, y1, z1 = self.local(after)
        t = x0 / xp.where(x0 == x1, 1.0, x0 - x1)
        y, z = xp.abs(y0 + t * (y1 - y0)), xp.abs(z0 + t * (z1 - z0))
        forward, crossing = (x0 < 0) & (x1 >= 0), (x0 < 0) != (x1 < 0)
        half = self.half
        wide, high = half[..., 0], half[..., 1]
        inside = (y < wide - radius) & (z < high - radius)
        outside = (y > wide + FRAME + radius) | (z > high + FRAME + radius)
        mine = index[:, None] == xp.arange(self.count)
        passed = xp.any(mine & forward & inside, axis=-1)
        missed = xp.any(mine & forward & ~inside, axis=-1)
        struck = xp.any(crossing & ~inside & ~outside, axis=-1)
        return passed, missed, struck


@dataclass(frozen=True)
class Tracks:
    """The tracks of n worlds, in arrays for the same number of gates."""

    gates: Gates
    """The gates, each array with a leading axis n. Gates beyond `count` are `BURIED`."""
    count: Any
    """(n,) number of gates."""
    closed: Any
    """(n,) whether the first gate follows the last."""

    @property
    def there(self) -> Any:
        """(n, g) which gates exist."""
        return self.count.__array_namespace__().arange(self.gates.count) < self.count[:, None]

    @staticmethod
    def of(track: RaceTrack, room: int = 0) -> "Tracks":
        """One world (n = 1) with a loaded track, in arrays for `room` gates, or for as many gates as the track has."""
        gates = Gates.of(track)
        more = max(room - gates.count, 0)
        buried = np.tile(np.array([0.0, 0.0, BURIED], np.float32), (more, 1))
        position = np.vstack([gates.position[:-1], buried, gates.position[-1:]])
        filled = (
            np.concatenate([x, np.ones((more, *x.shape[1:]), x.dtype)]) for x in (gates.cos, gates.sin, gates.half)
        )
        parts = (gates.start, np.float32(gates.start_yaw), position, *filled)
        every = Gates(*(np.asarray(x)[None] for x in parts))
        return Tracks(every, np.array([gates.count], np.int32), np.array([track.closed]))

    def track(self, world: int, name: str = "any") -> RaceTrack:
        """The track of a world as data."""
        g, k = self.gates, int(self.count[world])
        return RaceTrack(
            name=name,
            closed=bool(self.closed[world]),
            start=np.asarray(g.start[world], float),
            start_yaw=float(g.start_yaw[world]),
            position=np.asarray(g.position[world, :k], float),
            yaw=np.arctan2(np.asarray(g.sin[world, :k], float), np.asarray(g.cos[world, :k], float)),
            opening=2 * np.asarray(g.half[world, :k], float),
        )
