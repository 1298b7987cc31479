"""The backup manoeuvre: turn the thrust against the velocity, brake to rest, hover. Its path is computed in `way`."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from e2efly.flight.filter.arithmetic import Number, clip
from e2efly.flight.filter.forecast import ForecastCommand, ForecastMotion, Residual, Response
from e2efly.flight.filter.turn import TurnStep, steps_of
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

TILT_GAIN = 9.0
"""Body rate divided by the angle that remains to turn, 1/s. It may be this large because the state is forecast to the
time at which the command acts, so there is no delay."""
TURN_RATE = 0.8
"""Share of the vehicle's `body_rate_max` with which the backup turns."""
THRUST_SHARE = 0.8
"""Share of the largest thrust that is assumed to be available. A flat battery costs a fifth of it."""
UNSEEN = 0.85
"""Share of the thrust that remains before a loss of thrust is noticed."""
STEEPEST = math.radians(65)
"""The largest tilt of the manoeuvre, rad, if the fence allows it."""
TILT_MARGIN, LEAN_MARGIN, LEAST_TILT = 0.32, 0.36, 0.1
"""Margins below the largest tilt, rad. The first is the margin with which the tilt limit is kept. The second is the
margin of the manoeuvre itself, because a rate loop may overshoot its turns. The third is the smallest tilt that must
remain."""
COUNTED = (0.85, 0.55)
"""Shares of the commanded deceleration that are assumed, sideways and for a fall. They cover the time until a loss of
thrust is noticed."""
DIAGONAL = 1.4 / THRUST_SHARE
"""How much more rotor thrust a turn about a diagonal takes with a flat battery than a turn about x or y with a full
one, as a factor."""
YAW_KEPT = 0.8
"""Share of the rotation about the thrust axis that the manoeuvre keeps. Stopping it at once would take the control
authority that tilting needs."""
CLIMB_SHARE = 0.85
"""Share of that thrust that may point up to brake a fall. Braking sideways gets the rest."""
SINK = 4.5
"""Deceleration of a climb, m/s^2. The remaining thrust can still brake sideways."""
LEAST_BRAKING = 0.05
"""The least deceleration that is assumed, m/s^2."""
GUST = 0.4
"""How strongly the air may push against the braking, m/s^2: a gust of 3 m/s at 10 m/s, for the vehicles that are
shipped."""
MARGIN_S2 = 0.0065
"""The manoeuvre stays inside by this time squared multiplied by the vehicle's largest thrust over mass, s^2, because
the errors of the forecast grow with the thrust. For VIS-R this is 0.18 m. The margin is increased by ..."""
TIMING, TURNING = 0.05, 0.016
"""... the distance flown in the first time, s, because the forecast's time also has errors, and by the second value, m
s, multiplied by the body rate, because fast turns are predicted less well."""
SPEED_GAIN = 12.0
"""Deceleration divided by speed as the manoeuvre comes to rest, 1/s."""
WAY_GAINS = (4.0, 3.0)
"""The same gains, sideways and up, for the prediction of the turn, 1/s. There the deceleration is held from the
beginning, and must not have reversed the velocity at the end."""
LEAD, LEAD_UP = 0.1, 0.04
"""The velocity that is braked is the velocity after this time, s, because the thrust still pushes in its old direction
while it turns. Vertically, the thrust only has to wait for the rotors, so the time is shorter."""
REST_S = LEAD + 1 / SPEED_GAIN
"""Time constant with which the manoeuvre comes to rest, s."""


