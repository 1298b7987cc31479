"""An error-state Kalman filter on an IMU and on the pixels of corners of gates. Pure NumPy: state in, state out.

The nominal state is carried on by the IMU. The error has 19 numbers, whose covariance is kept: position and velocity
(world), attitude (body), the biases of gyroscope and accelerometer, the error of the camera's mounting (camera frame),
and the error of the time stamps of its images. A correction takes each corner's pixel as it is: two corners are enough
for one, and none is thrown away for the lack of others. The shape of this filter is that of ADR-VINS
(arXiv:2603.02742); the error state is that of J. Sola, Quaternion kinematics for the error-state Kalman filter, 2017,
with errors of the attitude in the body frame.
"""

import dataclasses
from dataclasses import dataclass

import numpy as np

from e2efly.control.vectors import rotate
from e2efly.flight.pose.gates.association import Expected, associated
from e2efly.flight.pose.gates.lens import NEAREST, Corners, Lens, Openings
from e2efly.vehicles.gravity import GRAVITY

SIZE = 19
POSITION, VELOCITY, ATTITUDE, GYRO, ACCEL, MOUNTING = (slice(3 * i, 3 * i + 3) for i in range(6))
OFFSET = 18
"""Where the parts of the error stand."""
MARGIN = 3.0
"""Corners nearer to the border of the image are not expected to be found, pixels."""
FARTHEST = 14.0
"""Corners farther away are not expected to be found, m."""
ALIKE = 0.75
"""Smallest cosine of the angle, in the image, between a found and an expected corner's direction into the opening."""
PASSES = 2
"""How often an image corrects the state."""
DOUBT = 1.15
"""Factor on the standard deviations of the pose after an image in which corners are expected, and none is found where
one may be."""
STILL = 0.02
"""Standard deviation of velocity, m/s, and body rate, rad/s, of a vehicle that stands, and of what its sensors say of
it."""
EYE = np.eye(3)


@dataclass(frozen=True)
class AssumedNoise:
    """What the filter assumes of its sensors. More than there is costs little; less makes it deaf."""

    gyro: float = 2e-3
    """White noise of the gyroscope, rad/s/sqrt(Hz)."""
    accel: float = 3e-2
    """White noise of the accelerometer, m/s^2/sqrt(Hz): vibration, and the model's errors."""
    gyro_walk: float = 1e-4
    """Random walk of its bias, rad/s/sqrt(s)."""
    accel_walk: float = 5e-3
    """The same of the accelerometer, m/s^2/sqrt(s)."""
    pixel: float = 6.0
    """Standard deviation of a corner, pixels at 640 columns and 90 degrees: pixels, gates that stand elsewhere, bent
    lenses."""
    mounting: float = 0.035
    """Standard deviation of the mounting's angles before the flight, rad: two degrees."""
    offset: float = 0.02
    """Standard deviation of the error of the images' time stamps before the flight, s."""
    gyro_bias: float = 0.02
    """Standard deviation of the bias of the gyroscope before the flight, rad/s."""
    accel_bias: float = 0.3
    """The same of the accelerometer, m/s^2."""
    start: tuple[float, float, float] = (0.2, 0.1, 0.05)
    """Standard deviations of position, m, velocity, m/s, and angles, rad, at the start."""


