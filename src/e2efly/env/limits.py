"""What a configuration comes to for its vehicle: the limits of the commands, and the delays."""

import numpy as np

from e2efly.config import EnvConfig
from e2efly.control import COMMAND_MODES, command_limits
from e2efly.vehicles import Family, Vehicle, load_family, load_vehicle
from e2efly.vehicles.posterior import IDENTIFIED, WIDEST, Posterior, load_posterior


def limits_of(config: EnvConfig) -> np.ndarray:
    """Smallest and largest command, (2, 4): of the nominal vehicle, or all vehicles of a family together.

    Raises:
        ValueError: for a family in a command mode that its vehicles do not share.
    """
    family = load_family(config.vehicle)
    if family is not None:
        return np.asarray(family.limits(config.command_mode), np.float64)
    mode = COMMAND_MODES[config.command_mode]
    return command_limits(mode, load_vehicle(config.vehicle), config.position_range)


def latencies_of(config: EnvConfig, vehicle: Vehicle, family: Family | None) -> tuple[float, float]:
    """Seconds from observation to command where the configuration does not say."""
    low, high = (vehicle.latency,) * 2 if family is None else family.ranges.latency
    sooner, later = config.latency_spread
    if (drawn := posterior_of(config)) is not None:
        sooner, later = (x + WIDEST * float(drawn.latency_sigma) for x in (sooner, later))
    return max(low - sooner, 0.0), high + later


def posterior_of(config: EnvConfig) -> Posterior | None:
    """The distribution about the vehicle's file that episodes draw from; None: they do not.

    Raises:
        ValueError: for a file that has no standard deviations.
    """
    width = config.randomize.get(IDENTIFIED, 0.0)
    return load_posterior(config.vehicle).times(width) if width else None
