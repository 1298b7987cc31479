"""A command from outside: how it is written, and the limits for it. Pure.

There are five modes: those of `e2efly.control.modes` that end in collective thrust and body rates. World ENU, body FLU,
SI units.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from e2efly.control import COMMAND_MODES, command_limits
from e2efly.flight.pilot.fence import MARGIN
from e2efly.flight.pose.json_source import array_of, header_of, number_of, object_of, short
from e2efly.flight.settings import Fence
from e2efly.policy.odometry import Odometry
from e2efly.policy.runtime import MODES
from e2efly.vehicles.vehicle import Vehicle

WHAT = "command"
"""The name of a command in messages."""
MAIN = {
    "position": "position", "velocity": "velocity", "acceleration": "acceleration", "attitude": "attitude",
    "ctbr": "body_rate",
}  # fmt: skip
"""The key of each mode's three numbers."""
THRUST, ALTITUDE, YAW, YAW_RATE = "thrust", "altitude", "yaw", "yaw_rate"
_WITH_HEADING = ("position", "velocity", "acceleration")
KEYS = ("mode", *MAIN.values(), THRUST, ALTITUDE, YAW, YAW_RATE, "stamp", "frame")
"""All keys of a message."""
FRAMES = ("", "map", "odom", "world")
"""Names of frames that stand for the world frame."""
TWICE = 2.0
"""A number beyond its range is clipped to the range, if its distance from the middle of the range is at most this many
times half the range. A number that is farther away is refused, because it cannot be a command in these units."""


@dataclass(frozen=True)
class Command:
    """One message of a commander, as it arrived."""

    received: float
    """Time of arrival, s on this machine's monotonic clock."""
    mode: str
    """A key of `MAIN`."""
    main: np.ndarray
    """(3,) world position, m, velocity, m/s, or acceleration, m/s^2; roll, pitch, yaw, rad; or body rates, rad/s."""
    thrust: float | None = None
    """Collective thrust divided by mass, m/s^2, for the modes attitude and CTBR."""
    altitude: float | None = None
    """Height to hold in the world, m. The velocity's z is then 0 here and is not used."""
    yaw: float | None = None
    """Heading to hold, rad. None without a yaw rate: the present heading."""
    yaw_rate: float | None = None
    """Yaw rate of the heading, rad/s."""
    stamp: float | None = None
    """When it was made, s on any steady clock of the sender. None: the sender does not say."""
    sender: str = ""
    """Address of the sender. Empty: not known."""
    clipped: bool = False
    """Whether a number was beyond the vehicle's limits and has been clipped to them."""


def parse_command(message: bytes, received: float, sender: str = "") -> Command:
    """Read one message. It is a JSON object in UTF-8; see `docs/commands.md`. `received` is the time of its arrival, s
    on the local monotonic clock, and `sender` the address of the sender.

    Raises:
        ValueError: naming the key, the value and what is accepted.
    """
    content = object_of(WHAT, message, KEYS)
    mode = content.get("mode")
    if not isinstance(mode, str) or mode not in MAIN:
        raise ValueError(f"{WHAT}: mode is {short(mode)}; accepted: {' or '.join(map(repr, MAIN))}")
    main = MAIN[mode]
    needed = [main, *((THRUST,) if mode not in _WITH_HEADING else ())]
    allowed = [*needed, *((YAW, YAW_RATE) if mode in _WITH_HEADING else ())]
    allowed += [ALTITUDE] if mode == "velocity" else []
    if missing := [key for key in needed if key not in content]:
        raise ValueError(f"{WHAT}: missing key {', '.join(map(repr, missing))} of mode {mode!r}")
    for key in content:
        if key not in (*allowed, "mode", "stamp", "frame"):
            raise ValueError(f"{WHAT}: mode {mode!r} has no key {key!r}; accepted: {', '.join(allowed)}")
    if YAW in content and YAW_RATE in content:
        raise ValueError(f"{WHAT}: yaw and yaw_rate are both given; accepted: one of them, or neither")
    thrust, altitude, yaw, yaw_rate = (
        number_of(WHAT, key, content[key]) if key in content else None for key in (THRUST, ALTITUDE, YAW, YAW_RATE)
    )
    level = mode == "velocity" and ALTITUDE in content
    vector = array_of(WHAT, main, content[main], 2 if level else 3)
    stamp, frame = header_of(WHAT, content)
    if frame not in FRAMES:
        accepted = "map, odom, world or none: commands are in the world's axes"
        raise ValueError(f"{WHAT}: frame is {short(frame)}; accepted: {accepted}")
    vector = np.append(vector, 0.0) if level else vector
    return Command(received, mode, vector, thrust, altitude, yaw, yaw_rate, stamp, sender)


