"""Options of the environment: the vehicle, its sensors, and what is random about them."""

import math
from dataclasses import dataclass, field
from typing import Literal

from e2efly.config.numbers import number


@dataclass(frozen=True)
class NoiseConfig:
    """Standard deviation of the white noise on each observed state, drawn anew at every control step."""

    position: float = 0.0
    """Position, m an axis."""
    velocity: float = 0.0
    """Velocity, m/s an axis."""
    attitude: float = 0.0
    """Attitude, rad about each body axis."""
    body_rate: float = 0.0
    """Body rate, rad/s an axis."""


@dataclass(frozen=True)
class ImuConfig:
    """A consumer IMU. White noise as density, bias as a random walk."""

    observed: bool = False
    """Whether gyroscope and accelerometer join the observation (sets shapes)."""
    gyro_noise: float = 8.7e-5
    """Gyroscope white noise, rad/s/sqrt(Hz)."""
    gyro_bias: float = 2.23e-5
    """Gyroscope bias instability B, rad/s: the bias moves by B sqrt(dt / tau) a step."""
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
    """What a camera does to its image, in this order; docs/noise.md. None leaves a noise out.

    Which noises are in sets the program; their strengths are leaves.
    """

    inverse_depth: float | None = None
    """Depth: standard deviation of 1 / d, 1/m."""
    d435i: bool = False
    """Depth: disparity noise, stereo shadows and range of an Intel D435i."""
    redwood: str | None = None
    """Depth: the Redwood model; synthetic, or a .npy file of the measured distortion, (80, 80, 5)."""
    speckle: float | None = None
    """Image: standard deviation as a share of the value."""
    poisson: float | None = None
    """Image: levels of brightness (256) whose shot noise it has."""
    gaussian: float | None = None
    """Image: standard deviation; of depth, as a share of the farthest."""
    salt_and_pepper: float | None = None
    """Image: share of the values that become 1 or 0, half of them each; of depth, the farthest or a hole."""


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
    """Images a second, a whole part of the control rate; every control step when left out (sets the program)."""
    latency: tuple[float, float] = (0.0, 0.0)
    """Age of an image when it is first seen, s, uniform an episode (its top sets shapes)."""
    fov_spread: float = 0.0
    """Relative half-width of the random factor on the field of view, an episode."""
    angle_spread: float = 0.0
    """Half-width of the random mounting angles, rad an axis, an episode."""
    position_spread: float = 0.0
    """Half-width of the random mounting position, m an axis, an episode."""
    noise: ImageNoiseConfig = ImageNoiseConfig()
    """What it does to the image."""
    noise_share: float = 1.0
    """Share of the episodes that have the noise; the others have clean images."""
    light_spread: float = 0.0
    """Colours: relative half-width of the sun's random strength and direction, an episode."""
    colour_spread: float = 0.0
    """Colours: half-width of what is added at random to red, green and blue of each solid, an episode."""


D435I = CameraConfig(fov=(math.radians(87), math.radians(58)), reach=(0.28, 10.0))
"""Depth of an Intel RealSense D435i."""


@dataclass(frozen=True)
class EnvConfig:
    """The vehicle, its controller, and what is random about them."""

    vehicle: str = "vis_r"
    """A shipped vehicle's name, or the path of a .toml file."""
    command_mode: str = "ctbr"
    """What the policy commands: rotor_thrust, ctbr, attitude, acceleration, velocity or position (sets the program)."""
    integrator: str = "semi_implicit"
    """euler, semi_implicit or rk4 (sets the program)."""
    control_rate: float | None = None
    """Hz; the vehicle's own when left out (sets shapes)."""
    largest_step: float = 0.005
    """Largest physics sub-step, s (sets shapes)."""
    action_latency: tuple[float, float] | None = None
    """Seconds from observation to command, uniform an episode; the vehicle's own when left out (top sets shapes)."""
    observation_latency: tuple[float, float] = (0.0, 0.0)
    """Age of the observed state, s, uniform an episode (its top sets shapes)."""
    past_actions: int | None = None
    """How many past actions the policy sees; as many as the latency holds when left out (sets shapes)."""
    randomize: dict[str, float] = field(default_factory=dict)
    """Relative half-width of the uniform factor on a vehicle parameter, an episode: {"mass": 0.1} is 0.9 to 1.1."""
    wind: float = 0.0
    """Largest wind speed, m/s: constant in an episode, uniform in a ball."""
    noise: NoiseConfig = NoiseConfig()
    """Noise of the observed state."""
    imu: ImuConfig = ImuConfig()
    """The IMU."""
    cameras: tuple[CameraConfig, ...] = ()
    """What the policy sees besides; the task's preset has its own."""
    position_range: float = 5.0
    """Reach of the position command mode, m an axis about the origin."""
