"""Flights of a validation, stored next to its report so that they can be viewed: report.flights.npz for report.json."""

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from e2efly.config.storage import read_npz
from e2efly.viewing.flights import Flights

PLACES = ("training", "plant")
"""The two places of the flights: the training simulator and the plant."""
LARGEST = 1 << 32
"""Largest size of all flights, bytes."""
_MOVED = {"position": 3, "velocity": 3, "quaternion": 4, "body_rate": 3, "command": 4, "goal": 3}
"""The quantities that are stored of each flight, and their count of numbers per step."""


@dataclass(frozen=True)
class Pair:
    """Some starts of a criterion, flown in two places."""

    starts: Int[np.ndarray, " n"]
    """Numbers of these starts in the report."""
    flown: Mapping[str, Flights]
    """Flights by the names of `PLACES`, in that order. The flights are in the order of `starts`."""


def flights_file(report: Path) -> Path:
    """The file of the flights: report.flights.npz next to report.json."""
    return report.with_suffix(".flights.npz")


def packed(pairs: Mapping[str, Pair]) -> bytes:
    """The content of such a file, from the pairs by criterion."""
    arrays: dict[str, Any] = {}
    for criterion, pair in pairs.items():
        arrays[f"{criterion}/starts"] = pair.starts
        for place, flights in pair.flown.items():
            found = {name: np.asarray(getattr(flights, name), np.float32) for name in ("time", *_MOVED)}
            found |= {"length": flights.length, "success": flights.success, "mode": np.array(flights.command_mode)}
            arrays |= {f"{criterion}/{place}/{name}": value for name, value in found.items()}
    content = io.BytesIO()
    np.savez_compressed(content, **arrays)
    return content.getvalue()


def read_flights(path: Path) -> dict[str, Pair]:
    """The flights of such a file, by criterion. Rotor speeds are not stored.

    Raises:
        ValueError: when the file contains something else, naming it.
    """
    accepted = "accepted: what `e2efly validate --json` has written beside its report"
    try:
        arrays = read_npz(path, LARGEST)
        found = {name.removesuffix("/starts"): arrays[name] for name in arrays if name.endswith("/starts")}
        return {
            criterion: Pair(starts, {place: _flights(arrays, f"{criterion}/{place}", len(starts)) for place in PLACES})
            for criterion, starts in found.items()
        }
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{path}: {error}; {accepted}") from None


def _flights(arrays: Mapping[str, np.ndarray], where: str, n: int) -> Flights:
    """The flights of one place."""
    time, length, success = (arrays[f"{where}/{name}"] for name in ("time", "length", "success"))
    t = len(time)
    shapes = {name: (t, n, width) for name, width in _MOVED.items()} | {"length": (n,), "success": (n,)}
    for name, shape in shapes.items():
        if (there := arrays[f"{where}/{name}"].shape) != shape:
            raise ValueError(f"{where}/{name} has shape {there}, wanted: {shape}")
    if length.dtype.kind != "i" or length.min(initial=0) < 0 or length.max(initial=0) > t:
        raise ValueError(f"{where}/length is {length.tolist()}, wanted: 0 to {t}")
    moved: dict[str, Any] = {name: arrays[f"{where}/{name}"].astype(float) for name in _MOVED}
    return Flights(
        time.astype(float), rotor_speed=np.full((t, n, 4), np.nan), length=length, success=success.astype(bool),
        command_mode=str(arrays[f"{where}/mode"]), **moved,
    )  # fmt: skip
