"""A pose source on a plant: the vehicle is told where it is by the gates that its camera sees, and by its IMU.

The camera is rendered at the plant's true pose, with the mounting, the age and the shutter that a flight draws. The
estimator is the one that flies. Imports JAX.
"""

import dataclasses
import math
from dataclasses import dataclass, field
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from e2efly.config import CameraConfig, ImuConfig
from e2efly.courses.gates import HALF_DEPTH, Gates
from e2efly.courses.tracks import RaceTrack
from e2efly.flight.pose.gates.error_state import AssumedNoise, ErrorState, quaternion_of, rotation_of, turned
from e2efly.flight.pose.gates.gate_estimator import GateEstimator, InertialSample
from e2efly.flight.pose.gates.lens import Corners, Lens, Openings
from e2efly.flight.sight.gate_corners import gate_corners
from e2efly.flight.sight.segment import Segmenter, chosen
from e2efly.policy.goal import Course
from e2efly.policy.odometry import Odometry
from e2efly.simulation.scenes import camera
from e2efly.simulation.scenes.camera import Mount
from e2efly.simulation.scenes.course import frames
from e2efly.simulation.scenes.gate_looks import KEPT_APART, Look, LookFamily, coloured, drawn, photographed
from e2efly.simulation.scenes.scene import Scene
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
KEPT_S = 0.2
"""How long the states of a vehicle are kept, s. Its images are younger."""


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
    colours: str = ""
    """The segmenter that finds the gates in colours, such as onnx:FILE. Empty: the camera gives the mask of the
    gates."""
    looks: LookFamily = KEPT_APART
    """How a world of colours may look; drawn for each flight."""
    imu: ImuConfig = ImuConfig(True, gyro_noise=1.3e-3, accel_noise=2e-2)
    """White noise of the IMU: vibration, too."""
    imu_rate: float = 250.0
    """Samples per second."""
    bias: tuple[float, float] = (0.01, 0.2)
    """Standard deviations of the constant biases of gyroscope, rad/s, and accelerometer, m/s^2."""
    noise: AssumedNoise = AssumedNoise()
    """What the estimator assumes."""

    @property
    def lens(self) -> Lens:
        """The camera that the estimator is told of."""
        c = self.camera
        readout = self.readout if self.told_readout else 0.0
        return Lens(c.width, c.height, (c.fov[0], c.fov[1]), c.pitch, c.position, readout)


