"""Limits of a flight: heights, speeds, time-outs, fence, and the pilot's channels. Checked before the first flight."""

import math
from dataclasses import dataclass, replace

from e2efly.config.numbers import ANGLE, SPEED, check_fields, number

Point = tuple[float, float, float]
Box = tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class Fence:
    """The volume in which policies may fly. Units: world ENU, m, m/s, rad."""

    low: Point = number((-3.0, -3.0, 0.2), low=-math.inf)
    """Smallest x, y, z."""
    high: Point = number((3.0, 3.0, 4.5), low=-math.inf)
    """Largest x, y, z."""
    speed: float = number(6.0, above=0, high=SPEED)
    """Largest speed, m/s."""
    tilt: float = number(1.4, above=0, high=ANGLE)
    """Largest angle between the body's z axis and the up direction, rad."""
    braking: float = number(6.0, above=0, high=100.0)
    """Deceleration that the hover controller can rely on, m/s^2. The guard takes over while this can still stop the
    vehicle inside."""
    reaction: float = number(0.15, above=0, high=10.0)
    """Time until the braking takes effect, s."""
    solids: tuple[Box, ...] = ()
    """Boxes that `--guard filter` keeps the vehicle out of. Each box is smallest x, y, z, largest x, y, z."""
    scene: str | None = None
    """A scene file (.toml, see docs/vision.md) in the frame of the poses. The filter also keeps the vehicle out of its
    solids. None: no scene."""

    @property
    def opened(self) -> "Fence":
        """This fence without its sides, its floor and its top."""
        return replace(self, low=(-math.inf,) * 3, high=(math.inf,) * 3)

    @property
    def height(self) -> "Fence":
        """Its floor and its top alone."""
        return replace(self, low=(-math.inf, -math.inf, self.low[2]), high=(math.inf, math.inf, self.high[2]))


@dataclass(frozen=True)
class PilotChannels:
    """The receiver channels of the pilot's inputs, counted from 1 as in Betaflight's receiver tab."""

    mission: int = 8
    """Three-position switch: low = stay on the ground or land, middle = take off and hover, high = policy."""
    roll: int | None = 9
    """Copy of the roll stick, because the stick itself cannot be read under MSP override. None: no stick input."""
    pitch: int | None = 10
    """Copy of the pitch stick."""
    throttle: int | None = 11
    """Copy of the throttle stick."""
    yaw: int | None = 12
    """Copy of the yaw stick."""


@dataclass(frozen=True)
class FlightSettings:
    """How the bridge flies."""

    takeoff_height: float = number(1.0, above=0, high=100.0)
    """Height of the hover after take-off, above the place of take-off, m."""
    takeoff_speed: float = number(0.4, above=0, high=10.0)
    """Climb speed at take-off, m/s."""
    land_speed: float = number(0.35, above=0, high=10.0)
    """Descent speed when landing, m/s."""
    reposition_speed: float = number(0.8, above=0, high=10.0)
    """Speed of the hover point at full stick, m/s."""
    odometry_timeout: float = number(0.1, above=0, high=10.0)
    """Odometry that is older than this counts as lost, s."""
    link_timeout: float = number(0.25, above=0, high=10.0)
    """The link counts as lost when the flight controller has been silent for this time, s."""
    policy_timeout: float = number(0.01, above=0, high=10.0)
    """How long a control step waits for the policy, s."""
    command_timeout: float = number(0.2, above=0, high=1.0)
    """Largest age of commands from another program, s. Older commands end its flight."""
    missed_deadlines: int = number(3, low=1, high=1000)
    """This number of late control steps within one second ends a policy's flight."""
    lateness: float = number(0.02, above=0, high=10.0)
    """A control step that is late by this time has missed its deadline, s."""
    battery_low: float = number(3.5, above=0, high=5.0)
    """Smallest battery voltage, V per cell. Below this, take-off is refused, and a hovering vehicle lands."""
    battery_unknown: bool = False
    """Fly although the flight controller reports no battery voltage."""
    stick_deadband: float = number(0.12, above=0, high=0.99)
    """Stick deflection, from 0 to 1, above which the pilot's input takes effect."""
    still_speed: float = number(0.1, above=0, high=10.0)
    """Largest speed before take-off and after landing, m/s."""
    ground_height: float = number(0.0, low=-math.inf)
    """Height of the ground, world, m."""
    land_settle: float = number(1.0, above=0, high=60.0)
    """The vehicle has landed if it stays still for this time while the target is well below it, s."""
    attitude_agreement: float = number(0.2, above=0, high=ANGLE)
    """Largest difference in roll and in pitch between the flight controller's estimate and the odometry before
    take-off, rad."""
    follow_distance: float = number(1.0, above=0)
    """How much farther from its target than the nearest point that it had reached the vehicle may fly, m. Beyond this,
    the odometry is judged to be wrong: a wrong heading, or the rigid body of another vehicle."""
    heading_agreement: float = number(0.7, above=0, high=ANGLE)
    """Largest error of the odometry's heading, as estimated from the flight itself, rad."""
    untrained_sensing: bool = False
    """Fly a policy although lags, age or holes of the poses are larger than what its training covered."""
    fence: Fence = Fence()
    """The volume in which policies may fly."""
    channels: PilotChannels = PilotChannels()
    """The pilot's channels."""


SMALLEST = 0.5
"""Smallest length, width and height of the fence, m."""
CHANNELS = (5, 18)
"""First and last channel for a switch or a copy of a stick. Channels 1 to 4 are the sticks."""


def check(settings: FlightSettings) -> None:
    """Refuse settings with which no flight is possible.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    _check_channels(settings.channels)
    check_fields("flight", settings)
    check_fence(settings.fence)
    low, high = settings.fence.low[2], settings.fence.high[2]
    if not low < settings.ground_height + settings.takeoff_height < high:
        raise ValueError(
            f"flight.takeoff_height is {settings.takeoff_height} m over {settings.ground_height} m; accepted: inside "
            f"the fence, {low} to {high} m"
        )


def check_fence(fence: Fence) -> None:
    """Refuse a fence in which no vehicle could fly.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    for axis, low, high in zip("xyz", fence.low, fence.high, strict=True):
        if high - low < SMALLEST:
            said = f"flight.fence.low and flight.fence.high are {low} and {high} in {axis}"
            raise ValueError(f"{said}; accepted: low at least {SMALLEST} m below high")
    for i, box in enumerate(fence.solids):
        finite = len(box) == 6 and all(map(math.isfinite, box))
        if not finite or not all(low < high for low, high in zip(box[:3], box[3:], strict=True)):
            raise ValueError(
                f"flight.fence.solids[{i}] is {box!r}; accepted: six numbers, the smallest x, y, z, then the largest"
            )


def _check_channels(channels: PilotChannels) -> None:
    first, last = CHANNELS
    named = {
        name: channel
        for name in ("mission", "roll", "pitch", "throttle", "yaw")
        if (channel := getattr(channels, name)) is not None or name == "mission"
    }
    for name, channel in named.items():
        if type(channel) is not int or not first <= channel <= last:
            none = "" if name == "mission" else ", or None"
            raise ValueError(
                f"flight.channels.{name} is {channel!r}; accepted: {first} to {last}{none} (1 to 4 are the sticks)"
            )
    if len(set(named.values())) != len(named):
        raise ValueError(f"flight.channels are {named}; accepted: each another")
