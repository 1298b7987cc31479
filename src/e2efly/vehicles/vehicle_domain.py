"""The ranges of the vehicles that a policy was trained for. Imports no JAX.

A policy knows of its vehicle what the flight controller and the physics let it feel. These parameters are compared with
the ranges of its training. Everything else belongs to the flight controller and the bridge, which take it from the file
of the vehicle that flies: the thrust map, the mixer, the height of the feet, and the gains of modes that the policy
does not command.
"""

import dataclasses
import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np

from e2efly.config.domain import Domain, Extent, union
from e2efly.vehicles.vehicle import Vehicle, quantities, rotor_arms, terms

FELT = (
    "mass", "inertia", "motor_time_constant", "drag_linear", "drag_quadratic", "torque_ratio", "rate_gain",
    "body_rate_max", "radius",
)  # fmt: skip
"""Fields of a vehicle file that every policy is compared by. In addition to these: the terms of the physics that the
file has."""
OF_MODE = {
    "rotor_thrust": ("rotor_spin",),
    "rotor_share": ("rotor_spin",),
    "rotor_speed": ("rotor_spin",),
    "ctbr": (),
    "attitude": ("attitude_gain",),
    "acceleration": ("attitude_gain", "tilt_max"),
    "velocity": ("attitude_gain", "tilt_max", "velocity_gain", "acceleration_max"),
    "position": ("attitude_gain", "tilt_max", "velocity_gain", "acceleration_max", "position_gain", "speed_max"),
}
"""Fields that policies of a command mode are compared by, besides: those that decide what a command means."""
AT_LEAST, AT_MOST = ("body_rate_max", "roll_rate_max", "yaw_rate_max"), "radius"
"""Quantities of which a vehicle may have more than the training, and less: a flight controller may accept higher rates
than a policy commands, and a vehicle may be smaller."""
ALIKE = 0.005
"""Relative difference from the vehicle of the training below which it is not worth a word."""


def vehicle_domain(vehicle: Vehicle, mode: str) -> Domain:
    """The parameters of a vehicle by which policies of a command mode are compared, each a range of one number.

    `hover_thrust` is the share of the largest thrust that carries the weight. `arm_x` and `arm_y` are the distances of
    the rotors from the centre of mass, forward and left. Vectors have an entry for each axis.
    """
    names = (*FELT, *OF_MODE[mode], *(term.name for term in terms()))
    fields = {f.name: f for f in quantities(vehicle)}
    found = []
    for name in names:
        if name in fields and name != "centre_of_mass":
            value, unit = np.asarray(getattr(vehicle, name), float), fields[name].metadata["unit"]
            names_of = "xyz" if value.shape == (3,) else range(value.size)
            axes, value = [f"_{axis}" for axis in names_of] if value.ndim else [""], value.ravel()
            found += [Extent(f"{name}{axis}", unit, x, x) for axis, x in zip(axes, map(float, value), strict=False)]
    height = 0.0 if vehicle.centre_of_mass is None else float(vehicle.centre_of_mass[2])
    arms = np.abs(rotor_arms(vehicle))
    found += [Extent(f"arm_{axis}", "m", float(x.min()), float(x.max())) for axis, x in zip("xy", arms.T, strict=True)]
    hover = 1 / vehicle.thrust_to_weight
    return (*found, Extent("centre_of_mass_z", "m", height, height), Extent("hover_thrust", "1", hover, hover))


