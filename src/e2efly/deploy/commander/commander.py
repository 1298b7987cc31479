"""A commander outside, in place of a policy: the bridge asks it as it asks one.

A command is flown by the cascade of the hover, at its own level, with the gains of the hover: at every control step
anew, until the next one comes or the time-out is over.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from e2efly.deploy.commander.command import Command, Limits
from e2efly.deploy.commander.stream import Stream, refuse, silence, take, unsteady
from e2efly.deploy.odometry import Odometry, tilt_of, yaw_of
from e2efly.deploy.pilot.hover import controlled, flight_gains, rates_of
from e2efly.deploy.policy.images import Image
from e2efly.deploy.policy.runtime import Decision, Envelope, Imu, beyond
from e2efly.deploy.settings import FlightSettings
from e2efly.vehicles import Vehicle

NAME = "commander"
"""What the log calls it."""
DISTANCE = 3.0
"""A place to fly to is at most so far from the vehicle, m, where the envelope says nothing else."""
LEASH = 0.5
"""A yaw rate leads the heading to hold at most so far from the vehicle's, rad."""
LONGEST_STEP = 0.1
"""A control step turns the heading for no longer than this, s."""


class CommandSource(Protocol):
    """Delivers commands as they come. Nothing here blocks or raises once it is open."""

    @property
    def refused(self) -> int:
        """Messages that were malformed or too many."""
        ...

    @property
    def problem(self) -> str | None:
        """What was wrong last; None: nothing so far."""
        ...

    def read(self, now: float) -> list[Command]:
        """What arrived since the last call, oldest first; now: s on this machine's monotonic clock."""
        ...

    def close(self) -> None:
        """Let go of everything; may be called twice."""
        ...

    def describe(self) -> str:
        """What this is, for people and logs."""
        ...


@dataclass(frozen=True)
class Heading:
    """What is remembered of a flight by commands."""

    yaw: float
    """To hold, rad."""
    time: float
    """Of the last control step, s."""
    told: int = 0
    """Messages that had come by then."""


class Commander:
    """Flies by a source of commands. None of its methods raises for what comes over it."""

    name = NAME
    images: tuple[Image, ...] = ()
    """It sees nothing."""
    lands = done = False
    """The pilot ends its flight, and lands."""
    native_id: int | None = None
    """It needs no thread."""

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
            vehicle: as loaded.
            settings: of the flight: time-out and fence.
            envelope: in which state of the vehicle it may take over, and how far off a place may be.
            latency: from the vehicle's motion to its rate loop, s; None: the vehicle file's.
        """
        self.source, self.timeout, self.envelope = source, settings.command_timeout, envelope or Envelope()
        self.gentle = flight_gains(vehicle, vehicle.latency if latency is None else latency)
        """The vehicle with the gains by which commands are flown."""
        distance = DISTANCE if self.envelope.distance is None else self.envelope.distance
        self.limits = Limits(vehicle, settings.fence, distance)
        self.stream = Stream()
        self.state: Heading | None = None
        self.decision: Decision | None = None
        self.problem: str | None = None
        self._counted, self._known = source.refused, source.problem

    def hear(self, odometry: Odometry | None, now: float) -> None:
        """Take in what has come."""
        flying = self.state is not None
        for command in self.source.read(now):
            self.stream = take(self.stream, command, self.limits, odometry, now, self.timeout, flying=flying)
        refused, problem = self.source.refused, self.source.problem
        if refused > self._counted or (problem and problem != self._known):
            self.stream = refuse(self.stream, problem or "malformed", now, refused - self._counted)
        self._counted, self._known = refused, problem

    def readiness(self, odometry: Odometry, now: float) -> str | None:
        """Why it must not take over now; None: it may."""
        limits = (
            ("speed", float(np.linalg.norm(odometry.velocity)), self.envelope.speed, "m/s"),
            ("tilt", tilt_of(odometry.quaternion), self.envelope.tilt, "rad"),
        )
        stands = beyond(limits)
        return silence(self.stream, now, self.timeout) or unsteady(self.stream, now) or "; ".join(stands) or None

    def start(self, odometry: Odometry, now: float) -> None:
        """It takes over, in the vehicle's heading."""
        self.problem = self.decision = None
        self.state = Heading(yaw_of(odometry.quaternion), now)

    def stop(self) -> None:
        """It flies no more."""
        self.state = self.decision = None

    def step(
        self, odometry: Odometry, now: float, slack: float, imu: Imu | None, images: Sequence[np.ndarray] = ()
    ) -> bool:
        """Make collective thrust and body rates of the newest command; whether a message has come since the last step.

        That there is none is in `problem`.
        """
        del slack, imu, images
        command, before = self.stream.command, self.state
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
    """The yaw to hold now, rad: the command's, or the one so far, turned by its yaw rate."""
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
    """The four numbers of the command's mode in `COMMAND_MODES`.

    Args:
        vehicle: with the gains of the flight; its position gain holds an altitude.
        command: within the limits.
        odometry: the motion now.
        yaw: to hold, rad.
    """
    x, y, z = command.main.tolist()
    if command.thrust is not None:
        return command.thrust, x, y, z
    if command.altitude is not None:
        most = float(vehicle.speed_max[2])
        z = float(vehicle.position_gain[2]) * (command.altitude - float(odometry.position[2]))
        z = min(max(z, -most), most)
    return x, y, z, yaw
