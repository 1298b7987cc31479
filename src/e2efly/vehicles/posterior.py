"""Uncertainty given by a vehicle file: standard deviations and correlations. Imports no JAX.

Beside its entries with `sigma`, a file may have a table `[correlation]`. There `of` names parameters, such as "mass" or
"inertia[0]", and `value` is their correlation matrix. `e2efly identify` writes this table.
"""

import dataclasses
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.config.tables import read_table, shown
from e2efly.vehicles.loading import CORRELATION, load_vehicle, sigmas_of, vehicle_file
from e2efly.vehicles.vehicle import Vehicle, quantities, terms

IDENTIFIED = "identified"
"""The name of this distribution in `randomize`."""
WIDEST = 2.5
"""Limit of the standard normal numbers that are drawn. The 1.2 % of them that lie beyond it are clipped to it."""
LARGEST = 0.7
"""Relative standard deviation above which a value is too uncertain to be drawn."""
TOGETHER = {"thrust_map": ("rotor_thrust_max",)}
"""Fields whose entries are all multiplied by one common factor, and the other fields that this factor multiplies."""
LATENCY = "latency"
ADDED = (LATENCY, "centre_of_mass", "inertia_products")
"""Fields whose deviation is added, in their own unit. For all other fields the deviation is the logarithm of a
factor."""


@dataclass(frozen=True)
class Entry:
    """One number that is uncertain: a field of the vehicle, or one of its entries."""

    field: str
    """Name of a field of `Vehicle`."""
    index: int | None = None
    """Index of the entry. None: the whole field."""

    @property
    def name(self) -> str:
        """Its name in files."""
        return self.field if self.index is None else f"{self.field}[{self.index}]"

    @staticmethod
    def of(name: str) -> "Entry":
        """The entry with this name in files.

        Raises:
            ValueError: for a name of another form, or for a name of no parameter.
        """
        found, shapes = (
            re.fullmatch(r"(\w+)(?:\[(\d+)\])?", name),
            {f.name: f.metadata["shape"] for f in (*quantities(), *terms())},
        )
        if found and found[1] in shapes:
            field, index, shape = found[1], found[2], shapes[found[1]]
            whole = shape == () or field in TOGETHER
            if (index is None) if whole else (index is not None and len(shape) == 1 and int(index) < shape[0]):
                return Entry(field, None if index is None else int(index))
        raise ValueError(f"{name!r} is no parameter; accepted: names such as mass, thrust_map, inertia[0]")


@dataclass(frozen=True)
class Posterior:
    """The distribution of a vehicle about the values of its file.

    It is normal in the logarithms of the values, and in the values themselves of the fields `ADDED`.
    """

    entries: tuple[Entry, ...]
    """The uncertain entries."""
    root: np.ndarray
    """(d, m). Multiplied by a vector of m standard normal numbers, it gives the deviations."""

    @property
    def latency(self) -> int | None:
        """Index of the entry of the latency. None: the file does not give its uncertainty."""
        return next((i for i, entry in enumerate(self.entries) if entry.field == LATENCY), None)

    @property
    def latency_sigma(self) -> Any:
        """Standard deviation of the latency, s. 0 if the file does not give it."""
        return 0.0 if self.latency is None else (self.root[self.latency] ** 2).sum() ** 0.5

    def without_latency(self) -> "Posterior":
        """The distribution of all other entries."""
        kept = [i for i, entry in enumerate(self.entries) if entry.field != LATENCY]
        return Posterior(tuple(self.entries[i] for i in kept), self.root[kept])

    @property
    def thrust_sigma(self) -> float:
        """Relative standard deviation of the ratio of thrust to mass."""
        names = [entry.field for entry in self.entries]
        rows = {name: self.root[names.index(name)] for name in ("thrust_map", "mass") if name in names}
        return float(np.linalg.norm(rows.get("thrust_map", 0.0 * self.root[0]) - rows.get("mass", 0.0)))

    def times(self, width: float) -> "Posterior":
        """The distribution with its standard deviations multiplied by `width`."""
        return dataclasses.replace(self, root=self.root * width)

    @property
    def sigma(self) -> dict[str, float]:
        """Standard deviations by the name of the entry: relative, but of `ADDED` in the field's unit."""
        return {e.name: float(np.linalg.norm(row)) for e, row in zip(self.entries, self.root, strict=True)}

    def deviation(self, normal: Any) -> Any:
        """Deviations of the entries, (n, d), from standard normal numbers, (n, m), of NumPy or JAX.

        Each number is clipped to `WIDEST`, so that no episode has an absurd vehicle.
        """
        return normal.clip(-WIDEST, WIDEST) @ self.root.T

    def values(self, vehicle: Vehicle, deviation: Any) -> dict[str, Any]:
        """Fields of the vehicles that have these deviations, each (n, ...), without the latency. `vehicle` is the
        vehicle with deviations of zero. What it does not have is left out. `deviation` is (n, d), from `deviation`.
        """
        drawn: dict[str, list[Any]] = {}
        for i, entry in enumerate(self.entries):
            if entry.field != LATENCY and getattr(vehicle, entry.field) is not None:
                drawn.setdefault(entry.field, []).append((entry.index, deviation[:, i]))
        out: dict[str, Any] = {}
        for field, moved in drawn.items():
            base, (index, first) = getattr(vehicle, field), moved[0]
            library = first.__array_namespace__()
            if index is None:
                for name in (field, *TOGETHER.get(field, ())):
                    own = getattr(vehicle, name)
                    out[name] = library.exp(first).reshape(-1, *(1,) * np.ndim(own)) * own
            else:
                by, still = dict(moved), 0 * first
                away = library.stack([by.get(i, still) for i in range(np.shape(base)[-1])], axis=-1)
                out[field] = base + away if field in ADDED else library.exp(away) * base
        return out


