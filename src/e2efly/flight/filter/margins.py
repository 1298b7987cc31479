"""How much room the backup manoeuvre leaves to the fence's walls, to solids, and to the largest speed and tilt."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from e2efly.flight.filter.arithmetic import Number, clip
from e2efly.flight.filter.backup import TILT_MARGIN, TIMING, TURNING, WAY_GAINS, Backup, Brake, brake
from e2efly.flight.filter.backup_path import Way, run_out, way
from e2efly.flight.filter.forecast import ForecastMotion, Residual
from e2efly.flight.filter.obstacle import Obstacle, Plane, obstacles
from e2efly.flight.pose.neighbours import OtherVehicle
from e2efly.flight.settings import Fence

SPEED_MARGIN, SPEED_S = 0.7, 0.25
"""The margin with which the largest speed is kept, m/s, and the factor that converts a difference of speed to room,
s."""
TILT_M = 0.3
"""The room that corresponds to one radian of tilt, m."""
FADES = 2.0
"""At this speed against the air's push, m/s, the push is not counted at all."""
RETREAT, BACK, BACK_UP = 2.0, 0.05, 0.35
"""Speed of the return divided by the distance beyond the margin, 1/s. The return ends this far inside, m, from the
walls and over the floor. There the policy has room again, and may leave the wall."""
WALLS = ("x low", "x high", "y low", "y high", "floor", "ceiling")
"""Names of the limits, in the order of their rooms. The solids follow."""
NAMES = (*WALLS, "speed", "tilt")


@dataclass(frozen=True)
class MarginLimits:
    """Where the vehicle may be and how it may move. Lengths are in m, with the margins already subtracted."""

    low: tuple[float, float, float]
    """Lower corner, world."""
    high: tuple[float, float, float]
    speed: float
    """Largest speed, m/s."""
    tilt: float
    """Largest tilt, rad. Infinite if every tilt is allowed."""
    solids: tuple[Obstacle, ...] = ()
    """The solids to avoid."""
    radius: float = 0.0
    """Distance to keep between the centre of mass and a solid."""

    @staticmethod
    def of(fence: Fence, radius: float, margin: float) -> "MarginLimits":
        """The limits of a fence, for a vehicle with this radius, m, that stays inside by a margin, m.

        Raises:
            ValueError: as for `obstacles`.
        """
        (a, b, c), (d, e, f) = fence.low, fence.high
        m = margin
        return MarginLimits(
            (a + m, b + m, c + m), (d - m, e - m, f - m), fence.speed - SPEED_MARGIN,
            fence.tilt - TILT_MARGIN if fence.tilt < math.pi else math.inf, obstacles(fence), radius + m,
        )  # fmt: skip


def near(limits: MarginLimits, m: ForecastMotion, reach: float) -> tuple[Plane, ...]:
    """The nearest sides of the solids within `reach` m. The distance to keep is subtracted from their gaps. Only for a
    single vehicle.
    """
    found = (solid.plane(m.px, m.py, m.pz, reach + limits.radius) for solid in limits.solids)
    return tuple(plane._replace(gap=plane.gap - limits.radius) for plane in found if plane is not None)


def halves(
    limits: MarginLimits, m: ForecastMotion, others: Sequence[OtherVehicle], ahead: float, reach: float
) -> tuple[Plane, ...]:
    """The sides of the half of the space that is the vehicle's own: each other is given the half beyond the middle.

    Where both keep to theirs, they do not meet: the room between them is the sum of what both need to stop (buffered
    Voronoi cells; Zhou, Wang, Bandyopadhyay and Schwager 2017). One that does not keep to its half has only this half
    to fly into.

    Args:
        limits: the radius and the margin of the vehicle.
        m: its state when the command begins to act.
        others: the others.
        ahead: time until then, s, in which they fly straight on.
        reach: the planes within this distance, m, are returned.
    """
    found = []
    for other in others:
        x, y, z = (
            p + ahead * v - own for p, v, own in zip(other.position, other.velocity, (m.px, m.py, m.pz), strict=True)
        )
        away = math.sqrt(x * x + y * y + z * z)
        gap = 0.5 * (away - other.ball) - limits.radius
        if gap <= reach:
            nx, ny, nz = (x / away, y / away, z / away) if away > 0.0 else (1.0, 0.0, 0.0)
            found.append(Plane(nx, ny, nz, gap, "another vehicle"))
    return tuple(found)


