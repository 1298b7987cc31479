"""What the values of a vehicle must satisfy together."""

import math

import numpy as np

from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle, allocation_matrix, principal_moments, quantities

BATTERY = ("nominal_voltage", "battery_voltage", "voltage_sag", "speed_per_volt")
"""The entries of the battery. The first two must be given together, and the others require them."""


LEAST_VOLTAGE = 0.1
"""Lower limit of the battery voltage, as a share of the nominal voltage. It keeps a gradient for the rotor speed."""


def reached_share(vehicle: Vehicle) -> float:
    """Largest steady thrust with the vehicle's battery, if each rotor had the lowest ceiling, divided by that without
    both.
    """
    full, rotors = vehicle.full_rotor_speed, vehicle.rotor_count
    most = rotors * vehicle.thrust_range[1]
    ceiling = np.inf if vehicle.rotor_speed_ceiling is None else float(np.min(vehicle.rotor_speed_ceiling))
    if vehicle.battery_voltage is None:
        return rotors * vehicle.rotor_thrust(min(full, ceiling)) / most
    sag = 0.0 if vehicle.voltage_sag is None else vehicle.voltage_sag
    exponent = 1.0 if vehicle.speed_per_volt is None else vehicle.speed_per_volt
    low, high = 0.0, 1e6
    for _ in range(100):  # more thrust lowers the voltage, and a lower voltage gives less thrust
        middle = (low + high) / 2
        volts = max((vehicle.battery_voltage - sag * middle) / vehicle.nominal_voltage, LEAST_VOLTAGE)
        gives = rotors * vehicle.rotor_thrust(min(full * volts**exponent, ceiling))
        low, high = (middle, high) if gives > middle else (low, middle)
    return low / most


def check_quadrotor(vehicle: Vehicle, what: str) -> None:
    """Refuse what is not a quadrotor with level rotors, for a part of the program that knows no other.

    Raises:
        ValueError: naming the vehicle, its rotors, the part and what it accepts.
    """
    tilted = "" if vehicle.rotor_axis is None else " tilted"
    if vehicle.rotor_count != 4 or tilted:
        raise ValueError(
            f"vehicle {vehicle.name!r} has {vehicle.rotor_count}{tilted} rotors; accepted by {what}: four level rotors"
        )


def check_level(vehicle: Vehicle, what: str) -> None:
    """Refuse tilted rotors, for a part of the program that knows only level ones.

    Raises:
        ValueError: naming the vehicle, the part and what it accepts.
    """
    if vehicle.rotor_axis is not None:
        raise ValueError(f"vehicle {vehicle.name!r} has tilted rotors; accepted by {what}: level rotors")


def check_terms(vehicle: Vehicle, allocation: np.ndarray, weight: float, where: str) -> None:
    """Check the optional terms of the physics that a vehicle has. The allocation is the matrix from rotor thrusts to
    collective thrust and torques, (4, N), and the weight in N. `where` names the vehicle's file in the error text.

    Raises:
        ValueError: naming the entry, its value and what is accepted.
    """
    given = [name for name in BATTERY if getattr(vehicle, name) is not None]
    if given and (missing := [name for name in BATTERY[:2] if name not in given]):
        raise ValueError(
            f"{where}: {' and '.join(given)} without {' and '.join(missing)}; accepted: all of these entries"
        )
    reached = reached_share(vehicle) * vehicle.thrust_to_weight
    if reached <= 1.05 and vehicle.battery_voltage is None:
        raise ValueError(
            f"{where}: rotor_speed_ceiling.value is {np.asarray(vehicle.rotor_speed_ceiling).tolist()} rad/s: it "
            f"cannot hover (thrust to weight {reached:.2f} if each rotor had the lowest; accepted: more than 1.05)"
        )
    if reached <= 1.05:
        raise ValueError(
            f"{where}: battery_voltage.value is {vehicle.battery_voltage} V, nominal_voltage.value "
            f"{vehicle.nominal_voltage} V, voltage_sag.value {vehicle.voltage_sag} V/N: it cannot hover (thrust to "
            f"weight {reached:.2f} with this battery; accepted: more than 1.05)"
        )
    low, high = vehicle.thrust_range
    hover = np.linalg.pinv(allocation) @ [weight, 0.0, 0.0, 0.0]
    if hover.min() <= low or hover.max() >= high:
        name = "rotor_position" if vehicle.centre_of_mass is None else "centre_of_mass"
        raise ValueError(
            f"{where}: {name}.value is {np.asarray(getattr(vehicle, name)).tolist()}: to hover level the rotors would "
            f"have to push {', '.join(f'{f:.3g}' for f in hover)} N; accepted: a place over which each pushes "
            f"between {low:.3g} and {high:.3g} N"
        )


