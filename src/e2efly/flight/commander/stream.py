"""What is known about a stream of commands: the newest usable command, its age, and what was refused. Pure."""

import math
from dataclasses import dataclass, replace

from e2efly.flight.commander.command import Command, Limits, within
from e2efly.flight.pose.clock_map import ClockMap, follow_clock, start_clock
from e2efly.policy.odometry import Odometry

STEADY_S = 0.3
"""Before a commander takes over, commands must have come for this time, s, with none refused and none too late."""
CLOCK_JUMP = 0.05
"""Forward jumps of the sender's clock that are larger than this are refused, s."""


@dataclass(frozen=True)
class CommandStream:
    """The commands so far. `Stream()` before the first one."""

    command: Command | None = None
    """The newest command that was accepted, within the limits."""
    time: float = -math.inf
    """When it was made, s on the local monotonic clock. If the sender does not say, when it arrived."""
    accepted: float = -math.inf
    """When it was accepted, s."""
    since: float = math.inf
    """Time since which commands have come without a gap or a refusal, s. Infinite: they do not."""
    clock: ClockMap | None = None
    """Map from the sender's clock to this machine's clock."""
    taken: int = 0
    """Number of commands that were accepted."""
    refused: int = 0
    """Number of messages that were refused."""
    clipped: int = 0
    """Number of commands with a value beyond the vehicle's limits."""
    problem: str = ""
    """Why the last refused message was refused, or the problem of the source, whichever came later."""
    problem_time: float = -math.inf
    """When that was, s."""

    def age(self, now: float) -> float:
        """Age of the newest command, s. Infinite before the first one."""
        return now - self.time


def take(
    stream: CommandStream,
    command: Command,
    limits: Limits,
    odometry: Odometry | None,
    now: float,
    timeout: float,
    *,
    flying: bool = False,
) -> CommandStream:
    """Process one message. `now` is in s on the local monotonic clock. `timeout` is the largest age of a command, s. A
    stream that was silent may start again, with another clock or another sender, only while the commander does not fly.
    Otherwise, stamps that do not advance would be accepted once per time-out.
    """
    silent = stream.age(now) > timeout and not flying
    first = command.sender if silent or stream.command is None else stream.command.sender
    try:
        if command.sender != first:
            raise ValueError(f"command: from {command.sender}, while {first} commands; accepted: one commander")
        clock, time = _dated(None if silent else stream.clock, command)
        if not now - time <= timeout:
            raise ValueError(f"command: it is {now - time:.3f} s old; accepted: at most {timeout:g}")
        fitting = within(limits, command, odometry)
    except ValueError as error:
        return refuse(stream, str(error), now)
    since = time if silent else min(stream.since, time)
    return replace(
        stream, command=fitting, time=time, accepted=now, since=since, clock=clock, taken=stream.taken + 1,
        clipped=stream.clipped + fitting.clipped,
    )  # fmt: skip


def _dated(clock: ClockMap | None, command: Command) -> tuple[ClockMap | None, float]:
    """The clock's map after a command, and when the command was made, s on the local monotonic clock."""
    received, stamp = command.received, command.stamp
    if stamp is None:
        return clock, received
    if clock is None:
        return start_clock(received, stamp), received
    said = f"command: stamp is {stamp:.3f} s"
    if stamp <= clock.stamp:
        raise ValueError(f"{said}; accepted: later than that of the one before, {clock.stamp:.3f}")
    if (jump := clock.offset - (received - stamp)) > CLOCK_JUMP:
        raise ValueError(f"{said}, a jump of the sender's clock by {jump:.3f}; accepted: a steady clock")
    return follow_clock(clock, received, stamp)


def refuse(stream: CommandStream, problem: str, now: float, count: int = 1) -> CommandStream:
    """Count messages that are not commands, or with a count of 0 note a problem of the source. They do not move the
    vehicle.
    """
    return replace(stream, since=math.inf, refused=stream.refused + count, problem=problem, problem_time=now)


def silence(stream: CommandStream, now: float, timeout: float) -> str | None:
    """Why there is no command to fly by now. None: there is one. `now` is in s. `timeout` is the largest age of a
    command, s.
    """
    age = stream.age(now)
    if age <= timeout:
        return None
    none = "no command has come yet" if math.isinf(age) else f"no good command for {age:.2f} s; accepted: {timeout:g}"
    why = stream.problem if stream.problem_time > stream.accepted else None
    return f"{none} ({why})" if why else none


def unsteady(stream: CommandStream, now: float) -> str | None:
    """Why a commander whose commands arrive must not take over yet. None: it may."""
    going = now - stream.since
    if going >= STEADY_S:
        return None
    why = f" ({stream.problem})" if now - stream.problem_time < STEADY_S else ""
    return f"good commands have come for {max(going, 0.0):.2f} s; accepted: {STEADY_S:g}{why}"
