"""Noise of the sensors, measured from the calm part of a flight, as a hover is.

A local parabola follows the motion of a hovering vehicle, which is slow. What differs from it is noise.
Source of the filter: Savitzky and Golay, "Smoothing and differentiation of data by simplified least squares
procedures", 1964.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_coeffs, savgol_filter

from e2efly.alignment.comparison import attitudes, common_times, runs, smooth, turns
from e2efly.control import Quat, Vec3
from e2efly.logs.recording import Record, Stream, listed
from e2efly.vehicles.gravity import GRAVITY

MEASURED = {"position": "m", "velocity": "m/s", "attitude": "rad", "body_rate": "rad/s", "specific_force": "m/s^2"}
"""What is measured, with its unit. The attitude's errors are about the body's axes."""
CALM_SPEED, CALM_RATE = 0.5, 0.5
"""Largest speed, m/s, and body rate, rad/s, of a hover."""
LEAST_S = 3.0
"""Shortest hover, s."""
FOLLOWED_S = 0.25
"""Length of the parabolas, s: motions that last longer are no noise."""
FEWEST = 7
"""Fewest samples of a parabola."""
_WINDOW_S = 0.3  # over which rates and speeds are averaged


@dataclass(frozen=True)
class SensorNoise:
    """The noise of one sensor."""

    name: str
    """One of `MEASURED`."""
    time: np.ndarray
    """(n,) s."""
    rest: np.ndarray
    """(n, 3) what the parabolas leave over, by axis, as large as the noise."""
    bias: np.ndarray | None
    """(3,) mean error. None: a hover does not show it."""
    slowest: float
    """Lowest frequency of what is taken for noise, Hz. Slower changes are taken for motion."""

    @property
    def rate(self) -> float:
        """Sampling rate, Hz."""
        return Stream(self.time, self.rest).rate

    @property
    def sigma(self) -> np.ndarray:
        """(3,) standard deviation of a sample, by axis."""
        return self.rest.std(0)

    @property
    def memory(self) -> float:
        """Correlation of a sample's noise with that of the next, -1 to 1, mean of the axes. That of white noise is 0,
        that of a filtered sensor near 1.
        """
        here, there = self.rest[:-1], self.rest[1:]
        return float(np.mean(np.sum(here * there, 0) / np.maximum(np.sum(self.rest**2, 0), 1e-30)))


def hover_of(record: Record) -> Record:
    """The longest calm part of a flight.

    Raises:
        ValueError: when the log has no body rates, or no calm part that is long enough.
    """
    if not record.has("body_rate"):
        raise ValueError(f"{record.path}: has {listed(record.streams)}; accepted: a log with body_rate, at hover")
    stream = record.streams["body_rate"]
    calm = np.linalg.norm(_averaged(stream), axis=1) < CALM_RATE
    if (speed := _velocity(record)) is not None:
        calm &= np.interp(stream.time, speed.time, np.linalg.norm(_averaged(speed), axis=1)) < CALM_SPEED
    begin, end = runs(calm)
    length = stream.time[end] - stream.time[begin] if len(begin) else np.zeros(1)
    longest = int(np.argmax(length))
    if length[longest] < LEAST_S:
        raise ValueError(
            f"{record.path}: is calm for {length[longest]:.1f} s at a time (below {CALM_RATE:g} rad/s and "
            f"{CALM_SPEED:g} m/s); accepted: {LEAST_S:g} s of hover or more"
        )
    return record.during(float(stream.time[begin[longest]]), float(stream.time[end[longest]]))


def measured_noise(hover: Record) -> list[SensorNoise]:
    """The noise of each sensor of a calm flight, as `hover_of` finds it. Sensors with too few samples are left out."""
    found = []
    for name in MEASURED:
        stream = _attitude_errors(hover) if name == "attitude" else hover.streams.get(name)
        if stream is None:
            continue
        width = max(round(FOLLOWED_S * stream.rate), FEWEST) // 2 * 2 + 1
        if len(stream.time) < 3 * width:
            continue
        own = savgol_coeffs(width, 2)[width // 2]  # a parabola takes this share of a sample's own noise along
        rest = (stream.values - savgol_filter(stream.values, width, 2, axis=0))[width:-width] / np.sqrt(1 - own)
        found.append(SensorNoise(name, stream.time[width:-width], rest, _bias(hover, name), stream.rate / width))
    return found


def _averaged(stream: Stream) -> np.ndarray:
    return smooth(stream.values, max(round(_WINDOW_S * stream.rate), 3))


def _velocity(record: Record) -> Stream | None:
    """Measured, or by the positions, (n, 3) m/s. None: the log does not show it."""
    if record.has("velocity") or not record.has("position"):
        return record.streams.get("velocity")
    stream = record.streams["position"]
    return Stream(stream.time, np.gradient(stream.values, stream.time, axis=0))


def _attitude_errors(hover: Record) -> Stream | None:
    """Small rotations from the mean attitude to each attitude, about the body's axes, rad."""
    if not hover.has("quaternion"):
        return None
    pose = hover.streams["quaternion"]
    q = attitudes(pose, pose.time)
    mean = Quat.of(np.broadcast_to(q.mean(0) / np.linalg.norm(q.mean(0)), q.shape))
    return Stream(pose.time, 2 * mean.conjugate().compose(Quat.of(q)).stack()[:, 1:])


def _bias(hover: Record, name: str) -> np.ndarray | None:
    """The mean error of a gyroscope or an accelerometer, in the body's axes. A hovering vehicle neither turns nor
    accelerates in the mean; the attitude's own turning is taken off where it is in the log.
    """
    stream = hover.streams.get(name)
    if stream is None:
        return None
    if name == "body_rate":
        turned = turns(hover.streams["quaternion"]).values.mean(0) if hover.has("quaternion") else np.zeros(3)
        return stream.values.mean(0) - turned
    if name == "specific_force" and hover.has("quaternion"):
        time = common_times(hover, "specific_force", "quaternion")
        up = Quat.of(attitudes(hover.streams["quaternion"], time)).unrotate(Vec3(0.0, 0.0, GRAVITY)).stack().mean(0)
        return stream.values.mean(0) - up
    return None
