"""The quadratic program of one axis of the predictive controller: its model, its costs and its limits. Pure."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

STEPS, STEP = 20, 0.05
"""A plan has so many steps, of so many s each."""
DAMPING = 0.9
"""Of the plan that meets no limit, over that of a motion which just does not swing."""
SOFT = 8
"""The solver's mark of a limit that may be broken where nothing else can be done."""
Solve = Callable[..., tuple[np.ndarray, float, int, dict[str, Any]]]


@dataclass(frozen=True)
class Plan:
    """An axis: (how far off, how fast, acceleration), which follows the wanted acceleration as a lag."""

    free: np.ndarray
    """(STEPS, 3) the plan that meets no limit, over the state now."""
    speeds: tuple[np.ndarray, np.ndarray]
    """(STEPS, 3) and (STEPS, STEPS): the speed after each step, over the state now and the plan."""
    cost: np.ndarray
    """(STEPS, STEPS) of a plan."""
    slope: np.ndarray
    """(STEPS, 3) its slope at no plan, over the state now."""

    def best(
        self, solve: Solve, state: np.ndarray, wanted: tuple[np.ndarray, np.ndarray], speed: np.ndarray
    ) -> np.ndarray:
        """The acceleration to ask for now, over that of where to be, m/s^2, (n,).

        Args:
            solve: the solver of quadratic programs.
            state: (n, 3) off where to be, m; its change, m/s; acceleration over that of where to be, m/s^2.
            wanted: (n,) smallest and largest acceleration that may be asked for, m/s^2.
            speed: (n, 2) smallest and largest speed, over that of where to be, m/s.
        """
        plan = state @ self.free.T
        goes = state @ self.speeds[0].T + plan @ self.speeds[1].T
        low, high = (limit[:, None] for limit in wanted)
        inside = ((plan >= low) & (plan <= high) & (goes >= speed[:, :1]) & (goes <= speed[:, 1:])).all(axis=1)
        first = np.clip(plan[:, 0], wanted[0], wanted[1])
        for i in np.flatnonzero(~inside):
            drift = self.speeds[0] @ state[i]
            lower = np.concatenate([np.full(STEPS, wanted[0][i]), speed[i, 0] - drift])
            upper = np.concatenate([np.full(STEPS, wanted[1][i]), speed[i, 1] - drift])
            marks = np.repeat(np.array([0, SOFT], np.int32), STEPS)
            found, _, status, _ = solve(self.cost, self.slope @ state[i], self.speeds[1], upper, lower, marks)
            if status > 0:
                first[i] = found[0]
        return first


def planned(frequency: float, lag: float) -> Plan:
    """An axis of a vehicle.

    Args:
        frequency: of the plan that meets no limit, rad/s.
        lag: with which the acceleration follows, s.
    """
    A, B = _model(lag)
    Q = np.diag([frequency**4, (4 * DAMPING**2 - 2) * frequency**2, 0.0])
    P = _riccati(A, B, Q)
    powers = [np.eye(3)]
    for _ in range(STEPS):
        powers.append(A @ powers[-1])
    drift = np.stack(powers[1:])  # (STEPS, 3, 3)
    turned = np.zeros((STEPS, 3, STEPS))
    for k in range(STEPS):
        for j in range(k + 1):
            turned[k, :, j] = powers[k - j] @ B
    weights = [*[Q] * (STEPS - 1), P]
    cost = np.eye(STEPS) + np.sum([t.T @ w @ t for t, w in zip(turned, weights, strict=True)], axis=0)
    slope = np.sum([t.T @ w @ d for t, w, d in zip(turned, weights, drift, strict=True)], axis=0)
    return Plan(-np.linalg.solve(cost, slope), (drift[:, 1], turned[:, 1]), cost, slope)


def _model(lag: float) -> tuple[np.ndarray, np.ndarray]:
    """The exact step of STEP s of x' = v, v' = a, a' = (u - a) / lag."""
    left = np.exp(-STEP / lag)
    v, x = lag * (1 - left), lag * (STEP - lag * (1 - left))
    A = np.array([[1.0, STEP, x], [0.0, 1.0, v], [0.0, 0.0, left]])
    return A, np.array([STEP**2 / 2 - x, STEP - v, 1 - left])


def _riccati(A: np.ndarray, B: np.ndarray, Q: np.ndarray) -> np.ndarray:
    """The cost of going on for ever: the fixed point of the discrete Riccati equation, input cost 1."""
    P = Q
    for _ in range(2000):
        gain = (P @ B) / (1 + B @ P @ B)
        P = Q + A.T @ (P - np.outer(gain, B @ P)) @ A
    return P
