"""Every option of a run, as frozen dataclasses: at once the configuration, the command line and its help.

Imports no JAX, so that `--help` is instant. Numbers are leaves of the compiled programs (changing one does not
recompile) unless the field says that it sets a shape.
"""

from dataclasses import dataclass, field
from typing import Literal

from e2efly.courses import defaults


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
    gyro_tau: float = 500.0
    """Time constant of the gyroscope's bias walk, s."""
    accel_noise: float = 2.35e-3
    """Accelerometer white noise, m/s^2/sqrt(Hz)."""
    accel_bias: float = 3.53e-4
    """Accelerometer bias instability B, m/s^2."""
    accel_tau: float = 800.0
    """Time constant of the accelerometer's bias walk, s."""


@dataclass(frozen=True)
class CameraConfig:
    """A camera on the vehicle, or a LiDAR."""

    sees: Literal["depth", "range", "label", "rgb", "normal", "instance"] = "depth"
    """What its image shows: planar depth, distance, semantic class, colour, surface normals or instances."""
    width: int = 64
    """Columns (sets shapes)."""
    height: int = 64
    """Rows (sets shapes)."""
    projection: Literal["pinhole", "spherical"] = "pinhole"
    """pinhole: a camera; spherical: equal angles between columns and rows, a LiDAR."""
    fov: tuple[float, float] = (1.518436449235301, 1.0122909661567112)
    """Horizontal and vertical field of view, rad."""
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where it sits, body frame (forward, left, up), m."""
    pitch: float = 0.0
    """Downwards from straight ahead, rad."""
    reach: tuple[float, float] = (0.0, 20.0)
    """Depth: nearest and farthest, m; nearer is a hole, farther is the farthest."""
    fov_spread: float = 0.0
    """Relative half-width of the random factor on the field of view, an episode."""
    angle_spread: float = 0.0
    """Half-width of the random mounting angles, rad an axis, an episode."""
    position_spread: float = 0.0
    """Half-width of the random mounting position, m an axis, an episode."""


@dataclass(frozen=True)
class ForestConfig:
    """Trees at random places of a lane along world x."""

    density: float = 0.1
    """Trees a square metre."""
    length: float = 40.0
    """Length of the lane from the start on, m."""
    width: float = 16.0
    """Its width, m."""
    radius: tuple[float, float] = (0.1, 0.35)
    """Of the trunks, m."""
    height: tuple[float, float] = (4.0, 8.0)
    """Of the trunks, m."""
    clear: float = 2.0
    """No tree within this of the start and of the goal, m."""
    room: int = 64
    """Most trees of a world (sets shapes)."""


@dataclass(frozen=True)
class ClutterConfig:
    """Boxes, balls, columns and capsules at random places along a track."""

    obstacles: float = 16.0
    """How many on average; each of `room` places is taken with the same probability."""
    sideways: float = 2.5
    """Their centres lie within this of the straight lines from gate to gate, m an axis."""
    size: tuple[float, float] = (0.15, 0.4)
    """Half-lengths and radii, m."""
    clear: float = 0.5
    """No obstacle nearer than this to a gate's opening or to the start, m."""
    moving: float = 0.0
    """Share of them that swings to and fro."""
    swing: float = 1.0
    """Amplitude of those, m."""
    room: int = 16
    """Most obstacles of a world; a multiple of 4 (sets shapes)."""


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
    position_range: float = 5.0
    """Reach of the position command mode, m an axis about the origin."""


@dataclass(frozen=True)
class HoverConfig:
    """Fly to a point and stay there."""

    episode_s: float = 8.0
    """Length of an episode, s."""
    target: tuple[float, float, float] = defaults.TARGET
    """Where to hover, world, m."""
    position: float = 2.0
    """Start within this of the target, m an axis."""
    velocity: float = 1.0
    """Start velocity, m/s an axis, uniform in +-."""
    tilt: float = 0.5235987755982988
    """Start roll and pitch, rad, uniform in +-."""
    body_rate: float = 1.0
    """Start body rates, rad/s an axis, uniform in +-."""
    radius: float = 0.1
    """Success: within this of the target, m, ..."""
    hold_s: float = 1.0
    """... for this last part of the episode, s."""
    fence: float = defaults.HOVER_FENCE
    """Farther than this from the target the episode fails, m."""


@dataclass(frozen=True)
class LandConfig:
    """Touch down gently on a point of the ground."""

    episode_s: float = 10.0
    """Length of an episode, s."""
    sideways: float = 2.0
    """Start within this of the pad's centre, m an axis."""
    height: tuple[float, float] = (1.0, 3.0)
    """Start height of the feet, m."""
    velocity: float = 0.5
    """Start velocity, m/s an axis, uniform in +-."""
    radius: float = 0.10
    """Success: horizontal error at touch, m."""
    height_error: float = 0.05
    """Success: height error at touch, m."""
    speed: float = 0.5
    """Success: speed at touch, m/s."""
    tilt: float = 0.2617993877991494
    """Success: tilt at touch, rad."""
    fence: float = defaults.LAND_FENCE
    """Farther than this from the pad, sideways or up, the episode fails, m."""


