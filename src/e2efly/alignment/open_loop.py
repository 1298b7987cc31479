"""A flight as a vehicle foretells it, open loop, from what was measured each half second; and without a vehicle."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from e2efly.alignment.comparison import turns
from e2efly.alignment.model import FACTOR, GYRO, LOST, NUISANCES, POSE_DELAY, TILT, Model
from e2efly.alignment.prediction import off, simulated
from e2efly.alignment.windows import REACH, STEP, Windows, cut, join
from e2efly.control.vectors import Quat
from e2efly.logs.recording import Record, Stream
from e2efly.vehicles.gravity import GRAVITY

AHEAD = (0.3, 0.5, 1.0, 2.0, 3.0)
"""How far ahead the motion is foretold, s."""
EVERY = 0.5
"""Time between the starts of two predictions, s."""
OWN_S = 10.0
"""The first part of a flight, s, that tells its own tilt and thrust; it is judged on the rest."""
OWN_AHEAD = {"motor_and_rate": 1.0}
"""How far ahead the position is foretold to find them, s. `OWN_AHEAD_ELSE` where the attitude is simulated, too: its
error would soon hide theirs."""
OWN_AHEAD_ELSE = 0.5
OWN = {FACTOR: 0.05, TILT.start: 0.03, TILT.start + 1: 0.03}
"""Standard deviations of the priors of the flight's own nuisances, by their index in `NUISANCES`."""
CLOSE, SPREAD = 0.05, 0.1
"""`CLOSE`: largest time since the last sample, s. `SPREAD`: standard deviation of a position, m, beside the priors."""
HOLD, HOVER, VEHICLE, OWN_VEHICLE = "hold", "hover thrust", "vehicle", "vehicle, own tilt and thrust"
"""The predictions: the measured velocity stays (or the body rate, or the attitude); a point mass with the mean thrust
of the flight along its measured attitude; the vehicle; the vehicle with the flight's own tilt and thrust."""
STREAMS = {"position": "m", "velocity": "m/s", "quaternion": "rad", "body_rate": "rad/s"}
"""What is foretold, and the units of its errors."""


@dataclass(frozen=True)
class Forecast:
    """The errors of the predictions of one flight."""

    record: Record
    driver: str
    """What drives the simulation (`Model.driver`)."""
    ahead: tuple[float, ...]
    """How far ahead, s: those of `AHEAD` for which the flight is long enough."""
    begin: np.ndarray
    """(n,) when each prediction starts, s since the start of the flight."""
    size: dict[str, dict[str, np.ndarray]]
    """By stream and prediction, (n, times): length of the error, in the unit of `STREAMS`. NaN: not measured then."""
    own: dict[str, float]
    """The flight's own `flight_thrust`, `tilt_x` and `tilt_y` (see `NUISANCES`). Empty if it does not tell them."""

    def mean(self, after: float | None = None) -> dict[str, dict[str, np.ndarray]]:
        """Mean errors by stream and prediction, (times,), of predictions that start so many s after the flight does.
        If omitted: on the part that did not tell the flight's own tilt and thrust.
        """
        least = (OWN_S if self.own else 0.0) if after is None else after
        kept = self.begin >= least
        return {
            stream: {name: _mean(size[kept]) for name, size in sizes.items()} for stream, sizes in self.size.items()
        }


