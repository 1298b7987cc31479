"""Betaflight's settings with which its rate loop answers as a vehicle file says.

The file's loop commands the angular acceleration K (wanted - rate), with K = `rate_gain`, and the rotors follow with
their lag. Betaflight adds P error + I integral - D slope to the motor outputs of one side and takes it from the other.
A motor output u turns a rotor at idle + u (full - idle), so about hover a torque output of 1 accelerates the body by
A = (sum of |arm| dF/du) / J, and P = K / A. The firmware's filters and its own period delay the rate by T, which takes
K T of damping. D gives it back: D = K T / A. The numbers hold at hover. At another throttle the loop is faster or
slower with the rotor speed, which the file's loop is not.
"""

from dataclasses import dataclass
from math import degrees

import numpy as np

from e2efly.flight.betaflight.mixers import mixer_of
from e2efly.flight.betaflight.rates import AXES
from e2efly.flight.betaflight.versions import Release
from e2efly.vehicles.vehicle import Vehicle, allocation_matrix

UNITS = np.array([0.032029, 0.244381, 0.000529]) * degrees(1) / 1000
"""A motor output for P = 1 and an error of 1 rad/s, I = 1 and 1 rad, D = 1 and 1 rad/s^2 (betaflight: `pid.h`)."""
LARGEST = 250
"""The largest P, I and D that the firmware takes."""
DELAY_S = 0.005
"""T, s: the low-passes of the gyro and of the D term with the firmware's defaults, and its period."""
INTEGRAL = 0.05
"""I / P, in units of K, for a file without `rate_integral_gain`: so slow that little but a lasting torque shows it."""


@dataclass(frozen=True)
class RateGains:
    """The rate loop of a controller for one vehicle."""

    pid: tuple[tuple[int, int, int], ...]
    """P, I, D of roll, pitch and yaw."""
    idle: float
    """Motor output of an idling rotor, 0 to 1: `rotor_speed_min` over the speed at full output."""


def gains_of(vehicle: Vehicle) -> RateGains:
    """The gains that a vehicle file asks for, as whole numbers that the firmware takes."""
    gain, integral = vehicle.rate_gain, vehicle.rate_integral_gain
    wanted = np.stack([gain, INTEGRAL * gain**2 if integral is None else integral, gain * _delay(vehicle)], axis=1)
    rows = np.clip(np.rint(wanted / authority_of(vehicle)[:, None] / UNITS), (1, 0, 0), LARGEST).astype(int).tolist()
    return RateGains(tuple((p, i, d) for p, i, d in rows), float(vehicle.rotor_speed_min) / vehicle.full_rotor_speed)


def authority_of(vehicle: Vehicle) -> np.ndarray:
    """(3,) angular acceleration about x, y and z for a torque output of 1, at hover, rad/s^2."""
    k2, k1, _ = vehicle.thrust_map
    slope = (2 * k2 * vehicle.hover_rotor_speed + k1) * (vehicle.full_rotor_speed - vehicle.rotor_speed_min)
    return slope * np.abs(allocation_matrix(vehicle)[1:] * mixer_of(vehicle).shares).sum(1) / vehicle.inertia


def rate_gain_of(vehicle: Vehicle, pid: tuple[tuple[int, int, int], ...]) -> list[float]:
    """`rate_gain` about each axis, 1/s, of a controller with these P, I, D: D slows what P commands."""
    p, _, d = (np.array(pid) * UNITS * authority_of(vehicle)[:, None]).T
    return (p / (1 + np.maximum(d - _delay(vehicle) * p, 0.0))).tolist()


def _delay(vehicle: Vehicle) -> float:
    """The part of `DELAY_S` that the file's own loop does not have, s."""
    return max(DELAY_S - (vehicle.gyro_time_constant or 0.0), 0.0)


def axis_lines(axis: str, pid: tuple[int, int, int], release: Release) -> tuple[str, ...]:
    """The lines of the controller's command line that set P, I, D of an axis of `AXES`, and let D be."""
    lines = (f"set {term}_{axis}={value}" for term, value in zip("pid", pid, strict=True))
    return (*lines, f"set {release.d_boost}_{axis}=0")


def gain_lines(gains: RateGains, release: Release) -> tuple[str, ...]:
    """The lines of the command line for all of a rate loop: also what would change the gains in flight is off."""
    return (
        *(line for axis, pid in zip(AXES, gains.pid, strict=True) for line in axis_lines(axis, pid, release)),
        "set anti_gravity_gain=0",
        "set tpa_rate=0",
        "set pidsum_limit=1000",
        "set pidsum_limit_yaw=1000",
        *release.idle_lines(gains.idle),
    )
