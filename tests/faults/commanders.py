"""A commander on the rig, by a real socket in virtual time, and what may be wrong with one."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from e2efly.flight.commander.stream import CommandStream
from e2efly.flight.log_record import Log
from e2efly.flight.pilot.flight_state import Mode
from e2efly.policy.odometry import yaw_of
from e2efly.validation.bridge_session import Session, rehearsal_settings
from e2efly.validation.rig import Rig
from e2efly.vehicles.loading import load_vehicle
from tests.flight.command_streams import Loopback, encode

VEHICLE = load_vehicle("vis_r")
HEIGHT = 1.2
TIMEOUT = 0.2
STEP = 0.01
Commands = Callable[[float], dict[str, Any]]


class Field:
    """A rig, the bridge on it and a commander, by UDP; time is virtual."""

    def __init__(self, rig: Rig, link: Loopback, log: Log | None = None) -> None:
        self.rig, self.link = rig, link
        self.session = Session(rig, rehearsal_settings(HEIGHT), commands=link, log=log)
        self.flown: set[str] = set()
        """The modes by whose commands the vehicle has flown."""

    @property
    def mode(self) -> Mode:
        return self.session.bridge.flight.mode

    @property
    def reasons(self) -> tuple[str, ...]:
        return self.session.bridge.flight.reasons

    @property
    def position(self) -> np.ndarray:
        return np.asarray(self.rig.state.position)

    @property
    def velocity(self) -> np.ndarray:
        return np.asarray(self.rig.state.velocity)

    @property
    def stream(self) -> CommandStream:
        return self.session.commander.stream

    def rest(self) -> tuple[float, float, float]:
        """Wait in HOVER; where the vehicle then is."""
        self.rig.set(mission="hover")
        self.session.fly(1.5)
        x, y, z = (float(p) for p in self.position)
        return x, y, z

    @property
    def yaw(self) -> float:
        return yaw_of(np.asarray(self.rig.state.quaternion))

    def command(self, seconds: float, commands: Commands, **stamped: float) -> None:
        """A message before each control step; without `mode` policy it ends."""
        began = self.rig.now()
        while self.rig.now() - began < seconds:
            message = commands(self.rig.now() - began)
            self.link.send(encode(**{"stamp": self.rig.now(), **stamped}, **message))
            self.session.step()
            if self.mode is Mode.POLICY:
                self.flown.add(message["mode"])

    def strike(self, fault: str) -> float:
        """Let a commander that flies break; how long the flight goes on by commands, s, at most 1 s."""
        commands, _ = FAULTS[fault]
        waiting: list[tuple[float, bytes]] = []
        began = self.rig.now()
        while self.mode is Mode.POLICY and self.rig.now() < began + 1.0:
            now = self.rig.now()
            if commands is not None:
                waiting.append((now + LATE.get(fault, 0.0), encode(**{"stamp": now, **commands(now)})))
            while waiting and waiting[0][0] <= now:
                self.link.send(waiting.pop(0)[1])
            self.session.step()
        return self.rig.now() - began

    def hand_over(self, commands: Commands) -> None:
        """From HOVER, at rest over the origin or wherever it is, to a commander that is heard already."""
        self.rig.set(mission="hover")
        self.session.fly(1.0)
        self.command(0.5, commands)
        assert self.mode is Mode.HOVER  # it is heard, and nothing moves by it
        self.rig.set(mission="policy")
        self.command(0.3, commands)
        assert self.mode is Mode.POLICY, self.reasons


def at(x: float, y: float, z: float, **heading: float) -> Commands:
    return lambda _: {"mode": "position", "position": [x, y, z], **heading}


HOME = at(0.0, 0.0, HEIGHT)


def nan(_: float) -> dict[str, Any]:
    return {"mode": "ctbr", "thrust": math.nan, "body_rate": [0, 0, 0]}


FAULTS: dict[str, tuple[Commands | None, str]] = {
    "silent": (None, "no good command for 0.2"),
    "nan": (nan, "NaN is no number"),
    "wrong length": (lambda _: {"mode": "position", "position": [0, 0]}, "position is [0, 0]; accepted: a list of 3"),
    "wrong mode": (lambda _: {"mode": "offboard"}, "mode is 'offboard'; accepted: 'position' or"),
    "out of range": (
        lambda _: {"mode": "velocity", "velocity": [1000, 0, 0]},
        "velocity is 1000 m/s; accepted: -5 to 5",
    ),
    "out of the fence": (at(0.0, 0.0, 100.0), "position is 100 m in z; accepted: 0.2 to 7.9, inside the fence"),
    "jump": (at(10.0, 0.0, HEIGHT), "m from the vehicle; accepted: at most 3"),
    "another frame": (lambda _: {"mode": "velocity", "velocity": [0, 0, 0], "frame": "base_link"}, "'base_link'"),
    "late": (HOME, "no good command for 0.2"),
    "stamps that stand": (
        lambda _: {"mode": "position", "position": [0, 0, HEIGHT], "stamp": 1.0},
        "accepted: later than",
    ),
}
"""What a commander sends instead, None: nothing, and what the reason of HOVER is to say."""
LATE = {"late": 0.3}
"""By how much its messages are late, s."""
