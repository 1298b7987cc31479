"""Vehicles whose structure is hidden from identification: the judge of `benchmarks/identify.py --plant structure`.

A body is the file's vehicle with other values and, each with probability one half, one more effect: another lag of
rotors that slow down; an integral part, a filter of the gyroscope and feed-forward in the rate loop; arms, a centre of
mass, rotors and products of inertia that are not the file's; drag of the rotors; a battery that sags; wind; gusts. It
flies in MuJoCo behind a rate loop and a mixer of this file. Neither shares code with the fit.
"""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.logs.recording import Stream
from e2efly.validation.flight_controller import Numbers
from e2efly.validation.plant import RigidState
from e2efly.validation.plants.mujoco import MujocoPlant
from e2efly.vehicles.vehicle import Vehicle

WIDTHS = {
    "mass": 0.2, "inertia": 0.3, "thrust_map": 0.12, "motor_time_constant": 0.4, "drag_linear": 0.5,
    "drag_quadratic": 0.5, "torque_ratio": 0.2, "rate_gain": 0.3,
}  # fmt: skip
"""Largest relative change of each value, drawn uniformly."""
DELAY = (0.02, 0.08)
"""Range of the delay from a command to the rate loop, s."""
SMOOTHED = (0.005, 0.02)
"""Range of the time constant of the filter of the commanded rates whose derivative the feed-forward takes, s."""

POWER = (1.5, 2.0)
"""Range of the power of a motor output that its thrust rises with."""


@dataclass(frozen=True)
class Body:
    """A hidden vehicle, and what its vehicle file cannot say. Zero: it does not have the effect."""

    vehicle: Vehicle
    share: np.ndarray
    """(4,) thrust of each rotor over that of the thrust map."""
    feed_forward: float = 0.0
    """Commanded angular acceleration over the derivative of the commanded rate."""
    smoothed: float = 0.01
    """Time constant of the filter of the commanded rates before that derivative, s."""
    rotor_drag: float = 0.0
    """Force across the rotor axes over the sum of the rotor speeds and the speed of the air, N s^2/(m rad)."""
    sag: float = 0.0
    """Share of the thrust that is lost by the end of the flight."""
    wind: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(3))
    """Mean wind, world, m/s."""
    gusts: float = 0.0
    """Standard deviation of the changing part of the wind, m/s an axis. It lasts a second."""

    @property
    def drag(self) -> np.ndarray:
        """(3,) linear drag with that of rotors at the speed of hover, N s/m."""
        rotors = 4 * self.vehicle.hover_rotor_speed * self.rotor_drag
        return np.asarray(self.vehicle.drag_linear) + rotors * np.array([1.0, 1.0, 0.0])


def parameters(vehicle: Vehicle, rng: np.random.Generator) -> Vehicle:
    """Other values of what the file says, without another structure."""
    changed: dict[str, Any] = {}
    for name, width in WIDTHS.items():
        value = np.asarray(getattr(vehicle, name), float)
        shape = () if name == "thrust_map" else value.shape
        changed[name] = value * (1 + width * rng.uniform(-1, 1, shape))
        while name == "inertia" and 2 * changed[name].max() > changed[name].sum():  # of no rigid body
            changed[name] = value * (1 + width * rng.uniform(-1, 1, shape))
    changed["rotor_thrust_max"] = vehicle.rotor_thrust_max * changed["thrust_map"][0] / vehicle.thrust_map[0]
    changed = {k: x if np.ndim(x) else float(x) for k, x in changed.items()}
    return dataclasses.replace(vehicle, **changed, latency=float(rng.uniform(*DELAY)))


def drawn(vehicle: Vehicle, rng: np.random.Generator) -> Body:
    """A body of the family: every structure with probability one half."""
    plain = parameters(vehicle, rng)

    def there(value: Any) -> Any:
        return value if rng.uniform() < 0.5 else None

    def around(width: float, *shape: int) -> np.ndarray:
        return width * rng.uniform(-1, 1, shape)

    root = np.sqrt(plain.inertia[[0, 0, 1]] * plain.inertia[[1, 2, 2]])
    angle = rng.uniform(0, 2 * math.pi)
    rotors = 0.5 * float(np.mean(plain.drag_linear[:2])) / (4 * plain.hover_rotor_speed)
    down = there(plain.motor_time_constant * rng.uniform(1.1, 1.8))
    integral = there(plain.rate_gain * rng.uniform(0.5, 4.0))
    gyro = there(rng.uniform(0.002, 0.006))
    forward = there(rng.uniform(0.3, 0.9))
    arms = there(1 + around(0.07, 2))
    centre = there(np.array([*around(0.005, 2), 0.0]))
    share = there(1 + around(0.04, 4))
    products = there(root * around(0.08, 3))
    rotor_drag = there(rotors * rng.uniform(0.5, 2.0))
    sag = there(rng.uniform(0.0, 0.08))
    wind = there(rng.uniform(0.5, 2.0) * np.array([math.cos(angle), math.sin(angle), 0.0]))
    gusts = there(rng.uniform(0.2, 0.6))
    return Body(
        dataclasses.replace(
            plain,
            rotor_position=plain.rotor_position * (1.0 if arms is None else arms),
            motor_time_constant_down=down,
            centre_of_mass=centre,
            inertia_products=products,
            rate_integral_gain=integral,
            gyro_time_constant=gyro,
        ),
        np.ones(4) if share is None else share,
        forward or 0.0,
        float(rng.uniform(*SMOOTHED)),
        rotor_drag or 0.0,
        sag or 0.0,
        np.zeros(3) if wind is None else wind,
        gusts or 0.0,
    )