def forecast(
    model: Model,
    p: np.ndarray,
    q: np.ndarray,
    record: Record,
    volts: float | None = None,
    ahead: Sequence[float] = AHEAD,
) -> Forecast:
    """Foretell a flight.

    Args:
        model: the vehicle, and what drives it in this flight.
        p: unknowns of the vehicle, (u,). Zeros: the vehicle of the file.
        q: nuisances of the flight, (len(NUISANCES),). Biases and delays of its sensors count as zero.
        record: the flight, as `checks.checked` returns it.
        volts: battery voltage for which the thrust of motor outputs holds, V. If omitted, they are taken as they are.
        ahead: how far ahead, s, increasing.

    Raises:
        ValueError: naming the flight, when it is too short or lacks what drives the vehicle.
    """
    if not record.has("body_rate"):
        raise ValueError(f"{record.path}: has no body_rate; accepted: a flight with a gyroscope in its log")
    flight = _with_velocity(record)
    if model.driver == "motor_and_rate":
        flight = _prescribed(flight)
    start, end = flight.span
    windows = _windows(flight, model.driver, volts, [t for t in ahead if t <= end - start - REACH])
    if windows is None or not windows.count:
        raise ValueError(
            f"{record.path}: lasts {record.duration:.2f} s; accepted: {REACH + ahead[0]:g} s or more, without a gap in "
            f"{model.driver.removesuffix('_and_rate')} or body_rate"
        )
    begin, times = windows.begin - start, tuple(t for t in ahead if t <= windows.length + 1e-9)
    q = q.copy()
    q[GYRO], q[POSE_DELAY] = 0.0, 0.0  # the poses alone say where a window starts
    seen = {HOLD: _held(windows), VEHICLE: _flown(model, p, q, windows)}
    if flight.has("position", "quaternion"):
        seen[HOVER] = _hovering(flight, windows)
    found = None
    if "position" in windows.measured:
        reach = min(OWN_AHEAD.get(model.driver, OWN_AHEAD_ELSE), times[-1])
        early = begin + reach <= OWN_S
        if early.any() and np.any(begin >= OWN_S):
            found = _own(model, p, q, windows.some(early), reach)
            seen[OWN_VEHICLE] = _flown(model, p, found, windows)
    names = [name for name in STREAMS if name in windows.measured and name in record.streams]
    if model.driver == "motor_and_rate":  # the measured attitude turns the vehicle
        names = [name for name in names if name != "quaternion"]
    size = {
        name: {
            label: np.stack([_size(windows, each, name, t) for t in times], -1)
            for label in (HOLD, HOVER, VEHICLE, OWN_VEHICLE)
            if label in seen and name in (each := seen[label])
        }
        for name in names
    }
    own = {} if found is None else {NUISANCES[i][0]: float(found[i]) for i in OWN}
    return Forecast(record, model.driver, times, begin, size, own)


def typical(q: np.ndarray, durations: Sequence[float], duration: float) -> np.ndarray:
    """The nuisances to expect of a flight, (len(NUISANCES),), from those of other flights, (f, len(NUISANCES)).

    Thrust is lost with time: a flight that lasts twice as long loses twice as much. `durations` are those of the other
    flights, (f,), `duration` that of the one to foretell, s.
    """
    mean = q.mean(0)
    mean[LOST] = duration * np.mean(q[:, LOST] / np.asarray(durations))
    return mean


def _mean(size: np.ndarray) -> np.ndarray:
    """The mean over predictions, (times,). NaN where nothing was measured."""
    there = np.isfinite(size)
    return np.where(there.any(0), np.nansum(size, 0) / np.maximum(there.sum(0), 1), np.nan)


def _windows(record: Record, driver: str, volts: float | None, ahead: Sequence[float]) -> Windows | None:
    """Windows that reach as far ahead as asked for, one every `EVERY` s. None if there is no time to foretell."""
    if not ahead:
        return None
    start, end = record.span
    parts = [
        cut(record.during(start + EVERY * i, end), driver, 0, volts, ahead[-1])
        for i in range(max(round(ahead[-1] / EVERY), 1))
        if end - start - EVERY * i >= REACH + ahead[-1]
    ]
    windows = join(parts)
    return dataclasses.replace(windows, when=(windows.begin - start) / (end - start))


def _with_velocity(record: Record) -> Record:
    """With velocities from the positions, over 0.1 s, where the log has none: predictions start with one."""
    if record.has("velocity") or not record.has("position"):
        return record
    stream = record.streams["position"]
    before, after = (np.clip(stream.time + side, stream.time[0], stream.time[-1]) for side in (-0.05, 0.05))
    moved = [np.interp(after, stream.time, x) - np.interp(before, stream.time, x) for x in stream.values.T]
    velocity = Stream(stream.time, np.stack(moved, -1) / (after - before)[:, None])
    return dataclasses.replace(record, streams={**record.streams, "velocity": velocity})


