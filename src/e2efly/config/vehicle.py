"""Options of the environment: the vehicle, its sensors, and what is random about them."""

import math
from dataclasses import dataclass, field
from typing import Literal

from e2efly.numbers import number


@dataclass(frozen=True)
class NoiseConfig:
    """Standard deviation of the white noise on each observed state, drawn anew at every control step."""

    position: float = 0.0
    """Position, m per axis."""
    velocity: float = 0.0
    """Velocity, m/s per axis."""
    attitude: float = 0.0
    """Attitude, rad about each body axis."""
    body_rate: float = 0.0
    """Body rate, rad/s per axis."""


@dataclass(frozen=True)
class DisturbanceConfig:
    """What the vehicle file does not know, drawn per episode between none and the largest, which stands here."""

    gust: float = 0.0
    """Standard deviation of gusts, m/s per axis."""
    gust_time: float = number(1.0, above=0)
    """Correlation time of the gusts, s."""
    thrust: float = number(0.0, high=0.9)
    """Relative half-width of the factor on the thrust of all rotors."""
    rotor: float = number(0.0, high=0.9)
    """Relative half-width of the factor on the thrust of each rotor."""
    sag: float = number(0.0, high=0.9)
    """Share of the thrust that is lost, evenly, by the end of the episode, as by a battery that empties."""
    centre_of_mass: float = 0.0
    """Half-width of the offset of the centre of mass, forward and left, m per axis; of a family: of its middle vehicle,
    and of the others in proportion to their arms."""
    drift: float = 0.0
    """Standard deviation of the observed position's random walk after one second, m per axis."""

    @property
    def weakest(self) -> float:
        """The smallest share of the nominal thrust that an episode can end with."""
        return (1 - self.thrust) * (1 - self.rotor) * (1 - self.sag)


@dataclass(frozen=True)
class ImuConfig:
    """Noise of a consumer IMU: white noise, given as a density, and a bias that walks at random."""

    observed: bool = False
    """Whether gyroscope and accelerometer join the observation (sets shapes)."""
    gyro_noise: float = 8.7e-5
    """Gyroscope white noise, rad/s/sqrt(Hz)."""
    gyro_bias: float = 2.23e-5
    """Gyroscope bias instability B, rad/s: the bias moves by B sqrt(dt / tau) per step."""
    gyro_tau: float = number(500.0, above=0, endless=True)
    """Time constant of the gyroscope's bias walk, s."""
    accel_noise: float = 2.35e-3
    """Accelerometer white noise, m/s^2/sqrt(Hz)."""
    accel_bias: float = 3.53e-4
    """Accelerometer bias instability B, m/s^2."""
    accel_tau: float = number(800.0, above=0, endless=True)
    """Time constant of the accelerometer's bias walk, s."""


@dataclass(frozen=True)
class ImageNoiseConfig:
    """Noises of a camera's images, applied in this order; None leaves one out. See docs/noise.md.

    Which noises are switched on sets the program; their strengths do not.
    """

    inverse_depth: float | None = None
    """Depth: standard deviation of the inverse depth, 1/m."""
    d435i: bool = False
    """Depth: disparity noise, stereo shadows and range of an Intel D435i."""
    redwood: str | None = None
    """Depth: the Redwood model; `synthetic`, or the path of a .npy file of measured distortion factors, (80, 80, 5)."""
    speckle: float | None = None
    """Image: standard deviation as a share of the value."""
    poisson: float | None = number(None, low=2, high=65536)
    """Image: levels of brightness, such as 256, whose shot noise it has."""
    gaussian: float | None = None
    """Image: standard deviation, of values in [0, 1]; of depth, as a share of the farthest."""
    salt_and_pepper: float | None = number(None, high=1)
    """Image: share of the values that become 1 or 0, half of them each; of depth, the farthest or a hole."""
    own: str | None = None
    """Your own function (key, images, camera) -> images: path/to/file.py:name or module:name."""


