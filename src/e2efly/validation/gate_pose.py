"""A pose source on a plant: the vehicle is told where it is by the gates that its camera sees, and by its IMU.

The camera is rendered at the plant's true pose, with the mounting, the age and the shutter that a flight draws. The
estimator is the one that flies. Imports JAX.
"""

import dataclasses
import math
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from e2efly.config import CameraConfig, ImuConfig
from e2efly.courses.gates import Gates
from e2efly.courses.tracks import RaceTrack
from e2efly.flight.pose.gates.error_state import ErrorState, SensorNoise, quaternion_of, rotation_of, turned
from e2efly.flight.pose.gates.gate_corners import gate_corners
from e2efly.flight.pose.gates.gate_estimator import GateEstimator, InertialSample
from e2efly.flight.pose.gates.lens import Lens, Openings
from e2efly.policy.goal import Course
from e2efly.policy.odometry import Odometry
from e2efly.simulation.scenes import camera
from e2efly.simulation.scenes.camera import Mount
from e2efly.simulation.scenes.course import HALF_DEPTH, frames
from e2efly.simulation.scenes.scene import Scene
from e2efly.simulation.sensors import eyes  # registers cameras as pytrees
from e2efly.validation.plant import RigidState
from e2efly.validation.plant_flight import imu_of

ACROSS = math.radians(90)
RACER = CameraConfig(
    "mask", 640, 360, of="gate", fov=(ACROSS, 2 * math.atan(math.tan(ACROSS / 2) * 360 / 640)),
    pitch=-math.radians(20), rate=30.0, latency=(0.02, 0.06), angle_spread=math.radians(2),
)  # fmt: skip
"""The camera of a racer: tilted up by 20 degrees, mounted within 2 degrees, its images 20 to 60 ms old."""
BANDS = 12
"""Bands of rows that a rolling shutter exposes one after the other."""


@dataclass(frozen=True)
class GateCamera:
    """What a camera and an IMU do wrong, in every flight another way."""

    camera: CameraConfig = RACER
    """The camera. Its spreads and the range of its latency are drawn for each flight. The estimator is told the middle
    of each."""
    readout: float = 0.016
    """Time between the exposures of the first and the last row, s."""
    told_readout: bool = True
    """Whether the estimator knows it."""
    survey: float = 0.02
    """Standard deviation of the gates' places from the map, m per axis."""
    lost: float = 0.05
    """Share of the images that are lost."""
    imu: ImuConfig = ImuConfig(True, gyro_noise=1.3e-3, accel_noise=2e-2)
    """White noise of the IMU: vibration, too."""
    imu_rate: float = 250.0
    """Samples per second."""
    bias: tuple[float, float] = (0.01, 0.2)
    """Standard deviations of the constant biases of gyroscope, rad/s, and accelerometer, m/s^2."""
    noise: SensorNoise = SensorNoise()
    """What the estimator assumes."""

    @property
    def lens(self) -> Lens:
        """The camera that the estimator is told of."""
        c = self.camera
        readout = self.readout if self.told_readout else 0.0
        return Lens(c.width, c.height, (c.fov[0], c.fov[1]), c.pitch, c.position, readout)


def track_of(course: Course) -> RaceTrack:
    """The gates of a course.

    Raises:
        ValueError: for a course without gates, or with gates that move.
    """
    tracks, gates = getattr(course.memory, "tracks", None), getattr(course.goal, "gates", None)
    if tracks is not None:
        return tracks.track(0)
    if not isinstance(gates, Gates) or getattr(getattr(course.goal, "config", None), "swing", 0.0):
        raise ValueError(
            f"--pose is 'gates' and the task {type(course.goal).__name__}; accepted: a task whose gates stand still"
        )
    return RaceTrack(
        "course", bool(course.goal.closed), np.asarray(gates.start, float), float(gates.start_yaw),
        np.asarray(gates.position[:-1], float), np.arctan2(np.asarray(gates.sin, float), np.asarray(gates.cos, float)),
        2 * np.asarray(gates.half, float),
    )  # fmt: skip


