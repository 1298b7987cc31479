"""The throttle map, from thrust to throttle, which is learned in flight.

The vehicle file gives the shape of the map: rotor speed rises linearly with the throttle from idle to full, and thrust
follows from the vehicle's thrust map. Two numbers are learned: a factor on this thrust, and how the factor falls with
the battery's voltage. They are learned from the specific force along body z that is measured some 40 ms after each
throttle. px4ctrl does this, too, but it learns only the factor of a straight line, by recursive least squares with
forgetting. Forgetting would lose the effect of the voltage, which becomes visible only over minutes. So here both
numbers are modelled as random walks, each with its own speed, and a Kalman filter follows them.
"""

import dataclasses
import json
import math
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.config.storage import finite, unique
from e2efly.config.tables import shown
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

SCALE_RANGE = (0.5, 2.0)
"""Bounds of the learned factor."""
GAIN_RANGE = (0.0, 4.0)
"""Bounds of the voltage gain: the relative change of the factor divided by the relative change of the voltage. It is 2
if rotor speed is proportional to the voltage."""
SCALE_RATE, GAIN_RATE = 0.25, 0.5
"""The fastest changes of the factor and of the voltage gain in use, 1/s. They never jump."""
LOWEST_FORCE = 0.3 * GRAVITY
"""Nothing is learned from a force below this, m/s^2, because drag and noise are then too large compared with thrust."""
BELIEVED = (0.25, 4.0)
"""A measurement is used only if the measured force divided by the nominal force is in this range."""
VOLTAGE_BELIEVED = (0.6, 1.4)
"""A voltage is trusted only if, divided by the voltage at which the factor holds, it is in this range."""
NOISE = 0.1
"""Standard deviation of the accelerometer's noise and of the errors of the map's model, in units of gravity."""
WANDER = np.diag([4e-6, 1e-5])
"""Growth of the variances of factor and voltage gain, 1/s. The filter follows the factor within 7 s, and the gain
within minutes."""
START = ((0.05, 0.0), (0.0, 0.5))
"""The first covariance, which is also its bound. It is the possible error of the vehicle file. Its standard deviation
is 20 % for the factor and 0.7 for the voltage gain."""
BLOWN = 3.0
"""With more force than this across the body, m/s^2, the air pushes so hard that the force along the body's z axis shows
little of the thrust."""
SATURATED = 0.9
"""Nothing is learned from a throttle above this: where motors reach their ends, the mixer takes thrust away."""
THRUST_DELAY = (0.015, 0.075)
"""The time between sending a throttle and the measured force that it causes, s: the delays of the link, the rate loop
and the motors."""
UNSTEADY = 0.15
"""If the throttle changed within this time before a force, s, it is less certain which throttle caused the force."""
_FIELDS = ("vehicle_hash", "voltage", "scale", "gain", "updates", "residual")