def drawn_domain(vehicle: Vehicle, mode: str, shares: Mapping[str, Any], offset: float = 0.0) -> Domain:
    """The ranges of the vehicles that a training draws about the vehicle of a file.

    A quantity of several parameters has the range that their draws give together: `hover_thrust` that of mass and
    thrust. Every range is as wide above the vehicle's own value as below it, so its middle is that value.

    Args:
        vehicle: the vehicle of the file.
        mode: the command mode of the policy.
        shares: the relative half-width of the draw of each field that is drawn, below 1; a number, or one for each
            entry of the field.
        offset: half-width of the offset of the centre of mass, forward and left, m.
    """
    own, corners = vehicle_domain(vehicle, mode), list[Domain]()
    for mass, others in itertools.product((-1, 1), repeat=2):
        sides = {name: 1 + (mass if name == "mass" else others) * np.asarray(share) for name, share in shares.items()}
        values = {name: np.asarray(getattr(vehicle, name)) * side for name, side in sides.items()}
        corners.append(vehicle_domain(dataclasses.replace(vehicle, **values), mode))
    ranges = []
    for part, whole in zip(own, union(corners), strict=True):
        beside = offset if part.name.startswith("arm_") else 0.0
        width = min(part.low - whole.low, whole.high - part.high) + beside
        ranges.append(Extent(part.name, part.unit, part.low - width, part.high + width))
    return tuple(ranges)


def misfits(trained: Domain, flown: Domain, name: str, whose: str = "") -> tuple[str, ...]:
    """The quantities in which a vehicle lies outside of ranges, in words: quantity, value, what is accepted.

    Args:
        trained: the ranges.
        flown: the quantities of the vehicle. One that only the vehicle or only the ranges have is a misfit, too.
        name: the name of the vehicle.
        whose: the name of the vehicle about which the ranges lie; empty: about none.
    """
    known, has = ({part.name: part for part in domain} for domain in (trained, flown))
    found = []
    for part in flown:
        if part.name not in known:
            found.append(f"{part.name} of vehicle {name!r} is {part.range}; accepted: a file without this entry")
        elif not known[part.name].holds(_taken(part, known[part.name])):
            by = f", {_difference(known[part.name], part)} of {whose!r}" if whose else ""
            accepted = f"accepted: {_accepted(known[part.name])}"
            found.append(f"{part.name} of vehicle {name!r} is {part.range}{by}; {accepted}")
    lacking = [part for part in trained if part.name not in has]
    return (*found, *(f"vehicle {name!r} has no {part.name}; accepted: {_accepted(part)}" for part in lacking))


def differences(trained: Domain, flown: Domain, whose: str) -> tuple[str, ...]:
    """By how much a vehicle differs from the one about which ranges lie, in words: one text for each quantity.

    The arguments are those of `misfits`.
    """
    known, found = {part.name: part for part in trained}, []
    for part in flown:
        range = known.get(part.name, part)
        middle, value = _middle(range), _farthest(range, part)
        if abs(value - middle) > ALIKE * abs(middle):
            trained_for = f"; trained for {_accepted(range)}" if range.low < range.high else ""
            found.append(f"{part.name} {part.range}: {_difference(range, part)} of {whose}{trained_for}")
    return tuple(found)


def _taken(part: Extent, range: Extent) -> Extent:
    """The part of a quantity of a vehicle that must lie inside of the range."""
    if part.name.startswith(AT_LEAST):
        return dataclasses.replace(part, low=min(part.low, range.high), high=min(part.high, range.high))
    if part.name.startswith(AT_MOST):
        return dataclasses.replace(part, low=max(part.low, range.low), high=max(part.high, range.low))
    return part


def _accepted(range: Extent) -> str:
    if range.name.startswith(AT_LEAST):
        return f"{range.low:.4g} {range.unit} or more"
    return f"{range.high:.4g} {range.unit} or less" if range.name.startswith(AT_MOST) else range.range


def _middle(range: Extent) -> float:
    return (range.low + range.high) / 2


def _farthest(range: Extent, part: Extent) -> float:
    """The end of a vehicle's quantity that is farther from the middle of a range."""
    return max(part.low, part.high, key=lambda x: abs(x - _middle(range)))


def _difference(range: Extent, part: Extent) -> str:
    middle, value = _middle(range), _farthest(range, part)
    word, own = "more" if value > middle else "less", Extent("", range.unit, middle, middle).range
    share = abs(value / middle - 1) if middle else np.inf
    return f"{f'{100 * share:.0f} % ' if share < 10 else ''}{word} than the {own}"
