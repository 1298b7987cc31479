"""Options of the environment: the vehicle, its sensors, and their random variation."""

import dataclasses
import math
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from e2efly.config.domain import Domain, extent
from e2efly.config.numbers import ANGLE, BODY_RATE, LATEST, SPEED, number, shape


@dataclass(frozen=True)
class NoiseConfig:
    """Standard deviation of the white noise on each observed state, drawn anew at every control step."""

    position: float = 0.0
    """Position, m per axis."""
    velocity: float = number(0.0, high=SPEED)
    """Velocity, m/s per axis."""
    attitude: float = number(0.0, high=ANGLE)
    """Attitude, rad about each body axis."""
    body_rate: float = number(0.0, high=BODY_RATE)
    """Body rate, rad/s per axis."""


@dataclass(frozen=True)
class DisturbanceConfig:
    """Effects that the vehicle file does not include.

    The strengths are the largest ones: each episode draws its own between zero and these.
    """

    gust: float = number(0.0, high=SPEED)
    """Standard deviation of gusts, m/s per axis."""
    gust_time: float = number(1.0, above=0)
    """Correlation time of the gusts, s."""
    thrust: float = number(0.0, high=0.9)
    """Relative half-width of the random factor on the thrust of all rotors."""
    rotor: float = number(0.0, high=0.9)
    """Relative half-width of the random factor on the thrust of each rotor."""
    sag: float = number(0.0, high=0.9)
    """Share of the thrust that is lost by the end of the episode. The loss is steady, as with a battery that drains."""
    centre_of_mass: float = number(0.0, high=1.0)
    """Half-width of the offset of the centre of mass, forward and left, m per axis. For a family, this is the value of
    its middle vehicle; that of the others is proportional to their arm length."""
    drift: float = number(0.0, high=SPEED)
    """Standard deviation of the observed position's random walk after one second, m per axis."""
    ceiling: float = number(0.0, high=0.9, added=True)
    """Largest share of its highest thrust that a rotor does not reach. Each rotor of an episode has its own ceiling.
    Commands below it are not affected."""
    push: float = number(0.0, high=0.9, added=True)
    """Largest force from outside at the centre of mass, relative to the vehicle's weight. It is constant in an episode,
    in a random horizontal direction."""
    plain_mixer: float = number(0.0, high=1.0, added=True)
    """Share of the episodes in which the mixer clips each rotor by itself. In the others attitude has priority over
    thrust."""

    @property
    def weakest(self) -> float:
        """The smallest share of the nominal thrust with which an episode can end, relative to what a hover needs."""
        return (1 - self.thrust) * (1 - self.rotor) * (1 - self.sag) * (1 - self.ceiling) / math.hypot(1, self.push)


@dataclass(frozen=True)
class EstimateConfig:
    """Errors of a state estimate, which white noise does not describe.

    Each number is the largest one: half of the episodes do not have the effect, and each of the others draws its own
    strength between zero and this.
    """

    position_lag: float = number(0.0, high=1.0)
    """Time constant of the low-pass of the observed position, s."""
    velocity_lag: float = number(0.0, high=1.0)
    """Time constant of the low-pass of the observed velocity, s."""
    attitude_lag: float = number(0.0, high=1.0)
    """Time constant of the low-pass of the observed attitude, s."""
    body_rate_lag: float = number(0.0, high=1.0)
    """Time constant of the low-pass of the observed body rates, s."""
    yaw: float = number(0.0, high=ANGLE)
    """Constant error of the observed heading, rad, to either side."""
    tilt: float = number(0.0, high=ANGLE)
    """Constant error of the observed attitude about a horizontal axis of the body, rad."""
    jump: float = number(0.0, high=100.0)
    """Error of the observed position while poses are wrong, m in a random direction. That is the case about every four
    seconds, for 0.2 s on average."""
    hold: float = number(0.0, high=100.0)
    """How often in succession a pose is repeated, control steps: each pose between not at all and so often, while the
    body rates go on."""