@dataclass(frozen=True)
class GateFlight:
    """The camera of a flight, and the seed of all that it draws."""

    setup: GateCamera
    seed: int

    def begin(self, course: Course, start: RigidState) -> "GatePose":
        """The pose source of the flight; see `GatePose.of`."""
        return GatePose.of(self.setup, course, start, self.seed)


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
class GateEyes:
    """The camera of one flight, with all that is drawn for it."""

    setup: GateCamera
    known: RaceTrack
    """The map of the gates."""
    scene: Scene
    """The gates where they stand: a copy of the world for each band of rows."""
    mount: Mount
    """The camera as it is mounted: a row of the leaves for each band of rows."""
    latency: float
    """Age of the images, s."""
    random: np.random.Generator
    look: Look | None = None
    """How the world looks: a row for each band of rows. None: the camera gives a mask."""
    segmenter: Segmenter | None = None
    """Makes a mask of colours."""
    problem: None = None
    _past: list[tuple[float, RigidState]] = field(default_factory=list)
    _coming: list[tuple[float, float]] = field(default_factory=list)
    """Arrival and exposure of the images that are exposed, s."""
    _next: float = -math.inf

    @staticmethod
    def of(setup: GateCamera, known: RaceTrack, seed: int) -> "GateEyes":
        """Draw the gates' places, the mounting and the age of the images."""
        random, c = np.random.default_rng(seed), setup.camera
        shift = setup.survey * random.standard_normal(known.position.shape)
        real = dataclasses.replace(known, position=known.position + shift)
        scene = Scene.of({"gate": frames(Gates.of(real), BANDS)}, BANDS)
        u = random.uniform(-1, 1, (1, 8))
        angles, offset = (
            jnp.asarray(x, jnp.float32) for x in (c.angle_spread * u[:, :3], c.position_spread * u[:, 5:])
        )
        whole = camera.mounted(c, angles, jnp.asarray(1 + c.fov_spread * u[:, 3:4], jnp.float32), offset)
        look = segmenter = None
        if setup.colours:
            one = drawn(jax.random.key(seed), 1, setup.looks)
            look = jax.tree.map(lambda leaf: jnp.repeat(jnp.asarray(leaf), BANDS, axis=0), one)
            segmenter = chosen(setup.colours)
        return GateEyes(setup, known, scene, banded(whole), float(random.uniform(*c.latency)), random, look, segmenter)

    def see(self, now: float, state: RigidState) -> list[tuple[float, Corners]]:
        """The corners in the images that arrive until `now`, s, with the stamps of the images, s.

        It must be called often: the vehicle moves evenly from one state to the next.
        """
        setup = self.setup
        self._past.append((now, state))
        if now >= self._next:
            self._next = max(self._next, now) + 1 / (setup.camera.rate or 30.0) - 1e-9
            if self.random.uniform() >= setup.lost:
                self._coming.append((now + max(self.latency, setup.readout / 2), now))
        found = []
        while self._coming and self._coming[0][0] <= now:
            came, exposed = self._coming.pop(0)
            found.append((came - float(np.mean(setup.camera.latency)), gate_corners(self._image(exposed))))
        while self._past[0][0] < now - KEPT_S:
            self._past.pop(0)
        return found

    def _image(self, exposed: float) -> np.ndarray:
        """The mask whose middle row was exposed at a time, s, each band of rows at its own."""
        times = exposed + self.setup.readout * ((np.arange(BANDS) + 0.5) / BANDS - 0.5)
        stamps = np.array([time for time, _ in self._past])
        near = [(time, *self._past[int(np.argmin(np.abs(stamps - time)))]) for time in times]
        position = np.array([s.position + (time - at) * s.velocity for time, at, s in near])
        turns = [quaternion_of(rotation_of(s.quaternion) @ turned((time - at) * s.body_rate)) for time, at, s in near]
        c = self.setup.camera
        band = dataclasses.replace(c, height=c.height // BANDS)
        where = self.scene, self.mount, position.astype(np.float32), np.array(turns, np.float32)
        if self.look is None or self.segmenter is None:
            return np.asarray(_look(band, *where)).reshape(c.height, c.width)
        colours = np.asarray(coloured(band, *where, self.look)[0]).reshape(c.height, c.width, 3)
        return self.segmenter(photographed(colours, self.look, c.width / 640, self.random))


@dataclass
class GatePose:
    """The pose source of one flight on a plant: an estimator with the images of `eyes` and an IMU of its own."""

    eyes: GateEyes
    estimator: GateEstimator
    bias: tuple[np.ndarray, np.ndarray]
    """(3,) of gyroscope, rad/s, and accelerometer, m/s^2."""
    last: tuple[float, RigidState]
    """Time, s since the start, and state of the last step."""
    error: list[float] = field(default_factory=list)
    """Distance of the estimate from the vehicle after each sample of the IMU, m."""

    @staticmethod
    def of(setup: GateCamera, course: Course, start: RigidState, seed: int) -> "GatePose":
        """The source of a flight on a course, with all that is drawn for it.

        Raises:
            ValueError: as for `track_of`.
        """
        eyes = GateEyes.of(setup, track_of(course), seed)
        draw, noise = eyes.random.standard_normal, setup.noise
        place, _, turn = noise.start
        state = ErrorState.at(
            0.0, start.position + place / 2 * draw(3),
            rotation_of(start.quaternion) @ turned(turn / 2 * draw(3)), noise,
        )  # fmt: skip
        state = dataclasses.replace(state, velocity=start.velocity.copy(), body_rate=start.body_rate.copy())
        estimator = GateEstimator(state, setup.lens, Openings.of(eyes.known, HALF_DEPTH), noise)
        return GatePose(eyes, estimator, (setup.bias[0] * draw(3), setup.bias[1] * draw(3)), (0.0, start))

    @property
    def interval(self) -> float:
        """Longest time between two samples of the IMU, s."""
        return 1 / self.eyes.setup.imu_rate

    def step(self, after: RigidState, now: float) -> None:
        """Feel and see the motion from the last step to the state `after`, at `now`, s since the start."""
        (then, before), setup = self.last, self.eyes.setup
        dt, imu = now - then, setup.imu
        felt, white = imu_of(before, after, dt), self.eyes.random.standard_normal((2, 3)) / math.sqrt(dt)
        self.estimator.feel(InertialSample(
            now, felt.gyroscope + self.bias[0] + imu.gyro_noise * white[0],
            felt.accelerometer + self.bias[1] + imu.accel_noise * white[1],
        ))  # fmt: skip
        self.last = now, after
        for stamp, corners in self.eyes.see(now, after):
            self.estimator.look(corners, stamp)
        self.error.append(float(np.linalg.norm(self.estimator.state.position - after.position)))

    def odometry(self, now: float) -> Odometry:
        """What the vehicle is told of itself."""
        return self.estimator.odometry(now)


@partial(jax.jit, static_argnames="band")
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
