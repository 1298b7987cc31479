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
    """How a policy takes depth d: 1 m over d, the logarithm of the farthest over d, or d over the farthest; a hole is 0
    (sets the program)."""
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
    cameras: tuple[CameraConfig, ...] = ()
    """What the policy sees besides; the task's preset has its own."""
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
class LandVisualConfig:
    """Touch down gently on a pad that is only seen."""

    episode_s: float = 10.0
    """Length of an episode, s."""
    sideways: float = 1.0
    """Start within this of the pad's centre, m an axis."""
    height: tuple[float, float] = (1.0, 3.0)
    """Start height of the feet over the pad, m."""
    velocity: float = 0.5
    """Start velocity, m/s an axis, uniform in +-."""
    pad_size: tuple[float, float] = (0.4, 0.6)
    """Width of the pad, m, uniform; its shape is a disc, a square or a triangle."""
    pad_height: float = 0.2
    """Height of the pad over the ground, m."""
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
class AvoidConfig:
    """Fly fast through a random forest that is only seen."""

    episode_s: float = 20.0
    """Length of an episode, s."""
    forest: ForestConfig = ForestConfig()
    """The forest; its lane is also the fence."""
    speed: tuple[float, float] = (3.0, 10.0)
    """Commanded speed, m/s, uniform an episode."""
    sideways: float = 3.0
    """Start within this of the middle of the lane, m."""
    altitude: float = 1.5
    """Where to fly, m over the ground."""
    ceiling: float = 3.0
    """Higher than this the episode fails, m."""
    collisions_end: bool = True
    """Whether a collision ends the episode; training goes on, so that it learns from what comes after."""


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


@dataclass(frozen=True)
class RaceClutterConfig:
    """Fly through gates in order, among obstacles that are only seen."""

    episode_s: float = 20.0
    """Length of an episode, s."""
    track: str = "s_shaped"
    """four_gates, s_shaped, circle_3d, j_shaped, or the path of a .toml file (its gate count sets shapes)."""
    scale: float = 2.0
    """The track's ground plan is this many times larger: wide enough for 10 m/s."""
    clutter: ClutterConfig = ClutterConfig()
    """The obstacles."""
    gate_position: float = 0.3
    """Half-width of each gate's random place about the track's, m an axis."""
    gate_yaw: float = 0.2
    """Half-width of each gate's random turn, rad."""
    speed: tuple[float, float] = (4.0, 12.0)
    """Commanded speed, m/s, uniform an episode."""
    position: float = 0.5
    """Start within this ball about the track's start, m."""
    laps: int = 1
    """Laps that end the episode with success; 0: fly on until time is out."""
    fence: float = 20.0
    """Farther than this from the next gate the episode fails, m."""
    collisions_end: bool = True
    """Whether a collision ends the episode; training goes on, so that it learns from what comes after."""


@dataclass(frozen=True)
class GapConfig:
    """Fly through a narrow slit in a wall, tilted so that only a banked vehicle fits."""

    episode_s: float = 6.0
    """Length of an episode, s."""
    distance: tuple[float, float] = (2.5, 4.0)
    """From the start to the slit, m, uniform."""
    sideways: float = 0.5
    """Half-width of the slit's random place about straight ahead, m an axis."""
    altitude: float = 2.0
    """Height of the start, m."""
    yaw: float = 0.3
    """Half-width of the wall's random turn about up, rad."""
    roll: tuple[float, float] = (0.4, 0.8)
    """Tilt of the slit to either side, rad, uniform."""
    opening: tuple[float, float] = (0.7, 0.18)
    """Long and short side of the slit, m."""
    thickness: float = 0.1
    """Of the wall, m."""
    approach: float = 1.5
    """From this distance to the wall on, the vehicle counts as approaching, m."""
    beyond: float = 2.0
    """Success: reach the point this far behind the slit ..."""
    radius: float = 0.5
    """... to within this, m."""
    fence: float = 6.0
    """Farther than this from the next target the episode fails, m."""
    collisions_end: bool = True
    """Whether a collision ends the episode; training goes on, so that it learns from what comes after."""


