"""The benchmark of `e2efly benchmark`: one policy, in fixed conditions, from starts that nothing else draws.

It composes `evaluation`, `stress` and `plant_stress`. A policy is judged by its file alone, in the preset of its task:
two files of the same policy have the same scores, whatever their trainings drew.
"""

import dataclasses
import hashlib
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from e2efly import __version__
from e2efly.environment.episodes import summary, wilson
from e2efly.environment.stress_rows import ALL, ROWS, rows_for
from e2efly.simulation.device import processor
from e2efly.validation import plant_stress
from e2efly.validation.candidate import Candidate, candidate, with_changes
from e2efly.validation.evaluation import fly_criteria
from e2efly.validation.plants import find_plant
from e2efly.validation.stress import fly_rows
from e2efly.validation.stress_laws import LAWS
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Controller

VERSION = 1
"""Version of the benchmark: of its seed, its rows and its conditions. Scores of different versions are not compared."""
SEED = 8_000_000
"""Seed of the starts and of the draws of the rows. No default of a command and no published figure has it."""
HOME, LATENCY, TRAINED, UNTRAINED = "training", "latency", "trained", "untrained"
"""The training simulator as a place, and the kinds of rows: latencies, rows that trainings draw from, and laws that
none draws from."""
NOMINAL = "nominal"
LATENCIES = (0.0, 0.01, 0.02, 0.03, 0.04, 0.06, 0.08, 0.1, 0.12)
"""Times from observation to command, s, with which the nominal vehicle flies."""
ON_PLANTS = {
    TRAINED: (NOMINAL, "mass x1.25", "thrust x0.8", "motor lag x2", "delay +40 ms", "gusts 1.5 m/s", ALL),
    UNTRAINED: ("delay walks", "wind with shear and turbulence", "battery collapses", "loose battery"),
}
"""The rows that are flown on plants, which take a second for a flight."""


@dataclass(frozen=True)
class CardScale:
    """How much is flown."""

    episodes: int = 100
    """Starts per row and criterion in the training simulator."""
    flights: int = 5
    """Starts per row and criterion on each plant."""
    plants: tuple[str, ...] = ("mujoco",)
    """Names or references of plants."""

    def check(self) -> None:
        """Refuse numbers that mean nothing, and plants that cannot be flown here.

        Raises:
            ValueError: naming the option, its value and what is accepted.
        """
        for name, least in (("episodes", 1), ("flights", 1)):
            if (value := getattr(self, name)) < least:
                raise ValueError(f"--{name} is {value}; accepted: more than 0")
        for i, plant in enumerate(self.plants):
            find_plant(plant)
            if plant in self.plants[:i]:
                raise ValueError(f"--plants has {plant!r} twice; accepted: each once")


def entrant(
    file: Path, vehicle: str | None = None, controller: Controller = "policy", baseline: str | None = None
) -> Candidate:
    """A policy, or a hover controller in its place, that the benchmark scores.

    Args:
        file: a policy.onnx outside of any run, which is therefore judged in the preset of its task.
        vehicle: the vehicle that flies. If left out: the policy's own.
        controller: the vehicle for which the flight controller is tuned, as in `evaluate`.
        baseline: the hover controller that flies in place of the policy, as in `evaluate`.

    Raises:
        ValueError: as for `candidate.candidate`; and for a family without one vehicle to fly.
    """
    found = candidate(file, vehicle, controller, baseline=baseline)
    if found.draws:
        raise ValueError(
            f"--vehicle is {vehicle or 'left out'}; accepted: one vehicle within the ranges of {found.vehicle}, about "
            "which the rows lie"
        )
    return found


def about(found: Candidate) -> dict[str, Any]:
    """What a card says of an entrant. Parts that were flown for the same are not flown again."""
    contract = found.policy.contract
    return {
        "sha256": hashlib.sha256(found.file.read_bytes()).hexdigest(),
        "task": contract.task,
        "baseline": found.baseline,
        "vehicle": found.vehicle,
        "vehicle_hash": load_vehicle(found.vehicle).hash,
        "controller": found.controller,
        "command_mode": contract.action.mode,
        "control_rate_hz": contract.control_rate_hz,
        "latency_s": found.latency,
        "trained_latency_s": list(contract.latency_range_s),
    }


def parts_of(scale: CardScale) -> Iterator[dict[str, Any]]:
    """The parts of a card, in their order: each a place, a kind of rows, and a number of starts."""
    for kind in (LATENCY, TRAINED, UNTRAINED):
        yield {"place": HOME, "kind": kind, "episodes": scale.episodes}
    for plant in scale.plants:
        for kind in ON_PLANTS:
            yield {"place": plant, "kind": kind, "episodes": scale.flights}