@dataclass(frozen=True)
class ThrottleMap:
    """The map between throttle (0: idle, 1: full) and specific force along body z, m/s^2. Make it with
    `ThrottleMap.of`.
    """

    vehicle_hash: str
    """Hash of the vehicle to which the map belongs."""
    mass: float
    """kg."""
    lift: float
    """Number of rotors, or `Vehicle.lift` of tilted ones."""
    thrust_map: tuple[float, float, float]
    """Thrust of a rotor as a polynomial of its speed: k2, k1, k0."""
    speed: tuple[float, float]
    """Rotor speed at idle and at full throttle, rad/s."""
    voltage: float
    """Volts per cell at which the factor holds."""
    scale: float = 1.0
    """The factor in use: it follows `learned` slowly."""
    gain: float = 2.0
    """The voltage gain in use: it follows `learned` slowly."""
    learned: tuple[float, float] = (1.0, 2.0)
    """The factor at `voltage` and the voltage gain, as the filter estimates them."""
    covariance: tuple[tuple[float, float], tuple[float, float]] = START
    """Covariance of `learned`."""
    last_voltage: float | None = None
    """The last voltage that was trusted, V per cell. None: none yet."""
    updates: int = 0
    """Number of measurements learned from."""
    residual: float = 0.0
    """Smoothed root mean square of the errors of its predictions, m/s^2."""

    @staticmethod
    def of(vehicle: Vehicle, voltage: float = 3.9) -> "ThrottleMap":
        """The map of the vehicle file, which is assumed to hold at `voltage`, V per cell."""
        k2, k1, k0 = (float(k) for k in vehicle.thrust_map)
        top = vehicle.thrust_range[1]
        full = (-k1 + math.sqrt(k1**2 + 4 * k2 * (top - k0))) / (2 * k2)
        idle = float(vehicle.rotor_speed_min)
        return ThrottleMap(vehicle.hash, float(vehicle.mass), float(vehicle.lift), (k2, k1, k0), (idle, full), voltage)

    @property
    def doubt(self) -> float:
        """The possible error of the map, as a share of the force: two standard deviations, plus the part of the learned
        change that is not yet in use.
        """
        scale, learned = self.scale, self.learned[0]
        return (2 * math.sqrt(self.covariance[0][0]) + abs(learned - scale)) / scale

    def nominal(self, throttle: float) -> float:
        """Specific force of a throttle from the vehicle file alone, m/s^2."""
        k2, k1, k0 = self.thrust_map
        idle, full = self.speed
        speed = idle + throttle * (full - idle)
        return self.lift * max((k2 * speed + k1) * speed + k0, 0.0) / self.mass

    def force(self, throttle: float, voltage: float | None = None) -> float:
        """Specific force of a throttle from the learned map, m/s^2.

        `voltage` is that of a cell, V. None: the last known voltage is used.
        """
        return self.nominal(throttle) * self._factor(voltage)

    def expected(self, throttle: float, voltage: float | None = None) -> tuple[float, float]:
        """Specific force of a throttle, and its possible error, m/s^2."""
        force = self.force(throttle, voltage)
        return force, force * self.doubt

    def throttle(self, force: float, voltage: float | None = None) -> float:
        """The throttle that gives a specific force, m/s^2: the inverse of `force`, limited to [0, 1]."""
        k2, k1, k0 = self.thrust_map
        idle, full = self.speed
        thrust = max(force, 0.0) / self._factor(voltage) * self.mass / self.lift
        inside = k1**2 + 4 * k2 * (thrust - k0)
        speed = (-k1 + math.sqrt(max(inside, 0.0))) / (2 * k2)
        return min(max((speed - idle) / (full - idle), 0.0), 1.0)

    def change(self, voltage: float | None) -> float:
        """Relative difference from the voltage at which the factor holds. If the voltage is not plausible, the last
        plausible one is used.
        """
        believed = voltage if _believed(self, voltage) else self.last_voltage
        return 0.0 if believed is None else believed / self.voltage - 1

    def _factor(self, voltage: float | None) -> float:
        factor = self.scale * (1 + self.gain * self.change(voltage))
        return min(max(factor, SCALE_RANGE[0] / 2), SCALE_RANGE[1] * 2)


def _believed(m: ThrottleMap, voltage: float | None) -> bool:
    return voltage is not None and VOLTAGE_BELIEVED[0] < voltage / m.voltage < VOLTAGE_BELIEVED[1]


def update(
    m: ThrottleMap, throttle: float, force: float, voltage: float | None, dt: float, swing: float = 0.0
) -> ThrottleMap:
    """Learn from the specific force, m/s^2, that a throttle gave. Nothing is learned from an implausible force.

    Args:
        m: the map.
        throttle: the throttle that was sent one delay before the measurement.
        force: the force measured along body z, m/s^2.
        voltage: of a cell, V. None: unknown; the last known voltage is used.
        dt: time since the last update, s.
        swing: the range, largest minus smallest, of the throttles that may have caused the force.
    """
    nominal = m.nominal(throttle)
    believed = force >= LOWEST_FORCE <= nominal and BELIEVED[0] * nominal < force < BELIEVED[1] * nominal
    if not (believed and 0 < dt < math.inf):  # true for NaN
        return m
    dt = min(dt, 0.1)
    change, (scale, gain) = m.change(voltage), m.learned
    row = np.array([1 + gain * change, scale * change]) * (nominal / GRAVITY)
    error = (force - scale * nominal * (1 + gain * change)) / GRAVITY
    covariance = np.array(m.covariance) + WANDER * dt
    unsure = (m.nominal(throttle + swing / 2) - m.nominal(max(throttle - swing / 2, 0.0))) / GRAVITY
    k = covariance @ row / (NOISE**2 + unsure**2 + row @ covariance @ row)
    covariance = covariance - np.outer(k, row @ covariance)
    shrink = np.sqrt(np.minimum(np.diag(START) / np.diag(covariance), 1.0))
    (a, b), (c, d) = (covariance * np.outer(shrink, shrink)).tolist()
    scale = min(max(scale + float(k[0]) * error, SCALE_RANGE[0]), SCALE_RANGE[1])
    gain = min(max(gain + float(k[1]) * error, GAIN_RANGE[0]), GAIN_RANGE[1])
    return dataclasses.replace(
        m,
        scale=_towards(m.scale, scale, SCALE_RATE * dt),
        gain=_towards(m.gain, gain, GAIN_RATE * dt),
        learned=(scale, gain),
        covariance=((a, b), (c, d)),
        last_voltage=voltage if _believed(m, voltage) else m.last_voltage,
        updates=m.updates + 1,
        residual=math.sqrt(0.99 * m.residual**2 + 0.01 * (error * GRAVITY) ** 2),
    )