def check(vehicle: Vehicle, where: str = "vehicle") -> None:
    """Check the rules that involve several values.

    Raises:
        ValueError: naming the values and what is accepted.
    """
    ix, iy, iz = principal_moments(vehicle)
    if ix <= 0:
        raise ValueError(
            f"{where}: inertia_products.value is {vehicle.inertia_products.tolist()} and inertia.value is "
            f"{np.asarray(vehicle.inertia).tolist()}; accepted: a tensor of which every principal moment is positive"
        )
    if ix + iy < iz:
        products = "" if vehicle.inertia_products is None else f" with products {vehicle.inertia_products.tolist()}"
        raise ValueError(
            f"{where}: inertia.value is {np.asarray(vehicle.inertia).tolist()}{products}; accepted: no principal "
            "moment larger than the sum of the other two (the triangle inequality of every rigid body)"
        )
    _check_rotors(vehicle, where)
    if vehicle.tilt_max >= np.pi / 2:
        raise ValueError(f"{where}: tilt_max.value is {vehicle.tilt_max}; accepted: below pi/2 rad")
    thrust_map = np.asarray(vehicle.thrust_map, np.float64).tolist()
    if thrust_map[0] <= 0:
        raise ValueError(f"{where}: thrust_map.value is {thrust_map}; accepted: k2 > 0")
    if vehicle.rotor_speed_min >= vehicle.rotor_speed_max:
        raise ValueError(
            f"{where}: rotor_speed_min.value is {vehicle.rotor_speed_min:g}; accepted: below rotor_speed_max "
            f"({vehicle.rotor_speed_max:g} rad/s)"
        )
    least = _slowest(*thrust_map)
    if vehicle.rotor_speed_min <= least:
        raise ValueError(
            f"{where}: rotor_speed_min.value is {vehicle.rotor_speed_min:g}; accepted: "
            f"{math.floor(10 * max(least, 0.0) + 1) / 10:g} rad/s or more (in tenths), where the thrust by thrust_map "
            f"{thrust_map} is positive and rising"
        )
    if vehicle.thrust_to_weight <= 1.05 or vehicle.lift * vehicle.thrust_range[0] >= vehicle.mass * GRAVITY:
        low, high = vehicle.thrust_range
        raise ValueError(
            f"{where}: mass.value is {vehicle.mass} kg and one rotor gives {low:.4g} to {high:.4g} N by thrust_map, "
            f"rotor_thrust_max and rotor_speed_max: it cannot hover (thrust to weight {vehicle.thrust_to_weight:.2f}; "
            "accepted: more than 1.05, and less than 1 at idle)"
        )
    allocation = allocation_matrix(vehicle)
    largest = np.abs(allocation).max(1, keepdims=True)
    if np.any(largest == 0) or np.linalg.cond(allocation / largest) > 1e3:
        raise ValueError(
            f"{where}: rotor_position.value {vehicle.rotor_position.tolist()}, rotor_spin and torque_ratio "
            f"({vehicle.torque_ratio} m) leave an axis without control; accepted: rotors that give independent "
            "thrust, roll, pitch and yaw"
        )
    check_terms(vehicle, allocation, vehicle.mass * GRAVITY, where)


def _check_rotors(vehicle: Vehicle, where: str) -> None:
    """Check that all values of single rotors are of the same rotors, that each turns, and pushes upwards."""
    count = vehicle.rotor_count
    for f in quantities(vehicle):
        given = np.shape(getattr(vehicle, f.name))
        if "per_rotor" in f.metadata and given[0] != count:
            raise ValueError(
                f"{where}: {f.name}.value has {given[0]} rotors, and rotor_spin.value {count}; accepted: {count}, one "
                "entry for each rotor"
            )
    spin = vehicle.rotor_spin.tolist()
    if count == 4 and sorted(spin) != [-1, -1, 1, 1]:
        raise ValueError(f"{where}: rotor_spin.value is {spin}; accepted: two of +1 and two of -1")
    if set(spin) != {-1, 1}:
        raise ValueError(f"{where}: rotor_spin.value is {spin}; accepted: +1 or -1 for each rotor, and both of them")
    if vehicle.rotor_axis is None:
        return
    axes = np.asarray(vehicle.rotor_axis)
    if np.any(np.abs(np.linalg.norm(axes, axis=1) - 1) > 1e-3) or np.any(axes[:, 2] <= 0):
        raise ValueError(
            f"{where}: rotor_axis.value is {axes.tolist()}; accepted: for each rotor a vector of length 1 (within "
            "0.001) whose part along body z is above 0"
        )


def _slowest(k2: float, k1: float, k0: float) -> float:
    """The rotor speed, rad/s, above which a thrust map with k2 > 0 is positive and rising."""
    lowest = -k1 / (2 * k2)  # of the parabola
    return lowest + math.sqrt(max(lowest**2 - k0 / k2, 0.0))
