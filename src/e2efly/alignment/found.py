"""The result of an identification from flights: what was found, how sure it is, and what was refused."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.alignment.estimates import Estimate
from e2efly.alignment.misfit import LeftOver
from e2efly.alignment.model import NUISANCES, Model, Unknown, from_zero, value_of
from e2efly.alignment.shooting import Fit
from e2efly.alignment.windows import Windows
from e2efly.vehicles.vehicle import Vehicle

SHOWN = 0.5
"""If the standard deviation is above this fraction of the prior's, the flights say nothing about an unknown."""
EXACT = {"latency": 0.02, "drag": 0.5}
"""Standard deviation above which an unknown is refused, s or relative. `EXACT_ELSE` applies to all others."""
EXACT_ELSE = 0.15
SURE = 3.0
"""Number of standard deviations from which on an effect that the vehicle file does not have counts as shown."""
ABOVE_ZERO = 2.0
"""Standard deviations by which an unknown that the file has as zero must be above it to be taken from the flights."""


@dataclass(frozen=True)
class Refusal:
    """An unknown that cannot be found from these flights."""

    unknown: Unknown
    sigma: float
    """Standard deviation after the fit, s or relative."""
    impossible: bool = False
    """Whether the fitted value is impossible for a rigid body."""
    added: float = 0.0
    """If the file has zero, the unit of `sigma`, in the unit of the file's field."""

    limited: float = 0.0
    """The share of the flights in which rotors at their limits hide it, if that is why."""

    def __str__(self) -> str:
        if self.limited:
            return (
                f"{self.unknown.name} is not taken from the flights: {100 * self.limited:.0f} % of them are with a "
                f"rotor near its limits, or soon after; fly: smaller {self.unknown.fly}"
            )
        if self.impossible:
            return f"{self.unknown.name} is not taken from the flights: no rigid body has it; fly: {self.unknown.fly}"
        unit = Vehicle.__dataclass_fields__[self.unknown.field].metadata["unit"] if self.unknown.field else "1"
        if self.added:
            off = f"{self.sigma * self.added:.2g} {unit}"
            return (
                f"{self.unknown.name} stays 0, as in the file: the flights show it to +- {off}; fly: {self.unknown.fly}"
            )
        how = f"+- {self.sigma:.2g} {unit}" if self.unknown.added else f"+- {100 * self.sigma:.0f} %"
        return f"{self.unknown.name} is not taken from the flights ({how}); fly: {self.unknown.fly}"


@dataclass(frozen=True)
class FittedPart:
    """Unknowns that were fitted together."""

    base: Vehicle
    """The vehicle at which all of them are zero."""
    unknowns: tuple[Unknown, ...]
    p: np.ndarray
    """(u,) their values."""
    sigma: np.ndarray
    """(u,) their standard deviations."""
    covariance: np.ndarray
    """(u, u) whose correlations hold."""
    noise: dict[str, float]
    """Spread of each sensor about the model."""


@dataclass(frozen=True)
class Found:
    """The result of the identification from flights."""

    model: Model
    fit: Fit
    windows: Windows
    """All windows."""
    held_out: np.ndarray
    """(n,) which of the windows the fit did not see."""
    estimates: list[Estimate]
    refusals: list[Refusal]
    p: np.ndarray
    """(u,) values of the unknowns: those of the fit, given that refused unknowns have the values of the file."""
    sigma: np.ndarray
    """(u,) standard deviations of the unknowns, including the uncertainty of the model itself."""
    structures: dict[str, np.ndarray]
    """(u,) values of the unknowns found with models of another structure, by the name of the structure."""
    response: FittedPart | None = None
    """What the rotor speeds show of lag, delay and rate loop, if they were measured."""
    misfits: tuple[LeftOver, ...] = ()
    """What the fit leaves over, by sensor."""

    @property
    def parts(self) -> tuple[FittedPart, ...]:
        """What was fitted, each part by itself."""
        own = FittedPart(self.model.base, self.model.unknowns, self.p, self.sigma, self.fit.covariance, self.fit.noise)
        return (own,) if self.response is None else (own, self.response)


def relative_sigma(part: FittedPart) -> np.ndarray:
    """Standard deviations of the unknowns, (u,), relative to the value where the file has zero, as elsewhere."""
    return np.where(from_zero(part.base, part.unknowns) > 0, part.sigma / np.maximum(part.p, 1e-12), part.sigma)


def whole_covariance(found: Fit, sigma: np.ndarray) -> np.ndarray:
    """The covariance with these standard deviations and the correlations of the fit."""
    spread = np.sqrt(np.diag(found.covariance))
    return found.covariance / np.outer(spread, spread) * np.outer(sigma, sigma)


def refusals_of(
    base: Vehicle, unknowns: Sequence[Unknown], sigma: np.ndarray, refused: np.ndarray, impossible: Any = False
) -> list[Refusal]:
    """The refusals of those unknowns that are refused, (u,)."""
    units, impossible = from_zero(base, unknowns), np.broadcast_to(impossible, refused.shape)
    return [
        Refusal(unknowns[i], float(sigma[i]), bool(impossible[i]), float(units[i]))
        for i in map(int, np.flatnonzero(refused))
        if unknowns[i].field
    ]


def is_vague(base: Vehicle, unknowns: Sequence[Unknown], p: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """About which unknowns, (u,), the flights say too little."""
    limits = []
    for u in unknowns:
        exact = next((v for name, v in EXACT.items() if u.field.startswith(name)), np.inf if u.added else EXACT_ELSE)
        limits.append(min(exact, SHOWN * u.prior))
    return (sigma > limits) | ((from_zero(base, unknowns) > 0) & (p < ABOVE_ZERO * sigma))


def estimates_of(
    base: Vehicle, unknowns: Sequence[Unknown], p: np.ndarray, sigma: np.ndarray, refused: np.ndarray, source: str
) -> list[Estimate]:
    """The estimates by field of the vehicle. Fields that the flights do not determine are left to the file, and so are
    effects that it does not have and that are not shown.
    """
    values: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    shown = [u.field for u, x, off in zip(unknowns, p, sigma, strict=True) if abs(x) > SURE * off]
    for unknown, x, off, vague, unit in zip(unknowns, p, sigma, refused, from_zero(base, unknowns), strict=True):
        absent = unknown.field and getattr(base, unknown.field) is None
        if vague or not unknown.field or (absent and unknown.added and unknown.field not in shown):
            continue
        own = np.asarray(value_of(base, unknown.field), float)
        lacking = own if absent else np.full(own.shape, np.nan)
        value, spread = values.setdefault(unknown.field, (lacking.copy(), np.full(own.shape, np.nan)))
        at = list(unknown.entries) if unknown.entries else ...
        if unknown.added:
            value[at], spread[at] = own[at] + x, off
        elif unit:
            value[at], spread[at] = unit * x, unit * off
        else:
            value[at], spread[at] = own[at] * np.exp(x), np.abs(own[at]) * np.exp(x) * off
        if unknown.field == "thrust_map":  # the largest thrust grows with the map
            top = float(base.rotor_thrust_max) * np.exp(x)
            values["rotor_thrust_max"] = np.array(top), np.array(top * off)
    return [Estimate(name, value, spread, source) for name, (value, spread) in values.items()]


def nuisances(found: Found) -> list[dict[str, float]]:
    """The nuisance parameters of each flight, by name."""
    return [dict(zip((name for name, _ in NUISANCES), map(float, q), strict=True)) for q in found.fit.q]
