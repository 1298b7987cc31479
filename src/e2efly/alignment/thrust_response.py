"""The response of the thrust to its command: gain, delay and a first-order lag, fitted to the accelerometer.

The rotors' speed, whose square the thrust is, follows its command after a delay and with a first-order lag, as in the
physics. The flight controller filters its accelerometer by two equal first-order stages; other logs are unfiltered.
What changes slowly (a bias, drag, a throttle map that is being learned) is not the response: every second of the log
has an offset of its own.
Least squares with Huber's weights (P. J. Huber, "Robust Estimation of a Location Parameter", 1964).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from e2efly.alignment.comparison import lagged
from e2efly.alignment.least_squares import HUBER
from e2efly.alignment.model import FORCE_FILTER
from e2efly.alignment.shooting import FLOOR
from e2efly.logs.blackbox_merge import DELAY_SIGMA
from e2efly.logs.readers import BLACKBOX, OURS
from e2efly.logs.recording import Record, Stream

GRID = 0.001
"""Step in time of the simulated response, s."""
CHANGES = 0.5
"""Root mean square of the changes of the commanded thrust within a second that a fit needs, m/s^2."""
EXACT = 0.15
"""Largest standard deviation of a lag that is used, relative."""
FLY = "steps of thrust of 3 m/s^2 and more, 0.2 s and longer each, three of them or more"
FILTER_SPREAD, UNFILTERED = 0.7, 1e-4
"""Standard deviation of the logarithm of the filter's time constant before the fit; and the time constant that stands
for no filter, s."""
SCALE = (0.01, 0.1, 0.002, 0.1)
"""Sizes of steps of the fit: of the gain, the logarithm of the lag, the delay, and the logarithm of the filter's time
constant."""
STEADY = 0.02
"""Standard deviation of the gain about that of the whole flight, which has the accelerometer's bias in it."""
STEP, FEW = 1.0, 6
"""A change of the commanded thrust between two commands that counts as a step, m/s^2, and the number of steps from
which on they alone are used."""
SHORT, STRUCTURE = 1e-3, 0.1
"""Time constant up to which the accelerometer counts as unfiltered, s; and the relative standard deviation of the lag
that a filter of another form adds."""
CALM, SETTLED = 0.1, 0.35
"""The time before and after a step that is used, s."""
WINDOW = 1.0
"""Length of the pieces of a log that have an offset of their own, s."""
LATEST = 0.25
"""Longest delay and lag that are tried, s."""


@dataclass(frozen=True)
class ThrustResponse:
    """What the thrust gave for what was asked, with standard deviations."""

    gain: tuple[float, float]
    """Measured over commanded."""
    lag: tuple[float, float]
    """Time constant, s."""
    delay: tuple[float, float]
    """From the sending of a command, s."""
    filter: float
    """Time constant of each of the two stages of the accelerometer's filter, s."""
    reason: str = ""
    """Why the lag is not to be believed. Empty: it is."""


def thrust_response(
    records: Sequence[Record], lag: float, delay: float | None = None, spread: float = DELAY_SIGMA
) -> ThrustResponse | None:
    """The response of the thrust in flights with commands and accelerometer. None: no flight has both, or no command
    tells the thrust.

    Args:
        records: the flights, checked.
        lag: the time constant from which the fit begins, s.
        delay: the delay from a command to the motors, s, if it is known.
        spread: the standard deviation of this delay, s.
    """
    told = [r for r in records if r.has("command", "specific_force")]
    told = [r for r in told if np.ptp(r.streams["command"].values[:, 0]) > 0]
    if not told:
        return None
    commands = [r.streams["command"] for r in told]
    felt = [_inside(command, r.streams["specific_force"]) for command, r in zip(commands, told, strict=True)]
    times, seen = [time for time, _ in felt], np.concatenate([force for _, force in felt])
    seconds = [np.floor(time / WINDOW).astype(int) for time in times]
    first = np.cumsum([0, *(int(each.max()) + 1 for each in seconds)])
    group = np.concatenate([each + begin for each, begin in zip(seconds, first[:-1], strict=True)])

    def foretold(p: np.ndarray) -> np.ndarray:
        return np.concatenate([_foretold(p, *each) for each in zip(commands, times, strict=True)])

    def missed(p: np.ndarray) -> np.ndarray:
        return _without_means(foretold(p) - seen, group)

    level = float(np.median(seen) / np.median(foretold(np.array([1.0, np.log(lag), 0.0, np.log(UNFILTERED)]))))
    late = 0.02 if delay is None else delay
    free = np.array([STEADY, 1.0, LATEST if delay is None else spread, FILTER_SPREAD])
    fits = []
    controller = all(record.kind in (OURS, BLACKBOX) for record in told)  # Betaflight filters its accelerometer
    for stage in (FORCE_FILTER,) if controller else (FORCE_FILTER, UNFILTERED):
        p0 = np.array([level, np.log(lag), late, np.log(stage)])
        kept = free if stage == FORCE_FILTER else free * [1.0, 1.0, 1.0, 1e-3]
        fits.append(_fit(missed, p0, kept))
    (p, jacobian, rest), _ = min(fits, key=lambda fit: fit[1])
    sigma = np.sqrt(np.diag(_covariance(jacobian, rest, group)))
    constant, stage = (float(np.exp(x)) for x in (p[1], p[3]))
    sigma[1] = np.hypot(sigma[1], 0.0 if stage < SHORT else STRUCTURE)
    changes = float(np.sqrt(np.mean([_changes(command) ** 2 for command in commands])))
    reason = ""
    if changes < CHANGES:
        reason = f"the commanded thrust changes by {changes:.2g} m/s^2 rms within a second, needed {CHANGES:g}"
    elif sigma[1] > EXACT:
        reason = f"+- {100 * sigma[1]:.0f} %"
    return ThrustResponse(
        gain=(float(p[0]), float(sigma[0])),
        lag=(constant, constant * float(sigma[1])),
        delay=(float(p[2]), float(sigma[2])),
        filter=stage,
        reason=reason,
    )


