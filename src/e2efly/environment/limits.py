"""Limits of the commands, and delays, that follow from a configuration and its vehicle."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from e2efly.config import EnvConfig
from e2efly.config.domain import Domain, Extent
from e2efly.control import COMMAND_MODES, command_limits
from e2efly.policy.contract import SENSING
from e2efly.vehicles.family import Family
from e2efly.vehicles.posterior import ADDED, IDENTIFIED, TOGETHER, WIDEST, Posterior, load_posterior
from e2efly.vehicles.vehicle import Vehicle
from e2efly.vehicles.vehicle_domain import drawn_domain

MOST = 10.0
"""Largest factor on the standard deviations of an identified vehicle from which episodes may draw."""


def limits_of(config: EnvConfig, vehicle: Vehicle, family: Family | None) -> np.ndarray:
    """Smallest and largest command, (2, c). If the configuration gives none, those of its vehicle, or of all vehicles
    of its family together.

    Raises:
        ValueError: for a family in a command mode that its vehicles do not share, and for an invalid range.
    """
    if config.command_range is not None:
        given = np.asarray(config.command_range, np.float64)
        if (size := len(COMMAND_MODES[config.command_mode].of(vehicle.rotor_count).fields)) != given.shape[1]:
            raise ValueError(
                f"env.command_range is {config.command_range} and a command of {vehicle.name} has {size} numbers, one "
                "for each rotor; accepted: None, for the rotors' own limits"
            )
        if not (np.all(np.isfinite(given)) and np.all(given[0] < given[1])):
            raise ValueError(
                f"env.command_range is {config.command_range}; accepted: four finite numbers, and four that are larger"
            )
        return given
    if family is not None:
        return np.asarray(family.limits(config.command_mode), np.float64)
    return command_limits(COMMAND_MODES[config.command_mode], vehicle, config.position_range)


def latencies_of(
    config: EnvConfig, vehicle: Vehicle, family: Family | None, posterior: Posterior | None
) -> tuple[float, float]:
    """Latency from observation to command, if the configuration does not give it, s."""
    low, high = (vehicle.latency,) * 2 if family is None else family.ranges.latency
    sooner, later = config.latency_spread
    margin = 0.0 if posterior is None else WIDEST * float(posterior.latency_sigma)
    return max(low - sooner - margin, 0.0), high + later + margin


def nominal_latency(own: float, latencies: Sequence[float]) -> float:
    """The latency of a vehicle by itself, s: its own, if episodes may have it, otherwise the mean of theirs."""
    low, high = latencies
    return own if low <= own <= high else (low + high) / 2


def vehicles_of(config: EnvConfig, vehicle: Vehicle, posterior: Posterior | None) -> Domain:
    """The ranges of the vehicles that episodes draw about one vehicle, for the contract of a policy.

    A posterior counts up to its widest draws. They are in the logarithm; the range has their lower, narrower side on
    both sides. Other draws of the same parameter are about them. What an episode's disturbances take of the thrust is
    no property of the vehicle, and stays a reserve.
    """
    shares: dict[str, Any] = {name: width for name, width in config.randomize.items() if name != IDENTIFIED}
    entries = () if posterior is None else zip(posterior.entries, posterior.sigma.values(), strict=True)
    for entry, sigma in entries:
        if entry.field in ADDED:
            continue
        share, at = -np.expm1(-WIDEST * sigma), ... if entry.index is None else entry.index
        for name in (entry.field, *TOGETHER.get(entry.field, ())):
            own = np.shape(getattr(vehicle, name))
            each = np.broadcast_to(np.float64(shares.get(name, 0.0)), own).copy()
            each[at] = 1 - (1 - share) * (1 - each[at])
            shares[name] = each
    return drawn_domain(vehicle, config.command_mode, shares, float(config.disturbance.centre_of_mass))


def sensing_of(config: EnvConfig, latency: Sequence[float], rate: float) -> Domain:
    """The lags, ages and holes of the observed state that episodes draw, for the contract of a policy (`SENSING`).

    Args:
        config: the options that episodes draw from.
        latency: smallest and largest latency from observation to command, s.
        rate: control rate, Hz. Each control step has a new state, unless it is repeated.
    """
    most = {name: getattr(config.estimate, name, 0.0) for name in SENSING} | {
        "pose_age": latency[1] + config.observation_latency[1],
        "hold": (1 + math.floor(config.estimate.hold)) / rate,
        "dropped": config.link.dropped,
    }
    return tuple(Extent(name, unit, 0.0, round(most[name], 6)) for name, unit in SENSING.items())


def posterior_of(config: EnvConfig) -> Posterior | None:
    """The distribution around the vehicle's file from which episodes draw. None: they do not draw from one.

    Raises:
        ValueError: for a file without standard deviations, and for a factor out of range.
    """
    width = config.randomize.get(IDENTIFIED, 0.0)
    if not 0 <= width <= MOST:
        raise ValueError(f"env.randomize.{IDENTIFIED} is {width}; accepted: 0 to {MOST:g} times the file's sigma")
    if not width:
        return None
    posterior = load_posterior(config.vehicle).times(width)
    return posterior if config.action_latency is None else posterior.without_latency()
