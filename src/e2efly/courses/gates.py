"""Gates, and what passing one is: the same arithmetic for NumPy's arrays and JAX's.

A gate's frame: x along its yaw, the direction in which it is flown through; y left; z up. A gate is passed when the
centre of mass crosses its plane forward with the vehicle's sphere inside the opening; crossing the next gate's plane
forward anywhere else is a failure, and so is touching the frame of any gate in either direction.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.courses.tracks import RaceTrack

FRAME = 0.1
"""Width of a gate's frame around its opening, m."""
STRAIGHT_ON = 3.0
"""Behind the last gate of an open track lies a point this far straight on, m."""
BURIED = -1000.0
"""Height of gates that a track of fewer gates has not, m: nobody meets them."""


@dataclass(frozen=True)
class Gates:
    """The gates of a track as arrays."""

    start: Any
    """(3,) or, each world its own, (n, 3): where a race begins, world, m."""
    start_yaw: Any
    """Heading there, rad; a number or (n,)."""
    position: Any
    """(g + 1, 3) or, each world its own, (n, g + 1, 3): centres, world, m. The last row is what the policy is shown
    behind the last gate."""
    cos: Any
    """(g,) or (n, g) cosine of each yaw."""
    sin: Any
    """(g,) or (n, g) sine of each yaw."""
    half: Any
    """(g, 2) or (n, g, 2) half of the opening's width and height, m."""

    @staticmethod
    def of(track: RaceTrack) -> "Gates":
        """The arrays of a loaded track: behind the last gate comes the first again, or a point 3 m straight on."""
        cos, sin = np.cos(track.yaw), np.sin(track.yaw)
        straight_on = track.position[-1] + STRAIGHT_ON * np.array([cos[-1], sin[-1], 0.0])
        position = np.vstack([track.position, track.position[0] if track.closed else straight_on])
        start, opening = track.start.astype(np.float32), track.opening.astype(np.float32)
        p, c, s = (x.astype(np.float32) for x in (position, cos, sin))
        return Gates(start, track.start_yaw, p, c, s, opening / 2)

    @property
    def count(self) -> int:
        """Gates of the track."""
        return self.cos.shape[-1]

    def local(self, point: Any) -> tuple[Any, Any, Any]:
        """Coordinates of points (n, 3) in every gate's frame, each (n, g)."""
        xp = point.__array_namespace__()
        d = point[:, None] - self.position[..., :-1, :]
        x, y, cos, sin = d[..., 0], d[..., 1], xp.asarray(self.cos), xp.asarray(self.sin)
        return cos * x + sin * y, cos * y - sin * x, d[..., 2]

    def judge(self, index: Any, before: Any, after: Any, radius: Any) -> tuple[Any, Any, Any]:
        """What steps along straight lines came to.

        Args:
            index: (n,) the next gate of each vehicle, counted from 0 within a lap.
            before: (n, 3) centres of mass at the start of the step, world, m.
            after: (n, 3) at its end.
            radius: of the vehicle's sphere, m.

        Returns:
            Booleans (n,): the next gate was passed; its plane was crossed forward elsewhere; a frame was struck.
        """
        xp = before.__array_namespace__()
        x0, y0, z0 = self.local(before)
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
    """The tracks of n worlds, which have room for the same number of gates."""

    gates: Gates
    """Each with a leading axis n. Gates beyond `count` are `BURIED`."""
    count: Any
    """(n,) gates that there are."""
    closed: Any
    """(n,) whether the first gate follows the last."""

    @property
    def there(self) -> Any:
        """(n, g) which gates there are."""
        return self.count.__array_namespace__().arange(self.gates.count) < self.count[:, None]

    @staticmethod
    def of(track: RaceTrack, room: int = 0) -> "Tracks":
        """One world (n = 1) with a loaded track, with room for so many gates, or for as many as it has."""
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
