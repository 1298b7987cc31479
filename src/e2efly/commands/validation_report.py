"""What a validation came to, and its report as JSON."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.deploy.policy import Policy
from e2efly.storage import write_json

UNITS = {
    "duration": "s", "final_error": "m", "mean_error": "m", "top_speed": "m/s", "top_rate": "rad/s",
    "roughness": "mean |change of action| a step, action in [-1, 1]",
    "start": "position m, velocity m/s (world), quaternion wxyz (body to world), body_rate rad/s",
    "drop": "points of success: percent of the training simulator less percent of the plant",
}  # fmt: skip
"""Units of the figures of the report."""


@dataclass(frozen=True)
class Validation:
    """How a policy did on one criterion."""

    trained: Any
    """`Episodes` in the training simulator, as `e2efly eval` flies them; NumPy."""
    flown: Any
    """`Verdicts` on the plant, of the same starts."""
    starts: Any
    """`Starts`."""
    flights: list[Any]
    """`Trajectory` of each start on the plant."""

    @property
    def drop(self) -> float:
        """Points of success that the plant costs."""
        return 100 * float(np.mean(self.trained.success) - np.mean(self.flown.success))


def write_report(
    file: Path,
    found: dict[str, Validation],
    path: Path,
    policy: Policy,
    plant: str,
    seed: int,
    max_drop: float,
    vehicle: str,
) -> None:
    """Write the report of `--json`: a summary of either place and a row for every start, by criterion.

    Raises:
        OSError: when the file cannot be written.
    """
    report = {
        "policy": str(path),
        "task": policy.contract.task,
        "vehicle": vehicle,
        "plant": plant,
        "latency_s": policy.contract.latency_s,
        "seed": seed,
        "max_drop": max_drop,
        "units": UNITS,
        "criteria": {
            name: {
                "drop": v.drop,
                "training": _summary(v.trained),
                plant: _summary(v.flown) | {"faults": sum(bool(f.fault) for f in v.flights)},
                "starts": _rows(v),
            }
            for name, v in found.items()
        },
    }
    write_json(file, report)


def _summary(e: Any) -> dict[str, Any]:
    from e2efly.evaluate import wilson

    ok = np.asarray(e.success)
    names = ("duration", "final_error", "mean_error", "top_speed", "top_rate", "roughness")
    return {
        "episodes": len(ok),
        "success": float(ok.mean()),
        "success_interval_95": wilson(int(ok.sum()), len(ok)),
        "crashed": int(np.sum(e.crashed)),
        "mean": {name: float(np.mean(getattr(e, name))) for name in names},
        "mean_duration_of_success_s": float(np.mean(np.asarray(e.duration)[ok])) if ok.any() else None,
    }


def _rows(v: Validation) -> list[dict[str, Any]]:
    """A row for every start."""
    rows = []
    for i, (start, flight) in enumerate(zip(v.starts.states, v.flights, strict=True)):
        row: dict[str, Any] = {"trained_success": bool(v.trained.success[i])}
        for f in dataclasses.fields(v.flown):
            value = getattr(v.flown, f.name)[i]
            row[f.name] = bool(value) if f.name in ("success", "crashed") else float(value)
        row["fault"] = flight.fault
        row["start"] = {f.name: getattr(start, f.name).round(6).tolist() for f in dataclasses.fields(start)}
        rows.append(row)
    return rows