@dataclass(frozen=True)
class LinkConfig:
    """Commands that do not reach the flight controller, which goes on with the last one.

    Each number is the largest one: half of the episodes do not have the effect, and each of the others draws its own
    strength between zero and this.
    """

    dropped: float = number(0.0, high=0.9)
    """Share of the control steps whose command is lost."""
    silence: float = number(0.0, high=10.0)
    """How long all commands are lost, s, once in every three seconds."""


@dataclass(frozen=True)
class PayloadConfig:
    """A load that hangs from the vehicle on a cable. Every episode draws its own."""

    mass: tuple[float, float] = number((0.0, 0.0), high=1.0, rising=True)
    """Mass of the load relative to the vehicle's, uniform. 0, 0: no load."""
    length: tuple[float, float] = number((0.5, 0.5), low=0.1, high=10.0, rising=True)
    """Length of the cable, m, uniform."""
    hook: float = number(0.0, high=1.0)
    """Distance of the cable's upper end below the vehicle's centre of mass, m."""
    swing: float = number(0.0, high=ANGLE / 2)
    """Largest angle of the cable from the vertical at the start, rad: uniform in a disc."""

    def domain(self) -> Domain:
        """The loads that episodes draw."""
        if not self.mass[1]:
            return ()
        return extent("load_mass", "1", self.mass), extent("cable_length", "m", self.length)

    LIGHTEST: ClassVar[float] = 0.01
    """Smallest accepted mass of a load relative to the vehicle's."""

    def check(self, name: str) -> None:
        """A load has a mass.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        if self.mass[1] and self.mass[0] < self.LIGHTEST:
            raise ValueError(
                f"{name}.mass is {self.mass}; accepted: 0, 0 for no load, or two rising numbers from {self.LIGHTEST:g}"
            )


@dataclass(frozen=True)
class ImuConfig:
    """Noise of a consumer IMU: white noise, given as a density, and a bias that follows a random walk."""

    observed: bool = False
    """Whether the gyroscope and the accelerometer are part of the observation. They are, too, if task.observes names
    one of them (sets shapes)."""
    gyro_noise: float = number(8.7e-5, high=BODY_RATE)
    """Gyroscope white noise, rad/s/sqrt(Hz)."""
    gyro_bias: float = number(2.23e-5, high=BODY_RATE)
    """Gyroscope bias instability B, rad/s: the bias moves by B sqrt(dt / tau) per step."""
    gyro_tau: float = number(500.0, above=0, endless=True)
    """Time constant of the gyroscope's bias walk, s."""
    accel_noise: float = number(2.35e-3, high=1e3)
    """Accelerometer white noise, m/s^2/sqrt(Hz)."""
    accel_bias: float = number(3.53e-4, high=1e3)
    """Accelerometer bias instability B, m/s^2."""
    accel_tau: float = number(800.0, above=0, endless=True)
    """Time constant of the accelerometer's bias walk, s."""


@dataclass(frozen=True)
class ImageNoiseConfig:
    """Noise types of a camera's images, applied in this order. None switches a noise off. See docs/noise.md.

    The choice of noises sets the program; their strengths do not.
    """

    inverse_depth: float | None = number(None, high=1e3)
    """Depth: standard deviation of the inverse depth, 1/m."""
    d435i: bool = False
    """Depth: disparity noise, stereo shadows and limited range of an Intel D435i."""
    redwood: str | None = None
    """Depth: the Redwood model; `synthetic`, or the path of a .npy file of measured distortion factors, (80, 80, 5)."""
    speckle: float | None = number(None, high=10.0)
    """Image: standard deviation as a share of the value."""
    poisson: float | None = number(None, low=2, high=65536)
    """Image: shot noise, for this number of brightness levels, such as 256."""
    gaussian: float | None = number(None, high=10.0)
    """Image: standard deviation, for values in [0, 1]. Depth: as a share of the farthest distance."""
    salt_and_pepper: float | None = number(None, high=1)
    """Image: share of the values that become 1 or 0, half of them each. Depth: they become the farthest distance or a
    hole."""
    own: str | None = None
    """Your own function (key, images, camera) -> images: path/to/file.py:name or module:name."""


