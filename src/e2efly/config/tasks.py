"""Options of the tasks, and of the worlds that they are flown in."""

from dataclasses import dataclass

from e2efly.courses import defaults


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
class HoverConfig:
    """Fly to a point and stay there."""

    episode_s: float = 8.0
    """Length of an episode, s."""
    judged_s: float = 0.0
    """Length of the episodes that the policy is judged by, s; 0: the same."""
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
