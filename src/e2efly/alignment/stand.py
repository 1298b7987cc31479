"""Thrust map, torque ratio, limits and lag of a rotor, from the record of a thrust stand."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import curve_fit

from e2efly.alignment.estimates import Estimate
from e2efly.alignment.stand_file import read_stand
from e2efly.logs.csv_file import Column

STEP = 0.1
"""Change of the throttle that counts as a step."""
LONGEST = 0.5
"""Time after a step during which its response is used, s."""
SETTLED = 0.02
"""Relative change of the rotor speed over 0.1 s below which it counts as steady."""
FLOOR = 0.01
"""Relative standard deviation of a stand's calibration. No sigma becomes smaller than this."""


@dataclass(frozen=True)
class Stand:
    """The results of the record of a thrust stand."""

    thrust_map: np.ndarray
    """[k2, k1, k0] as in the vehicle file."""
    covariance: np.ndarray
    """Covariance of these three, (3, 3)."""
    residual: float
    """Root mean square of measured minus fitted thrust, N."""
    torque_ratio: tuple[float, float] | None
    """Torque ratio and its standard deviation, m."""
    lag_up: np.ndarray
    """Time constant of each step upwards, s."""
    lag_down: np.ndarray
    """Time constant of each step downwards, s."""
    speed: tuple[float, float]
    """Slowest and fastest steady rotor speed, rad/s."""
    thrust_max: float
    """Largest steady thrust, N."""
    speed_per_volt: float | None
    """Relative change of the rotor speed divided by the relative change of the voltage, at constant throttle."""


def evaluate(
    path: Path, columns: Mapping[str, Column] | None = None, told: Callable[[str], None] = lambda _: None
) -> Stand:
    """Fit a stand's record. The arguments are those of `read_stand`.

    Raises:
        ValueError: as for `read_stand`; when the thrust does not rise with the speed, or when too little of the range
            was measured.
    """
    data = read_stand(path, columns, told)
    steady = _steady(data)
    speed, thrust = data["rotor_speed"][steady], data["thrust"][steady]
    if len(speed) < 6 or speed.max() < 2 * max(speed.min(), 1e-9):
        raise ValueError(
            f"{path}: {len(speed)} steady points between {speed.min(initial=math.inf):.0f} and "
            f"{speed.max(initial=0):.0f} rad/s; accepted: 6 or more, the fastest at least twice the slowest"
        )
    # scaled, because the normal equations of squared speeds in the thousands would lose all digits
    scale = speed.max()
    x = np.stack([(speed / scale) ** 2, speed / scale, np.ones_like(speed)], -1)
    fit, *_ = np.linalg.lstsq(x, thrust, rcond=None)
    left = thrust - x @ fit
    noise = np.sum(left**2) / (len(left) - 3)
    unscale = np.array([1 / scale**2, 1 / scale, 1.0])
    covariance = np.linalg.inv(x.T @ x) * noise * np.outer(unscale, unscale)
    found = fit * unscale
    if found[0] <= 0 or 2 * found[0] * speed.min() + found[1] <= 0:
        raise ValueError(
            f"{path}: the fitted thrust map {found.tolist()} does not rise with the speed; accepted: thrust that grows "
            "with the square of the speed (are rpm and thrust in the right columns, and thrust positive upwards?)"
        )
    covariance = covariance + np.outer(found, found) * FLOOR**2
    return Stand(
        found, covariance, float(np.sqrt(np.mean(left**2))), _torque(data, steady),
        *_lags(data), (float(speed.min()), float(speed.max())), float(thrust.max()), _per_volt(data, steady),
    )  # fmt: skip


