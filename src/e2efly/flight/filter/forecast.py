"""How the vehicle responds to collective thrust and body rates in the filter's forecast.

It is a rigid body without drag. The rate loop demands an angular acceleration in proportion to the rate error. The
rotors follow with a lag, which is a lag of their speed, the root of the thrust. As in the flight controller's mixer,
attitude has priority over thrust: a hard turn needs a spread between the rotors, which raises a small thrust and lowers
a large one.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from e2efly.flight.filter.arithmetic import Number
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle


class ForecastCommand(NamedTuple):
    """Collective thrust and body rates."""

    thrust: Number
    """Collective thrust over mass, m/s^2."""
    x: Number
    """Body rate about body x, rad/s."""
    y: Number
    z: Number


class ForecastMotion(NamedTuple):
    """The vehicle's state as single numbers. It is a tuple because a frozen dataclass takes ten times as long to
    create.
    """

    px: Number
    """Position, world, m."""
    py: Number
    pz: Number
    vx: Number
    """Velocity, world, m/s."""
    vy: Number
    vz: Number
    qw: Number
    """Attitude, body to world."""
    qx: Number
    qy: Number
    qz: Number
    wx: Number
    """Body rate, rad/s."""
    wy: Number
    wz: Number
    ax: Number
    """Angular acceleration of the vehicle about body x by its rotors, rad/s^2."""
    ay: Number
    f: Number
    """Collective thrust over mass from the commands, m/s^2."""


class Actuators(NamedTuple):
    """The part of the state that no pose contains: the effect of the sent commands on the rotors."""

    wx: Number
    wy: Number
    wz: Number
    ax: Number
    ay: Number
    f: Number


class Residual(NamedTuple):
    """What the odometry shows but the forecast does not explain."""

    x: Number
    """Acceleration from wind and drag, world, m/s^2."""
    y: Number
    z: Number
    share: Number
    """Actual thrust divided by the commanded thrust. Below 1 for a sagging battery or a wrong throttle map."""


NOTHING = Residual(0.0, 0.0, 0.0, 1.0)
"""Everything is explained."""


class ResponseStep(NamedTuple):
    """How the rate loop and the rotors answer over a time. Create it with `Response.step`."""

    h: Number
    """The time, s."""
    x: tuple[Number, Number, Number, Number]
    """The rate loop about body x: `turning`."""
    y: tuple[Number, Number, Number, Number]
    z: Number
    """The share of the rate error about body z that remains."""
    rotors: Number
    """The share of the error of the rotors' speed that remains."""


@dataclass(frozen=True)
class Response:
    """The response of a vehicle. Create it with `Response.of`."""

    thrust: tuple[float, float]
    """Smallest and largest collective thrust over mass, m/s^2."""
    motor_time: float
    """Time constant of the rotors, s."""
    gain: tuple[float, float, float]
    """Angular acceleration divided by the error of the body rate, 1/s."""
    spread: tuple[float, float, float]
    """Thrust over mass that an angular acceleration about body x, y, z takes from either end of the thrust range, m."""
    rate_max: tuple[float, float, float]
    """The largest body rates that are commanded, rad/s."""

    def step(self, h: float) -> ResponseStep:
        """The answer over h s."""
        (kx, ky, kz), slow = self.gain, self.motor_time
        return ResponseStep(h, turning(kx, slow, h), turning(ky, slow, h), lag(1 / kz, h)[0], lag(slow, h)[0])

    @staticmethod
    def of(vehicle: Vehicle) -> "Response":
        """The response of a loaded vehicle."""
        low, high = vehicle.thrust_range
        arm_x, arm_y = (float(np.mean(np.abs(vehicle.rotor_position[:, i]))) for i in range(2))
        mass, (jx, jy, jz) = float(vehicle.mass), (float(j) for j in vehicle.inertia)
        gx, gy, gz = (float(g) for g in vehicle.rate_gain)
        rx, ry, rz = (float(r) for r in vehicle.body_rate_max)
        return Response(
            thrust=(float(vehicle.lift) * low / mass, float(vehicle.lift) * high / mass),
            motor_time=float(vehicle.motor_time_constant),
            gain=(gx, gy, gz),
            spread=(jx / (mass * arm_y), jy / (mass * arm_x), jz / (mass * float(vehicle.torque_ratio))),
            rate_max=(rx, ry, rz),
        )


@lru_cache(maxsize=4096)
def turning(gain: float, motor_time: float, h: float) -> tuple[float, float, float, float]:
    """The exact step of a rate loop with rotor lag. The matrix maps (rate error, acceleration) to their values after h
    s. `gain` is that of the rate loop, 1/s, and `motor_time` the time constant of the rotors, s.
    """
    m = np.array([[0.0, 1.0], [-gain / motor_time, -1.0 / motor_time]]) * (h / 64)
    total, term = np.eye(2), np.eye(2)
    for k in range(1, 9):
        term = term @ m / k
        total = total + term
    for _ in range(6):
        total = total @ total
    (a, b), (c, d) = total.tolist()
    return a, b, c, d


