"""Checks rotor speeds, motor outputs and commanded thrust against the vehicle's file, gyroscope and accelerometer."""

from collections.abc import Iterable
from dataclasses import replace
from itertools import permutations

import numpy as np
from scipy.optimize import linear_sum_assignment

from e2efly.alignment.comparison import GRID, at_times, common_times, lagged, pearson, smooth
from e2efly.alignment.unit_checks import AGREE, scaled
from e2efly.logs.recording import KINDS, Record
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

SEEN = 0.12
"""Lowest correlation between the rotors' torques and the body's angular acceleration that shows the rotor order."""
SPEED_OFF, THRUST_OFF = 1.33, 2.0
"""Ratios from which on rotor speeds and commanded thrust have another unit. The file of a vehicle that is not known yet
is itself off by tens of percent."""
NEAR, FITS = 0.1, 0.35
"""By how much a ratio may differ from that of a unit, as a logarithm: of rotor speeds, and of thrusts."""
FOUR = "rear right, front right, rear left, front left"
"""The order of a quadrotor's rotors."""
MOVED = 1.0
"""Distance that shows a flight, m."""
RPM = 30 / np.pi
SPEEDS = {"rpm": RPM, "revolutions a second": RPM / 60} | {
    f"{name}, by {pairs} pairs of poles": pairs * RPM / over
    for name, over in (("eRPM/100", 100), ("eRPM", 1))
    for pairs in (7, 6, 8, 11, 12, 14)
}
"""Other units of rotor speeds: how many of them are one rad/s."""


def check_rotor_count(record: Record, vehicle: Vehicle) -> None:
    """Check that there is a column for each rotor of the vehicle.

    Raises:
        ValueError: naming the stream, its number of rotors and the vehicle's.
    """
    for name in ("rotor_speed", "motor"):
        if name in record.streams and (size := record.streams[name].values.shape[1]) != vehicle.rotor_count:
            raise ValueError(
                f"{record.path}: {name} is of {size} rotors; accepted: {vehicle.rotor_count}, as vehicle "
                f"{vehicle.name!r} has, the --vehicle that flew, or the log --without {name}"
            )


def check_rotor_speed_unit(record: Record, vehicle: Vehicle) -> None:
    """Compare the thrust that the rotor speeds mean by the vehicle's file with the specific force, or else the weight.

    Raises:
        ValueError: naming the unit and the option that converts it.
    """
    if not record.has("rotor_speed"):
        return
    stream = record.streams["rotor_speed"]
    turning = stream.values.mean(1)
    force = np.full(len(turning), GRAVITY)
    if record.has("specific_force"):
        force = at_times(record.streams["specific_force"], stream.time)[:, 2]
    flying = (turning > 0.5 * np.quantile(turning, 0.95)) & (force > 0.3 * GRAVITY)
    if flying.sum() < 20:
        return
    k2, k1, k0 = vehicle.thrust_map
    each = float(np.mean(force[flying])) * vehicle.mass / vehicle.lift
    ratio = float(np.mean(turning[flying]) / ((-k1 + np.sqrt(k1**2 + 4 * k2 * max(each - k0, 0.0))) / (2 * k2)))
    if 1 / SPEED_OFF < ratio < SPEED_OFF:
        return
    width = max(round(0.1 * stream.rate), 3)
    push, seen = smooth(turning[flying, None] ** 2, width)[:, 0], smooth(force[flying, None], width)[:, 0]
    moved = record.has("position") and np.ptp(record.streams["position"].values, axis=0).max() > MOVED
    if ratio < 0.5 and not moved and not pearson(push, seen) > AGREE:
        return  # the rotors may idle on the ground
    unit = min(SPEEDS, key=lambda u: abs(np.log(ratio / SPEEDS[u])))
    fits = abs(np.log(ratio / SPEEDS[unit])) < NEAR
    option = scaled("rotor_speed", 1 / (SPEEDS[unit] if fits else ratio), vehicle.rotor_count)
    raise ValueError(
        f"{record.path}: rotor_speed is {ratio:.3g} times what gives the thrust of this flight by the vehicle's file: "
        f"it looks like {unit if fits else 'another unit, or another vehicle'}; accepted: rad/s "
        f"({option}), the --vehicle that flew, or the log --without rotor_speed"
    )


