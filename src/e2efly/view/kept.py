"""Flights of a validation beside its report, so that they can be watched: report.flights.npz beside report.json."""

import io
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from e2efly.view.flights import Flights

PLACES = ("training", "plant")
"""Where the flights were flown: in the training simulator and on the plant."""
_MOVED = {"position": 3, "velocity": 3, "quaternion": 4, "body_rate": 3, "command": 4, "goal": 3}
"""What is kept of each flight, and how many numbers of each step."""


@dataclass(frozen=True)
class Pair:
    """Some starts of a criterion, flown in two places."""

    starts: Int[np.ndarray, " n"]
    """Their numbers among the starts of the report."""
    flown: Mapping[str, Flights]
    """By a name of `PLACES`, in that order; flights in the order of `starts`."""


def flights_file(report: Path) -> Path:
    """Where they are: report.flights.npz beside report.json."""
    return report.with_suffix(".flights.npz")


def packed(pairs: Mapping[str, Pair]) -> bytes:
    """The content of such a file; pairs by criterion."""
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
    """The flights of such a file, by criterion; rotor speeds are not kept.

    Raises:
        ValueError: naming the file, where it holds something else.
    """
    accepted = "accepted: what `e2efly validate --json` has written beside its report"
    try:
        with np.load(path, allow_pickle=False) as content:
            arrays = {name: content[name] for name in content.files}
        found = {name.removesuffix("/starts"): arrays[name] for name in arrays if name.endswith("/starts")}
        return {
            criterion: Pair(starts, {place: _flights(arrays, f"{criterion}/{place}", len(starts)) for place in PLACES})
            for criterion, starts in found.items()
        }
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile) as error:
        raise ValueError(f"{path}: {error}; {accepted}") from None


def _flights(arrays: Mapping[str, np.ndarray], where: str, n: int) -> Flights:
    """Of one place.

    Raises:
        KeyError: for an array that is missing.
        ValueError: for one of another shape.
    """
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
