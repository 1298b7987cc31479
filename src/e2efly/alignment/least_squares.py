"""Robust least squares with standard deviations that hold where residuals are neither white nor normal.

Gauss-Newton with Levenberg's damping and Huber's weights (P. J. Huber, "Robust Estimation of a Location Parameter",
1964). The covariance is the sandwich of the gradients of consecutive groups of residuals, whose correlation over time
counts by Bartlett's weights (W. K. Newey and K. D. West, "A Simple, Positive Semi-Definite, Heteroskedasticity and
Autocorrelation Consistent Covariance Matrix", 1987).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from e2efly.alignment.misfit import white_by
from e2efly.control.vectors import namespace

HUBER = 2.0
"""Up to this number of standard deviations, a residual counts with its square."""
NEIGHBOURS = 4
"""Number of groups over which the correlation of neighbouring groups counts."""
HELD = 1e-9
"""Prior standard deviation of a number that stays zero."""
STILL = 0.01
"""If a step changes every number by less than this part of its standard deviation, it is the last."""


@dataclass(frozen=True)
class Solution:
    """The result."""

    x: np.ndarray
    """(k,) the numbers."""
    covariance: np.ndarray
    """(k, k) the sandwich."""
    assumed: np.ndarray
    """(k, k) the covariance for white residuals."""
    noise: dict[str, float]
    """Root mean square of the residuals of each sensor."""
    left: dict[str, np.ndarray]
    """By sensor, (groups, rows): the residuals, in its unit."""
    gradients: np.ndarray
    """(groups, k) of each group, without the prior."""
    curvatures: np.ndarray
    """(groups, k, k) of each group, without the prior."""
    white: dict[str, np.ndarray]
    """By sensor, (k,): standard deviations by its white noise alone."""
    prior: np.ndarray
    """(k,) standard deviations about zero."""
    bound: np.ndarray
    """(k,) which numbers are as small as possible, and would be smaller."""
    iterations: int


def solve(
    residuals: Callable[[Array, Any], dict[str, Array]],
    data: Any,
    there: Mapping[str, np.ndarray],
    start: np.ndarray,
    prior: np.ndarray,
    floor: Mapping[str, float],
    least: np.ndarray | None = None,
    held: np.ndarray | None = None,
    iterations: int = 25,
) -> Solution:
    """The numbers whose residuals are smallest.

    Args:
        residuals: of the numbers, (k,), and the data: by sensor, (groups, rows) in its unit. It is compiled.
        data: arrays of the measurements.
        there: by sensor, (groups, rows): 1 where something was measured, else 0.
        start: the first values, (k,).
        prior: standard deviations about zero, (k,).
        floor: the smallest spread of each sensor, in its unit.
        least: the smallest possible values, (k,). None: none is known.
        held: (k,) which numbers stay zero. None: none does.
        iterations: the largest number of iterations.
    """
    least = np.full(len(start), -np.inf) if least is None else least
    if held is not None:
        start, prior = np.where(held, 0.0, start), np.where(held, HELD, prior)
    of, slopes = _compiled(residuals)
    counts = {name: max(float(mask.sum()), 1.0) for name, mask in there.items()}

    def spread(r: Mapping[str, np.ndarray]) -> dict[str, float]:
        return {k: max(float(np.sqrt(np.sum((x * there[k]) ** 2) / counts[k])), floor[k]) for k, x in r.items()}

    def cost(r: Mapping[str, np.ndarray], noise: Mapping[str, float], x: np.ndarray) -> float:
        by_sensor = sum(float(np.sum(huber(v / noise[k]) * there[k])) for k, v in r.items())
        return by_sensor + 0.5 * float(np.sum((x / prior) ** 2))

    x, damping, done = np.maximum(start, least), 1e-3, 0
    r = _numpy(of(jnp.asarray(x), data))
    noise = spread(r)
    J = _numpy(slopes(jnp.asarray(x), data))
    gradients, curvatures = _terms(J, r, noise, there)
    for _ in range(iterations):
        done += 1
        H = curvatures.sum(0) + np.diag(prior**-2)
        g = gradients.sum(0) + x / prior**2
        bound = np.flatnonzero((x <= least) & (g > 0))
        H[bound, bound] *= 1e12
        now, tried = cost(r, noise, x), np.inf
        for _ in range(8):
            step = -np.linalg.solve(H + damping * np.diag(np.diag(H)), g)
            step = np.maximum(step, least - x)
            ahead = _numpy(of(jnp.asarray(x + step), data))
            tried = cost(ahead, noise, x + step)
            if np.isfinite(tried) and tried <= now:
                break
            damping *= 10
        else:
            break
        x, r, damping = x + step, ahead, max(damping / 10, 1e-9)
        noise = spread(r)
        J = _numpy(slopes(jnp.asarray(x), data))
        gradients, curvatures = _terms(J, r, noise, there)
        if np.all(np.abs(step) < STILL * np.sqrt(np.diag(np.linalg.inv(H)))):
            break
    H = curvatures.sum(0) + np.diag(prior**-2)
    inverse = np.linalg.inv(H)
    sandwich = inverse @ (correlated(gradients) + np.diag(prior**-2)) @ inverse
    bound = (x <= least) & (gradients.sum(0) + x / prior**2 > 0)
    white = {k: white_by(inverse, _terms({k: own}, r, noise, there)[1].sum(0)) for k, own in J.items()}
    return Solution(x, sandwich, inverse, noise, r, gradients, curvatures, white, prior, bound, done)


@lru_cache
def _compiled(residuals: Callable[[Array, Any], dict[str, Array]]) -> tuple[Any, Any]:
    """The residuals and their slopes, compiled once."""
    return jax.jit(residuals), jax.jit(jax.jacfwd(residuals))


def between(found: Solution, part: np.ndarray) -> np.ndarray:
    """The jackknife over parts of the data, (k,). `part` is the number of the part of each group, (groups,)."""
    parts = np.unique(part)
    curvatures, gradients = (
        np.stack([x[part == one].sum(0) for one in parts]) for x in (found.curvatures, found.gradients)
    )
    stiff = np.diag(np.where(found.bound, 1e12, 1.0) * found.prior**-2)
    return jackknife(curvatures, gradients, stiff, found.x / found.prior**2)


def jackknife(curvatures: np.ndarray, gradients: np.ndarray, stiff: np.ndarray, pulled: np.ndarray) -> np.ndarray:
    """Standard deviations of a fit, (k,), by the spread between parts of its data: each is left out in turn, and the
    others take one step. Zeros for one part.

    Args:
        curvatures: of each part, (parts, k, k).
        gradients: of each part, (parts, k).
        stiff: curvature of the prior, (k, k).
        pulled: gradient of the prior, (k,).
    """
    if len(gradients) < 2:
        return np.zeros(len(pulled))
    H, g = curvatures.sum(0) + stiff, gradients.sum(0) + pulled
    steps = [np.linalg.solve(H - own, g - pull) for own, pull in zip(curvatures, gradients, strict=True)]
    return np.asarray(np.sqrt((len(steps) - 1) * np.var(steps, axis=0)))


def correlated(gradients: np.ndarray) -> np.ndarray:
    """The covariance of the sum of gradients, (groups, k), that are correlated with those of neighbouring groups."""
    each = gradients - gradients.mean(0)
    total = each.T @ each
    for lag in range(1, min(NEIGHBOURS, len(each) - 1) + 1):
        with_later = each[:-lag].T @ each[lag:]
        total += (1 - lag / (NEIGHBOURS + 1)) * (with_later + with_later.T)
    return np.asarray(total * (len(each) / max(len(each) - 1, 1)))


def _terms(
    slopes: Mapping[str, np.ndarray],
    r: Mapping[str, np.ndarray],
    noise: Mapping[str, float],
    there: Mapping[str, np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """Gradient and curvature of each group."""
    g, H = [], []
    for name, J in slopes.items():
        scaled = r[name] / noise[name]
        weight = np.minimum(1.0, HUBER / np.maximum(np.abs(scaled), 1e-12)) * there[name] / noise[name] ** 2
        weighed = J * weight[..., None]
        g.append(np.einsum("nrk,nr->nk", weighed, r[name]))
        H.append(np.einsum("nrk,nrl->nkl", weighed, J, optimize=True))
    return np.sum(g, 0), np.sum(H, 0)


def huber(r: Array | np.ndarray) -> Any:
    """Huber's cost of residuals over their standard deviation."""
    xp = namespace(r)
    size = xp.abs(r)
    return xp.where(size < HUBER, 0.5 * r**2, HUBER * (size - HUBER / 2))


def _numpy(found: Mapping[str, Array]) -> dict[str, np.ndarray]:
    return {name: np.asarray(x) for name, x in found.items()}