def estimates(
    path: Path, columns: Mapping[str, Column] | None = None, told: Callable[[str], None] = lambda _: None
) -> list[Estimate]:
    """Thrust map, largest thrust and speed, torque ratio and motor lag, as far as the record contains them.

    The arguments are those of `read_stand`.

    Raises:
        ValueError: as for `evaluate`.
    """
    found, source = evaluate(path, columns, told), f"{path.name}, thrust stand"
    said = [
        Estimate("thrust_map", found.thrust_map, np.sqrt(np.diag(found.covariance)), source),
        Estimate("rotor_thrust_max", np.array(found.thrust_max), np.array(found.thrust_max * FLOOR), source),
        Estimate("rotor_speed_max", np.array(found.speed[1]), np.array(found.speed[1] * FLOOR), source),
    ]
    if found.torque_ratio is not None:
        ratio, off = found.torque_ratio
        said.append(Estimate("torque_ratio", np.array(ratio), np.array(off), source))
    lags = np.concatenate([found.lag_up, found.lag_down])
    if len(lags):
        up, down = (np.mean(x) if len(x) else np.mean(lags) for x in (found.lag_up, found.lag_down))
        # the model has only one lag: half the difference between the two counts as uncertainty
        spread = np.hypot(np.std(lags) / np.sqrt(len(lags)), abs(up - down) / 2)
        said.append(Estimate("motor_time_constant", np.array((up + down) / 2), np.array(max(spread, 1e-3)), source))
    return said


def _steady(data: dict[str, np.ndarray]) -> np.ndarray:
    """Which points are steady. Without times, all points with a turning rotor."""
    speed = data["rotor_speed"]
    turning = speed > 0
    if "t" not in data:
        return turning
    t = data["t"]
    before = np.interp(t - 0.1, t, speed)
    settled = np.abs(speed - before) < SETTLED * np.maximum(speed, 1.0)
    return turning & settled & (t - t[0] >= 0.1)


def _torque(data: dict[str, np.ndarray], steady: np.ndarray) -> tuple[float, float] | None:
    if "torque" not in data:
        return None
    thrust, torque = data["thrust"][steady], np.abs(data["torque"][steady])
    ratio = float(thrust @ torque / (thrust @ thrust))
    left = torque - ratio * thrust
    sigma = math.sqrt(float(left @ left) / (len(left) - 1) / float(thrust @ thrust))
    return ratio, math.hypot(sigma, FLOOR * ratio)


def _lags(data: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Time constants of the steps upwards and of the steps downwards."""
    if "t" not in data or "throttle" not in data:
        return np.zeros(0), np.zeros(0)
    t, throttle, speed = data["t"], data["throttle"], data["rotor_speed"]
    steps = np.flatnonzero(np.abs(np.diff(throttle)) > STEP) + 1
    found: dict[bool, list[float]] = {True: [], False: []}
    for n, start in enumerate(steps):
        end = steps[n + 1] if n + 1 < len(steps) else len(t)
        end = min(end, int(np.searchsorted(t, t[start] + LONGEST)))
        if end - start < 8:
            continue
        x, y = t[start:end] - t[start], speed[start:end]

        def response(x: np.ndarray, first: float, last: float, tau: float, delay: float) -> np.ndarray:
            return last + (first - last) * np.exp(-np.maximum(x - delay, 0) / tau)

        try:
            bounds = ([0, 0, 1e-3, 0], [np.inf, np.inf, LONGEST, 0.1])
            best, _ = curve_fit(response, x, y, [y[0], y[-1], 0.03, 0.001], bounds=bounds)
        except RuntimeError:  # the fit failed: this was not a step
            continue
        if abs(best[1] - best[0]) > SETTLED * speed.max():
            found[throttle[start] > throttle[start - 1]].append(float(best[2]))
    return np.array(found[True]), np.array(found[False])


def _per_volt(data: dict[str, np.ndarray], steady: np.ndarray) -> float | None:
    """The exponent q in rotor speed = a throttle^p voltage^q, if the voltage varied by 3 % or more. Otherwise None."""
    if "voltage" not in data or "throttle" not in data:
        return None
    use = steady & (data["throttle"] > 0.05) & (data["voltage"] > 0)
    volts = data["voltage"][use]
    if use.sum() < 10 or volts.max() < 1.03 * volts.min():
        return None
    x = np.stack([np.log(data["throttle"][use]), np.log(volts), np.ones(use.sum())], -1)
    fit, *_ = np.linalg.lstsq(x, np.log(data["rotor_speed"][use]), rcond=None)
    return float(fit[1])
