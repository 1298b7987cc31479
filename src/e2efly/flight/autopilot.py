"""What the bridge asks of an autopilot: one protocol, whichever firmware and link stand behind it.

Each autopilot is one folder: `betaflight/`, `mavlink/`. All vectors are body FLU, and all times are s on the bridge's
clock.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from e2efly.flight.attitude import Attitude
from e2efly.flight.pilot.flight_state import Pilot
from e2efly.flight.row import Row
from e2efly.flight.settings import FlightSettings
from e2efly.policy.contract import Contract
from e2efly.policy.odometry import Odometry
from e2efly.vehicles.vehicle import Vehicle

METHODS = (
    "versions", "connections", "heard", "statuses", "identify", "check", "poll", "read", "attitude", "rotor_speeds",
    "send", "pose", "delivered", "uncertain", "link_record", "close",
)  # fmt: skip
"""What an autopilot must have."""
HOLE = 0.1
"""Between two commands that are known to have arrived and are further apart than this, s, others may not have."""


@dataclass(frozen=True)
class InertialReading:
    """A measurement of the inertial sensors."""

    acceleration: tuple[float, float, float]
    """Specific force, in any unit in which gravity at rest, from which the scale is known, is 200 to 9000."""
    body_rate: tuple[float, float, float]
    """rad/s."""
    asked: float
    """When it was requested, s. Everything sent before that had arrived when it was taken."""
    time: float
    """When it came, s."""


@dataclass(frozen=True)
class AutopilotState:
    """What is known about an autopilot at a control step."""

    link_problem: str | None = None
    """Why it is not heard. None: it is."""
    armed: bool = False
    override: bool = False
    """It takes its commands from this program."""
    pilot: Pilot | None = None
    """What the pilot wants. None: it is not known."""
    failsafe: bool = False
    """It follows its own failsafe, not the commands that are sent."""
    voltage: float | None = None
    """Voltage of a cell, V. None: it does not know it."""
    problems: tuple[str, ...] = ()
    """Why its settings and modes, as they are now, forbid a take-off."""
    policy_problem: str | None = None
    """Why its modes, as they are now, forbid a policy. None: they do not."""
    attitude: Attitude | None = None
    """Its own estimate of the attitude. None: not known."""
    inertial: InertialReading | None = None
    """A measurement that came since the previous report. None: none did."""
    records: tuple[tuple[str, float, dict[str, Any]], ...] = ()
    """(channel, time, values) for the log: what came since the previous report."""


@dataclass(frozen=True)
class Outgoing:
    """What was sent to an autopilot."""

    alive: bool
    """Whether there was a link to send it on."""
    channels: tuple[int, ...] = ()
    """Pulse widths of stick channels, us. Empty: it takes no sticks."""
    saturated: tuple[str, ...] = ()
    """The parts of the command that it cannot follow."""


def arrived(acknowledged: Sequence[float], start: float, end: float, hole: float = HOLE) -> bool:
    """Whether all commands sent from `start` to `end`, s, are known to have arrived.

    `acknowledged` are the times, s, oldest first, at which commands were sent that have arrived. Between two of them
    that are more than `hole` s apart, others may not have.
    """
    later = end
    for time in reversed(acknowledged):
        if time < later - hole or time <= start:
            break
        later = min(later, time)
    return later - start <= hole


class Autopilot(Protocol):
    """A flight controller at the other end of a link. Nothing here blocks or raises, but for `identify`."""

    @property
    def versions(self) -> Mapping[str, str]:
        """What it is, for the log: `firmware`, and the version of its protocol."""
        ...

    @property
    def connections(self) -> int:
        """How often its link has connected. When this changes, its settings may have changed, too."""
        ...

    @property
    def heard(self) -> float:
        """When it was last heard, s."""
        ...

    @property
    def statuses(self) -> int:
        """How often it has reported so far whether it is armed."""
        ...

    def identify(self, timeout: float) -> None:
        """Read its settings, on the ground. `timeout` is how long an answer may take, s.

        Raises:
            ValueError: it is none that is known, or its settings do not allow commands.
            TimeoutError: it does not answer.
        """
        ...

    def check(self, vehicle: Vehicle, settings: FlightSettings, contract: Contract | None) -> tuple[Row, ...]:
        """Its settings that matter to a flight: the table of `e2efly fly --check`."""
        ...

    def poll(self, now: float) -> None:
        """Read what has come, and request what is due."""
        ...

    def read(self, now: float, *, land: bool, sends: bool, grounded: bool) -> AutopilotState:
        """Evaluate what has come until `now`.

        Args:
            now: s.
            land: the operator asks for a landing, as the pilot does with the mission switch.
            sends: commands are sent. If not, only what the autopilot reports by itself is known.
            grounded: no flight has begun.
        """
        ...

    def attitude(self, now: float, oldest: float) -> tuple[Attitude, float] | None:
        """Its newest attitude, and when that was requested, s. None: it came more than `oldest` s ago."""
        ...

    def rotor_speeds(self, now: float, oldest: float) -> Sequence[float] | None:
        """The newest speeds of the rotors, rad/s. None: not measured, or they came more than `oldest` s ago."""
        ...

    def send(self, now: float, throttle: float | None, rates: tuple[float, float, float]) -> Outgoing:
        """Send a command: throttle, 0 (idle) to 1 (full), with rotor speeds linear in it, and body rates, rad/s. None:
        closed.
        """
        ...

    def pose(self, now: float, odometry: Odometry) -> None:
        """Pass a pose on to its own estimator, if that wants it."""
        ...

    def delivered(self, start: float, end: float, hole: float = HOLE) -> bool:
        """Whether the commands sent from `start` to `end`, s, are known to have arrived, `hole` s at most apart."""
        ...

    def uncertain(self, now: float) -> bool:
        """Whether messages get lost, so that nothing is known of when the answers were asked for."""
        ...

    def link_record(self) -> dict[str, Any]:
        """The quality of the link, for the channel `link` of the log."""
        ...

    def close(self) -> None:
        """Close the link."""
        ...