def _prescribed(record: Record) -> Record:
    """With the body rates by which its attitudes go over into each other, in the place of the gyroscope's, of which a
    slow log misses too much.
    """
    return dataclasses.replace(record, streams={**record.streams, "body_rate": turns(record.streams["quaternion"])})


def _flown(model: Model, p: np.ndarray, q: np.ndarray, windows: Windows) -> dict[str, np.ndarray]:
    """As the vehicle flies. The measured attitude is turned by the tilt of the poses' axes."""
    start = np.zeros(model.start)
    start[6:8] = -q[TILT]
    return simulated(model, p, np.tile(q, (windows.count, 1)), windows, start)


def _held(windows: Windows) -> dict[str, np.ndarray]:
    """As if the measured velocity stayed, or the attitude, or the body rate."""
    time = STEP * np.arange(windows.steps + 1)[:, None]
    seen = {name: np.repeat(x[:, None], windows.steps + 1, 1) for name, x in windows.start.items()}
    if "position" in seen and "velocity" in seen:
        seen["position"] = seen["position"] + windows.start["velocity"][:, None] * time
    return seen


def _hovering(record: Record, windows: Windows) -> dict[str, np.ndarray]:
    """A point mass whose thrust stays that which carries the flight on average, along the measured attitude."""
    pose, speed = record.streams["quaternion"], record.streams["velocity"]
    up = Quat.of(pose.values).normalized().z_axis().stack()
    time = windows.begin[:, None] + STEP * np.arange(windows.steps + 1)
    gained = (speed.values[-1, 2] - speed.values[0, 2]) / (speed.time[-1] - speed.time[0])
    carried = np.trapezoid(up[:, 2], pose.time) / (pose.time[-1] - pose.time[0])
    thrust = (GRAVITY + gained) / carried
    along = np.stack([np.interp(time, pose.time, column) for column in up.T], -1)
    velocity = windows.start["velocity"][:, None] + _summed(thrust * along - np.array([0.0, 0.0, GRAVITY]))
    return {"velocity": velocity, "position": windows.start["position"][:, None] + _summed(velocity)}


def _summed(rate: np.ndarray) -> np.ndarray:
    """The integral over time of a rate, (n, m + 1, 3), from zero, by trapezoids."""
    return np.concatenate([np.zeros_like(rate[:, :1]), np.cumsum(0.5 * STEP * (rate[:, 1:] + rate[:, :-1]), 1)], 1)


def _at(windows: Windows, seen: dict[str, np.ndarray], name: str, time: float) -> np.ndarray:
    """The error at the last sample until a time, (n, k). NaN if there is none shortly before it."""
    step, reach = round(time / STEP), round(CLOSE / STEP)
    left = off(windows, seen, name)[:, max(step - reach, 1) : step + 1]
    last = left.shape[1] - 1 - np.argmax(np.isfinite(left[:, ::-1, 0]), 1)
    return left[np.arange(len(left)), last]


def _size(windows: Windows, seen: dict[str, np.ndarray], name: str, time: float) -> np.ndarray:
    return np.linalg.norm(_at(windows, seen, name, time), axis=-1)


def _own(model: Model, p: np.ndarray, q: np.ndarray, windows: Windows, ahead: float) -> np.ndarray:
    """The nuisances with tilt and thrust that explain the positions of these windows best, by Gauss-Newton."""
    free, prior = list(OWN), np.array(list(OWN.values()))
    q, centre = q.copy(), q[list(OWN)].copy()

    def residual(q: np.ndarray) -> np.ndarray:
        left = _at(windows, _flown(model, p, q, windows), "position", ahead) / SPREAD
        return np.where(np.isfinite(left), left, 0.0).ravel()

    for _ in range(4):
        r = residual(q)
        slopes = []
        for i in free:
            moved = q.copy()
            moved[i] += 1e-4
            slopes.append((residual(moved) - r) / 1e-4)
        J = np.stack(slopes, -1)
        q[free] -= np.linalg.solve(J.T @ J + np.diag(prior**-2.0), J.T @ r + (q[free] - centre) / prior**2)
    return q