@dataclass(frozen=True)
class HoverAwareConfig:
    """Hover at a point and keep a slowly moving target in the middle of the camera's image."""

    episode_s: float = 8.0
    """Length of an episode, s."""
    target: tuple[float, float, float] = defaults.TARGET
    """Where to hover, world, m."""
    position: float = 1.5
    """Start within this of the target, m an axis."""
    velocity: float = 0.5
    """Start velocity, m/s an axis, uniform in +-."""
    tilt: float = 0.2617993877991494
    """Start roll and pitch, rad, uniform in +-; any heading."""
    distance: tuple[float, float] = (4.0, 6.0)
    """From where to hover to what to look at, m, uniform."""
    elevation: float = 0.2
    """What to look at is within this of the height of where to hover, m."""
    turn_rate: float = 0.2
    """It circles around where to hover at up to this, rad/s, either way."""
    size: float = 0.2
    """Radius of what to look at, m."""
    fov: tuple[float, float] = (1.518436449235301, 1.0122909661567112)
    """Of the camera: horizontal and vertical, rad."""
    camera_position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where the camera sits, body frame (forward, left, up), m."""
    camera_pitch: float = 0.0
    """Of the camera, downwards from straight ahead, rad."""
    radius: float = 0.1
    """Success: within this of the target, m, ..."""
    centred: float = 0.25
    """... what to look at within this share of half the image from its middle, across and down, ..."""
    hold_s: float = 1.0
    """... for this last part of the episode, s."""
    fence: float = defaults.HOVER_FENCE
    """Farther than this from the target the episode fails, m."""


TaskConfig = (
    HoverConfig
    | HoverAwareConfig
    | LandConfig
    | LandVisualConfig
    | TrackConfig
    | RaceConfig
    | RaceClutterConfig
    | AvoidConfig
    | GapConfig
)


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
    pool: tuple[int, int] = (16, 16)
    """Rows and columns that an image is averaged to; divide the camera's (sets shapes)."""
    convolution: tuple[int, ...] = ()
    """Channels of the convolutions that take an image in place of its averages; their stride is their size, 4 (2 where
    4 does not divide the image), so that they are products of matrices (sets shapes)."""
    encoder: tuple[int, ...] = (64,)
    """Units of the layers that each image passes before it joins the rest (sets shapes)."""
    recurrent: int = 0
    """Units of a gated recurrent unit (GRU) before the hidden layers; 0: none (sets shapes)."""


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

    @property
    def steps(self) -> int:
        """Environment steps of an update."""
        return self.envs * self.horizon


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
    horizon_start: int = 0
    """Steps after which the gradient is cut at first; they grow to the window's over the run. 0: never cut."""
    term_gradients: bool = False
    """Whether to log the norm of the gradient of each term of the reward; an update takes as many times as long."""

    @property
    def steps(self) -> int:
        """Environment steps of an update."""
        return self.envs * self.horizon


@dataclass(frozen=True)
class SHACConfig:
    """Short-horizon actor-critic (Xu et al. 2022): the exact gradient over a window, and a critic's beyond it."""

    envs: int = 64
    """Environments side by side (sets shapes)."""
    horizon: int = 32
    """Steps of a window (sets shapes)."""
    epochs: int = 4
    """Passes of the critic over the samples of a window (sets shapes)."""
    minibatch: int = 512
    """Samples of a gradient step of the critic; divides envs * horizon (sets shapes)."""
    learning_rate: float = 4e-3
    """Adam's step at the start."""
    learning_rate_end: float = 1e-4
    """Adam's step at the end; exponential in between."""
    critic_rate: float = 0.5
    """The critic's step over the policy's."""
    gamma: float = 0.98
    """Discount a step."""
    td_lambda: float = 0.95
    """Lambda of the returns that the critic learns."""
    target_share: float = 0.2
    """How far the critic's slow copy follows it, an update."""
    noise: float = 0.0
    """Standard deviation of the noise on the action."""
    max_grad_norm: float = 0.5
    """Norm to which a gradient is clipped."""
    gradient_decay: float = 0.0
    """Decay of the gradient through the state, 1/s of backward time; 0: the exact gradient."""
    horizon_start: int = 0
    """Steps after which the gradient is cut at first; they grow to the window's over the run. 0: never cut."""
    term_gradients: bool = False
    """Whether to log the norm of the gradient of each term of the reward; an update takes as many times as long."""

    @property
    def steps(self) -> int:
        """Environment steps of an update."""
        return self.envs * self.horizon