def score(
    found: Candidate,
    scale: CardScale,
    known: list[dict[str, Any]],
    keep: Callable[[list[dict[str, Any]]], None],
    told: Callable[[str], None] = lambda text: None,
) -> list[dict[str, Any]]:
    """Fly all parts of a card that are not known yet.

    Args:
        found: from `entrant`.
        scale: how much is flown; checked.
        known: parts that were flown before, of the same `about`. Those of another version or scale are left out.
        keep: called with all parts so far after each that was flown.
        told: called with the name of each part that is going to be flown.

    Returns:
        The parts as JSON: `parts_of` with version, seed, date, processor and seconds, and with `rows`: for each row and
        criterion the figures of `environment.episodes.summary`. On a plant also `left_out`, the rows that it cannot
        reproduce with what it cannot change; or only `refused`, why it does not fly the policy.

    Raises:
        OSError: when a plant cannot be started.
    """
    wanted = [{"version": VERSION, "seed": SEED, "e2efly": __version__, **part} for part in parts_of(scale)]
    parts = [next((old for old in known if key.items() <= old.items()), None) for key in wanted]
    for i, key in enumerate(wanted):
        if parts[i] is None:
            told(f"{key['kind']} rows in {key['place']}")
            where, began = {"date": f"{datetime.now(UTC):%Y-%m-%d}", "cpu": processor()[0]}, time.perf_counter()
            flown = _flown(found, key["place"], key["kind"], key["episodes"])
            parts[i] = {**key, **where, "seconds": round(time.perf_counter() - began, 1), **flown}
            keep([part for part in parts if part is not None])
    return [part for part in parts if part is not None]


def _flown(found: Candidate, place: str, kind: str, episodes: int) -> dict[str, Any]:
    if place != HOME:
        return _on_plant(found, place, kind, episodes)
    if kind == LATENCY:
        return {"rows": {f"{1e3 * late:.0f} ms": _late(found, late, episodes) for late in LATENCIES}}
    rows = rows_for(found.env.cameras) if kind == TRAINED else tuple(LAWS)
    return {"rows": _summed(fly_rows(found, rows, episodes, SEED))}


def _late(found: Candidate, latency: float, episodes: int) -> dict[str, Any]:
    env = with_changes(found.env, {"action_latency": (latency, latency)})
    flown, _, _ = fly_criteria(dataclasses.replace(found, env=env), episodes, SEED)
    return {name: summary(e) for name, e in flown.items()}


def _on_plant(found: Candidate, plant: str, kind: str, episodes: int) -> dict[str, Any]:
    able = find_plant(plant)
    flies: dict[str, Any] = {"vehicle": found.vehicle, "controller": found.controller, "baseline": found.baseline}
    lacks = {row: plant_stress.lacking(able, ROWS.get(row) or LAWS[row]) for row in ON_PLANTS[kind]}
    rows, left_out = tuple(row for row in lacks if not lacks[row]), {row: lack for row, lack in lacks.items() if lack}
    try:
        report = plant_stress.stress(found.file, plant, episodes, rows=rows, seed=SEED, **flies)
    except ValueError as error:
        return {"refused": str(error)}
    return {"rows": _summed(report.flown), "left_out": left_out}


def _summed(flown: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    return {row: {name: summary(e) for name, e in criteria.items()} for row, criteria in flown.items()}


def worst_criterion(criteria: Mapping[str, dict[str, Any]]) -> dict[str, Any]:
    """The figures of the criterion with the lowest success: a row counts as much as that."""
    return min(criteria.values(), key=lambda figures: figures["success"])


@dataclass(frozen=True)
class Mean:
    """The mean success of several rows."""

    success: float
    interval: tuple[float, float]
    """95 %, by Wilson, as if each start were flown once: rows share their starts, so more of them do not narrow it."""
    worst: str
    """The row with the lowest success."""
    lowest: float
    """Its success."""

    @staticmethod
    def of(rows: Mapping[str, Mapping[str, dict[str, Any]]]) -> "Mean":
        """Of the rows of a part, one or more."""
        each = {row: worst_criterion(criteria) for row, criteria in rows.items()}
        share = {row: figures["success"] for row, figures in each.items()}
        n, mean = next(iter(each.values()))["episodes"], float(np.mean(list(share.values())))
        worst = min(share, key=lambda row: share[row])
        return Mean(mean, wilson(min(mean * n, n), n), worst, share[worst])
