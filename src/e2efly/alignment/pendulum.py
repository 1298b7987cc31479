"""Inertia from the periods of a bifilar pendulum: the vehicle hangs on two equal parallel threads and oscillates about
the vertical.

The threads have length L and distance 2 a, and the centre of mass is in the middle between them. Small oscillations
then have the period T = 2 pi sqrt(J L / (m g a^2)), hence J = m g a^2 T^2 / (4 pi^2 L) (Jardin and Mueller, "Optimized
Measurements of Unmanned-Air-Vehicle Mass Moment of Inertia with a Bifilar Pendulum", 2009, small angles).
"""

from pathlib import Path
from typing import Any

import numpy as np

from e2efly.alignment.estimates import Estimate
from e2efly.alignment.parts import positive
from e2efly.config.tables import number, read_table, shown
from e2efly.vehicles.gravity import GRAVITY

AXES = ("x", "y", "z")
SPREAD = 0.01
"""Relative standard deviation that remains with the best set-up, from air that moves with the vehicle and from threads
that are not parallel."""
_KEYS = {"mass", "mass_sigma", "length", "length_sigma", "distance", "distance_sigma", "periods", "count"}


def estimates(path: Path) -> list[Estimate]:
    """The inertia about each axis that was hung vertically, and the mass, if its sigma is given.

    The file has one table per axis: `[x]`, `[y]`, `[z]`.

    Raises:
        ValueError: naming the file, the table, the key, the value and what is accepted.
    """
    table = read_table(path)
    if not table or set(table) - set(AXES):
        raise ValueError(f"{path}: has the keys {', '.join(table) or 'none'}; accepted: tables [x], [y], [z]")
    value, sigma = np.full(3, np.nan), np.full(3, np.nan)
    masses: set[tuple[float, float]] = set()
    for axis, entry in table.items():
        i = AXES.index(axis)
        value[i], sigma[i], mass = _axis(f"{path}: {axis}", entry)
        masses.add(mass)
    source = f"{path.name}, bifilar pendulum"
    found = [Estimate("inertia", value, sigma, source)]
    for mass, off in masses:
        if off > 0:
            found.append(Estimate("mass", np.array(mass), np.array(off), source))
    return found


def _axis(where: str, entry: Any) -> tuple[float, float, tuple[float, float]]:
    """Inertia and its standard deviation, and the mass with its standard deviation."""
    if not isinstance(entry, dict) or set(entry) - _KEYS:
        raise ValueError(f"{where} is {shown(entry)}; accepted: a table of {', '.join(sorted(_KEYS))}")
    if missing := [key for key in ("mass", "length", "distance", "periods") if key not in entry]:
        raise ValueError(f"{where}: missing key {', '.join(map(repr, missing))}")
    m, length, distance = (positive(f"{where}: {key}", entry[key]) for key in ("mass", "length", "distance"))
    off = {
        key: float(number(f"{where}: {key}_sigma", entry.get(f"{key}_sigma", 0.0)))
        for key in ("mass", "length", "distance")
    }
    count = positive(f"{where}: count", entry["count"]) if "count" in entry else 1.0
    listed = entry["periods"]
    if not isinstance(listed, list) or len(listed) < 3:
        raise ValueError(
            f"{where}: periods is {shown(listed)}; accepted: three or more times of {count:g} period(s), s"
        )
    times = np.array([number(f"{where}: periods", one, " of seconds") for one in listed]) / count
    if np.any(times <= 0):
        raise ValueError(f"{where}: periods is {shown(listed)}; accepted: positive times, s")
    period = float(np.median(times))
    if np.any(np.abs(times / period - 1) > 0.1):
        raise ValueError(
            f"{where}: periods is {shown(listed)}: they differ by more than 10 % from their median, "
            f"{period * count:.3g} s; accepted: the same number of periods each time"
        )
    inertia = m * GRAVITY * (distance / 2) ** 2 * np.mean(times) ** 2 / (4 * np.pi**2 * length)
    timing = np.std(times, ddof=1) / np.sqrt(len(times)) / period
    parts = [2 * timing, off["mass"] / m, off["length"] / length, 2 * off["distance"] / distance, SPREAD]
    return float(inertia), float(inertia * np.sqrt(np.sum(np.square(parts)))), (m, off["mass"])
