"""The closed loop of a policy: a flight, and the simulator's flight by the same policy from the same start."""

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.alignment.windows import on_grid
from e2efly.logs.flight_log import FlightLog
from e2efly.logs.recording import Record
from e2efly.policy.loader import Policy, load_policy
from e2efly.tasks.route import Route, course_for, route_of
from e2efly.validation.fleet import FleetFlight, FleetMission, fly_all
from e2efly.validation.plant import RigidState
from e2efly.validation.plant_flight import Trajectory
from e2efly.validation.reality import Reality
from e2efly.vehicles.vehicle import Vehicle

STATES = ("position", "velocity", "quaternion", "body_rate")
"""What a start consists of."""
COMPARED_S = 3.0
"""Time over which the two are compared in numbers, s. Later, the smallest difference has grown to one of time."""
SIGNALS = {"body_rate": "rad/s", "position": "m", "velocity": "m/s"}
"""What is compared in numbers, and its unit."""


@dataclass(frozen=True)
class ClosedLoop:
    """A policy's flight and the simulator's, from the same start."""

    policy: Path
    """The file of the policy."""
    task: str
    """What it flew."""
    begin: float
    """The start, s of the log's clock."""
    command_mode: str
    """Mode of the simulator's commands."""
    sent: np.ndarray
    """(n, 5) time since the start, s, and the commands of the flight, as they were sent: thrust over mass, m/s^2, and
    body rates, rad/s."""
    flown: dict[str, np.ndarray]
    """By stream, (m, 1 + k): time since the start, s, and measured values."""
    simulated: dict[str, Trajectory]
    """By the name of the vehicle, the flight of the simulator."""
    shift: float
    """Time from the start until the first command, s: the age of the poses that it is computed from."""

    @property
    def compared(self) -> float:
        """The time over which the two are compared in numbers, s: as long as both last."""
        ends = [float(t.time[-1]) for t in self.simulated.values()]
        return min(COMPARED_S, float(self.flown["position"][-1, 0]), *ends)

    def difference(self, name: str, stream: str) -> float:
        """Root mean square of the length of the difference to the flight over the time that is compared."""
        told, seen = self.simulated[name], self.flown[stream]
        within = seen[:, 0] <= self.compared
        foretold = [np.interp(seen[within, 0], told.time, column) for column in getattr(told, stream).T]
        return float(np.sqrt(np.mean(np.sum((np.stack(foretold, 1) - seen[within, 1:]) ** 2, axis=1))))


def policy_of(log: FlightLog, given: Path | None = None) -> tuple[Path, Policy] | None:
    """The policy that flew, if it can be flown again without its world: its file and itself. None: another one flew, or
    none, or its file is gone.

    Args:
        log: the flight.
        given: the file of the policy. None: the one that the log names.

    Raises:
        ValueError: for a file that cannot be loaded, or a given policy that needs images.
    """
    named, flew = _settings(log).get("policy"), log.meta.get("contract", "")
    file = given or (Path(named) if named else None)
    if file is None or not _began(log) or (given is None and not file.is_file()):
        return None
    policy = load_policy(file)
    if flew and json.loads(policy.contract.to_json()) != json.loads(flew):
        return None
    if policy.contract.images:
        if given is None:
            return None
        raise ValueError(f"{file}: sees images, which the simulator has not; accepted: a policy without images")
    return file, policy


def closed_loop(
    log: FlightLog, record: Record, file: Path, policy: Policy, vehicles: dict[str, Vehicle], pose_delay: float
) -> ClosedLoop:
    """Fly a policy in the simulator from where it took over in a flight.

    The flight controller is tuned to the first of the vehicles, as in the flight. The others differ from it without its
    knowledge.

    Args:
        log: the flight.
        record: the same flight, checked: its poses are on the gyroscope's clock.
        file: the file of the policy.
        policy: the policy.
        vehicles: vehicles by name.
        pose_delay: age of the poses when commands are computed from them, s.

    Raises:
        ValueError: naming the log and what it lacks.
    """
    contract = policy.contract
    if not record.has(*STATES, "command"):
        raise ValueError(f"{log.path}: has {', '.join(record.streams)}; accepted: {', '.join(STATES)} and command")
    began, ended = _began(log)[0]
    begin = began - pose_delay
    state = {name: on_grid(record.streams[name], np.array([begin]))[0][0] for name in STATES}
    state["quaternion"] = state["quaternion"] / np.linalg.norm(state["quaternion"])
    start, believed = RigidState(**state), next(iter(vehicles.values()))
    course = course_for(contract, believed, _route(log, policy))
    mission = FleetMission(file, "simulator", believed, believed, max(ended - began, 1 / contract.control_rate_hz))
    flights = [FleetFlight(start, course, Reality(body, body.latency)) for body in vehicles.values()]
    flown = dict(zip(vehicles, fly_all(mission, flights, processes=1), strict=True))
    for name, trajectory in flown.items():
        if trajectory.fault:
            raise ValueError(f"{file}: cannot fly in the simulator with the vehicle {name}: {trajectory.fault}")

    def since(stream: str) -> np.ndarray:
        part = record.streams[stream].during(begin, ended)
        return np.column_stack([part.time - begin, part.values])

    measured = {stream: since(stream) for stream in SIGNALS}
    return ClosedLoop(
        file, contract.task, begin, contract.action.mode, since("command"), measured, flown, pose_delay
    )  # fmt: skip


def _began(log: FlightLog) -> list[tuple[float, float]]:
    """When a policy flew: begin and end, s since the start of the log. The longest time comes first."""
    changes = log["mode"]
    names, ends = changes.texts("mode"), [*changes.time[1:], log.duration]
    spans = [(float(t), float(e)) for t, e, n in zip(changes.time, ends, names, strict=True) if n == "policy"]
    return sorted(spans, key=lambda span: span[0] - span[1])


def _settings(log: FlightLog) -> dict[str, Any]:
    try:
        found = json.loads(log.meta.get("settings", "{}"))
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def _route(log: FlightLog, policy: Policy) -> Route | None:
    """Where the policy flew. None: the log does not say it, as where the usual course was flown."""
    told, kind = _settings(log).get("goal"), route_of(policy.contract)
    if not isinstance(told, dict):
        return None
    defaults = {f.name: f.default for f in dataclasses.fields(kind)}
    if unknown := [name for name in told if name not in defaults]:
        raise ValueError(f"{log.path}: goal.{unknown[0]} is no option of {policy.contract.task}; accepted: its own log")

    def typed(name: str, value: Any) -> Any:
        value = tuple(tuple(v) if isinstance(v, list) else v for v in value) if isinstance(value, list) else value
        return Path(value) if isinstance(defaults[name], Path) else value

    return kind(**{name: typed(name, value) for name, value in told.items()})
