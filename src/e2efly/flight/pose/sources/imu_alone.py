"""Motion from the IMU of the flight controller alone, for a policy that is not told where it is."""

import dataclasses
import math
from collections import deque

import numpy as np

from e2efly.flight.pose.gates.error_state import AssumedNoise, ErrorState, quaternion_of, rotation_of, turned
from e2efly.flight.pose.gates.gate_source import PAUSE_S, SHAKEN, TURNING
from e2efly.flight.pose.registry import MalformedError, register
from e2efly.policy.odometry import Sample
from e2efly.vehicles.gravity import GRAVITY

SHAKEN_S = 0.15
"""The sensors of a vehicle that stands are smoothed over this time, s, before they tell that it is carried: rotors that
idle shake it."""
FILTERED_S = 0.02
"""How much later the accelerometer tells than the gyroscope, s: flight controllers filter it more. Measured with
Betaflight's filters in lockstep. A force belongs to the attitude of that time, and so the velocity is as late as it."""
UPRIGHT_S = 1.0
"""Time constant with which the attitude follows the flight controller's, s: that one integrates its gyroscope a
thousand times a second, this one as often as it is told."""
SETTLES_S = 1.0
"""Time over which the sensors at rest are averaged, s, and for which a vehicle must rest before it may fly."""


@register("imu", "imu")
def open_imu(where: str) -> "ImuSource":
    """No place at all: see `ImuSource`.

    Raises:
        MalformedError: for any text after the name.
    """
    if where:
        raise MalformedError(where)
    return ImuSource()


class ImuSource:
    """Carries velocity and attitude on from where the vehicle stands, which is the origin, at heading 0.

    At rest, gravity shows where up is, and what gyroscope and accelerometer measure beyond it is their bias. In flight
    the flight controller's attitude corrects where up is, and nothing corrects velocity and place: the velocity is good
    for a take-off, a short hover and the braking after a race, the place for the take-off. `drifts` tells the bridge.
    """

    drifts = True

    def __init__(self) -> None:
        """A vehicle of which nothing is known yet."""
        self.refused = 0
        self.problem: str | None = "imu: the IMU has not been heard"
        self._state: ErrorState | None = None
        self._last: tuple[float, np.ndarray, np.ndarray] | None = None
        self._rest: tuple[np.ndarray, np.ndarray] | None = None
        self._shaking: tuple[np.ndarray, np.ndarray] | None = None
        self._rested = 0.0
        self._told = -math.inf
        self._turns: deque[tuple[float, np.ndarray]] = deque(maxlen=64)

    def feel(
        self, time: float, gyroscope: np.ndarray, force: np.ndarray, *, standing: bool,
        attitude: tuple[float, np.ndarray] | None = None,
    ) -> None:  # fmt: skip
        """See `AidedSource.feel`."""
        if not standing and self._state is not None:
            force = turned(-FILTERED_S * (gyroscope - self._state.gyro_bias)) @ force
        last = self._last
        if last is None:
            self._last = time, gyroscope, force
            return
        dt = time - last[0]
        if dt <= 0:
            return
        self._last = time, gyroscope, force
        if dt > PAUSE_S:
            self._state, self._rest = None, None
            self.problem = f"imu: the IMU was silent for {dt:.2f} s; accepted: at most {PAUSE_S:g} s"
            return
        if standing:
            self._stand(time, gyroscope, force, dt)
            return
        self._rest = self._shaking = None
        if self._state is not None:
            # two samples at the ends of the interval; the mean of what they say, in the axes at its end
            turn = turned(0.5 * (last[1] + gyroscope) * dt)
            state = self._state.moved(gyroscope, 0.5 * (force + turn.T @ last[2]), dt, AssumedNoise())
            self._turns.append((state.time, state.rotation))
            if attitude is not None:
                state = dataclasses.replace(state, rotation=state.rotation @ self._righted(*attitude, dt))
            self._state = state

    def read(self, now: float) -> list[Sample]:
        """The newest motion, if it is new."""
        state = self._state
        if state is None or state.time <= self._told:
            return []
        self._told, self.problem = state.time, None
        return [Sample(
            now, state.position, quaternion_of(state.rotation), state.time, state.velocity, state.body_rate
        )]  # fmt: skip

    def close(self) -> None:
        """Nothing to release."""

    def describe(self) -> str:
        """What it is."""
        return "imu, which knows no place"

    def _righted(self, time: float, quaternion: np.ndarray, dt: float) -> np.ndarray:
        """(3, 3) the turn, body, by which the attitude follows another one of some time ago."""
        then = min(self._turns, key=lambda turn: abs(turn[0] - time))[1]
        up, theirs = then[2], rotation_of(quaternion)[2]  # the world's z axis in the body
        return turned(-math.expm1(-dt / UPRIGHT_S) * np.cross(theirs, up))

    def _stand(self, time: float, gyroscope: np.ndarray, force: np.ndarray, dt: float) -> None:
        """Average what the sensors say at rest. A vehicle that is carried is nowhere until it rests again."""
        share = 1.0 if self._shaking is None else -math.expm1(-dt / SHAKEN_S)
        rate, weight = self._shaking or (gyroscope, force)
        self._shaking = rate + share * (gyroscope - rate), weight + share * (force - weight)
        if np.linalg.norm(self._shaking[0]) > TURNING or abs(np.linalg.norm(self._shaking[1]) - GRAVITY) > SHAKEN:
            self._state, self._rest = None, None
            self.problem = "imu: it is being moved; put it down"
            return
        if self._rest is None:
            self._rest, self._rested = (gyroscope, force), 0.0
        share = -math.expm1(-dt / SETTLES_S)
        bias, up = (old + share * (new - old) for old, new in zip(self._rest, (gyroscope, force), strict=True))
        self._rest, self._rested = (bias, up), self._rested + dt
        if self._rested < SETTLES_S:
            self._state, self.problem = None, "imu: it has just been put down"
            return
        size = float(np.linalg.norm(up))
        state = ErrorState.at(time, np.zeros(3), _level(up), AssumedNoise())
        beyond = up * (1 - GRAVITY / size)
        self._state = dataclasses.replace(state, gyro_bias=bias, accel_bias=beyond)


def _level(up: np.ndarray) -> np.ndarray:
    """(3, 3) rotation from the body to a world whose z axis is this vector of the body, at heading 0."""
    x, y, z = (up / np.linalg.norm(up)).tolist()
    pitch, roll = math.atan2(-x, math.hypot(y, z)), math.atan2(y, z)
    return turned(np.array([0.0, pitch, 0.0])) @ turned(np.array([roll, 0.0, 0.0]))
