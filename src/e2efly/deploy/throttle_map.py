"""From thrust to throttle: a map that learns in flight.

The vehicle file gives its shape: rotor speed rises linearly with the throttle from idle to full, thrust by the
vehicle's thrust map. What is learned is a factor on it, and how that falls with the battery's voltage, by recursive
least squares with forgetting on the specific force along body z that was measured some 40 ms after each throttle
(as in px4ctrl, which learns the one factor of a straight line).
"""

import dataclasses
import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from e2efly.vehicles.vehicle import GRAVITY, Vehicle

SCALE_RANGE = (0.5, 2.0)
"""Bounds of the learned factor."""
GAIN_RANGE = (0.0, 4.0)
"""Bounds of its relative change over the relative change of voltage: 2 where rotor speed follows the voltage."""
FORGETTING = 0.998
"""Weight of the past every hundredth of a second."""
SCALE_RATE = 0.25
"""Largest change of the factor that is used, 1/s: it never jumps."""
LOWEST_FORCE = 0.3 * GRAVITY
"""Measurements below are not learned from: drag and noise outweigh thrust."""
_DRIFT = np.diag([1e-6, 1e-8])
"""Added to the covariance an update: keeps it alive."""
_LARGEST = np.diag([0.05, 0.5])
"""Bound and start of the covariance: how far off the vehicle file may be (factor: 20 % rms; voltage gain: 0.7)."""


@dataclass(frozen=True)
class ThrottleMap:
    """Throttle (0: idle, 1: full) against specific force along body z, m/s^2. Make it with `ThrottleMap.of`."""

    mass: float
    thrust_map: tuple[float, float, float]
    """Thrust of a rotor over its speed: k2, k1, k0."""
    speed: tuple[float, float]
    """Rotor speed at idle and at full throttle, rad/s."""
    voltage: float
    """Volts a cell at which the factor holds."""
    scale: float = 1.0
    """The factor in use: it follows `learned` slowly."""
    learned: tuple[float, float] = (1.0, 2.0)
    """The factor at `voltage`, and its voltage gain, as the least squares have them."""
    covariance: tuple[tuple[float, float], tuple[float, float]] = ((0.05, 0.0), (0.0, 0.5))
    """Of `learned`."""
    updates: int = 0
    """Measurements learned from."""
    residual: float = 0.0
    """Smoothed root of the squared error of its predictions, m/s^2."""

    @staticmethod
    def of(vehicle: Vehicle, voltage: float = 3.9) -> "ThrottleMap":
        """The vehicle file's map, taken to hold at `voltage` V a cell."""
        k2, k1, k0 = (float(k) for k in vehicle.thrust_map)
        top = vehicle.thrust_range[1]
        full = (-k1 + math.sqrt(k1**2 + 4 * k2 * (top - k0))) / (2 * k2)
        return ThrottleMap(float(vehicle.mass), (k2, k1, k0), (float(vehicle.rotor_speed_min), full), voltage)

    def nominal(self, throttle: float) -> float:
        """Specific force, m/s^2, of a throttle by the vehicle file alone."""
        k2, k1, k0 = self.thrust_map
        idle, full = self.speed
        speed = idle + throttle * (full - idle)
        return 4 * max((k2 * speed + k1) * speed + k0, 0.0) / self.mass

    def force(self, throttle: float, voltage: float | None = None) -> float:
        """Specific force, m/s^2, of a throttle, as learned; voltage of a cell, None: unknown."""
        return self.nominal(throttle) * self._factor(voltage)

    def throttle(self, force: float, voltage: float | None = None) -> float:
        """The throttle in [0, 1] that gives a specific force, m/s^2: the inverse of `force`, saturating."""
        k2, k1, k0 = self.thrust_map
        idle, full = self.speed
        thrust = max(force, 0.0) / self._factor(voltage) * self.mass / 4
        inside = k1**2 + 4 * k2 * (thrust - k0)
        speed = (-k1 + math.sqrt(max(inside, 0.0))) / (2 * k2)
        return min(max((speed - idle) / (full - idle), 0.0), 1.0)

    def _factor(self, voltage: float | None) -> float:
        if voltage is None:
            return self.scale
        factor = self.scale * (1 + self.learned[1] * (voltage - self.voltage) / self.voltage)
        return min(max(factor, SCALE_RANGE[0] / 2), SCALE_RANGE[1] * 2)


def update(m: ThrottleMap, throttle: float, force: float, voltage: float | None, dt: float) -> ThrottleMap:
    """Learn from the specific force, m/s^2, that a throttle gave; what cannot be is not learned from.

    Args:
        m: the map.
        throttle: sent one delay before the measurement.
        force: measured along body z.
        voltage: of a cell, V; None: unknown, and the voltage gain is not learned.
        dt: since the last update, s: bounds the change of the factor in use.
    """
    nominal = m.nominal(throttle)
    if not math.isfinite(force) or force < LOWEST_FORCE or nominal < LOWEST_FORCE or force > 10 * nominal:
        return m
    change = 0.0 if voltage is None else (voltage - m.voltage) / m.voltage
    # force = scale * nominal + scale * gain * nominal * change: linear in (scale, scale * gain)
    theta = np.array([m.learned[0], m.learned[0] * m.learned[1]])
    row = np.array([nominal, nominal * change]) / GRAVITY
    error = force / GRAVITY - row @ theta
    covariance = np.array(m.covariance)
    forgetting = FORGETTING ** (100 * dt)
    gain = covariance @ row / (forgetting + row @ covariance @ row)
    theta = theta + gain * error
    covariance = (covariance - np.outer(gain, row @ covariance)) / forgetting + _DRIFT
    covariance = np.clip(covariance, -_LARGEST.max(), _LARGEST.max())
    covariance[[0, 1], [0, 1]] = np.minimum(np.diag(covariance), np.diag(_LARGEST))
    learned = float(np.clip(theta[0], *SCALE_RANGE))
    slope = float(np.clip(theta[1] / learned, *GAIN_RANGE)) if voltage is not None else m.learned[1]
    reach = SCALE_RATE * dt
    scale = m.scale + min(max(learned - m.scale, -reach), reach)
    rest = 0.99 * m.residual**2 + 0.01 * (error * GRAVITY) ** 2
    (a, b), (c, d) = covariance.tolist()
    return dataclasses.replace(
        m, scale=scale, learned=(learned, slope), covariance=((a, b), (c, d)), updates=m.updates + 1,
        residual=math.sqrt(rest),
    )  # fmt: skip


class ThrottleHistory:
    """The throttles that were sent, to be met with what they caused."""

    def __init__(self, seconds: float = 0.5) -> None:
        self._sent: deque[tuple[float, float]] = deque()
        self._seconds = seconds

    def add(self, time: float, throttle: float) -> None:
        """A throttle was sent at `time`, s."""
        self._sent.append((time, throttle))
        while self._sent and self._sent[0][0] < time - self._seconds:
            self._sent.popleft()

    def between(self, start: float, end: float) -> float | None:
        """The mean throttle in force from `start` to `end`, s; None: not known that far back."""
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