@dataclass(frozen=True)
class Backup:
    """The manoeuvre of a vehicle. Create it with `Backup.of`."""

    response: Response
    """The response of the vehicle."""
    most: float
    """Thrust over mass that is assumed to be available, m/s^2."""
    level: float
    """Sideways deceleration that is commanded, m/s^2."""
    climb: float
    """Deceleration of a fall that is commanded, m/s^2."""
    braking: tuple[float, float, float]
    """Decelerations that are assumed sideways, for a fall and for a climb, m/s^2."""
    beside: tuple[float, float]
    """Decelerations that are assumed sideways while a fall and while a climb is braked, m/s^2."""
    steepest: float
    """The largest tilt, rad."""
    rate: float
    """The largest body rate, rad/s."""
    steps: tuple[TurnStep, ...]
    """Steps of the turn."""

    @property
    def margin(self) -> float:
        """Margin by which the manoeuvre stays inside at rest, m."""
        return MARGIN_S2 * self.response.thrust[1]

    @staticmethod
    def of(vehicle: Vehicle, tilt: float) -> "Backup":
        """The manoeuvre of a loaded vehicle, within a tilt, rad.

        Raises:
            ValueError: for a vehicle with too little thrust for braking, or a tilt that is too small. It names the
                value.
        """
        response = Response.of(vehicle)
        most = response.thrust[1] * THRUST_SHARE
        spare = most - GRAVITY
        if spare < GRAVITY:
            least = 2.0 / THRUST_SHARE
            raise ValueError(
                f"guard 'filter': the vehicle's thrust is {vehicle.thrust_to_weight:.2f} of its weight; accepted: "
                f"{least:.2f} or more, so that it brakes with a flat battery"
            )
        if tilt < LEAN_MARGIN + LEAST_TILT:
            least = LEAN_MARGIN + LEAST_TILT
            raise ValueError(f"guard 'filter': flight.fence.tilt is {tilt:g} rad; accepted: {least:g} or more")
        climb = CLIMB_SHARE * most - GRAVITY
        steepest = min(STEEPEST, tilt - LEAN_MARGIN)
        level = min(0.8 * most, GRAVITY * math.tan(min(steepest, 1.05)))
        braking = (COUNTED[0] * level - GUST, COUNTED[1] * climb - GUST, SINK - GUST)
        # a fall takes CLIMB_SHARE of the thrust; a climb leaves so little of it that the tilt is what limits
        left = (math.sqrt(1.0 - CLIMB_SHARE**2) * most, (GRAVITY - SINK) * math.tan(steepest))
        falling, climbing = (max(COUNTED[0] * min(level, x) - GUST, LEAST_BRAKING) for x in left)
        rate = TURN_RATE * min(response.rate_max[:2])
        return Backup(response, most, level, climb, braking, (falling, climbing), steepest, rate, steps_of(response))


class Brake(NamedTuple):
    """The direction in which the manoeuvre points the thrust, and the attitude that the present rotation reaches by
    itself.
    """

    bx: Number
    """Present direction of the thrust, world."""
    by: Number
    bz: Number
    cx: Number
    """Direction at which the present rotation comes to rest, world."""
    cy: Number
    cz: Number
    tx: Number
    """Desired direction, world."""
    ty: Number
    tz: Number
    thrust: Number
    """Desired collective thrust over mass along that direction, m/s^2."""
    share: Number
    """Actual thrust divided by the commanded thrust."""
    vx: Number
    """The velocity that is braked, m/s."""
    vy: Number
    vz: Number
    wx: Number
    """Rate at which the thrust direction turns, world, rad/s."""
    wy: Number
    wz: Number
    ax: Number
    """Change of that rate by the rotors, world, rad/s^2."""
    ay: Number
    az: Number


def axes(m: ForecastMotion) -> tuple[Number, ...]:
    """The body's axes x, y and z in the world, nine numbers."""
    w, x, y, z = m.qw, m.qx, m.qy, m.qz
    return (
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
        2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
        2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y),
    )  # fmt: skip


def axes_z(w: Number, x: Number, y: Number, z: Number) -> tuple[Number, Number, Number]:
    """The body's z axis in the world, from a quaternion."""
    return 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)