def rooms(
    xp: Any,
    b: Backup,
    limits: MarginLimits,
    m: ForecastMotion,
    air: Residual,
    solids: tuple[Plane, ...] = (),
    floor: Number = True,
    at: ForecastMotion | None = None,
) -> tuple[Number, ...]:
    """The room that the manoeuvre from a state leaves to each limit of `NAMES`, then to each solid. In m, negative
    beyond the limit. `solids` are the nearby sides from `near`, which was called for the state `at`. `floor` tells
    whether the lowest height counts.
    """
    air = against(xp, m, air)
    k = brake(xp, b, m, air, gains=WAY_GAINS)
    w = way(xp, b, m, k, air)
    level, fall, rise = b.braking
    side = xp.sqrt(w.vx * w.vx + w.vy * w.vy + 1e-9)
    # while the vertical speed is braked, less thrust is left for the level one
    climbs = w.vz > 0.0
    busy, beside = xp.where(climbs, w.vz / rise, -w.wz / fall), xp.where(climbs, b.beside[1], b.beside[0])
    after = xp.maximum(side - beside * busy, 0.0)
    run = (0.5 * (side + after) * (side - after) / beside + run_out(xp, after, level)) / side
    dx, dy = w.vx * run, w.vy * run
    down = -run_out(xp, -w.wz, fall)
    dz = xp.where(w.vz > 0.0, run_out(xp, xp.maximum(w.vz, 0.0), rise), down)
    (x0, y0, z0), (x1, y1, z1) = limits.low, limits.high
    low_x, high_x = _ends(xp, w.px, dx)
    low_y, high_y = _ends(xp, w.py, dy)
    low_z, _ = _ends(xp, w.lz, down)
    _, high_z = _ends(xp, w.pz, dz)
    rough = TURNING * xp.sqrt(m.wx * m.wx + m.wy * m.wy + 1e-9)
    off_x, off_y, off_z = TIMING * abs(m.vx) + rough, TIMING * abs(m.vy) + rough, TIMING * abs(m.vz) + rough
    low_z = xp.where(floor, low_z - z0, z1 - low_z)
    found = [
        low_x - x0 - off_x, x1 - high_x - off_x, low_y - y0 - off_y, y1 - high_y - off_y,
        low_z - off_z, z1 - high_z - off_z,
        SPEED_S * (limits.speed - xp.sqrt(w.speed2)) - rough, _tilt_room(xp, limits, k) - TILT_M * rough,
    ]  # fmt: skip
    for nx, ny, nz, gap, _ in solids:
        assert at is not None
        off = rough + TIMING * xp.maximum(nx * m.vx + ny * m.vy + nz * m.vz, 0.0)
        found.append(gap - off - _towards(xp, w, at, (nx, ny, nz), (dx, dy, dz)))
    return tuple(found)


def against(xp: Any, m: ForecastMotion, air: Residual) -> Residual:
    """The part of the air's push that is counted while braking. A push that helps the braking may end as the speed
    falls, so it is not counted.
    """
    x, y, z = (
        push * clip(xp, 1.0 + speed * push / (FADES * (abs(push) + 1e-9)), 0.0, 1.0)
        for push, speed in zip(air[:3], (m.vx, m.vy, m.vz), strict=True)
    )
    return Residual(x, y, z, air.share)


def retreat(xp: Any, limits: MarginLimits, m: ForecastMotion, floor: Number = True) -> tuple[Number, ...]:
    """The velocity back inside, world, m/s, in proportion to how far a state is beyond the margins or close to them."""
    (x0, y0, z0), (x1, y1, z1) = limits.low, limits.high
    z0 = xp.where(floor, z0, -math.inf)
    return tuple(
        RETREAT * (xp.maximum(low + back - at, 0.0) - xp.maximum(at - high + BACK, 0.0))
        for at, low, high, back in ((m.px, x0, x1, BACK), (m.py, y0, y1, BACK), (m.pz, z0, z1, BACK_UP))
    )


def _ends(xp: Any, places: tuple[Number, ...], tail: Number) -> tuple[Number, Number]:
    """The smallest and the largest coordinate on the path."""
    low = high = places[0]
    for place in places[1:]:
        low, high = xp.minimum(low, place), xp.maximum(high, place)
    end = places[-1] + tail
    return xp.minimum(low, end), xp.maximum(high, end)


def _towards(xp: Any, w: Way, at: ForecastMotion, normal: tuple[float, ...], tail: tuple[Number, ...]) -> Number:
    """How far the path goes in a direction."""
    nx, ny, nz = normal
    most = 0.0
    for x, y, z in zip(w.px, w.py, w.pz, strict=True):
        most = xp.maximum(most, nx * (x - at.px) + ny * (y - at.py) + nz * (z - at.pz))
    x, y, z = w.px[-1] + tail[0], w.py[-1] + tail[1], w.pz[-1] + tail[2]
    return xp.maximum(most, nx * (x - at.px) + ny * (y - at.py) + nz * (z - at.pz))


def _tilt_room(xp: Any, limits: MarginLimits, k: Brake) -> Number:
    """The room to the largest tilt. The thrust turns from c to t on a great circle. Between two directions within a
    cone, it stays within the cone.
    """
    if limits.tilt == math.inf:
        return 0.0 * k.cz + 1e3
    tilt = xp.arctan2(xp.sqrt(k.cx * k.cx + k.cy * k.cy), k.cz)
    return TILT_M * (limits.tilt - tilt)
