"""Estimates of a vehicle's parameters from different sources, and their combination."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

CONTRADICTION = 3.0
"""Difference from which on two sources contradict each other, in standard deviations of the difference."""


@dataclass(frozen=True)
class Estimate:
    """The estimate of a parameter from one source."""

    name: str
    """A field of `e2efly.vehicles.vehicle.Vehicle`."""
    value: np.ndarray
    """Value, in the shape and unit of the field. NaN in entries for which the source has no value."""
    sigma: np.ndarray
    """Standard deviation of each entry, in the same unit."""
    source: str
    """Origin of the estimate: the file and the estimator."""


def weighed(mass: tuple[float, float]) -> Estimate:
    """The mass of a vehicle by a scale: kg, and the standard deviation of the scale.

    Raises:
        ValueError: for numbers that are not positive, as the option `--mass`.
    """
    kg, sigma = mass
    if not (kg > 0 and sigma > 0):
        raise ValueError(f"--mass is {kg} {sigma}; accepted: kg and its standard deviation, both above 0")
    return Estimate("mass", np.array(kg), np.array(sigma), "weighed")


class ContradictionError(ValueError):
    """The values of two sources cannot both be true."""


def fuse(estimates: Sequence[Estimate]) -> dict[str, Estimate]:
    """One estimate per parameter: the mean weighted by one over the variance, entry by entry.

    Raises:
        ContradictionError: when two sources differ by more than three standard deviations of their difference, naming
            the parameter, the entry, both values and both sources.
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