@dataclass(frozen=True)
class TrackConfig:
    """Follow a reference that is seen one second ahead."""

    episode_s: float = 10.0
    """Length of an episode, s (sets shapes)."""
    reference: str = "polynomial"
    """polynomial (random, smooth), circle, lemniscate, or the path of a .csv file with columns t, x, y, z."""
    centre: tuple[float, float, float] = defaults.CENTRE
    """Centre of the reference, world, m."""
    position: float = 1.0
    """Start within this ball about the reference, m."""
    velocity: float = 0.5
    """Start velocity, m/s an axis, uniform in +-."""
    settle_s: float = 2.0
    """The error counts after this time, s."""
    mean_error: float = 0.08
    """Success: mean distance to the reference, m."""
    fence: float = defaults.TRACK_FENCE
    """Farther than this from the reference the episode fails, m."""
    radius: float = defaults.RADIUS
    """Circle: radius; lemniscate: half its length, m."""
    circle_rate: float = defaults.CIRCLE_RATE
    """Circle: angular rate, rad/s."""
    lemniscate_speed: float = defaults.LEMNISCATE_SPEED
    """Lemniscate: top speed, m/s."""
    polynomial_reach: float = 2.0
    """Random polynomial: its knots lie within this of the centre, m an axis."""
    polynomial_speed: float = 2.5
    """Random polynomial: largest speed at a knot, m/s."""


@dataclass(frozen=True)
class RaceConfig:
    """Fly through gates in order."""

    episode_s: float = 12.0
    """Length of an episode, s."""
    track: str = defaults.TRACK
    """four_gates, s_shaped, circle_3d, j_shaped, or the path of a .toml file (its gate count sets shapes)."""
    position: float = 1.0
    """Start within this ball about the track's start, m."""
    laps: int = 1
    """Laps that end the episode with success; 0: fly on until time is out."""
    fence: float = defaults.RACE_FENCE
    """Farther than this from the next gate the episode fails, m."""


TaskConfig = HoverConfig | LandConfig | TrackConfig | RaceConfig


@dataclass(frozen=True)
class RewardConfig:
    """The reward: a weighted sum of the manual's terms."""

    weights: dict[str, float] = field(default_factory=dict)
    """Weight of each term by name; see `e2efly list`. On the command line: changes to the preset's, 0 drops a term."""
    parameters: dict[str, float] = field(default_factory=dict)
    """Constants of the terms that differ from their defaults."""


@dataclass(frozen=True)
class NetworkConfig:
    """The policy network (and the critic's, where there is one)."""

    hidden: tuple[int, ...] = (64, 64)
    """Units of the hidden layers (sets shapes)."""
    activation: Literal["relu", "tanh", "elu"] = "relu"
    """Activation of the hidden layers (sets the program)."""


@dataclass(frozen=True)
class PPOConfig:
    """Proximal policy optimisation (Schulman et al. 2017)."""

    envs: int = 64
    """Environments side by side (sets shapes)."""
    horizon: int = 64
    """Steps of each environment between updates (sets shapes)."""
    epochs: int = 2
    """Passes over the samples of an update (sets shapes)."""
    minibatch: int = 512
    """Samples of a gradient step; divides envs * horizon (sets shapes)."""
    learning_rate: float = 3e-3
    """Adam's step at the start."""
    learning_rate_end: float = 3e-4
    """Adam's step at the end; exponential in between."""
    gamma: float = 0.96
    """Discount a step."""
    gae_lambda: float = 0.95
    """Lambda of the generalised advantage estimate."""
    clip: float = 0.2
    """Clip of the probability ratio."""
    value_weight: float = 0.5
    """Weight of the critic's loss."""
    entropy_weight: float = 0.0
    """Weight of the entropy bonus."""
    log_std: float = -1.0
    """Initial log standard deviation of the action noise."""
    max_grad_norm: float = 0.5
    """Norm to which a gradient is clipped."""


@dataclass(frozen=True)
class BPTTConfig:
    """Back-propagation through time: the exact gradient of the return through physics and policy."""

    envs: int = 64
    """Environments side by side (sets shapes)."""
    horizon: int = 64
    """Steps of a window (sets shapes)."""
    learning_rate: float = 4e-3
    """Adam's step at the start."""
    learning_rate_end: float = 1e-4
    """Adam's step at the end; exponential in between."""
    gamma: float = 0.99
    """Discount a step within the window."""
    max_grad_norm: float = 0.5
    """Norm to which a gradient is clipped."""
    gradient_decay: float = 0.0
    """Decay of the gradient through the state, 1/s of backward time; 0: the exact gradient."""


AlgorithmConfig = PPOConfig | BPTTConfig


@dataclass(frozen=True)
class TrainConfig:
    """Everything that decides the outcome of a run."""

    task: TaskConfig
    """The task."""
    algo: AlgorithmConfig
    """The algorithm."""
    reward: RewardConfig
    """The reward."""
    env: EnvConfig = EnvConfig()
    """Vehicle, latency, randomisation, noise."""
    network: NetworkConfig = NetworkConfig()
    """The networks."""
    seed: int = 0
    """Seed of everything random."""
    steps: int = 2_000_000
    """Environment steps of the whole run."""
    chunk: int = 20
    """Updates between two evaluations (sets shapes)."""
    eval_episodes: int = 250
    """Starts of an evaluation while training (sets shapes)."""
    devices: int | None = None
    """Devices (CPU: cores) that share the environments; left out: all there are, 32 environments or more on each."""
    fast_compile: bool = True
    """On a CPU: compile in half the time, run up to a tenth slower; right for runs of seconds."""
    stop_at: float | None = None
    """Stop once the success on 1000 starts is at least this; left out: use all steps."""
