"""The flight controller of a plant that simulates none: rate loop and mixer on plain numbers, float64. Imports no JAX.

On plain numbers it is four times as fast as on arrays of three. This matters at a thousand calls per second.
"""

import math
from collections.abc import Sequence

from e2efly.control import COMMAND_MODES, Quat, Vec3
from e2efly.control.allocation import Allocation, ThrustLimits, nearest, shifted
from e2efly.validation.plant import PlantMotion
from e2efly.vehicles.vehicle import MixerRule, Vehicle, inertia_tensor

Numbers = Sequence[float]


class FlightController:
    """Maps commands to rotor thrusts, for the vehicle to which it is tuned."""

    def __init__(self, vehicle: Vehicle, command_mode: str, plain_mixer: bool = False) -> None:
        """Make the controller, tuned to a vehicle, for a mode of `COMMAND_MODES`.

        Call `start` before the first `thrusts`.

        Raises:
            KeyError: for an unknown command mode.
        """
        mode = COMMAND_MODES[command_mode]
        self._vehicle, self._by_rates, self._controller = vehicle, command_mode == "ctbr", mode.controller
        self._low, self._high = vehicle.thrust_range
        self._of_largest, self._full = mode.of_largest, vehicle.full_rotor_speed
        self._loop = PlainRateLoop(vehicle, plain_mixer)

    def start(self, body_rate: Numbers) -> None:
        """Reset the integrals and settle the filter of the body rates."""
        self._loop.start(body_rate)

    def thrusts(self, command: Numbers, pose: Numbers, motion: Numbers, dt: float) -> list[float]:
        """Thrusts of the rotors, N.

        Args:
            command: in the units of the command mode.
            pose: position and quaternion.
            motion: velocity in the world and body rates.
            dt: time since the last call, s.
        """
        if self._controller is None:
            return [min(max(self._thrust(x), self._low), self._high) for x in command]
        if not self._by_rates:
            known = PlantMotion(Vec3(*pose[:3]), Vec3(*motion[:3]), Quat(*pose[3:]))
            wanted = self._controller(self._vehicle, known, (command[0], command[1], command[2], command[3]))
            command = [float(x) for x in (wanted.thrust, wanted.rate.x, wanted.rate.y, wanted.rate.z)]
        return self._loop.thrusts(command, motion[3:], dt)

    def _thrust(self, command: float) -> float:
        """Thrust that a rotor's command asks for, N."""
        if self._of_largest == "speed":
            return self._vehicle.rotor_thrust(max(command, 0.0) * self._full)
        return command * self._high if self._of_largest == "thrust" else command


class PlainRateLoop:
    """The rate loop and the mixer, from collective thrust over mass, m/s^2, and body rates, rad/s, to rotor thrusts.

    torque = J (K (wanted - w) + integral) + w x J w at the filtered body rates w. The mixer follows the rule of the
    vehicle file (`e2efly.control.allocation`). A plain mixer clips each rotor by itself instead.
    """

    def __init__(self, vehicle: Vehicle, plain_mixer: bool = False) -> None:
        self._plain, self._mass = plain_mixer, float(vehicle.mass)
        (jx, xy, xz), (_, jy, yz), (*_, jz) = inertia_tensor(vehicle).tolist()
        self._inertia = jx, jy, jz, xy, xz, yz
        self._gains, self._limits = vehicle.rate_gain.tolist(), vehicle.body_rate_max.tolist()
        found = Allocation.of(vehicle)
        self._rule: MixerRule = found.rule
        self._rows = found.matrix.tolist()
        self._descent, self._pull = ([] if x is None else x.tolist() for x in (found.descent, found.pull))
        self._thrust_limits = ThrustLimits(*vehicle.thrust_range, larger=max, smaller=min)
        gain, time = vehicle.rate_integral_gain, vehicle.gyro_time_constant
        self._integral_gains = None if gain is None else gain.tolist()
        self._largest = [k * rate for k, rate in zip(self._gains, self._limits, strict=True)]
        self._filter = None if time is None else float(time)
        self.start([0.0, 0.0, 0.0])

    def start(self, body_rate: Numbers) -> None:
        """Reset the integrals and settle the filter of the body rates."""
        self._integral, self._seen, self._last = [0.0, 0.0, 0.0], list(body_rate), list(body_rate)
        self._error: Numbers | None = None

    def thrusts(self, command: Numbers, body_rate: Numbers, dt: float) -> list[float]:
        """Thrusts of the rotors, N, for a command of thrust and rates, `dt` s after the last one."""
        if self._filter is not None:
            left = math.exp(-dt / self._filter)
            means = [(before + now) / 2 for before, now in zip(self._last, body_rate, strict=True)]
            self._last = list(body_rate)
            self._seen = body_rate = [w + (old - w) * left for old, w in zip(self._seen, means, strict=True)]
        errors = [
            min(max(wanted, -limit), limit) - rate
            for wanted, limit, rate in zip(command[1:], self._limits, body_rate, strict=True)
        ]
        asked = [k * error for k, error in zip(self._gains, errors, strict=True)]
        if self._integral_gains is not None:
            before, self._error = errors if self._error is None else self._error, errors
            means = [(a + b) / 2 for a, b in zip(before, errors, strict=True)]
            self._integral = [
                min(max(now + k * error * dt, -most), most)
                for now, k, error, most in zip(self._integral, self._integral_gains, means, self._largest, strict=True)
            ]
            asked = [a + now for a, now in zip(asked, self._integral, strict=True)]
        return self._mixed(self._mass * command[0], self._torque(asked, body_rate))

    def _torque(self, asked: Numbers, body_rate: Numbers) -> tuple[float, float, float]:
        """J times the commanded angular acceleration, and w x J w, N*m."""
        (jx, jy, jz, xy, xz, yz), (a, b, c), (p, q, r) = self._inertia, asked, body_rate
        hx, hy, hz = jx * p + xy * q + xz * r, xy * p + jy * q + yz * r, xz * p + yz * q + jz * r
        return (
            jx * a + xy * b + xz * c + q * hz - r * hy,
            xy * a + jy * b + yz * c + r * hx - p * hz,
            xz * a + yz * b + jz * c + p * hy - q * hx,
        )

    def _mixed(self, collective: float, torque: tuple[float, float, float]) -> list[float]:
        plain, limits = 1.0 if self._plain else None, self._thrust_limits
        wrench = collective, *torque
        if self._descent:
            return list(nearest((self._rows, self._descent, self._pull), wrench, limits, plain))
        return list(shifted(self._rule, self._rows, wrench, limits, plain))


def rotor_speed_of(thrust_map: Numbers, thrusts: Numbers) -> list[float]:
    """The rotor speeds, rad/s, that give thrusts, N: the rising branch of the map k2 W^2 + k1 W + k0."""
    k2, k1, k0 = thrust_map
    return [(math.sqrt(k1 * k1 + 4 * k2 * (f - k0)) - k1) / (2 * k2) for f in thrusts]