@dataclass(frozen=True)
class ErrorState:
    """The vehicle's motion as far as it is known, and how far."""

    time: float
    """s, on the clock of the IMU's samples."""
    position: np.ndarray
    """(3,) world, m."""
    velocity: np.ndarray
    """(3,) world, m/s."""
    rotation: np.ndarray
    """(3, 3) body to world."""
    gyro_bias: np.ndarray
    """(3,) rad/s."""
    accel_bias: np.ndarray
    """(3,) m/s^2."""
    mounting: np.ndarray
    """(3, 3) rotation from the camera frame as it should be to the camera frame as it is."""
    offset: float
    """How much later than its stamp an image is exposed, s."""
    body_rate: np.ndarray
    """(3,) rad/s, of the newest IMU sample, without its bias."""
    covariance: np.ndarray
    """(19, 19)."""

    @staticmethod
    def at(time: float, position: np.ndarray, rotation: np.ndarray, noise: AssumedNoise) -> "ErrorState":
        """A vehicle that stands at a known place, within `AssumedNoise.start`."""
        place, speed, turn = noise.start
        deviation = np.repeat(
            [place, speed, turn, noise.gyro_bias, noise.accel_bias, noise.mounting, noise.offset], [3] * 6 + [1]
        )
        zero = np.zeros(3)
        return ErrorState(
            time, np.array(position, float), zero, np.array(rotation, float), zero, zero, EYE, 0.0, zero,
            np.diag(deviation**2),
        )  # fmt: skip

    def moved(self, gyroscope: np.ndarray, accelerometer: np.ndarray, dt: float, noise: AssumedNoise) -> "ErrorState":
        """The state `dt` s later.

        Args:
            gyroscope: (3,) body rate at the end, rad/s.
            accelerometer: (3,) mean specific force over the interval in the body axes at its end, m/s^2.
            dt: s.
            noise: of the sensors.
        """
        rate, force = gyroscope - self.gyro_bias, accelerometer - self.accel_bias
        turn = turned(0.5 * (self.body_rate + rate) * dt)
        rotation = self.rotation @ turn
        push = rotation @ force
        gain = push - np.array([0.0, 0.0, GRAVITY])
        step = np.eye(SIZE)
        step[POSITION, VELOCITY] = EYE * dt
        step[VELOCITY, ATTITUDE] = -rotation @ crossing(force) * dt
        step[VELOCITY, ACCEL] = -rotation * dt
        step[ATTITUDE, ATTITUDE] = turn.T
        step[ATTITUDE, GYRO] = -EYE * dt
        covariance = step @ self.covariance @ step.T
        variances = np.repeat(
            [noise.accel**2, noise.gyro**2, noise.gyro_walk**2, noise.accel_walk**2], 3
        )  # of velocity, attitude, biases
        index = np.arange(3, 15)
        covariance[index, index] += variances * dt
        return dataclasses.replace(
            self, time=self.time + dt, position=self.position + self.velocity * dt + 0.5 * gain * dt**2,
            velocity=self.velocity + gain * dt, rotation=rotation, body_rate=rate, covariance=covariance,
        )  # fmt: skip

    def resting(self, gyroscope: np.ndarray) -> "ErrorState":
        """The state of a vehicle that stands still: its velocity is zero, and its gyroscope (3,), rad/s, measures its
        bias.
        """
        slope = np.zeros((6, SIZE))
        slope[:3, VELOCITY], slope[3:, GYRO] = EYE, EYE
        miss = np.concatenate([-self.velocity, gyroscope - self.gyro_bias])
        cross = slope @ self.covariance
        gain = np.linalg.solve(cross @ slope.T + STILL**2 * np.eye(6), cross).T
        rest = np.eye(SIZE) - gain @ slope
        return self._with(gain @ miss, rest @ self.covariance @ rest.T + STILL**2 * gain @ gain.T)

    def corrected(
        self, found: Corners, lens: Lens, openings: Openings, noise: AssumedNoise
    ) -> "tuple[ErrorState, int]":
        """The state, corrected by the corners of an image with its stamp, and how many of them were used.

        The correction is made twice: the second time, the pixels are expected from where the first has led.
        """
        if not len(found.pixel):
            return self, 0
        sigma = noise.pixel * lens.focal.mean() / 320.0
        state, error, used, likely = self, np.zeros(SIZE), 0, True
        expected, inward = self._expected(lens, openings)
        for _ in range(PASSES):
            pairs = associated(expected, state.covariance, found.pixel, inward @ found.inward.T > ALIKE, sigma)
            if not pairs:
                likely = used > 0 or pairs is not None
                break
            e, f = np.array(pairs).T
            slope = expected.slope[e].reshape(-1, SIZE)
            miss = (found.pixel[f] - expected.pixel[e]).reshape(-1) + slope @ error
            cross = slope @ self.covariance
            gain = np.linalg.solve(cross @ slope.T + sigma**2 * np.eye(len(miss)), cross).T
            rest = np.eye(SIZE) - gain @ slope
            error, used = gain @ miss, len(pairs)
            state = self._with(error, rest @ self.covariance @ rest.T + sigma**2 * gain @ gain.T)
            expected, inward = state._expected(lens, openings)
        if likely or not len(expected.pixel):
            return state, used
        wider = np.eye(SIZE)
        wider[:9, :9] *= DOUBT
        return dataclasses.replace(self, covariance=wider @ self.covariance @ wider), 0

    def _with(self, error: np.ndarray, covariance: np.ndarray) -> "ErrorState":
        """The state with an error added."""
        return dataclasses.replace(
            self,
            position=self.position + error[POSITION],
            velocity=self.velocity + error[VELOCITY],
            rotation=self.rotation @ turned(error[ATTITUDE]),
            gyro_bias=self.gyro_bias + error[GYRO],
            accel_bias=self.accel_bias + error[ACCEL],
            mounting=turned(error[MOUNTING]) @ self.mounting,
            offset=self.offset + float(error[OFFSET]),
            body_rate=self.body_rate - error[GYRO],
            covariance=(covariance + covariance.T) / 2,
        )

    def _expected(self, lens: Lens, openings: Openings) -> tuple[Expected, np.ndarray]:
        """The k corners that are in view, and the directions (k, 2) in the image into their openings."""
        points, ways = (part.reshape(-1, 3) for part in openings.seen(self.position))
        view = self.mounting @ lens.matrix
        body = (points - self.position) @ self.rotation
        ahead = (body - np.array(lens.position)) @ view.T
        near = (ahead[:, 2] > NEAREST) & (ahead[:, 2] < FARTHEST)
        near[near] = lens.inside(lens.pixels(ahead[near]), MARGIN)
        body, ahead, way = body[near], ahead[near], (ways[near] @ self.rotation) @ view.T
        # the image is exposed later than its stamp, and its rows one after the other
        speed = self.velocity @ self.rotation
        drift = -np.cross(self.body_rate, body) - speed
        late = (self.offset + lens.readout * (lens.pixels(ahead)[:, 1] / lens.height - 0.5))[:, None, None]
        turn = EYE - late * crossing(self.body_rate)
        shift = np.zeros((len(body), 3, SIZE))
        shift[:, :, POSITION] = -turn @ self.rotation.T
        shift[:, :, VELOCITY] = -late * self.rotation.T
        shift[:, :, ATTITUDE] = turn @ crossing(body) - late * crossing(speed)
        shift[:, :, GYRO] = -late * crossing(body)
        shift[:, :, OFFSET] = drift
        ahead = (body + drift * late[:, 0] - np.array(lens.position)) @ view.T
        ahead[:, 2] = np.maximum(ahead[:, 2], NEAREST)
        shift = view @ shift
        shift[:, :, MOUNTING] = -crossing(ahead)
        slope = lens.slope(ahead)
        inward = np.einsum("kij,kj->ki", slope, way)
        inward /= np.maximum(np.linalg.norm(inward, axis=-1, keepdims=True), 1e-9)
        return Expected(lens.pixels(ahead), slope @ shift), inward