def load_posterior(name_or_path: str | Path) -> Posterior:
    """The uncertainty that a vehicle file gives.

    Raises:
        ValueError: naming the file and what is wrong with it; or if the file has no standard deviation at all.
    """
    path = vehicle_file(name_or_path)
    vehicle, table = load_vehicle(path), read_table(path)
    known = _relative(vehicle, sigmas_of(vehicle, table, str(path)), str(path))
    if not known:
        raise ValueError(
            f"env.randomize is identified, but {path} has no sigma; accepted: a vehicle file whose entries have "
            "standard deviations, as `e2efly identify` writes it"
        )
    names, correlation = read_correlation(table, str(path))
    for name in names:
        if name not in known:
            raise ValueError(f"{path}: correlation.of names {name!r}, which has no sigma; accepted: {', '.join(known)}")
    order, sigma, whole = list(known), np.array(list(known.values())), np.eye(len(known))
    at = [order.index(name) for name in names]
    whole[np.ix_(at, at)] = correlation
    return Posterior(tuple(map(Entry.of, order)), np.linalg.cholesky(whole) * sigma[:, None])


def _relative(vehicle: Vehicle, sigmas: dict[str, np.ndarray], where: str) -> dict[str, float]:
    """Standard deviations by entry: relative, but in its own unit for a deviation that is added."""
    moved_along = {name for names in TOGETHER.values() for name in names}
    found: dict[str, float] = {}
    for field, sigma in sigmas.items():
        value = np.asarray(getattr(vehicle, field), np.float64)
        if field in moved_along or value.ndim > 1:
            continue
        places = [None] if not value.ndim or field in TOGETHER else list(range(value.size))
        for index in places:
            at = 0 if index is None else index
            off, own = float(sigma.flat[at]), float(value.flat[at])
            share = off if field in ADDED else off / abs(own) if own else np.nan
            if not (np.isfinite(share) and share > 0):
                continue
            entry = Entry(field, index)
            if field not in ADDED and share > LARGEST:
                raise ValueError(
                    f"{where}: {entry.name} is {own:.4g} with sigma {off:.2g}; accepted for a draw: a sigma of at most "
                    f"{100 * LARGEST:g} % of the value"
                )
            found[entry.name] = share
    return found


def read_correlation(file: dict[str, Any], where: str) -> tuple[list[str], np.ndarray]:
    """Names and matrix of the table `[correlation]` of a vehicle file. Both are empty if the file has none.

    Raises:
        ValueError: naming the file and what is wrong with the table.
    """
    table = file.get(CORRELATION)
    if table is None:
        return [], np.zeros((0, 0))
    names = table.get("of") if isinstance(table, dict) else None
    if not isinstance(names, list) or not names or len({*map(str, names)}) < len(names):
        raise ValueError(f"{where}: correlation.of is {shown(names)}; accepted: a list of parameters, each once")
    for name in names:
        try:
            Entry.of(str(name))
        except ValueError as error:
            raise ValueError(f"{where}: correlation.of: {error}") from None
    try:
        matrix = np.asarray(table.get("value"), np.float64)
    except (TypeError, ValueError):
        matrix = np.zeros(0)
    good = matrix.shape == (len(names),) * 2 and np.isfinite(matrix).all()
    good = good and np.allclose(matrix, matrix.T) and np.allclose(np.diag(matrix), 1)
    if not (good and np.linalg.eigvalsh(matrix).min() > 0):
        raise ValueError(
            f"{where}: correlation.value is {shown(table.get('value'))}; accepted: a symmetric, positive definite "
            f"matrix of {len(names)} rows with 1 on its diagonal"
        )
    return names, matrix