def _fit(
    missed: Callable[[np.ndarray], np.ndarray], p0: np.ndarray, free: np.ndarray
) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray], float]:
    """Values, Jacobian and residuals over the spread, the last rows of both being the prior's; and the cost."""

    def left(p: np.ndarray, noise: float) -> np.ndarray:
        return np.concatenate([missed(p) / noise, (p - p0) / free])

    def solved(p: np.ndarray, noise: float) -> Any:
        return least_squares(left, p, loss="huber", f_scale=HUBER, x_scale=SCALE, args=(noise,))

    p, noise = p0, 1.0
    for _ in range(2):
        p = solved(p, noise).x
        noise = max(float(1.4826 * np.median(np.abs(missed(p)))), FLOOR["specific_force"])
    found = solved(p, noise)
    return (found.x, found.jac, left(found.x, noise)), float(found.cost + (len(found.fun) - len(p)) * np.log(noise))


def _covariance(jacobian: np.ndarray, rest: np.ndarray, group: np.ndarray) -> np.ndarray:
    """The sandwich estimate over windows, which also holds if neighbouring residuals are alike. Never less than that of
    white residuals.
    """
    inverse = np.linalg.inv(jacobian.T @ jacobian)
    scores, prior = jacobian[: len(group)] * np.clip(rest[: len(group)], -HUBER, HUBER)[:, None], jacobian[len(group) :]
    sums = np.zeros((int(group.max()) + 1, jacobian.shape[1]))
    np.add.at(sums, group, scores)
    sandwich = inverse @ (sums.T @ sums + prior.T @ prior) @ inverse
    wider = np.maximum(np.sqrt(np.diag(inverse) / np.diag(sandwich)), 1.0)
    return sandwich * np.outer(wider, wider)


def _without_means(values: np.ndarray, group: np.ndarray) -> np.ndarray:
    """Values without the mean of their group."""
    count = np.maximum(np.bincount(group), 1)
    return values - (np.bincount(group, values) / count)[group]


def _inside(command: Stream, force: Stream) -> tuple[np.ndarray, np.ndarray]:
    """The samples that the commands drive: times, s, and specific force along body z, m/s^2. If the thrust was stepped,
    they are those about its steps: between them, disturbances and a throttle map that learns move the thrust, too.
    """
    inside = force.during(command.time[0] + LATEST, command.time[-1])
    steps = command.time[1:][np.abs(np.diff(command.values[:, 0])) >= STEP]
    if len(steps) >= FEW:
        after = inside.time - steps[np.maximum(np.searchsorted(steps, inside.time, side="right") - 1, 0)]
        until = steps[np.minimum(np.searchsorted(steps, inside.time), len(steps) - 1)] - inside.time
        near = ((after >= 0) & (after <= SETTLED)) | ((until >= 0) & (until <= CALM))
        return inside.time[near], inside.values[near, 2]
    return inside.time, inside.values[:, 2]


def _foretold(p: np.ndarray, command: Stream, time: np.ndarray) -> np.ndarray:
    gain, lag, late, stage = p[0], np.exp(p[1]), p[2], np.exp(p[3])
    grid = np.arange(command.time[0], time[-1] + GRID, GRID)
    area = np.concatenate([[0.0], np.cumsum(command.values[:-1, 0] * np.diff(command.time))])
    until = np.interp(grid - late, command.time, area)
    until += np.maximum(grid - late - command.time[-1], 0) * command.values[-1, 0]
    until += np.minimum(grid - late - command.time[0], 0) * command.values[0, 0]
    asked = np.maximum(np.diff(until, prepend=until[0] - GRID * command.values[0, 0]) / GRID, 0.0)
    force = lagged(np.sqrt(asked), lag, GRID) ** 2
    for _ in range(2):
        force = lagged(force, stage, GRID)
    return gain * np.interp(time, grid, force)


def _changes(command: Stream) -> float:
    """Root mean square of the changes of the commanded thrust within a second, m/s^2."""
    grid = np.arange(command.time[0], command.time[-1], 0.01)
    held = command.values[np.searchsorted(command.time, grid, side="right") - 1, 0]
    mean = np.convolve(np.pad(held, 50, mode="edge"), np.ones(101) / 101, "valid")
    return float(np.std(held - mean))