def crossing(vectors: np.ndarray) -> np.ndarray:
    """(..., 3, 3) matrices of the cross products with vectors (..., 3)."""
    zero = np.zeros_like(vectors[..., 0])
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    rows = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1)
    return rows.reshape(*vectors.shape, 3)


def turned(angles: np.ndarray) -> np.ndarray:
    """(3, 3) rotation by a rotation vector (3,), rad."""
    angle = float(np.linalg.norm(angles))
    across = crossing(angles)
    if angle < 1e-6:
        return EYE + across
    return EYE + np.sin(angle) / angle * across + (1 - np.cos(angle)) / angle**2 * across @ across


def quaternion_of(rotation: np.ndarray) -> np.ndarray:
    """(4,) unit quaternion wxyz of a rotation matrix (3, 3)."""
    m = rotation
    # four times each product of two components: the row of the largest square is far from zero (Shepperd, 1978)
    rows = np.array([
        [1 + m[0, 0] + m[1, 1] + m[2, 2], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
        [m[2, 1] - m[1, 2], 1 + m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
        [m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], 1 - m[0, 0] + m[1, 1] - m[2, 2], m[1, 2] + m[2, 1]],
        [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], 1 - m[0, 0] - m[1, 1] + m[2, 2]],
    ])  # fmt: skip
    row = rows[int(np.argmax(np.diag(rows)))]
    return row / np.linalg.norm(row)


def rotation_of(quaternion: np.ndarray) -> np.ndarray:
    """(3, 3) rotation matrix of a unit quaternion (4,) wxyz."""
    return rotate(quaternion, EYE).T