@dataclass(frozen=True)
class ABPTConfig:
    """Amended back-propagation through time (Li et al. 2025): windows of exact gradients between values of critics that
    learn from a replay buffer.
    """

    envs: int = 64
    """Environments side by side (sets shapes)."""
    horizon: int = 32
    """Steps of a window (sets shapes)."""
    collect: int = 8
    """Steps of each environment into the replay buffer, an update (sets shapes)."""
    buffer: int = 65_536
    """Transitions in the replay buffer, a multiple of envs * collect (sets shapes)."""
    places: int = 1024
    """Visited states that windows may begin at, a multiple of envs (sets shapes)."""
    minibatch: int = 1024
    """Samples of a gradient step of the critics (sets shapes)."""
    fits: int = 8
    """Gradient steps of the critics, an update (sets shapes)."""
    learning_rate: float = 4e-3
    """Adam's step at the start."""
    learning_rate_end: float = 1e-4
    """Adam's step at the end; exponential in between."""
    critic_rate: float = 0.5
    """The critics' step over the policy's."""
    gamma: float = 0.98
    """Discount a step."""
    target_share: float = 0.02
    """How far the critics' slow copies follow them, a gradient step."""
    fresh_share: float = 0.5
    """Share of the windows that begin at a new start; the others begin at visited states."""
    at_once: float = 0.5
    """Weight of the critics' value of a window's first action; the window's own return has the rest."""
    entropy_weight: float = 1e-3
    """Weight of the entropy bonus."""
    log_std: float = -2.0
    """Initial log standard deviation of the action noise."""
    max_grad_norm: float = 0.5
    """Norm to which a gradient is clipped."""
    gradient_decay: float = 0.0
    """Decay of the gradient through the state, 1/s of backward time; 0: the exact gradient."""
    horizon_start: int = 0
    """Steps after which the gradient is cut at first; they grow to the window's over the run. 0: never cut."""
    term_gradients: bool = False
    """Whether to log the norm of the gradient of each term of the reward; an update takes as many times as long."""

    @property
    def steps(self) -> int:
        """Environment steps of an update."""
        return self.envs * (self.collect + self.horizon)


@dataclass(frozen=True)
class FOPPOConfig:
    """PPO refined by first-order gradients: epochs over a rollout, then a step along its exact gradient. Ours."""

    envs: int = 64
    """Environments side by side (sets shapes)."""
    horizon: int = 32
    """Steps of a rollout, which is the window of the exact gradient (sets shapes)."""
    epochs: int = 2
    """Passes over the samples of an update (sets shapes)."""
    minibatch: int = 512
    """Samples of a gradient step; divides envs * horizon (sets shapes)."""
    learning_rate: float = 3e-3
    """Adam's step at the start."""
    learning_rate_end: float = 3e-4
    """Adam's step at the end; exponential in between."""
    exact_rate: float = 1.0
    """The step along the exact gradient over that of the epochs."""
    gamma: float = 0.98
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
    gradient_decay: float = 0.0
    """Decay of the gradient through the state, 1/s of backward time; 0: the exact gradient."""
    horizon_start: int = 0
    """Steps after which the gradient is cut at first; they grow to the window's over the run. 0: never cut."""
    term_gradients: bool = False
    """Whether to log the norm of the gradient of each term of the reward; an update takes as many times as long."""

    @property
    def steps(self) -> int:
        """Environment steps of an update."""
        return self.envs * self.horizon


AlgorithmConfig = PPOConfig | BPTTConfig | SHACConfig | ABPTConfig | FOPPOConfig


@dataclass(frozen=True)
class StageConfig:
    """A stage of a curriculum: the task with a few numbers changed, until it is mastered or its time is over."""

    changes: dict[str, float | tuple[float, ...]]
    """Values of the task's fields by dotted path: {"forest.density": 0.0}; none that sets shapes or the program."""
    success: float | None = None
    """Promotion: success of an evaluation in this stage."""
    steps: int | None = None
    """Promotion at the latest after so many environment steps."""


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
    curriculum: tuple[StageConfig, ...] = ()
    """Stages before the task itself."""
    stop_at: float | None = None
    """Stop once the success on 1000 starts is at least this; left out: use all steps."""
