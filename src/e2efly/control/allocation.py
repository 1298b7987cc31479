"""The mixer: from collective thrust and torque to the thrusts of N rotors. One implementation for simulator and flight.

Every number may be a number or an array of the batch's shape, from NumPy or JAX. A vehicle file names the rule
(`e2efly.vehicles.vehicle.MixerRule`) by which thrusts are kept inside of their limits.
"""

import itertools
import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np

from e2efly.control.vectors import Array
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import MixerRule, Vehicle, allocation_matrix, rotor_arms

TILT, THRUST, YAW = 10.0, 1.0, 0.3
"""Weights of the squared errors of the rule `qp`: of tilt torque divided by weight times mean arm, of collective thrust
divided by weight, and of yaw torque divided by weight times the mean yaw torque of a rotor that pushes by one newton
(`torque_ratio`, unless rotors are tilted)."""
STEPS = 10
"""Steps of the rule `qp`: accelerated projected gradient descent (Y. Nesterov, 1983; A. Beck and M. Teboulle, 2009)."""
EVEN = 1e-9
"""Relative difference of the rotors' shares of pure thrust below which one shift for all of them is pure thrust."""
Rows = Sequence[Sequence[Array]]
Choice = Callable[[Array, Array], Array]


def _momenta() -> list[float]:
    """The momentum of each step, by Nesterov's sequence."""
    found, pace = [], 1.0
    for _ in range(STEPS):
        following = (1 + math.sqrt(1 + 4 * pace**2)) / 2
        found.append((pace - 1) / following)
        pace = following
    return found


MOMENTA = _momenta()


def _dot(row: Sequence[Array], values: Sequence[Array]) -> Array:
    return reduce(operator.add, (a * b for a, b in zip(row, values, strict=True)))


def _repeat(step: Callable[[Any, Any], Any], first: Any, numbers: Sequence[float]) -> Any:
    return reduce(step, numbers, first)


@dataclass(frozen=True)
class Allocation:
    """What a mixer knows of its vehicle."""

    rule: MixerRule
    """`shift` only where it differs from `betaflight`."""
    matrix: np.ndarray
    """(N, 4): thrusts, N, of smallest norm from [collective, N; roll, pitch, yaw torque, N*m]."""
    descent: np.ndarray | None = None
    """(N, N): a gradient step of the rule `qp` is descent @ thrusts + pull @ wrench."""
    pull: np.ndarray | None = None
    """(N, 4)."""

    @staticmethod
    def of(vehicle: Vehicle) -> "Allocation":
        """The allocation of a loaded vehicle."""
        wrench = allocation_matrix(vehicle)
        matrix = np.linalg.inv(wrench) if vehicle.rotor_count == 4 else np.linalg.pinv(wrench)
        if vehicle.mixer_rule != "qp":
            pure = matrix[:, 0]
            even = vehicle.mixer_rule == "betaflight" or np.ptp(pure) <= EVEN * np.max(pure)
            return Allocation("betaflight" if even else "shift", matrix)
        weight, arm = vehicle.mass * GRAVITY, np.mean(np.linalg.norm(rotor_arms(vehicle), axis=1))
        units = weight * np.array([1.0, arm, arm, np.mean(np.abs(wrench[3]))])
        weighted = wrench.T * (np.array([THRUST, TILT, TILT, YAW]) / units**2)
        steepest = np.linalg.eigvalsh(weighted @ wrench)[-1]
        return Allocation("qp", matrix, np.eye(len(matrix)) - weighted @ wrench / steepest, weighted / steepest)


@dataclass(frozen=True)
class ThrustLimits:
    """The limits of a rotor's thrust, N, and how two values are compared: `max`, `min` of numbers or of arrays."""

    low: Any
    high: Any
    larger: Choice
    smaller: Choice

    def clip(self, thrusts: Sequence[Array]) -> tuple[Array, ...]:
        """Each thrust inside of the limits."""
        return tuple(self.smaller(self.larger(f, self.low), self.high) for f in thrusts)

    def largest(self, values: Sequence[Array]) -> Array:
        """The largest of the values."""
        return reduce(self.larger, values)

    def smallest(self, values: Sequence[Array]) -> Array:
        """The smallest of the values."""
        return reduce(self.smaller, values)


