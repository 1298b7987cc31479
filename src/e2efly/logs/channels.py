"""What a flight log contains: its channels, their fields, units and frames. Schemas, reader and documentation follow
from it.

SI units, world ENU, body FLU, quaternions wxyz body to world. A field that is not known at the moment is null.
"""

from dataclasses import dataclass
from typing import Any, Literal

Kind = Literal["number", "numbers", "flag", "text", "texts"]

_NUMBER = {"type": ["number", "null"]}
_TYPES: dict[Kind, dict[str, Any]] = {
    "number": _NUMBER,
    "numbers": {"type": ["array", "null"], "items": _NUMBER},
    "flag": {"type": ["boolean", "null"]},
    "text": {"type": ["string", "null"]},
    "texts": {"type": ["array", "null"], "items": {"type": "string"}},
}


@dataclass(frozen=True)
class LogField:
    """One field of a channel."""

    name: str
    """Its key in the message."""
    kind: Kind
    """A number, numbers, a flag, a text or texts."""
    unit: str
    """Unit, `1` for a ratio. Empty if it is not a quantity."""
    description: str
    """What it is, and its frame if it has one."""


@dataclass(frozen=True)
class Channel:
    """One channel of a flight log."""

    name: str
    """Its topic."""
    description: str
    """When it is recorded, and what it contains."""
    fields: tuple[LogField, ...]
    """Its fields."""


def _channel(name: str, description: str, *fields: tuple[str, Kind, str, str]) -> Channel:
    return Channel(name, description, tuple(LogField(*field) for field in fields))


