"""What the terms of the physics that a vehicle's file may leave out have to keep."""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from e2efly.vehicles.vehicle import Vehicle


def check_terms(vehicle: "Vehicle", allocation: np.ndarray, weight: float, where: str) -> None:
    """Check the terms that a vehicle has.

    Args:
        vehicle: as read.
        allocation: from the rotors' thrusts to collective thrust and torques, (4, 4).
        weight: N.
        where: of the vehicle, for the error.

    Raises:
        ValueError: naming the entry, its value and what is accepted.
    """
    if vehicle.centre_of_mass is not None:
        low, high = vehicle.thrust_range
        hover = np.linalg.solve(allocation, [weight, 0.0, 0.0, 0.0])
        if hover.min() <= low or hover.max() >= high:
            raise ValueError(
                f"{where}: centre_of_mass.value is {vehicle.centre_of_mass.tolist()}: to hover level the rotors would "
                f"have to push {', '.join(f'{f:.3g}' for f in hover)} N; accepted: a place over which each pushes "
                f"between {low:.3g} and {high:.3g} N"
            )
