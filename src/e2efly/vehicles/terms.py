"""Checks of the optional terms of the physics that a vehicle file may contain."""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from e2efly.vehicles.vehicle import Vehicle


BATTERY = ("nominal_voltage", "battery_voltage", "voltage_sag", "speed_per_volt")
"""The entries of the battery. The first two must be given together, and the others require them."""
LEAST_VOLTAGE = 0.1
"""Lower limit of the battery voltage, as a share of the nominal voltage. It keeps a gradient for the rotor speed."""


def battery_share(vehicle: "Vehicle") -> float:
    """Largest steady thrust of all rotors with the vehicle's battery, divided by that at the nominal voltage."""
    if vehicle.battery_voltage is None:
        return 1.0
    full, most = vehicle.full_rotor_speed, 4 * vehicle.thrust_range[1]
    sag = 0.0 if vehicle.voltage_sag is None else vehicle.voltage_sag
    exponent = 1.0 if vehicle.speed_per_volt is None else vehicle.speed_per_volt
    low, high = 0.0, 1e6
    for _ in range(100):  # more thrust lowers the voltage, and a lower voltage gives less thrust
        middle = (low + high) / 2
        volts = max((vehicle.battery_voltage - sag * middle) / vehicle.nominal_voltage, LEAST_VOLTAGE)
        gives = 4 * vehicle.rotor_thrust(full * volts**exponent)
        low, high = (middle, high) if gives > middle else (low, middle)
    return low / most


def check_terms(vehicle: "Vehicle", allocation: np.ndarray, weight: float, where: str) -> None:
    """Check the optional terms of the physics that a vehicle has.

    Args:
        vehicle: the vehicle as read.
        allocation: matrix from rotor thrusts to collective thrust and torques, (4, 4).
        weight: weight of the vehicle, N.
        where: name of the vehicle's file, for the error text.

    Raises:
        ValueError: naming the entry, its value and what is accepted.
    """
    given = [name for name in BATTERY if getattr(vehicle, name) is not None]
    if given and (missing := [name for name in BATTERY[:2] if name not in given]):
        raise ValueError(
            f"{where}: {' and '.join(given)} without {' and '.join(missing)}; accepted: all of these entries"
        )
    reached = battery_share(vehicle) * vehicle.thrust_to_weight
    if reached <= 1.05:
        raise ValueError(
            f"{where}: battery_voltage.value is {vehicle.battery_voltage} V, nominal_voltage.value "
            f"{vehicle.nominal_voltage} V, voltage_sag.value {vehicle.voltage_sag} V/N: it cannot hover (thrust to "
            f"weight {reached:.2f} with this battery; accepted: more than 1.05)"
        )
    if vehicle.centre_of_mass is not None:
        low, high = vehicle.thrust_range
        hover = np.linalg.solve(allocation, [weight, 0.0, 0.0, 0.0])
        if hover.min() <= low or hover.max() >= high:
            raise ValueError(
                f"{where}: centre_of_mass.value is {vehicle.centre_of_mass.tolist()}: to hover level the rotors would "
                f"have to push {', '.join(f'{f:.3g}' for f in hover)} N; accepted: a place over which each pushes "
                f"between {low:.3g} and {high:.3g} N"
            )