def brake(
    xp: Any,
    b: Backup,
    m: ForecastMotion,
    air: Residual,
    back: tuple[Number, ...] = (0.0, 0.0, 0.0),
    gains: tuple[float, float] = (SPEED_GAIN, SPEED_GAIN),
) -> Brake:
    """The manoeuvre from a state, to rest or to a return velocity `back`, world, m/s. `gains` are decelerations divided
    by speed, 1/s.

    The present rotation comes to rest by itself at the attitude c of `Brake`.
    """
    r = b.response
    xx, xy, xz, yx, yy, yz, bx, by, bz = axes(m)
    ox, oy = _coast(xp, r, m)
    s2 = ox * ox + oy * oy
    cos, sinc = 1.0 - s2 / 2 + s2 * s2 / 24, 1.0 - s2 / 6 + s2 * s2 / 120
    # about body x the z axis goes to -y, about body y to x
    cx = cos * bx + sinc * (oy * xx - ox * yx)
    cy = cos * by + sinc * (oy * xy - ox * yy)
    cz = cos * bz + sinc * (oy * xz - ox * yz)
    f = air.share * m.f
    vx, vy = m.vx + LEAD * (f * cx + air.x), m.vy + LEAD * (f * cy + air.y)
    vz = m.vz + LEAD_UP * (f * cz + air.z - GRAVITY)
    vx, vy, vz = vx - back[0], vy - back[1], vz - back[2]
    level = xp.sqrt(vx * vx + vy * vy + 1e-9)
    gz = GRAVITY - air.z + clip(xp, -gains[1] * vz, -SINK, b.climb)
    gz = clip(xp, gz, 0.3 * GRAVITY, b.most)
    push = -xp.minimum(xp.minimum(b.level, gains[0] * level), xp.sqrt(b.most * b.most - gz * gz + 1.0)) / level
    gx, gy = push * vx - air.x, push * vy - air.y
    reach = gz * math.tan(b.steepest)
    side = xp.sqrt(gx * gx + gy * gy + 1e-9)
    shrink = reach / xp.maximum(side, reach)
    gx, gy = gx * shrink, gy * shrink
    thrust = xp.sqrt(gx * gx + gy * gy + gz * gz)
    return Brake(
        bx, by, bz, cx, cy, cz, gx / thrust, gy / thrust, gz / thrust, thrust, air.share, vx, vy, vz,
        m.wx * xx + m.wy * yx, m.wx * xy + m.wy * yy, m.wx * xz + m.wy * yz,
        m.ax * xx + m.ay * yx, m.ax * xy + m.ay * yy, m.ax * xz + m.ay * yz,
    )  # fmt: skip


def _coast(xp: Any, r: Response, m: ForecastMotion) -> tuple[Number, Number]:
    """The angle about body x and y that the rate loop still turns after the command to stop, rad.

    This is the integral of its free response, (rate + lag * acceleration) / gain. For a rate that needs more than the
    rotors can give, it is the angle turned under their largest acceleration, down to the rate that does not need more,
    plus the effect of their lag.
    """
    gain, (low, high) = UNSEEN * min(r.gain[:2]), r.thrust
    x, y = m.wx + r.motor_time * m.ax, m.wy + r.motor_time * m.ay
    rate = xp.sqrt(x * x + y * y + 1e-9)
    fair = THRUST_SHARE * 0.5 * (high - low) * rate / (gain * (r.spread[0] * abs(x) + r.spread[1] * abs(y)) + 1e-9)
    over = xp.maximum(rate - fair, 0.0)
    turn = xp.minimum(rate, fair) / gain + over * ((rate + fair) / (2.0 * gain * fair) + r.motor_time)
    return x * turn / rate, y * turn / rate


def command(xp: Any, b: Backup, m: ForecastMotion, k: Brake) -> ForecastCommand:
    """The command that the manoeuvre sends now: turn by the shortest way, with the part of the thrust that already
    points in the desired direction. `m` is the state when the command acts, and `k` the manoeuvre from that state.
    """
    xx, xy, xz, yx, yy, yz, bx, by, bz = axes(m)
    nx, ny, nz = by * k.tz - bz * k.ty, bz * k.tx - bx * k.tz, bx * k.ty - by * k.tx
    sine = xp.sqrt(nx * nx + ny * ny + nz * nz + 1e-18)
    cosine = bx * k.tx + by * k.ty + bz * k.tz
    turn = xp.minimum(TILT_GAIN * xp.arctan2(sine, cosine), b.rate) / sine
    # if the thrust points exactly opposite to the desired direction, there is no shortest way: use body x
    over = (sine < 1e-3) & (cosine < 0.0)
    wx = xp.where(over, b.rate, turn * (nx * xx + ny * xy + nz * xz))
    wy = xp.where(over, 0.0, turn * (nx * yx + ny * yy + nz * yz))
    return ForecastCommand(k.thrust / k.share * xp.maximum(cosine, 0.0), wx, wy, YAW_KEPT * m.wz)
