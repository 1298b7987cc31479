"""The quadratic program of one axis of the predictive controller: its model, its costs and its limits. Pure."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

STEPS, STEP = 20, 0.05
"""The number of steps of a plan, and the duration of a step, s."""
DAMPING = 0.9
"""Damping ratio of the plan that meets no limit: 1 is critical damping."""
SOFT = 8
"""The solver's mark of a soft limit, which may be broken if there is no other solution."""
Solve = Callable[..., tuple[np.ndarray, float, int, dict[str, Any]]]


@dataclass(frozen=True)
class Plan:
    """The program of one axis.

    Its state is (position, velocity, acceleration) relative to the goal. The acceleration follows the wanted
    acceleration with a first-order lag. A plan is the wanted acceleration at each step.
    """

    free: np.ndarray
    """(STEPS, 3) the matrix from the present state to the plan that meets no limit."""
    speeds: tuple[np.ndarray, np.ndarray]
    """(STEPS, 3) and (STEPS, STEPS): the matrices from the present state and from the plan to the speed after each
    step."""
    cost: np.ndarray
    """(STEPS, STEPS) the quadratic cost of a plan."""
    slope: np.ndarray
    """(STEPS, 3) the matrix from the present state to the gradient of the cost at the zero plan."""

    def best(
        self, solve: Solve, state: np.ndarray, wanted: tuple[np.ndarray, np.ndarray], speed: np.ndarray
    ) -> np.ndarray:
        """(n,) the acceleration to command now, relative to that of the goal, m/s^2.

        Args:
            solve: the solver of quadratic programs.
            state: (n, 3) position, m, velocity, m/s, and acceleration, m/s^2, relative to those of the goal.
            wanted: (n,) the smallest and (n,) the largest acceleration that may be commanded, relative to that of the
                goal, m/s^2.
            speed: (n, 2) the smallest and the largest speed, relative to that of the goal, m/s.
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
    """The program of an axis of a vehicle. `frequency` is the natural frequency of the plan that meets no limit, rad/s.
    `lag` is the time constant with which the acceleration follows, s.
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
    """The cost over an infinite horizon: the fixed point of the discrete Riccati equation with input cost 1."""
    P = Q
    for _ in range(2000):
        gain = (P @ B) / (1 + B @ P @ B)
        P = Q + A.T @ (P - np.outer(gain, B @ P)) @ A
    return P
