"""The controllers for take-off, hover and landing, and the conversion of a policy's commands to body rates."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from e2efly.control import COMMAND_MODES, Ctbr, Quat, Vec3
from e2efly.flight.attitude import Attitude
from e2efly.policy.odometry import Odometry
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

LEVEL_GAIN = 4.0
"""Body rate divided by tilt in a blind descent, 1/s."""
LEVEL_RATE = 3.0
"""The largest body rate in a blind descent, rad/s."""
SINK_SPEED, SINK_ACCELERATION = 0.55, 3.0
"""A blind descent first reaches this speed, m/s, with this acceleration, m/s^2 ..."""
SINK_THRUST = 0.95
"""... and then continues with this share of the weight. It must sink, whatever the last error of the throttle map."""
SINK_FASTER = 0.2
"""Rate at which the sink speed grows, m/s^2. It is larger than the error of a throttle map, so that the vehicle always
sinks."""
SLOWEST_SINK, SLOWEST_FASTER = 0.5, 0.07
"""The slowest possible sink speed, m/s, and its slowest growth, m/s^2. The time to the ground is estimated with
them."""
LIFTED = 0.12
"""Height over the ground above which the vehicle counts as flying. Below it, nothing is learned and no tilt is
commanded."""


@dataclass(frozen=True)
class FlightMotion:
    """The parts of an odometry, as the controllers use them."""

    position: Vec3
    velocity: Vec3
    attitude: Quat

    @staticmethod
    def of(odometry: Odometry) -> "FlightMotion":
        """The motion of an odometry."""
        return FlightMotion(Vec3(*odometry.position), Vec3(*odometry.velocity), Quat(*odometry.quaternion))


def flight_gains(vehicle: Vehicle, latency: float) -> Vehicle:
    """The vehicle with gains that suit a latency.

    In the simulator, the attitude loop runs in the flight controller, without delay. Here it is closed over the link. A
    loop with bandwidth k and delay T loses k T of phase. The attitude loop is limited to half a radian of this loss,
    the velocity loop to a third of the attitude loop's bandwidth, and the position loop to 0.4 of the velocity loop's.
    `latency` is the time from the motion to the body-rate setpoint, s.
    """
    slowest = latency + 1 / float(np.min(vehicle.rate_gain[:2]))
    attitude = np.minimum(vehicle.attitude_gain, 0.5 / slowest)
    # vertically there is no attitude loop in between, only the motors, as slow as the rate loop
    velocity = np.minimum(vehicle.velocity_gain, [attitude[0] / 3, attitude[0] / 3, 0.5 / slowest])
    position = np.minimum(vehicle.position_gain, 0.4 * velocity)
    return dataclasses.replace(vehicle, attitude_gain=attitude, velocity_gain=velocity, position_gain=position)


def controlled(vehicle: Vehicle, mode: str, odometry: Odometry, command: tuple[float, ...] | np.ndarray) -> Ctbr:
    """The CTBR command for a command of a mode that has a controller, from the simulator's own cascade."""
    a, b, c, d = (np.float64(x) for x in command)
    controller = COMMAND_MODES[mode].controller
    assert controller is not None
    return controller(vehicle, FlightMotion.of(odometry), (a, b, c, d))


def blind(attitude: Attitude | None, elapsed: float, climb: float = 0.0) -> Ctbr:
    """Level by the controller's own attitude, and sink. Without any attitude, the body rates are zero. `elapsed` is the
    time since the descent began, s. `climb` is the vertical speed when it began, m/s. A climb is stopped, and a fall is
    slowed, first.
    """
    thrust = SINK_THRUST * GRAVITY
    if elapsed < sink_time(climb):
        thrust = GRAVITY - math.copysign(SINK_ACCELERATION, climb + SINK_SPEED)
    if attitude is None:
        return Ctbr(thrust, Vec3(0.0, 0.0, 0.0))
    tilt = max(math.cos(attitude.roll) * math.cos(attitude.pitch), 0.5)
    return Ctbr(thrust / tilt, Vec3(_levelling(attitude.roll), _levelling(attitude.pitch), 0.0))


def rates_of(command: Ctbr) -> tuple[float, float, float]:
    """The body rates of a command, rad/s."""
    return float(command.rate.x), float(command.rate.y), float(command.rate.z)


def _levelling(angle: float) -> float:
    return max(-LEVEL_RATE, min(LEVEL_RATE, -LEVEL_GAIN * angle))


def sink_time(climb: float = 0.0) -> float:
    """The time that a blind descent that begins with a vertical speed, m/s, takes to reach its own speed, s."""
    return abs(climb + SINK_SPEED) / SINK_ACCELERATION


def blind_time(height: float, climb: float = 0.0) -> float:
    """The time after which a blind descent from a height, m, has surely ended, s. The throttle is then closed."""
    up = max(climb, 0.0)
    top = max(height, 0.0) + up**2 / (2 * SINK_ACCELERATION)
    sinking = (math.sqrt(SLOWEST_SINK**2 + 2 * SLOWEST_FASTER * top) - SLOWEST_SINK) / SLOWEST_FASTER
    return 1.8 + up / SINK_ACCELERATION + sinking