def nearest(
    matrices: tuple[Rows, Rows, Rows],
    wrench: Sequence[Array],
    limits: ThrustLimits,
    plain: Array | None = None,
    repeat: Callable[..., Any] = _repeat,
) -> tuple[Array, ...]:
    """Thrusts of the rotors by the rule `qp`, N: the least weighted squared error of the wrench inside of the limits.

    A wrench that the thrusts of smallest norm give inside of the limits is given exactly.

    Args:
        matrices: matrix, descent and pull of the `Allocation`, row by row.
        wrench: collective thrust, N, and roll, pitch and yaw torque, N*m.
        limits: the limits of each thrust.
        plain: 1: each rotor is clipped by itself. 0 or None: the rule is followed.
        repeat: (step, first, numbers) -> what `step` makes of `first`, called with one number after the other.
            `jax.lax.scan` compiles one step in place of all.
    """
    matrix, descent, pull = matrices
    first = limits.clip([_dot(row, wrench) for row in matrix])
    drawn = [_dot(row, wrench) for row in pull]

    def step(thrusts: tuple[tuple[Array, ...], tuple[Array, ...]], momentum: Array) -> Any:
        now, ahead = thrusts
        after = limits.clip([_dot(row, ahead) + more for row, more in zip(descent, drawn, strict=True)])
        return after, tuple(new + momentum * (new - old) for new, old in zip(after, now, strict=True))

    found, _ = repeat(step, (first, first), MOMENTA)
    if plain is None:
        return found
    return limits.clip([f + (1 - plain) * (best - f) for f, best in zip(first, found, strict=True)])


def shifted(
    rule: MixerRule, rows: Rows, wrench: Sequence[Array], limits: ThrustLimits, plain: Array | None = None
) -> tuple[Array, ...]:
    """Thrusts of the rotors by the rules `shift` and `betaflight`, N: attitude has priority over thrust.

    If the torque needs a larger span than a rotor has, the whole torque is scaled down. Then the collective thrust is
    shifted until every rotor is inside its limits. A wrench that rotors can give is given exactly, but by the rule
    `betaflight` on a lopsided frame.

    Args:
        rule: the rule of the `Allocation`.
        rows: the rows of its matrix.
        wrench: collective thrust, N, and roll, pitch and yaw torque, N*m.
        limits: the limits of each thrust.
        plain: 1: each rotor is clipped by itself. 0 or None: the rule is followed.
    """
    spread = [row[1] * wrench[1] + row[2] * wrench[2] + row[3] * wrench[3] for row in rows]
    if rule == "shift":
        return _along_pure_thrust(rows, spread, wrench[0], limits, plain)
    available = limits.high - limits.low
    scale = available / limits.larger(limits.largest(spread) - limits.smallest(spread), available)
    if plain is not None:
        scale = scale + (1 - scale) * plain
    asked = [row[0] * wrench[0] + scale * s for row, s in zip(rows, spread, strict=True)]
    shift = limits.larger(limits.low - limits.smallest(asked), 0.0)
    shift = shift - limits.larger(limits.largest(asked) - limits.high, 0.0)
    if plain is not None:
        shift = shift * (1 - plain)
    return limits.clip([f + shift for f in asked])


def _along_pure_thrust(
    rows: Rows, spread: Sequence[Array], collective: Array, limits: ThrustLimits, plain: Array | None
) -> tuple[Array, ...]:
    """The rule `shift`, by which the shift is pure thrust.

    Rotor i is inside of its limits for collective thrusts between (low - scale spread_i) / pure_i and
    (high - scale spread_i) / pure_i. `scale` is the largest share of the torque with which these ranges of all rotors
    meet.
    """
    low, high, pure = limits.low, limits.high, [row[0] for row in rows]
    turns = [s / p for s, p in zip(spread, pure, strict=True)]
    scales = []
    for i, k in itertools.permutations(range(len(rows)), 2):
        room = high / pure[k] - low / pure[i]
        scales.append(room / limits.larger(turns[k] - turns[i], room))
    scale = limits.smallest(scales)
    if plain is not None:
        scale = scale + (1 - scale) * plain
    least = limits.largest([low / p - scale * t for p, t in zip(pure, turns, strict=True)])
    most = limits.smallest([high / p - scale * t for p, t in zip(pure, turns, strict=True)])
    shift = limits.larger(least - collective, 0.0) - limits.larger(collective - most, 0.0)
    if plain is not None:
        shift = shift * (1 - plain)
    return limits.clip([p * (collective + shift) + scale * s for p, s in zip(pure, spread, strict=True)])