class HiddenRateLoop:
    """The flight controller of a hidden body. It believes in the file's vehicle; gains and filter are the body's.

    Angular acceleration = K (wanted - seen) + integral of Ki (wanted - seen) + feed-forward times the derivative of the
    smoothed command. Torque = J of the file times that. Rotors are clipped after the collective is shifted.
    """

    def __init__(self, believed: Vehicle, body: Body) -> None:
        x, y = believed.rotor_position.T
        turns = np.stack([np.ones(4), y, -x, believed.rotor_spin * believed.torque_ratio])
        self._mix, self._low_high = np.linalg.inv(turns), believed.thrust_range
        self._mass, self._inertia = float(believed.mass), np.asarray(believed.inertia)
        flown = body.vehicle
        self._gain, self._limit = np.asarray(flown.rate_gain), np.asarray(believed.body_rate_max)
        self._integral_gain = np.zeros(3) if flown.rate_integral_gain is None else flown.rate_integral_gain
        self._filter, self._forward, self._smoothed = flown.gyro_time_constant, body.feed_forward, body.smoothed
        self.start([0.0, 0.0, 0.0])

    def start(self, body_rate: Numbers) -> None:
        """Settle."""
        self._seen, self._integral, self._smooth = np.array(body_rate), np.zeros(3), np.zeros(3)
        self.asked = np.full(4, self._mass * 9.81 / 4)
        """(4,) thrusts that were last asked for, N."""

    def thrusts(self, command: Numbers, pose: Numbers, motion: Numbers, dt: float) -> list[float]:
        """Thrusts of the rotors, N, for a command of mode ctbr."""
        rate = np.array(motion[3:])
        if self._filter is not None:
            self._seen = rate + (self._seen - rate) * math.exp(-dt / self._filter)
            rate = self._seen
        wanted = np.clip(command[1:], -self._limit, self._limit)
        change = (wanted - self._smooth) / self._smoothed
        self._smooth = wanted + (self._smooth - wanted) * math.exp(-dt / self._smoothed)
        error = wanted - rate
        most = self._gain * self._limit
        self._integral = np.clip(self._integral + self._integral_gain * error * dt, -most, most)
        torque = self._inertia * (self._gain * error + self._integral + self._forward * change)
        torque = torque + np.cross(rate, self._inertia * rate)
        low, high = self._low_high
        asked = self._mix @ np.array([self._mass * command[0], *torque])
        asked = asked + max(low - asked.min(), 0.0) - max(asked.max() - high, 0.0)
        self.asked = np.clip(asked, low, high)
        return self.asked.tolist()


class HiddenPlant(MujocoPlant):
    """MuJoCo with a hidden body, its rate loop, its wind and its rotors' drag."""

    name = "mujoco"

    def __init__(self, believed: Vehicle, body: Body, seed: int) -> None:
        self._hidden, self._rng = body, np.random.default_rng([seed, 77])
        self._power = float(np.random.default_rng([seed, 78]).uniform(*POWER))
        super().__init__(believed)

    def meet(self, body: Vehicle, plain_mixer: bool = False) -> None:
        """The hidden body, whatever is asked for."""
        super().meet(self._hidden.vehicle)
        self._controller: Any = HiddenRateLoop(self._believed, self._hidden)

    def reset(self, state: RigidState) -> None:
        """Put the vehicle into a state, in the mean wind."""
        self._lost, self._gust, self._time = np.ones(4), np.zeros(3), 0.0
        self._outputs: list[tuple[float, np.ndarray]] = []
        super().reset(state)

    def disturb(self, wind: np.ndarray, rotor_share: np.ndarray) -> None:
        """Only the shares of a sagging battery come from outside."""
        self._lost = rotor_share

    def step(self, command: np.ndarray, dt: float) -> None:
        """Hold a command, (4,), for `dt` s."""
        h, left = self._hidden, math.exp(-dt)
        self._gust = self._gust * left + h.gusts * math.sqrt(1 - left**2) * self._rng.standard_normal(3)
        wind = h.wind + self._gust
        super().disturb(wind, self._lost * h.share)
        away = self.state.velocity - wind
        up = _axis(self.state.quaternion)
        across = away - up * (up @ away)
        self.data.qfrc_applied[:3] = -h.rotor_drag * float(np.sum(self.data.act)) * across
        super().step(command, dt)
        self._time += dt
        self._outputs.append((self._time, self._controller.asked))

    def outputs(self) -> Stream:
        """The motor outputs of the flight, 0 to 1: the thrust that is asked for is their `POWER`."""
        time, asked = zip(*self._outputs, strict=True)
        top = self._believed.thrust_range[1]
        return Stream(np.array(time), (np.array(asked) / top) ** (1 / self._power))


def _axis(quaternion: Sequence[float]) -> np.ndarray:
    w, x, y, z = quaternion
    return np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])


def truths(body: Body, believed: Vehicle) -> Vehicle:
    """The vehicle that identification ought to find: what the hidden effects amount to in the values of a file.

    Thrust is that of the mean rotor. Inertia is over torque: relative to the arms of the file.
    """
    v = body.vehicle
    by_arm = np.asarray(believed.rotor_position)[0] / np.asarray(v.rotor_position)[0]  # x, y
    whole = np.array([by_arm[1], by_arm[0], 1.0])
    products = None if v.inertia_products is None else v.inertia_products * np.sqrt(whole[[0, 0, 1]] * whole[[1, 2, 2]])
    return dataclasses.replace(
        v,
        thrust_map=v.thrust_map * float(np.mean(body.share)),
        rotor_thrust_max=v.rotor_thrust_max * float(np.mean(body.share)),
        inertia=v.inertia * whole,
        inertia_products=products,
        drag_linear=body.drag,
    )
