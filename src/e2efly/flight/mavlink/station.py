"""This program's end of a MAVLink link: what has come from the autopilot, and what is sent to it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from e2efly.flight.echoes import Echoes
from e2efly.flight.link import MOST, Link
from e2efly.flight.mavlink.wire import FrameReader, MavlinkMessage, encode

COMPONENT = 191
"""MAV_COMP_ID_ONBOARD_COMPUTER."""
HEARTBEAT_S = 0.5
"""Interval of this program's heartbeats, s."""
ONBOARD, INVALID, ACTIVE = 18, 8, 4
"""MAV_TYPE_ONBOARD_CONTROLLER, MAV_AUTOPILOT_INVALID, MAV_STATE_ACTIVE."""
SET_MESSAGE_INTERVAL, REQUEST_MESSAGE = 511, 512
STREAMS = {
    "HEARTBEAT": 5.0, "SYS_STATUS": 5.0, "ATTITUDE_QUATERNION": 100.0, "HIGHRES_IMU": 100.0, "RAW_IMU": 100.0,
    "RC_CHANNELS": 50.0, "ESC_TELEMETRY_1_TO_4": 50.0,
}  # fmt: skip
"""How often each message is requested, Hz. PX4 has no RAW_IMU, ArduPilot no HIGHRES_IMU."""


@dataclass
class Station:
    """Sends and receives. Nothing here blocks or raises."""

    link: Link
    system: int = 1
    """The system id under which this program sends."""
    target: int = 0
    """System id of the autopilot. 0: none was heard yet."""
    latest: dict[str, tuple[dict[str, Any], float]] = field(default_factory=dict)
    """The newest message of each kind from the autopilot, and when it came, s."""
    parameters: dict[str, tuple[bytes, int]] = field(default_factory=dict)
    """Value, 4 bytes, and type of each parameter that was told."""
    heard: float = -math.inf
    """When the newest message came, s."""
    statuses: int = 0
    """Number of the autopilot's heartbeats so far."""
    echoes: Echoes = field(default_factory=Echoes)
    """The time stamps that come back."""
    said: list[str] = field(default_factory=list)
    """Texts of the autopilot since they were taken."""
    reader: FrameReader = field(default_factory=FrameReader)
    _sequence: int = 0
    _connection: int = 0
    _beat: float = -math.inf

    def poll(self, now: float) -> None:
        """Read what has come, and send what is due. `now` is in s."""
        self.link.poll(now)
        if self.link.connections != self._connection:
            self._connection = self.link.connections
            self.latest.clear()
            self.echoes.forget()
        for message in self.reader.feed(self.link.receive()[-MOST:]):
            self._take(message, now)
        if now - self._beat >= HEARTBEAT_S:
            self._beat = now
            self.send("HEARTBEAT", {"type": ONBOARD, "autopilot": INVALID, "system_status": ACTIVE})
        if self.target and self.echoes.due(now):
            self.send("TIMESYNC", {"tc1": 0, "ts1": round(now * 1e9)})

    def send(self, name: str, values: Mapping[str, Any]) -> bool:
        """Send a message to the autopilot. Returns whether the link is alive."""
        if not self.link.alive:
            return False
        values = {"target_system": self.target, "target_component": 1, **values}
        self.link.send(encode(name, values, sequence=self._sequence, system=self.system, component=COMPONENT))
        self._sequence += 1
        return self.link.alive

    def command(self, number: int, *params: float) -> None:
        """Send a command with its parameters."""
        self.send("COMMAND_LONG", {"command": number, "params": (*params, *(0.0,) * (7 - len(params)))})

    def newest(self, name: str, now: float, oldest: float) -> tuple[dict[str, Any], float] | None:
        """The newest message of a kind, and when it came, s. None: that is more than `oldest` s ago."""
        found = self.latest.get(name)
        return found if found is not None and now - found[1] <= oldest else None

    def _take(self, message: MavlinkMessage, now: float) -> None:
        told = message.fields
        if message.name == "HEARTBEAT":
            if told["autopilot"] == INVALID or message.component != 1:
                return  # a ground station, a gimbal, another companion
            self.target = self.target or message.system
        if message.system != self.target or message.component != 1:
            return
        self.heard = now
        self.latest[message.name] = told, now
        if message.name == "HEARTBEAT":
            self.statuses += 1
        elif message.name == "TIMESYNC" and told["tc1"] > 0:
            self.echoes.hear(told["ts1"] / 1e9, now)
        elif message.name == "PARAM_VALUE":
            self.parameters[_text(told["param_id"])] = told["param_value"], told["param_type"]
        elif message.name == "STATUSTEXT":
            self.said = [*self.said[-20:], _text(told["text"])]


def interval_us(rate: float) -> float:
    """The interval of a rate, Hz, in us, as SET_MESSAGE_INTERVAL takes it."""
    return 1e6 / rate


def _text(raw: bytes) -> str:
    return raw.split(b"\0")[0].decode("ascii", "replace")