def learn(
    m: ThrottleMap, throttle: float, force: np.ndarray, voltage: float | None, dt: float, swing: float = 0.0
) -> ThrottleMap:
    """`update` with a specific force (3,), body FLU, m/s^2, unless the air pushes hard across the body."""
    blown = math.hypot(force[0], force[1]) > BLOWN
    return m if blown or throttle + swing / 2 > SATURATED else update(m, throttle, float(force[2]), voltage, dt, swing)


def _towards(value: float, goal: float, reach: float) -> float:
    return value + min(max(goal - value, -reach), reach)


def as_json(m: ThrottleMap) -> str:
    """What was learned, as JSON. It is saved with the flight, and the next flight can use it."""
    values = (m.vehicle_hash, m.voltage, *m.learned, m.updates, m.residual)
    return json.dumps(finite(dict(zip(_FIELDS, values, strict=True))), indent=2)


def from_json(text: str, vehicle: Vehicle) -> ThrottleMap:
    """The map of a vehicle with what an earlier flight learned. This flight continues learning from there.

    Raises:
        ValueError: a field is not valid, or the map is that of another vehicle. The message names the field, the value
            and what is accepted.
    """
    try:
        values = json.loads(text, object_pairs_hook=unique)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"throttle map: not JSON: {error}") from None
    if not isinstance(values, dict) or set(values) != set(_FIELDS):
        found = ", ".join(map(str, values)) if isinstance(values, dict) else type(values).__name__
        raise ValueError(f"throttle map: it has {found}; accepted: an object with {', '.join(_FIELDS)}")
    if values["vehicle_hash"] != vehicle.hash:
        raise _refusal("vehicle_hash", values["vehicle_hash"], f"{vehicle.hash!r}, that of {vehicle.name!r}")
    ranges = {"voltage": (2.0, 5.0), "scale": SCALE_RANGE, "gain": GAIN_RANGE, "residual": (0.0, 100.0)}
    numbers = {}
    for name, (low, high) in ranges.items():
        value = values[name]
        if type(value) not in (int, float) or not low <= value <= high:
            raise _refusal(name, value, f"{low:g} to {high:g}")
        numbers[name] = float(value)
    if type(values["updates"]) is not int or values["updates"] < 0:
        raise _refusal("updates", values["updates"], "a whole number, 0 or more")
    learned = numbers["scale"], numbers["gain"]
    fresh = ThrottleMap.of(vehicle, numbers.pop("voltage"))
    return dataclasses.replace(fresh, **numbers, learned=learned, updates=values["updates"])


def _refusal(name: str, value: Any, accepted: str) -> ValueError:
    return ValueError(f"throttle map: {name} is {shown(value)}; accepted: {accepted}")


class ThrottleHistory:
    """The throttles that were sent. They are matched with the forces that they caused."""

    def __init__(self, seconds: float = 5.0) -> None:
        self._sent: deque[tuple[float, float]] = deque()
        self._seconds = seconds

    def add(self, time: float, throttle: float) -> None:
        """Add a throttle that was sent at `time`, s."""
        self._sent.append((time, throttle))
        while self._sent and self._sent[0][0] < time - self._seconds:
            self._sent.popleft()

    def felt(self, moment: float) -> float | None:
        """The mean throttle that caused the force at a moment, s. None: not known."""
        return self.between(moment - THRUST_DELAY[1], moment - THRUST_DELAY[0])

    def swing(self, moment: float) -> float:
        """The range, largest minus smallest, of the throttles from `UNSTEADY` before a moment, s, up to it."""
        known = []
        for time, throttle in reversed(self._sent):
            if time <= moment:
                known.append(throttle)
            if time <= moment - UNSTEADY:
                break
        return max(known) - min(known) if known else 0.0

    def between(self, start: float, end: float) -> float | None:
        """The mean throttle in effect from `start` to `end`, s. None: it is not known that far back."""
        if not self._sent or self._sent[0][0] > start:
            return None
        total, until = 0.0, end
        for time, throttle in reversed(self._sent):
            begin = max(time, start)
            if begin < until:
                total += throttle * (until - begin)
                until = begin
            if time <= start:
                break
        return total / (end - start)