@dataclass
class GatePose:
    """The pose source of one flight."""

    setup: GateCamera
    scene: Scene
    """The world: gates where they stand, n copies."""
    mount: Mount
    """The camera as it is mounted: a leaf row for each band of rows."""
    latency: float
    """Age of the images, s."""
    estimator: GateEstimator
    random: np.random.Generator
    bias: tuple[np.ndarray, np.ndarray]
    """(3,) of gyroscope and accelerometer."""
    error: list[float] = field(default_factory=list)
    """Distance of the estimate from the vehicle after each sample of the IMU, m."""
    _past: list[tuple[float, RigidState]] = field(default_factory=list)
    _coming: list[tuple[float, float]] = field(default_factory=list)
    """Arrival and exposure of the images that are exposed, s."""
    _next: float = 0.0

    @staticmethod
    def of(setup: GateCamera, course: Course, start: RigidState, seed: int) -> "GatePose":
        """The source of a flight on a course, with all that is drawn for it.

        Raises:
            ValueError: as for `track_of`.
        """
        random, c = np.random.default_rng(seed), setup.camera
        known = track_of(course)
        real = dataclasses.replace(
            known, position=known.position + setup.survey * random.standard_normal(known.position.shape)
        )
        scene = Scene.of({"gate": frames(Gates.of(real), BANDS)}, BANDS)
        u = random.uniform(-1, 1, 8)
        angles, offset = c.angle_spread * u[:3], c.position_spread * u[5:]
        whole = camera.mounted(c, jnp.asarray(angles[None]), jnp.asarray(1 + c.fov_spread * u[None, 3:4]), offset[None])
        rotation = rotation_of(start.quaternion)
        place, _, turn = setup.noise.start
        state = ErrorState.at(
            0.0, start.position + place / 2 * random.standard_normal(3),
            rotation @ turned(turn / 2 * random.standard_normal(3)), setup.noise,
        )  # fmt: skip
        state = dataclasses.replace(state, velocity=start.velocity.copy(), body_rate=start.body_rate.copy())
        bias = setup.bias[0] * random.standard_normal(3), setup.bias[1] * random.standard_normal(3)
        estimator = GateEstimator(state, setup.lens, Openings.of(known, HALF_DEPTH), setup.noise)
        latency = float(random.uniform(*c.latency))
        return GatePose(setup, scene, banded(whole), latency, estimator, random, bias, _past=[(0.0, start)])

    @property
    def interval(self) -> float:
        """Longest time between two samples of the IMU, s."""
        return 1 / self.setup.imu_rate

    def step(self, after: RigidState, now: float) -> None:
        """Feel and see the motion from the last step to the state `after`, at `now`, s since the start."""
        before, dt = self._past[-1][1], now - self._past[-1][0]
        setup, imu = self.setup, self.setup.imu
        felt = imu_of(before, after, dt)
        white = self.random.standard_normal((2, 3)) / math.sqrt(dt)
        self.estimator.feel(InertialSample(
            now, felt.gyroscope + self.bias[0] + imu.gyro_noise * white[0],
            felt.accelerometer + self.bias[1] + imu.accel_noise * white[1],
        ))  # fmt: skip
        self._past.append((now, after))
        if now >= self._next:
            self._next += 1 / (setup.camera.rate or 30.0)
            if self.random.uniform() >= setup.lost:
                self._coming.append((now + max(self.latency, setup.readout / 2), now))
        while self._coming and self._coming[0][0] <= now:
            came, exposed = self._coming.pop(0)
            stamp = came - float(np.mean(setup.camera.latency))
            self.estimator.look(gate_corners(self._image(exposed)), stamp)
        while self._past[0][0] < now - 0.2:
            self._past.pop(0)
        self.error.append(float(np.linalg.norm(self.estimator.state.position - after.position)))

    def odometry(self, now: float) -> Odometry:
        """What the vehicle is told of itself."""
        return self.estimator.odometry(now)

    def _image(self, exposed: float) -> np.ndarray:
        """The mask whose middle row was exposed at a time, s, each band of rows at its own."""
        times = exposed + self.setup.readout * ((np.arange(BANDS) + 0.5) / BANDS - 0.5)
        stamps = np.array([time for time, _ in self._past])
        nearest = [self._past[int(np.argmin(np.abs(stamps - time)))] for time in times]
        position = np.array([s.position + (t - at) * s.velocity for t, (at, s) in zip(times, nearest, strict=True)])
        turns = [
            quaternion_of(rotation_of(s.quaternion) @ turned((t - at) * s.body_rate))
            for t, (at, s) in zip(times, nearest, strict=True)
        ]
        c = self.setup.camera
        band = dataclasses.replace(c, height=c.height // BANDS)
        rows = _look(band, self.scene, self.mount, position.astype(np.float32), np.array(turns, np.float32))
        return np.asarray(rows).reshape(c.height, c.width)


@jax.jit
def _look(
    band: CameraConfig, scene: Scene, mount: Mount, position: Float[Array, "b 3"], quaternion: Float[Array, "b 4"]
) -> Float[Array, "b h w"]:
    return camera.look(band, scene, mount, position, quaternion)


def banded(whole: Mount) -> Mount:
    """The camera of one vehicle as one camera for each band of rows, from the top."""
    half = 1 / BANDS
    middle = (np.arange(BANDS) + 0.5) * 2 * half - 1
    part = np.tile(np.eye(3), (BANDS, 1, 1))
    part[:, 1, 1], part[:, 1, 2] = half, middle
    return Mount(whole.matrix @ jnp.asarray(part, jnp.float32), jnp.repeat(whole.offset, BANDS, axis=0))
