"""The estimator of a flight: IMU samples as they come, and corners of images that are older than these."""

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from e2efly.flight.pose.gates.error_state import AssumedNoise, ErrorState, quaternion_of, turned
from e2efly.flight.pose.gates.lens import Corners, Lens, Openings
from e2efly.policy.odometry import Odometry

OLDEST = 0.5
"""Images older than this cannot be used, s."""


@dataclass(frozen=True)
class InertialSample:
    """A sample of the IMU, on the clock of its time."""

    time: float
    """End of the interval that it is measured over, s."""
    gyroscope: np.ndarray
    """(3,) body rate at the end, rad/s."""
    accelerometer: np.ndarray
    """(3,) mean specific force over the interval in the body axes at its end, m/s^2."""


@dataclass
class GateEstimator:
    """Carries a state on by the IMU. An image corrects the state of its own time, from which the IMU's samples since
    then lead to the present again.
    """

    state: ErrorState
    """The newest state."""
    lens: Lens
    openings: Openings
    noise: AssumedNoise = AssumedNoise()
    seen: float = -np.inf
    """Time of the last image in which a corner was used, s."""
    used: int = 0
    """Number of corners of the last image that were used."""
    _past: deque[tuple[ErrorState, InertialSample]] = field(default_factory=deque)
    """The states before each of the last samples."""

    def odometry(self, now: float) -> Odometry:
        """The newest motion, carried on to `now`, s, at the same velocity and body rate."""
        state = self.state
        since = now - state.time
        rotation = state.rotation @ turned(state.body_rate * since)
        return Odometry(
            now, state.position + since * state.velocity, state.velocity, quaternion_of(rotation), state.body_rate
        )

    def feel(self, sample: InertialSample) -> None:
        """Carry the state on by a sample of the IMU."""
        dt = sample.time - self.state.time
        if dt <= 0:
            return
        self._past.append((self.state, sample))
        while self._past[0][1].time < sample.time - OLDEST:
            self._past.popleft()
        self.state = self.state.moved(sample.gyroscope, sample.accelerometer, dt, self.noise)

    def rest(self, gyroscope: np.ndarray) -> None:
        """The vehicle stands still, and its gyroscope measures (3,), rad/s."""
        self.state = self.state.resting(gyroscope)

    def look(self, found: Corners, stamp: float) -> bool:
        """Correct the state by an image with a stamp, s. False: it is too old, or no corner could be used."""
        after = [sample for _, sample in self._past if sample.time > stamp]
        if not self._past or stamp < self._past[0][0].time:
            return False
        state = next((state for state, sample in self._past if sample.time > stamp), self.state)
        if after and stamp > state.time:
            state = state.moved(after[0].gyroscope, after[0].accelerometer, stamp - state.time, self.noise)
        state, self.used = state.corrected(found, self.lens, self.openings, self.noise)
        kept = [entry for entry in self._past if entry[1].time <= stamp]
        self._past = deque(kept)
        self.state = state
        for sample in after:
            self.feel(sample)
        if self.used:
            self.seen = stamp
        return bool(self.used)
