"""What a source says of a vehicle's parameter, and what all sources say together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

CONTRADICTION = 3.0
"""Standard deviations of their difference from which on two sources contradict each other."""


@dataclass(frozen=True)
class Estimate:
    """A parameter as a source gives it."""

    name: str
    """A field of `e2efly.vehicles.Vehicle`."""
    value: np.ndarray
    """Of the field's shape and unit; NaN in entries of which the source says nothing."""
    sigma: np.ndarray
    """Standard deviation of each entry, in the same unit."""
    source: str
    """Where it is from: the file, and by which estimator."""


class ContradictionError(ValueError):
    """Two sources say what cannot both be true."""


def fuse(estimates: Sequence[Estimate]) -> dict[str, Estimate]:
    """One estimate a parameter: the mean weighted by one over the variance, entry by entry.

    Raises:
        ContradictionError: naming parameter, entry, both values and both sources, where two of them are more than three
            standard deviations of their difference apart.
    """
    named: dict[str, list[Estimate]] = {}
    for estimate in estimates:
        named.setdefault(estimate.name, []).append(estimate)
    return {name: _fused(name, found) for name, found in named.items()}


def _fused(name: str, found: list[Estimate]) -> Estimate:
    for i, a in enumerate(found):
        for b in found[:i]:
            _check_agree(name, b, a)
    if len(found) == 1:
        return found[0]
    value, sigma = (
        np.stack([np.asarray(x, float) for x in one]) for one in zip(*((e.value, e.sigma) for e in found), strict=True)
    )
    weight = np.where(np.isfinite(value), 1 / sigma**2, 0.0)
    total = weight.sum(0)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(total > 0, np.nansum(weight * np.nan_to_num(value), 0) / total, np.nan)
        spread = np.where(total > 0, total**-0.5, np.nan)
    return Estimate(name, mean, spread, "; ".join(e.source for e in found))


def _check_agree(name: str, a: Estimate, b: Estimate) -> None:
    apart = np.abs(a.value - b.value) / np.hypot(a.sigma, b.sigma)
    for place in np.argwhere(np.nan_to_num(apart) > CONTRADICTION):
        at = tuple(place)
        index = f"[{', '.join(map(str, at))}]" if at else ""
        said = " and ".join(f"{e.value[at]:.4g} +- {e.sigma[at]:.2g} by {e.source}" for e in (a, b))
        raise ContradictionError(
            f"{name}{index} is {said}: {apart[at]:.1f} standard deviations apart; accepted: at most {CONTRADICTION:g}. "
            "One of the two is wrong, or says that it is more exact than it is: leave it out, or measure again"
        )