@dataclass(frozen=True)
class CameraConfig:
    """A camera on the vehicle, or a LiDAR."""

    sees: Literal["depth", "range", "mask", "rgb", "normal", "label", "instance"] = "depth"
    """What its image shows: planar depth, distance (range), the mask of one class, colour, surface normals, semantic
    class or instances. A policy can use only the first five (sets the program)."""
    width: int = number(64, low=1, high=8192)
    """Columns (sets shapes)."""
    height: int = number(64, low=1, high=8192)
    """Rows (sets shapes)."""
    projection: Literal["pinhole", "spherical"] = "pinhole"
    """pinhole: a camera. spherical: equal angles between columns and between rows, as in a LiDAR."""
    fov: tuple[float, float] = number((1.518436449235301, 1.0122909661567112), above=0, high=2 * math.pi + 1e-6)
    """Horizontal and vertical field of view, rad (sets the program)."""
    position: tuple[float, float, float] = number((0.0, 0.0, 0.0), low=-math.inf)
    """Position of the camera in the body frame (forward, left, up), m."""
    pitch: float = number(0.0, low=-ANGLE, high=ANGLE)
    """Downward pitch from straight ahead, rad."""
    reach: tuple[float, float] = number((0.0, 20.0), rising=True)
    """Depth: nearest and farthest distance, m. Nearer points become holes; farther points get the farthest distance
    (sets the program)."""
    of: str = "pad"
    """mask: the class that it shows: sky, ground, obstacle, gate, pad or wall (sets the program)."""
    encoding: Literal["inverse", "log", "linear"] = "inverse"
    """How the depth d is given to a policy, with the farthest distance f. inverse: 1 m / d - 1 m / f. log: log(f / d).
    linear: 1 - d / f. The value 0 means the farthest distance or a hole (sets the program)."""
    rate: float | None = number(None, above=0)
    """Images per second; must divide the control rate. If omitted, one image per control step (sets the program)."""
    latency: tuple[float, float] = number((0.0, 0.0), high=LATEST, rising=True)
    """Age of an image when the policy first sees it, s, uniform per episode (the upper bound sets shapes)."""
    fov_spread: float = number(0.0, high=0.9)
    """Relative half-width of the random factor on the field of view, per episode."""
    angle_spread: float = number(0.0, high=ANGLE)
    """Half-width of the random mounting angles, rad per axis, per episode."""
    position_spread: float = number(0.0, high=10.0)
    """Half-width of the random mounting position, m per axis, per episode."""
    noise: ImageNoiseConfig = ImageNoiseConfig()
    """Noise of its images."""
    noise_share: float = number(1.0, high=1.0)
    """Share of the episodes in which the images have the noise. In the other episodes they are clean."""
    light_spread: float = number(0.0, high=1.0)
    """Colour images: relative half-width of the random variation of the sun's strength and direction, per episode."""
    colour_spread: float = number(0.0, high=1.0)
    """Colour images: half-width of the random offset of the red, green and blue of each solid, per episode."""


D435I = CameraConfig(fov=(math.radians(87), math.radians(58)), reach=(0.28, 10.0))
"""Depth camera of an Intel RealSense D435i."""
AHEAD = dataclasses.replace(D435I, noise=ImageNoiseConfig(d435i=True), pitch=-0.35)
"""The same on a vehicle, as every task that looks ahead has it: tilted 20 degrees up, because a vehicle that flies fast
leans forwards. A vehicle has one mount, so there is one pitch."""


FILE, RANDOM = "vehicle of the file", "random vehicles"
"""Names of what flies, wherever a success or an error is told. The vehicle of the file flies with its delay, in still
air. Random vehicles have what each episode draws: vehicles, delays, air and cameras."""
STILL, STRESS = f"{RANDOM}, still air", "all stress at once"
"""The same for the vehicles of a family without anything else that is drawn, and for the stress test's last row."""


