"""The correlation of the errors of the identified values: a matrix over the uncertain entries of the vehicle file."""

from collections.abc import Iterable, Mapping

import numpy as np

from e2efly.alignment.estimates import Estimate
from e2efly.alignment.found import Found, relative_sigma
from e2efly.alignment.model import Unknown
from e2efly.vehicles.posterior import ADDED, TOGETHER, Entry

OVER_MASS = ("thrust_map", "rotor_thrust_max", "inertia", "drag_linear", "drag_quadratic")
"""Fields that flights determine only relative to the mass. A relative error of the mass changes all of them by the same
fraction."""
MASS = "mass"
FIRM = 2e-3
"""Smallest eigenvalue of the matrix, so that it stays positive definite when it is written with four digits."""


def entry_of(unknown: Unknown) -> Entry:
    """The entry of the vehicle file that corresponds to an unknown of the fit."""
    whole = unknown.field in TOGETHER or not unknown.entries
    return Entry(unknown.field, None if whole else unknown.entries[0])


def correlation(
    found: Iterable[Found], fused: Mapping[str, Estimate], mass_sigma: float
) -> tuple[list[str], np.ndarray]:
    """Names of entries, and their correlation matrix, (d, d).

    Args:
        found: the results of the flights.
        fused: the combined estimates of all sources. If another source knows an entry better than the flights do, its
            error depends less on the errors of the flights: by the square root of their fraction of the information.
        mass_sigma: relative standard deviation of the mass that was used for the flights. 0: it is not known.
    """
    names: list[str] = []
    blocks: list[np.ndarray] = []
    for each in (part for whole in found for part in whole.parts):
        covariance, sigma = each.covariance, relative_sigma(each)
        spread = np.sqrt(np.diag(covariance))
        kept = [
            i for i, u in enumerate(each.unknowns)
            if u.field in fused and entry_of(u).name not in names and _sigma(fused[u.field], entry_of(u)) > 0
        ]  # fmt: skip
        own = (covariance / np.outer(spread, spread) * np.outer(sigma, sigma))[np.ix_(kept, kept)]
        entries = [entry_of(each.unknowns[i]) for i in kept]
        over = np.array([float(e.field in OVER_MASS) for e in entries]) * mass_sigma
        whole = own + np.outer(over, over)
        by_flight = np.sqrt(np.diag(whole))
        share = np.array([_sigma(fused[e.field], e) for e in entries]) / by_flight
        # the fused variance divided by that of the flights is the flights' fraction of the information
        block = whole / np.outer(by_flight, by_flight) * np.outer(*(np.minimum(share, 1.0),) * 2)
        np.fill_diagonal(block, 1.0)
        if mass_sigma and not blocks and kept:
            with_mass = over / by_flight * np.minimum(share, 1.0)
            block = np.block([[block, with_mass[:, None]], [with_mass[None], np.ones((1, 1))]])
            entries.append(Entry(MASS))
        names += [e.name for e in entries]
        blocks.append(block)
    matrix = np.zeros((len(names), len(names)))
    at = 0
    for block in blocks:
        end = at + len(block)
        matrix[at:end, at:end] = block
        at = end
    # a flight of fewer windows than unknowns leaves directions without a spread
    if names and np.linalg.eigvalsh(np.round(matrix, 4))[0] <= 0:
        low = float(np.linalg.eigvalsh(matrix)[0])
        own = (FIRM - low) / (1 - low)
        matrix = (1 - own) * matrix + own * np.eye(len(names))
    return names, matrix


def _sigma(estimate: Estimate, entry: Entry) -> float:
    """Standard deviation of an entry, relative, for the delay in s. 0 if the entry was not found."""
    at = 0 if entry.index is None else entry.index
    value, sigma = (float(np.atleast_1d(x).flat[at]) for x in (estimate.value, estimate.sigma))
    if not np.isfinite(sigma):
        return 0.0
    return sigma if entry.field in ADDED else sigma / abs(value)
