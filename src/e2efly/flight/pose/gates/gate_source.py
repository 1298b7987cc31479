"""The pose source of a vehicle that has no other one than its camera and the IMU of its flight controller."""

from typing import Protocol

import numpy as np

from e2efly.courses.gates import HALF_DEPTH
from e2efly.flight.pose.gates.error_state import ErrorState, quaternion_of, turned
from e2efly.flight.pose.gates.gate_estimator import GateEstimator, InertialSample
from e2efly.flight.pose.gates.gate_setup import GateSetup
from e2efly.flight.pose.gates.lens import Corners, Openings
from e2efly.policy.odometry import Sample
from e2efly.vehicles.gravity import GRAVITY

LARGEST = 0.5
"""Standard deviation of the position above which there is no pose, m."""
PAUSE_S = 0.2
"""After a pause of the IMU longer than this, s, nothing is known any more."""
TURNING, SHAKEN = 0.15, 0.6
"""A vehicle that turns faster, rad/s, or whose specific force differs more from gravity, m/s^2, is carried."""


class Looks(Protocol):
    """The images of a camera, as the corners that are found in them. Nothing here blocks or raises."""

    @property
    def problem(self) -> str | None:
        """The last problem. None: no problem so far."""
        ...

    def read(self, now: float) -> list[tuple[float, Corners]]:
        """What has come since the last call, at `now`, s: the stamp of the image, s, and its corners."""
        ...

    def close(self) -> None:
        """Release all resources. May be called twice."""
        ...

    def describe(self) -> str:
        """A description of the camera, for people and logs."""
        ...


class GateSource:
    """Poses from gates. Whoever has the IMU calls `feel`; images come by themselves."""

    def __init__(self, setup: GateSetup, looks: Looks, name: str = "gates") -> None:
        """A vehicle that stands at the setup's start."""
        self.refused = 0
        self.problem: str | None = None
        self._setup, self._looks, self._name = setup, looks, name
        self._openings = Openings.of(setup.track, HALF_DEPTH)
        self._estimator: GateEstimator | None = None
        self._last: tuple[np.ndarray, np.ndarray] | None = None
        self._told = -np.inf

    @property
    def estimator(self) -> GateEstimator | None:
        """What is estimated. None: the IMU has not been felt."""
        return self._estimator

    def feel(
        self, time: float, gyroscope: np.ndarray, force: np.ndarray, *, standing: bool,
        attitude: tuple[float, np.ndarray] | None = None,
    ) -> None:  # fmt: skip
        """See `AidedSource.feel`. The gates correct the attitude; the flight controller's is not needed."""
        del attitude
        estimator, last = self._estimator, self._last
        self._last = gyroscope, force
        dt = np.inf if estimator is None else time - estimator.state.time
        if estimator is None or last is None or dt > PAUSE_S:
            if estimator is not None:
                self.problem = f"{self._name}: the IMU was silent for {dt:.2f} s; accepted: at most {PAUSE_S:g} s"
            self._estimator = self._placed(time) if standing else None  # in the air it may be anywhere
            return
        # two samples at the ends of the interval; the mean of what they say, in the axes at its end
        turn = turned(0.5 * (last[0] + gyroscope) * dt)
        estimator.feel(InertialSample(time, gyroscope, 0.5 * (force + turn.T @ last[1])))
        if standing and np.linalg.norm(gyroscope) < TURNING and abs(np.linalg.norm(force) - GRAVITY) < SHAKEN:
            estimator.rest(gyroscope)

    def read(self, now: float) -> list[Sample]:
        """The newest pose, if it is new and certain enough."""
        looks, estimator = self._looks.read(now), self._estimator
        if estimator is None:
            self.problem = self.problem or f"{self._name}: the IMU has not been heard"
            return []
        for stamp, corners in looks:
            estimator.look(corners, stamp - self._setup.latency)
        state = estimator.state
        doubt = float(np.sqrt(np.trace(state.covariance[:3, :3])))
        if doubt > LARGEST:
            blind = state.time - estimator.seen
            self.problem = (
                f"{self._name}: the place is uncertain by {doubt:.2f} m; accepted: at most {LARGEST:g} m. No gate was "
                + (f"recognised for {blind:.1f} s" if np.isfinite(blind) else "ever recognised")
                + (f" ({self._looks.problem})" if self._looks.problem else "")
            )
            return []
        if state.time <= self._told:
            return []
        self._told, self.problem = state.time, self._looks.problem
        return [Sample(
            now, state.position, quaternion_of(state.rotation), state.time, state.velocity, state.body_rate
        )]  # fmt: skip

    def close(self) -> None:
        """Release the camera."""
        self._looks.close()

    def describe(self) -> str:
        """The track, and the camera."""
        return f"{self._name}, track {self._setup.track.name}, seen by {self._looks.describe()}"

    def _placed(self, time: float) -> GateEstimator:
        start, noise = self._setup.start, self._setup.noise
        state = ErrorState.at(time, start[:3], turned(np.array([0.0, 0.0, start[3]])), noise)
        return GateEstimator(state, self._setup.lens, self._openings, noise)