@dataclass(frozen=True)
class EnvConfig:
    """The vehicle, its controller, and their random variation."""

    vehicle: str = "vis_r"
    """Name of a shipped vehicle, `any`, or the path of a .toml file. The file describes one vehicle, or the parameter
    ranges of many (a family)."""
    command_mode: str = "ctbr"
    """What the policy commands: a command mode of `e2efly list rest` (sets the program)."""
    integrator: str = "rk3"
    """Integrator of the physics: euler, semi_implicit, rk3 or rk4 (sets the program)."""
    control_rate: float | None = number(None, low=0.1)
    """Control rate, Hz. If omitted, the vehicle's own rate (sets shapes)."""
    largest_step: float = number(0.005, low=1e-6, high=1.0)
    """Largest physics sub-step, s (sets shapes)."""
    action_latency: tuple[float, float] | None = number(None, high=LATEST, rising=True)
    """Latency from observation to command, s, uniform per episode. If omitted, the vehicle's own (the upper bound sets
    shapes)."""
    latency_spread: tuple[float, float] = number((0.0, 0.0), high=1.0)
    """Largest deviation of that latency below and above the vehicle's own, s, uniform per episode. Used if
    action_latency is omitted (the second value sets shapes)."""
    observation_latency: tuple[float, float] = number((0.0, 0.0), high=LATEST, rising=True)
    """Age of the observed state, s, uniform per episode (the upper bound sets shapes)."""
    command_range: tuple[tuple[float, float, float, float], tuple[float, float, float, float]] | None = None
    """Commands that correspond to the actions -1 and 1, in the units of the command mode. If omitted, the vehicle's own
    limits. The flight controller clips commands beyond the vehicle's limits."""
    past_actions: int | None = number(None, high=1000)
    """Number of past actions that the policy sees; 0 as in the paper. If omitted, as many as the latency spans (sets
    shapes)."""
    randomize: dict[str, float] = field(default_factory=dict)
    """Relative half-width of the uniform random factor on a vehicle parameter, per episode: mass 0.1 means 0.9 to 1.1.
    identified 1.0 draws from the standard deviations, multiplied by this number, and the correlations of the
    vehicle's file."""
    wind: float = number(0.0, high=SPEED)
    """Largest wind speed, m/s. The wind is constant in an episode and is drawn uniformly from a ball."""
    downwash: float = number(0.0, high=3.0, added=True)
    """Velocity of the air that the other vehicles of a world blow downwards, relative to a turbulent jet of their
    weight. Only for tasks with several vehicles in a world. 0: none (sets the program)."""
    cushion: float = number(0.0, high=3.0, added=True)
    """Additional thrust of a rotor near the ground z = 0, relative to the formula of Cheeseman and Bennett. 0: none
    (sets the program)."""
    central_critic: bool = shape(False, added=True)
    """Whether a critic knows the motion of all others of the world, whatever the policy observes of them. Only for
    tasks with several vehicles in a world (sets shapes)."""
    lost_rotor: float = number(0.0, high=1.0, added=True)
    """Probability that an episode loses a rotor: any one of them stops, and neither the policy nor the flight
    controller is told. 0: none does (sets the program)."""
    lost_rotor_time: tuple[float, float] = number((0.5, 3.0), rising=True, added=True)
    """Earliest and latest time of that, s since the start of the episode; drawn uniformly."""
    disturbance: DisturbanceConfig = DisturbanceConfig()
    """Gusts, uneven rotors, a sagging battery, an offset of the centre of mass, and drifting poses."""
    noise: NoiseConfig = NoiseConfig()
    """Noise of the observed state."""
    estimate: EstimateConfig = shape(EstimateConfig(), added=True)
    """Late, turned, jumping and repeated poses."""
    link: LinkConfig = shape(LinkConfig(), added=True)
    """Lost commands."""
    payload: PayloadConfig = shape(PayloadConfig(), added=True)
    """A load on a cable."""
    imu: ImuConfig = ImuConfig()
    """The IMU."""
    cameras: tuple[CameraConfig, ...] = ()
    """Cameras whose images the policy sees in addition to the state. The task's preset has its own cameras."""
    position_range: float = number(5.0, above=0)
    """Largest distance that the position command mode can command, m per axis from the origin."""

    @property
    def weakest(self) -> float:
        """The smallest thrust-to-weight ratio that an episode can have, relative to that of the vehicle's file."""
        lost = self.randomize.get("thrust_map", 0.0)
        return (1 - lost) * self.disturbance.weakest / (1 + self.randomize.get("mass", 0.0) + self.payload.mass[1])
