"""What is recorded of each control step: the messages of `e2efly.logs.channels`."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from e2efly.control import Ctbr
from e2efly.flight.commander.commander import Commander
from e2efly.flight.filter.guard import CommandChange
from e2efly.flight.pilot.flight_state import Flight
from e2efly.flight.pilot.hover import rates_of
from e2efly.flight.pilot.throttle_map import ThrottleMap
from e2efly.policy.odometry import Odometry
from e2efly.policy.worker import Worker


class Log(Protocol):
    """Keeps the flight's record. It never raises."""

    def record(self, channel: str, time: float, values: dict[str, Any]) -> None:
        """Record a message of a channel."""
        ...


@dataclass(frozen=True)
class Logs:
    """Several logs as one."""

    logs: tuple[Log, ...]
    """Each gets every message."""

    def record(self, channel: str, time: float, values: dict[str, Any]) -> None:
        """Record a message of a channel in each log."""
        for log in self.logs:
            log.record(channel, time, values)


@dataclass(frozen=True)
class Sent:
    """What a control step sent."""

    source: str
    """The source of the command."""
    command: Ctbr | None
    """The command. None: the throttle is closed."""
    throttle: float
    """Throttle, 0 to 1."""
    channels: tuple[int, ...]
    """Pulse width of each stick channel, us. Empty: the autopilot takes no sticks."""
    saturated: tuple[str, ...] = ()

    @property
    def rate(self) -> tuple[float, float, float]:
        """Body rate, FLU, rad/s."""
        return (0.0, 0.0, 0.0) if self.command is None else rates_of(self.command)


def record_mode(log: Log, now: float, before: Flight, flight: Flight) -> None:
    """Record a change of mode and its reasons."""
    log.record("mode", now, {
        "mode": str(flight.mode), "previous": str(before.mode), "reasons": [str(reason) for reason in flight.reasons],
    })  # fmt: skip


def record_policy(log: Log, now: float, worker: Worker, image_ages: Sequence[float] = ()) -> None:
    """Record what the policy saw and wants, or what the commander sent, and the age of each camera's image, s."""
    if isinstance(worker, Commander):
        _record_commander(log, now, worker)
        return
    d, state = worker.decision, worker.state
    if d is not None:
        log.record("policy", now, {
            "observation": d.observation.tolist(), "action": d.action.tolist(), "inference_s": d.inference_s,
            "step": state.steps if state is not None else 0, "image_age": list(image_ages),
        })  # fmt: skip


def _record_commander(log: Log, now: float, commander: Commander) -> None:
    stream, command = commander.stream, commander.stream.command
    if command is not None:
        log.record("commander", now, {
            "mode": command.mode, "numbers": command.main.tolist(), "thrust": command.thrust,
            "altitude": command.altitude, "yaw": command.yaw, "yaw_rate": command.yaw_rate, "age": stream.age(now),
            "taken": stream.taken, "refused": stream.refused, "clipped": stream.clipped, "problem": stream.problem,
        })  # fmt: skip


def record_odometry(log: Log, now: float, odometry: Odometry) -> None:
    """Record the motion of the vehicle."""
    o = odometry
    log.record("odometry", now, {
        "time": o.time, "age": now - o.time, "position": o.position.tolist(), "velocity": o.velocity.tolist(),
        "quaternion": o.quaternion.tolist(), "body_rate": o.body_rate.tolist(),
    })  # fmt: skip


def record_sent(log: Log, now: float, sent: Sent, mode: str, setpoint: list[float] | None, yaw: float | None) -> None:
    """Record what was sent, its source, and the setpoint: world, m; rad."""
    command = sent.command
    log.record("command", now, {
        "source": f"{mode}: {sent.source}",
        "collective_thrust": None if command is None else float(command.thrust),
        "body_rate": None if command is None else list(sent.rate),
        "setpoint": setpoint, "yaw": yaw,
    })  # fmt: skip
    log.record("sticks", now, {
        "channels": list(sent.channels), "throttle": sent.throttle, "saturated": bool(sent.saturated),
    })  # fmt: skip


def record_filter(log: Log, now: float, change: CommandChange) -> None:
    """Record how the filter changed a command. The command that was sent is in the channel `command`."""
    log.record("filter", now, {
        "limit": change.limit, "room": change.room, "share": change.share,
        "wanted_thrust": float(change.wanted.thrust), "wanted_rate": list(rates_of(change.wanted)),
    })  # fmt: skip


def record_map(log: Log, now: float, throttle_map: ThrottleMap) -> None:
    """Record the learned throttle map."""
    log.record("throttle_map", now, {
        "scale": throttle_map.scale * throttle_map.nominal(1.0), "voltage_gain": throttle_map.learned[1],
        "residual": throttle_map.residual,
    })  # fmt: skip