_ALL = (
    _channel(
        "odometry",
        "The vehicle's motion that the bridge flew by.",
        ("time", "number", "s", "when it was true, on the companion's monotonic clock"),
        ("age", "number", "s", "its age when it was used"),
        ("position", "numbers", "m", "centre of mass, world, 3"),
        ("velocity", "numbers", "m/s", "world, 3"),
        ("quaternion", "numbers", "1", "attitude, wxyz, body to world, 4"),
        ("body_rate", "numbers", "rad/s", "about body x, y, z, 3"),
    ),
    _channel(
        "imu",
        "What the flight controller measures.",
        ("gyro", "numbers", "rad/s", "body rate, FLU, 3"),
        ("specific_force", "numbers", "m/s^2", "accelerometer, FLU, 3: (0, 0, 9.81) at rest"),
        ("attitude", "numbers", "rad", "the controller's own roll, pitch, yaw, 3"),
    ),
    _channel(
        "command",
        "What was asked of the vehicle, before it became sticks.",
        ("source", "text", "", "who asked: a mode, a controller, the policy"),
        ("collective_thrust", "number", "m/s^2", "thrust over mass along body z"),
        ("body_rate", "numbers", "rad/s", "about body x, y, z, 3"),
        ("setpoint", "numbers", "m", "position that is held or followed, world, 3"),
        ("yaw", "number", "rad", "heading that is held or followed"),
    ),
    _channel(
        "sticks",
        "What was sent to the flight controller.",
        ("channels", "numbers", "us", "pulse width of each channel"),
        ("throttle", "number", "1", "throttle, 0 to 1"),
        ("saturated", "flag", "", "whether a stick was cut at its end"),
    ),
    _channel(
        "motors",
        "Motor outputs of the flight controller.",
        ("values", "numbers", "1", "0 to 1, in Betaflight's order, 4"),
    ),
    _channel(
        "rc",
        "Channels as the flight controller sees them: the pilot's, and those overridden.",
        ("channels", "numbers", "us", "pulse width of each channel"),
    ),
    _channel(
        "battery",
        "The battery by the flight controller.",
        ("voltage", "number", "V", "of the whole pack"),
        ("current", "number", "A", "drawn from it"),
        ("cells", "number", "1", "cells in series"),
    ),
    _channel(
        "status",
        "The flight controller's state.",
        ("armed", "flag", "", "whether motors may turn"),
        ("modes", "texts", "", "active modes"),
        ("cpu_load", "number", "1", "load of its processor, 0 to 1"),
        ("arming_disabled", "texts", "", "why it refuses to arm"),
        ("cycle_time", "number", "s", "period of its rate loop"),
    ),
    _channel(
        "link",
        "The link to the flight controller, counted since the start.",
        ("requests", "number", "1", "requests sent"),
        ("replies", "number", "1", "replies received"),
        ("timeouts", "number", "1", "requests without a reply in time"),
        ("errors", "number", "1", "bytes or frames thrown away: wrong checksum, wrong framing"),
        ("reconnects", "number", "1", "times the link was opened anew"),
        ("round_trip", "number", "s", "time from the latest request to its reply"),
    ),
    _channel(
        "mode",
        "A change of mode.",
        ("mode", "text", "", "mode from now on"),
        ("previous", "text", "", "mode until now"),
        ("reasons", "texts", "", "why"),
    ),
    _channel(
        "policy",
        "One step of the policy.",
        ("observation", "numbers", "", "as the contract lays it out"),
        ("action", "numbers", "1", "in [-1, 1], 4"),
        ("inference_s", "number", "s", "time that the network took"),
        ("step", "number", "1", "steps since the policy took over"),
        ("image_age", "numbers", "s", "time from the exposure of each camera's image to this step"),
    ),
    _channel(
        "commander",
        "While a commander outside flies in place of a policy: each of its messages.",
        ("mode", "text", "", "of the newest command: position, velocity, acceleration, attitude or ctbr"),
        ("numbers", "numbers", "", "its three numbers: m, m/s or m/s^2, world; roll, pitch, yaw, rad; or rad/s, body"),
        ("thrust", "number", "m/s^2", "collective thrust over mass"),
        ("altitude", "number", "m", "height to hold, world"),
        ("yaw", "number", "rad", "heading to hold"),
        ("yaw_rate", "number", "rad/s", "by which the heading turns"),
        ("age", "number", "s", "since it was made"),
        ("taken", "number", "1", "commands accepted since the start"),
        ("refused", "number", "1", "messages refused since the start"),
        ("clipped", "number", "1", "commands beyond the vehicle's limits since the start"),
        ("problem", "text", "", "why the last message was refused that was"),
    ),
    _channel(
        "filter",
        "With --guard filter: each command that it changed; what was sent is in `command`.",
        ("limit", "text", "", "what would not have been kept: a wall, floor, ceiling, speed, tilt or a solid"),
        ("room", "number", "m", "what stopping after the wanted command would have left to it; negative: beyond it"),
        ("share", "number", "1", "how far the command was changed towards stopping, 0 to 1"),
        ("wanted_thrust", "number", "m/s^2", "collective thrust over mass of the command as it came"),
        ("wanted_rate", "numbers", "rad/s", "its body rates, 3"),
    ),
    _channel(
        "timing",
        "One round of the control loop.",
        ("period_s", "number", "s", "since the round before"),
        ("work_s", "number", "s", "spent working"),
        ("lateness_s", "number", "s", "start after the time planned"),
        ("deadline_missed", "flag", "", "whether the round ended after the next should have begun"),
        ("cpu_load", "number", "1", "processor time of the companion's process over time passed; 1 is a whole core"),
    ),
    _channel(
        "throttle_map",
        "The adaptive map from throttle to thrust.",
        ("scale", "number", "m/s^2", "thrust over mass at full throttle"),
        ("voltage_gain", "number", "1", "effect of the battery's voltage on it"),
        ("residual", "number", "m/s^2", "measured less predicted specific force along body z"),
    ),
    _channel(
        "event",
        "Something worth telling.",
        ("level", "text", "", "info, warning or error"),
        ("text", "text", "", "what happened"),
    ),
    _channel(
        "meta",
        "What flies: once at the start, and again where more becomes known.",
        ("contract", "text", "", "contract of the policy, JSON"),
        ("vehicle", "text", "", "name and hash of the vehicle"),
        ("settings", "text", "", "settings of the bridge and of the flight controller, JSON"),
        ("versions", "text", "", "of e2efly, of the firmware and of what they run on, JSON"),
    ),
)

CHANNELS: dict[str, Channel] = {channel.name: channel for channel in _ALL}
"""All channels by name."""


def json_schema(channel: Channel) -> dict[str, Any]:
    """The JSON schema of a channel's messages."""
    fields = {
        f.name: {**_TYPES[f.kind], "description": f"{f.description}{f' [{f.unit}]' if f.unit else ''}"}
        for f in channel.fields
    }
    return {"title": channel.name, "description": channel.description, "type": "object", "properties": fields}