@dataclass(frozen=True)
class CameraConfig:
    """A camera on the vehicle, or a LiDAR."""

    sees: Literal["depth", "range", "mask", "rgb", "normal", "label", "instance"] = "depth"
    """What its image shows: planar depth, distance, where a class is, colour, surface normals, semantic class or
    instances; a policy takes the first five (sets the program)."""
    width: int = 64
    """Columns (sets shapes)."""
    height: int = 64
    """Rows (sets shapes)."""
    projection: Literal["pinhole", "spherical"] = "pinhole"
    """pinhole: a camera; spherical: equal angles between columns and rows, a LiDAR."""
    fov: tuple[float, float] = (1.518436449235301, 1.0122909661567112)
    """Horizontal and vertical field of view, rad (sets the program)."""
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where it sits, body frame (forward, left, up), m."""
    pitch: float = 0.0
    """Downwards from straight ahead, rad."""
    reach: tuple[float, float] = (0.0, 20.0)
    """Depth: nearest and farthest, m; nearer is a hole, farther is the farthest (sets the program)."""
    of: str = "pad"
    """mask: the class that it is of: sky, ground, obstacle, gate, pad or wall (sets the program)."""
    encoding: Literal["inverse", "log", "linear"] = "inverse"
    """How a policy takes depth d, f the farthest: 1 m / d - 1 m / f, log(f / d) or 1 - d / f. 0 is the farthest, and a
    hole (sets the program)."""
    rate: float | None = None
    """Images per second, a whole part of the control rate; one per control step when left out (sets the program)."""
    latency: tuple[float, float] = (0.0, 0.0)
    """Age of an image when it is first seen, s, uniform per episode (its top sets shapes)."""
    fov_spread: float = 0.0
    """Relative half-width of the random factor on the field of view, per episode."""
    angle_spread: float = 0.0
    """Half-width of the random mounting angles, rad per axis, per episode."""
    position_spread: float = 0.0
    """Half-width of the random mounting position, m per axis, per episode."""
    noise: ImageNoiseConfig = ImageNoiseConfig()
    """Noise of its images."""
    noise_share: float = 1.0
    """Share of the episodes that have the noise; the others have clean images."""
    light_spread: float = 0.0
    """Colours: relative half-width of the sun's random strength and direction, per episode."""
    colour_spread: float = 0.0
    """Colours: half-width of what is added at random to red, green and blue of each solid, per episode."""


D435I = CameraConfig(fov=(math.radians(87), math.radians(58)), reach=(0.28, 10.0))
"""Depth of an Intel RealSense D435i."""


@dataclass(frozen=True)
class EnvConfig:
    """The vehicle, its controller, and what is random about them."""

    vehicle: str = "vis_r"
    """A shipped vehicle's name, `any`, or the path of a .toml file: of a vehicle, or of ranges of many (a family)."""
    command_mode: str = "ctbr"
    """What the policy commands: a command mode of `e2efly list` (sets the program)."""
    integrator: str = "rk3"
    """euler, semi_implicit, rk3 or rk4 (sets the program)."""
    control_rate: float | None = None
    """Hz; the vehicle's own when left out (sets shapes)."""
    largest_step: float = 0.005
    """Largest physics sub-step, s (sets shapes)."""
    action_latency: tuple[float, float] | None = None
    """Seconds from observation to command, uniform per episode; the vehicle's own when left out (top sets shapes)."""
    latency_spread: tuple[float, float] = (0.0, 0.0)
    """Seconds by which that latency lies below or above the vehicle's own at most, uniform per episode, where
    action_latency is left out (the second sets shapes)."""
    observation_latency: tuple[float, float] = (0.0, 0.0)
    """Age of the observed state, s, uniform per episode (its top sets shapes)."""
    command_range: tuple[tuple[float, float, float, float], tuple[float, float, float, float]] | None = None
    """Commands that actions of -1 and of 1 stand for, in the units of the command mode; the vehicle's own limits when
    left out. What is beyond those the flight controller clips."""
    past_actions: int | None = None
    """How many past actions the policy sees: 0 as in the paper, as many as the latency holds when left out (sets
    shapes)."""
    randomize: dict[str, float] = field(default_factory=dict)
    """Relative half-width of the uniform factor on a vehicle parameter, per episode: {"mass": 0.1} is 0.9 to 1.1.
    {"identified": 1.0} draws from the standard deviations and correlations of the vehicle's file, times so much."""
    wind: float = 0.0
    """Largest wind speed, m/s: constant in an episode, uniform in a ball."""
    disturbance: DisturbanceConfig = DisturbanceConfig()
    """Gusts, uneven rotors, a sagging battery, an offset of the centre of mass, and drifting poses."""
    noise: NoiseConfig = NoiseConfig()
    """Noise of the observed state."""
    imu: ImuConfig = ImuConfig()
    """The IMU."""
    cameras: tuple[CameraConfig, ...] = ()
    """What the policy sees besides; the task's preset has its own."""
    position_range: float = 5.0
    """Reach of the position command mode, m per axis about the origin."""

    @property
    def weakest(self) -> float:
        """The smallest thrust over weight that an episode can have, over that of the vehicle's file."""
        lost = self.randomize.get("thrust_map", 0.0)
        return (1 - lost) * self.disturbance.weakest / (1 + self.randomize.get("mass", 0.0))
