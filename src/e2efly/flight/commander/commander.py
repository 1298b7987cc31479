"""An external commander in place of a policy. The bridge calls it as it calls a policy.

A command is flown by the cascade of the hover, entered at the command's own level, with the gains of the hover. It is
evaluated again at every control step, until the next command comes or the time-out is over.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from e2efly.config.domain import Domain
from e2efly.flight.commander.command import Command, Limits
from e2efly.flight.commander.stream import CommandStream, refuse, silence, take, unsteady
from e2efly.flight.pilot.hover import controlled, flight_gains, rates_of
from e2efly.flight.settings import FlightSettings
from e2efly.policy.images import Image
from e2efly.policy.odometry import Odometry, tilt_of, yaw_of
from e2efly.policy.runtime import Decision, Envelope, beyond
from e2efly.policy.worker import Sensed
from e2efly.vehicles.vehicle import Vehicle

NAME = "commander"
"""The name in the log."""
DISTANCE = 3.0
"""The largest distance of a commanded position from the vehicle, m, unless the envelope gives another."""
LEASH = 0.5
"""The largest lead of the heading to hold over the vehicle's heading, while a yaw rate turns it, rad."""
LONGEST_STEP = 0.1
"""A control step turns the heading by at most this duration times the yaw rate, s."""


class CommandSource(Protocol):
    """Delivers commands as they arrive. Nothing here blocks or raises once the source is open."""

    @property
    def refused(self) -> int:
        """Messages that were malformed or too many."""
        ...

    @property
    def problem(self) -> str | None:
        """The last problem. None: no problem so far."""
        ...

    def read(self, now: float) -> list[Command]:
        """The commands that arrived since the last call, oldest first. `now`: s on this machine's monotonic clock."""
        ...

    def close(self) -> None:
        """Release all resources. May be called twice."""
        ...

    def describe(self) -> str:
        """A description of the source, for people and logs."""
        ...


@dataclass(frozen=True)
class Heading:
    """What is remembered of a flight by commands."""

    yaw: float
    """Yaw to hold, rad."""
    time: float
    """Time of the last control step, s."""
    told: int = 0
    """Messages that had arrived by then."""


class Commander:
    """Flies by the commands of a source. None of its methods raises because of what the source delivers."""

    name = NAME
    images: tuple[Image, ...] = ()
    """It uses no images."""
    sensing: Domain | None = None
    """It was not trained."""
    lands = done = False
    """It never ends its flight or lands by itself. The pilot ends the flight and lands."""
    native_id: int | None = None
    """It has no thread."""
    neighbours = 0
    """It is told of no other vehicles."""
    unplaced = False
    """It is told everything else."""

    def __init__(
        self,
        source: CommandSource,
        vehicle: Vehicle,
        settings: FlightSettings,
        *,
        envelope: Envelope | None = None,
        latency: float | None = None,
    ) -> None:
        """Listen to a source.

        Args:
            source: delivers commands.
            vehicle: the loaded vehicle.
            settings: the settings of the flight, for the time-out and the fence.
            envelope: the states of the vehicle in which it may take over, and the largest distance of a commanded
                position.
            latency: the time from the vehicle's motion to its rate loop, s. None: the value of the vehicle file.
        """
        self.source, self.timeout, self.envelope = source, settings.command_timeout, envelope or Envelope()
        self.gentle = flight_gains(vehicle, vehicle.latency if latency is None else latency)
        """The vehicle with the gains with which commands are flown."""
        distance = DISTANCE if self.envelope.distance is None else self.envelope.distance
        self.limits = Limits(vehicle, settings.fence, distance)
        self.stream = CommandStream()
        self.state: Heading | None = None
        self.decision: Decision | None = None
        self.problem: str | None = None
        self._counted, self._known = source.refused, source.problem

    def hear(self, odometry: Odometry | None, now: float) -> None:
        """Process the messages that have arrived."""
        flying = self.state is not None
        for command in self.source.read(now):
            self.stream = take(self.stream, command, self.limits, odometry, now, self.timeout, flying=flying)
        refused, problem = self.source.refused, self.source.problem
        if refused > self._counted or (problem and problem != self._known):
            self.stream = refuse(self.stream, problem or "malformed", now, refused - self._counted)
        self._counted, self._known = refused, problem

    def readiness(self, odometry: Odometry, now: float) -> str | None:
        """Why it must not take over now. None: it may."""
        limits = (
            ("speed", float(np.linalg.norm(odometry.velocity)), self.envelope.speed, "m/s"),
            ("tilt", tilt_of(odometry.quaternion), self.envelope.tilt, "rad"),
        )
        stands = beyond(limits)
        return silence(self.stream, now, self.timeout) or unsteady(self.stream, now) or "; ".join(stands) or None

    def start(self, odometry: Odometry, now: float) -> None:
        """Take over, with the vehicle's present heading."""
        self.problem = self.decision = None
        self.state = Heading(yaw_of(odometry.quaternion), now)

    def stop(self) -> None:
        """Stop flying."""
        self.state = self.decision = None

    def step(self, sensed: Sensed, now: float, slack: float) -> bool:
        """Convert the newest command to collective thrust and body rates. Returns whether a message has come since the
        last step.

        If there is no command to fly by, `problem` says why.
        """
        odometry, command, before = sensed.odometry, self.stream.command, self.state
        if before is None:
            return False
        self.problem = silence(self.stream, now, self.timeout)
        if self.problem or command is None:
            return False
        yaw = heading(command, before, odometry, now)
        self.state = Heading(yaw, now, self.stream.taken + self.stream.refused)
        wanted = controlled(self.gentle, command.mode, odometry, numbers(self.gentle, command, odometry, yaw))
        self.decision = Decision(
            observation=np.zeros(0, np.float32), action=np.zeros(0, np.float32), mode="ctbr",
            command=np.array([wanted.thrust, *rates_of(wanted)], np.float64),
            position=command.main if command.mode == "position" else None,
            late_s=self.stream.age(now), inference_s=0.0,
        )  # fmt: skip
        return self.state.told > before.told

    def close(self) -> None:
        """Close the source."""
        self.source.close()


def heading(command: Command, before: Heading, odometry: Odometry, now: float) -> float:
    """The yaw to hold now, rad: the command's yaw, or the previous one turned by the command's yaw rate."""
    here = yaw_of(odometry.quaternion)
    if command.mode == "ctbr":
        return here
    if command.mode == "attitude":
        return float(command.main[2])
    if command.yaw is not None:
        return command.yaw
    if command.yaw_rate is None:
        return before.yaw
    dt = min(max(now - before.time, 0.0), LONGEST_STEP)
    off = math.remainder(before.yaw + command.yaw_rate * dt - here, math.tau)
    return math.remainder(here + min(max(off, -LEASH), LEASH), math.tau)


def numbers(vehicle: Vehicle, command: Command, odometry: Odometry, yaw: float) -> tuple[float, ...]:
    """The four numbers of the command's mode in `COMMAND_MODES`. `vehicle` has the gains of the flight. Its position
    gain holds an altitude. `yaw` is the yaw to hold, rad.
    """
    x, y, z = command.main.tolist()
    if command.thrust is not None:
        return command.thrust, x, y, z
    if command.altitude is not None:
        most = float(vehicle.speed_max[2])
        z = float(vehicle.position_gain[2]) * (command.altitude - float(odometry.position[2]))
        z = min(max(z, -most), most)
    return x, y, z, yaw