def check_commanded_thrust(record: Record, vehicle: Vehicle) -> Record:
    """Compare the commanded thrust with the specific force along body z, or else with the weight.

    Raises:
        ValueError: naming the unit and the option that converts it.
    """
    if not record.has("command"):
        return record
    stream = record.streams["command"]
    asked = stream.values[:, 0]
    if np.ptp(asked) == 0:  # it was not told
        return record
    given = GRAVITY
    if record.has("specific_force"):
        force = record.streams["specific_force"]
        inside = (force.time >= stream.time[0]) & (force.time <= stream.time[-1])
        given = float(np.mean(force.values[inside, 2])) if inside.any() else GRAVITY
    held = float(np.average(asked[:-1], weights=np.diff(stream.time)))
    ratio = held / max(given, 1e-9)
    top = vehicle.lift * float(vehicle.rotor_thrust_max) / float(vehicle.mass)
    units = {"N": float(vehicle.mass), "g": 1 / GRAVITY}
    if np.all(np.abs(asked) <= 1.05):
        units["0 to 1 of the largest thrust"] = 1 / top
    off = {unit: abs(np.log(max(abs(ratio), 1e-9) / expected)) for unit, expected in units.items()}
    unit = min(off, key=lambda u: off[u])
    fits = off[unit] < FITS
    factor = np.sign(ratio) / (units[unit] if fits else max(abs(ratio), 1e-9))
    said = (
        f"the commanded thrust is {ratio:.3g} times the specific force along body z: it looks like "
        f"{unit if fits else 'another unit' if ratio > 0 else 'another sign'}"
    )
    remedy = f"m/s^2 (--columns cmd_thrust=cmd_thrust*{factor:.5g}, in a CSV file with its own name behind the =)"
    if not 1 / THRUST_OFF < ratio < THRUST_OFF:
        raise ValueError(f"{record.path}: {said}; accepted: {remedy}, or the log --without command")
    if unit == "N" and fits and off["N"] < abs(np.log(ratio)) - NEAR:
        return replace(record, notes=(*record.notes, f"{said}, the vehicle's mass; if so: {remedy}"))
    return record


def check_rotor_order(record: Record, vehicle: Vehicle) -> None:
    """Check the order of the rotors by the effect of their torques on the body rates.

    Raises:
        ValueError: naming the order in which the columns fit the vehicle.
    """
    name = "rotor_speed" if record.has("rotor_speed") else "motor" if record.has("motor") else ""
    if not name or not record.has("body_rate"):
        return
    rate, rotors = record.streams["body_rate"], record.streams[name]
    grid = common_times(record, "body_rate", name)
    if len(grid) < 200:
        return
    w = smooth(at_times(rate, grid))
    thrust = at_times(rotors, grid)
    thrust = smooth(thrust**2 if name == "rotor_speed" else _answering(thrust, vehicle))
    turn = np.gradient(w, GRID, axis=0)[:, :2]
    x, y = vehicle.rotor_position[:, :2].T

    def seen(order: tuple[int, ...]) -> np.ndarray:
        torque = np.stack([thrust[:, order] @ y, -thrust[:, order] @ x], -1)
        return np.array([pearson(torque[:, i], turn[:, i]) for i in range(2)])

    usual = seen((*range(len(x)),))
    best = max(_orders(thrust, turn, x, y), key=lambda order: float(seen(order).sum()))
    if np.all(seen(best) > SEEN) and seen(best).sum() > 1.4 * max(float(usual.sum()), 0.0):
        columns = KINDS[name].names(len(x))
        listed = ", ".join(columns[i] for i in best)
        first, other = next((columns[i], columns[k]) for i, k in enumerate(best) if i != k)
        raise ValueError(
            f"{record.path}: {name} does not turn the vehicle as its geometry says; the columns fit it in the order "
            f"{listed}; "
            f"accepted: {FOUR if len(x) == 4 else 'the order of its file'} (--columns OURS=THEIRS, as {first}={other})"
        )


def _orders(thrust: np.ndarray, turn: np.ndarray, x: np.ndarray, y: np.ndarray) -> Iterable[tuple[int, ...]]:
    """The orders of the columns to look at: of four rotors all; of more the one whose torques go best with the angular
    accelerations, by their covariances, and the file's.
    """
    if len(x) == 4:
        return permutations(range(4))
    with_turn = (thrust - thrust.mean(0)).T @ (turn / turn.std(0))
    _, order = linear_sum_assignment(-(np.outer(y, with_turn[:, 0]) - np.outer(x, with_turn[:, 1])))
    return (*range(len(x)),), tuple(int(i) for i in order)


def _answering(outputs: np.ndarray, vehicle: Vehicle) -> np.ndarray:
    """The approximate response of the rotors to motor outputs: with the vehicle's motor lag and a delay of two grid
    steps.
    """
    late = np.concatenate([outputs[:1], outputs[:1], outputs[:-2]])
    return lagged(late.T, float(vehicle.motor_time_constant), GRID).T