@dataclass(frozen=True)
class Limits:
    """The limits for commands."""

    vehicle: Vehicle
    """The vehicle that flies, as loaded."""
    fence: Fence
    """Commanded positions have to be inside this fence."""
    distance: float
    """The largest distance of a commanded position from the vehicle, m."""


def within(limits: Limits, command: Command, odometry: Odometry | None) -> Command:
    """The command, with its numbers clipped to the vehicle's limits like those of a policy. If the motion of the
    vehicle is not known (None), distances are not checked.

    Raises:
        ValueError: for a number far beyond the limits, or a position outside the fence or far from the vehicle. It
            names the number and what is accepted.
    """
    mode, vehicle = COMMAND_MODES[command.mode], limits.vehicle
    low, high = command_limits(mode, vehicle)
    main, units = command.main.tolist(), mode.units
    if command.mode == "position":
        _check_place(limits, command.main, odometry)
    elif command.thrust is None:
        main = [_clipped(MAIN[command.mode], x, a, b, u) for x, a, b, u in zip(main, low, high, units, strict=False)]
    else:
        named = mode.fields[1:]
        main = [
            _clipped(n, x, a, b, u) for n, x, a, b, u in zip(named, main, low[1:], high[1:], units[1:], strict=True)
        ]
        if command.mode == "attitude":
            main[2] = _heading(float(command.main[2]))
    thrust = None if command.thrust is None else _clipped(THRUST, command.thrust, low[0], high[0], units[0])
    if command.altitude is not None:
        _check_height(limits, command.altitude, odometry)
    most = float(vehicle.body_rate_max[2])
    rate = None if command.yaw_rate is None else _clipped(YAW_RATE, command.yaw_rate, -most, most, "rad/s")
    yaw = None if command.yaw is None else _heading(command.yaw)
    angle = slice(0, 2 if command.mode == "attitude" else 3)  # a yaw is wrapped by whole turns, not clipped
    same = (main[angle], thrust, rate) == (command.main.tolist()[angle], command.thrust, command.yaw_rate)
    return replace(command, main=np.array(main), thrust=thrust, yaw=yaw, yaw_rate=rate, clipped=not same)


def _clipped(name: str, value: float, low: float, high: float, unit: str) -> float:
    middle, half = (low + high) / 2, (high - low) / 2
    if not abs(value - middle) <= TWICE * half:  # true for NaN
        raise ValueError(
            f"{WHAT}: {name} is {value:.4g} {unit}; accepted: {low:.4g} to {high:.4g} (up to {TWICE:g} times as far "
            "it is clipped)"
        )
    return float(min(max(value, low), high))


def _heading(yaw: float) -> float:
    if not abs(yaw) <= TWICE * math.pi:
        raise ValueError(f"{WHAT}: yaw is {yaw:.4g} rad; accepted: -{TWICE:g} pi to {TWICE:g} pi")
    return math.remainder(yaw, math.tau)


def _check_place(limits: Limits, place: np.ndarray, odometry: Odometry | None) -> None:
    low, high = np.add(limits.fence.low, MARGIN), np.subtract(limits.fence.high, MARGIN)
    for axis, x, a, b in zip("xyz", place.tolist(), low, high, strict=True):
        if not a <= x <= b:
            raise ValueError(f"{WHAT}: position is {x:.4g} m in {axis}; accepted: {a:.4g} to {b:.4g}, inside the fence")
    _check_distance(limits, "position", place if odometry is None else place - odometry.position, odometry)


def _check_height(limits: Limits, altitude: float, odometry: Odometry | None) -> None:
    low, high = limits.fence.low[2] + MARGIN, limits.fence.high[2] - MARGIN
    if not low <= altitude <= high:
        raise ValueError(f"{WHAT}: altitude is {altitude:.4g} m; accepted: {low:.4g} to {high:.4g}, inside the fence")
    off = np.array([0.0 if odometry is None else altitude - odometry.position[2]])
    _check_distance(limits, ALTITUDE, off, odometry)


def _check_distance(limits: Limits, name: str, off: np.ndarray, odometry: Odometry | None) -> None:
    far = float(np.linalg.norm(off))
    if odometry is not None and not far <= limits.distance:
        raise ValueError(f"{WHAT}: {name} is {far:.3g} m from the vehicle; accepted: at most {limits.distance:g}")


assert set(MAIN) == set(MODES)