@lru_cache(maxsize=4096)
def lag(time_constant: float, h: float) -> tuple[float, float]:
    """The share of an error that a lag leaves after h s, and the mean of this share over that time."""
    left = float(np.exp(-h / time_constant))
    return left, (1 - left) * time_constant / h


def actuated(xp: Any, r: Response, a: Actuators, command: ForecastCommand, step: ResponseStep) -> Actuators:
    """The rotors after a step of a command. If a turn needs more than the rotors can give, the turn is slower."""
    (kx, ky, kz), (sx, sy, sz), (low, high) = r.gain, r.spread, r.thrust
    _, (ax, bx, cx, dx), (ay, by, cy, dy), left_z, left = step
    ex, ey, ez = a.wx - command.x, a.wy - command.y, a.wz - command.z
    angular, half = sx * kx * abs(ex) + sy * ky * abs(ey) + sz * kz * abs(ez) + 1e-9, 0.5 * (high - low)
    scale, angular = xp.minimum(half / angular, 1.0), xp.minimum(angular, half)
    ex, ey, ez = scale * ex, scale * ey, scale * ez
    root = xp.sqrt(xp.minimum(xp.maximum(command.thrust, low + angular), high - angular))
    root += left * (xp.sqrt(a.f) - root)
    return Actuators(
        a.wx - ex + ax * ex + bx * a.ax,
        a.wy - ey + ay * ey + by * a.ay,
        a.wz - ez + left_z * ez,
        cx * ex + dx * a.ax,
        cy * ey + dy * a.ay,
        root * root,
    )


def moved(
    xp: Any, r: Response, m: ForecastMotion, command: ForecastCommand, air: Residual, step: ResponseStep
) -> ForecastMotion:
    """The motion after a step of a command, so short that the attitude turns by only a fraction of a radian."""
    a = actuated(xp, r, Actuators(m.wx, m.wy, m.wz, m.ax, m.ay, m.f), command, step)
    h = step.h
    s = 0.25 * h
    tx, ty, tz = s * (m.wx + a.wx), s * (m.wy + a.wy), s * (m.wz + a.wz)  # half of the turn
    w, x, y, z = m.qw, m.qx, m.qy, m.qz
    qw = w - x * tx - y * ty - z * tz
    qx = x + w * tx + y * tz - z * ty
    qy = y + w * ty + z * tx - x * tz
    qz = z + w * tz + x * ty - y * tx
    n = 1.0 / xp.sqrt(qw * qw + qx * qx + qy * qy + qz * qz)
    qw, qx, qy, qz = qw * n, qx * n, qy * n, qz * n
    # the thrust along the mean of both axes
    f = 0.5 * air.share * (m.f + a.f)
    gx = f * (x * z + w * y + qx * qz + qw * qy) + air.x
    gy = f * (y * z - w * x + qy * qz - qw * qx) + air.y
    gz = f * (1.0 - x * x - y * y - qx * qx - qy * qy) + air.z - GRAVITY
    k = 0.5 * h * h
    return ForecastMotion(
        m.px + h * m.vx + k * gx, m.py + h * m.vy + k * gy, m.pz + h * m.vz + k * gz,
        m.vx + h * gx, m.vy + h * gy, m.vz + h * gz,
        qw, qx, qy, qz, a.wx, a.wy, a.wz, a.ax, a.ay, a.f,
    )  # fmt: skip


class GyroReading(NamedTuple):
    """A reading of the gyro, and how fast the rates change."""

    x: Number
    """Body rate about body x, rad/s."""
    y: Number
    z: Number
    known: Number
    """1.0: the change is known. 0.0: it is not."""
    ax: Number
    """Change of the body rate about body x, rad/s^2."""
    ay: Number


class Stretch(NamedTuple):
    """A command on its way, the step for which it acts, and the gyro's reading at its end. None: there is none."""

    command: ForecastCommand
    step: ResponseStep
    reading: GyroReading | None = None


def advanced(xp: Any, r: Response, m: ForecastMotion, air: Residual, stretch: Stretch) -> ForecastMotion:
    """The motion after a stretch."""
    return measured(xp, moved(xp, r, m, stretch.command, air, stretch.step), stretch.reading)


def measured(xp: Any, m: ForecastMotion, reading: GyroReading | None) -> ForecastMotion:
    """The motion with the body rates that the gyro has read, and with their change, where it is known."""
    if reading is None:
        return m
    known = reading.known > 0.0
    ax, ay = xp.where(known, reading.ax, m.ax), xp.where(known, reading.ay, m.ay)
    return m._replace(wx=reading.x, wy=reading.y, wz=reading.z, ax=ax, ay=ay)
