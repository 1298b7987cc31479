"""The flights of a validation report: the policy on a plant, and as a ghost the same start in the simulator of the
training.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.config.reading import read
from e2efly.config.storage import read_json
from e2efly.validation.candidate import candidate
from e2efly.validation.starts import Starts, draw_starts
from e2efly.vehicles.vehicle import Controller, Vehicle
from e2efly.viewing.flights import Flights
from e2efly.viewing.kept import Pair, flights_file, read_flights
from e2efly.viewing.watch.poses import TURNING
from e2efly.viewing.watch.recorded import RecordedFlight, even
from e2efly.viewing.watch.simulation import stage
from e2efly.viewing.watch.stage import Stage


@dataclass(frozen=True)
class Told:
    """The entries of a report of `e2efly validate` that are needed here."""

    policy: str
    """The policy.onnx."""
    vehicle: str
    """The vehicle that flew."""
    controller: Controller
    """The vehicle that the flight controller assumed."""
    plant: str
    """The plant on which it was flown."""
    seed: int
    """Seed of the starts."""


@dataclass(frozen=True)
class ShownReport:
    """One start."""

    name: str
    """Label for people: criterion, number, and how the flight ended."""
    criterion: str
    flights: tuple[RecordedFlight, ...]
    """The flight on the plant, then the flight in the training simulator. Of several vehicles in a world, those of all
    on the plant, then those of all in the simulator."""
    together: int
    """Number of vehicles in a world."""
    stage: Stage
    """The world of that start."""


def report_of(path: Path) -> Path | None:
    """The report that a path names: the file itself, or the only report in a folder. None: it names no report.

    Raises:
        ValueError: for a folder with several reports.
    """
    if path.suffix == ".json":
        return path
    if not path.is_dir() or (path / "config.json").is_file():
        return None
    found = [file for file in sorted(path.glob("*.json")) if flights_file(file).is_file()]
    if len(found) > 1:
        raise ValueError(f"{path} holds the reports {', '.join(f.name for f in found)}; accepted: one of these files")
    return found[0] if found else None


def read_report(path: Path) -> tuple[list[ShownReport], Vehicle]:
    """The starts of a report whose flights were stored, failures first, and the vehicle that flew them.

    Their worlds are generated again from the seed.

    Raises:
        ValueError: when the file is not a report with flights, or when the policy or the task has changed.
    """
    accepted = "accepted: a report of `e2efly validate --json`, with its .flights.npz beside it"
    content = read_json(path)
    objects = {name: content.get(name) for name in ("changed", "criteria")}
    missing = {name for name, value in objects.items() if not isinstance(value, dict)}
    if missing := missing | (Told.__annotations__.keys() - content.keys()):
        raise ValueError(f"{path} has no {', '.join(sorted(missing))}; {accepted}")
    if not flights_file(path).is_file():
        raise ValueError(f"{path} has no flights: there is no {flights_file(path)}; {accepted}")
    told: Told = read(Told, {name: content[name] for name in Told.__annotations__}, str(path))
    pairs = read_flights(flights_file(path))
    changes = {name.removeprefix("task."): value for name, value in content["changed"].items()}
    flew = candidate(told.policy, told.vehicle, told.controller, task=changes)
    shown = list[ShownReport]()
    for criterion, suite in flew.task.criteria().items():
        if criterion not in pairs:
            raise ValueError(f"{flights_file(path)} has no flights of {criterion}; {accepted}")
        pair, env = pairs[criterion], flew.environment(suite)
        starts = draw_starts(env, env.whole(int(pair.starts.max(initial=0)) + 1), told.seed)
        _check(path, content["criteria"], criterion, pair, starts)
        scene = env.task.scene(starts.memory)
        numbers = pair.starts.tolist()
        for first in range(0, len(numbers), env.agents):
            world = list(enumerate(numbers))[first : first + env.agents]
            flights = tuple(
                flight_of(
                    f"{criterion} {number} {where}: {pair.flown[place].ending(row)}",
                    starts.states[number], pair.flown[place], row,
                )
                for place, where in (("plant", f"on {told.plant}"), ("training", "in the training simulator"))
                for row, number in world
            )  # fmt: skip
            number = numbers[first]
            name = f"{criterion} {number}: {pair.flown['plant'].ending(first)}"
            seen = stage(flew.flown.body, suite, scene, number)
            shown.append(ShownReport(name, criterion, flights, env.agents, seen))
    return shown, flew.flown.body


def _check(path: Path, criteria: Mapping[str, Any], criterion: str, pair: Pair, starts: Starts) -> None:
    """Refuse a report whose starts differ from those that are generated now."""
    for number in pair.starts.tolist():
        try:
            then = np.array(criteria[criterion]["starts"][number]["start"]["position"], float)
        except (KeyError, IndexError, TypeError, ValueError):
            raise ValueError(f"{path} has no start {number} of {criterion}; accepted: the report as it was") from None
        now = starts.states[number].position
        if then.shape != now.shape or not np.allclose(then, now, atol=1e-4):
            raise ValueError(
                f"{path}: start {number} of {criterion} was at {then.tolist()} and is at {now.round(6).tolist()} now; "
                "accepted: the policy and the e2efly that wrote the report, or a new report"
            )


def flight_of(name: str, begin: Any, flights: Flights, row: int) -> RecordedFlight:
    """One flight of a policy, including its start, `begin`: the state of the vehicle."""
    steps = int(flights.length[row])
    time = np.append(0.0, flights.time[:steps])
    period = float(flights.time[0])

    def whole(of: str) -> np.ndarray:
        return np.concatenate([getattr(begin, of)[None], getattr(flights, of)[:steps, row]])

    streams = {of: (time, whole(of)) for of in ("position", "velocity", "quaternion", "body_rate")}
    streams["rotor_speed"] = time, np.full((len(time), 1), TURNING)
    asked = flights.time[:steps] - period
    if steps:
        streams["goal"] = asked, flights.goal[:steps, row]
        if flights.command_mode == "ctbr":
            streams["command"] = asked, flights.command[:steps, row, 1:]
    return even(name, streams)
