"""What a flight may do: heights, speeds, time-outs, fence, pilot's channels. Checked before the first flight."""

import math
from dataclasses import dataclass

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Fence:
    """Outside of it no policy flies. World ENU, m, m/s, rad."""

    low: Point = (-3.0, -3.0, 0.2)
    """Smallest x, y, z."""
    high: Point = (3.0, 3.0, 4.5)
    """Largest x, y, z."""
    speed: float = 6.0
    """Largest speed, m/s."""
    tilt: float = 1.4
    """Largest angle between the body's z axis and up, rad."""
    braking: float = 6.0
    """Deceleration that hovering can count on, m/s^2: the guard takes over while that still stops inside."""
    reaction: float = 0.15
    """Time before the braking acts, s."""


@dataclass(frozen=True)
class PilotChannels:
    """Which channels of the receiver carry what, counted from 1 as in Betaflight's receiver tab."""

    mission: int = 8
    """Three positions: low = stay on the ground or land, middle = take off and hover, high = policy."""
    roll: int | None = 9
    """Copy of the roll stick: under MSP override the stick itself cannot be read. None: no stick input."""
    pitch: int | None = 10
    """Copy of the pitch stick."""
    throttle: int | None = 11
    """Copy of the throttle stick."""
    yaw: int | None = 12
    """Copy of the yaw stick."""


@dataclass(frozen=True)
class FlightSettings:
    """How the bridge flies."""

    takeoff_height: float = 1.0
    """Height of the hover after take-off over where it stood, m."""
    takeoff_speed: float = 0.4
    """m/s."""
    land_speed: float = 0.35
    """m/s."""
    reposition_speed: float = 0.8
    """Speed of the hover point at full stick, m/s."""
    odometry_timeout: float = 0.1
    """Odometry older than this is lost, s."""
    link_timeout: float = 0.25
    """Silence of the flight controller after which the link is lost, s."""
    policy_timeout: float = 0.01
    """How long a control step waits for the policy, s."""
    missed_deadlines: int = 3
    """So many late control steps within a second end a policy's flight."""
    lateness: float = 0.02
    """A control step this late missed its deadline, s."""
    battery_low: float = 3.5
    """Volts a cell: no take-off below, and hovering lands."""
    battery_unknown: bool = False
    """Fly although the flight controller reports no battery voltage."""
    stick_deadband: float = 0.12
    """Stick deflection, of 1, that counts as the pilot's will."""
    still_speed: float = 0.1
    """Largest speed before take-off, and when landed, m/s."""
    ground_height: float = 0.0
    """Height of the ground, world, m."""
    land_settle: float = 1.0
    """Still for so long, with the target well below: landed, s."""
    attitude_agreement: float = 0.2
    """Largest roll and pitch between the controller's estimate and the odometry before take-off, rad."""
    follow_distance: float = 1.0
    """A vehicle that flies so far away from its target, having come to rest nearer, has odometry that is not its own:
    a wrong heading, another vehicle's body, m."""
    heading_agreement: float = 0.7
    """Largest error of the odometry's heading, as the flight itself shows it, rad."""
    fence: Fence = Fence()
    """Where policies may fly."""
    channels: PilotChannels = PilotChannels()
    """The pilot's channels."""


SMALLEST = 0.5
"""The fence is at least so long, wide and high, m."""
CHANNELS = (5, 18)
"""First and last channel that a switch or a copy of a stick can be on: 1 to 4 are the sticks."""
_POSITIVE = (
    "takeoff_height", "takeoff_speed", "land_speed", "reposition_speed", "odometry_timeout", "link_timeout",
    "policy_timeout", "missed_deadlines", "lateness", "battery_low", "stick_deadband", "still_speed", "land_settle",
    "attitude_agreement", "follow_distance", "heading_agreement",
)  # fmt: skip


def check(settings: FlightSettings) -> None:
    """Refuse what cannot be flown with.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    for name in _POSITIVE:
        _positive(name, getattr(settings, name))
    if type(settings.missed_deadlines) is not int:
        raise ValueError(f"missed_deadlines is {settings.missed_deadlines!r}; accepted: a whole number, 1 or more")
    if settings.stick_deadband >= 1:
        raise ValueError(f"stick_deadband is {settings.stick_deadband}; accepted: less than 1, the whole stick")
    if not _number(settings.ground_height):
        raise ValueError(f"ground_height is {settings.ground_height!r}; accepted: a finite number")
    _check_fence(settings.fence)
    low, high = settings.fence.low[2], settings.fence.high[2]
    if not low < settings.ground_height + settings.takeoff_height < high:
        raise ValueError(
            f"takeoff_height is {settings.takeoff_height} m over {settings.ground_height} m; accepted: inside the "
            f"fence, {low} to {high} m"
        )
    _check_channels(settings.channels)


def _check_fence(fence: Fence) -> None:
    for name in ("low", "high"):
        point = getattr(fence, name)
        if not (isinstance(point, tuple) and len(point) == 3 and all(map(_number, point))):
            raise ValueError(f"fence.{name} is {point!r}; accepted: x, y and z, m")
    for axis, low, high in zip("xyz", fence.low, fence.high, strict=True):
        if high - low < SMALLEST:
            said = f"fence.low and fence.high are {low} and {high} in {axis}"
            raise ValueError(f"{said}; accepted: low at least {SMALLEST} m below high")
    for name in ("speed", "tilt", "braking", "reaction"):
        _positive(f"fence.{name}", getattr(fence, name))


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
                f"channels.{name} is {channel!r}; accepted: {first} to {last}{none} (1 to 4 are the sticks)"
            )
    if len(set(named.values())) != len(named):
        raise ValueError(f"channels are {named}; accepted: each another")


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _positive(name: str, value: float) -> None:
    if not (_number(value) and value > 0):
        raise ValueError(f"{name} is {value!r}; accepted: a positive number")
