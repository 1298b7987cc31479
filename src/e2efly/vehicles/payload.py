"""A payload that is fixed to a vehicle: the rigid body of both together."""

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.vehicles.vehicle import Vehicle, inertia_tensor, quantity


@dataclass(frozen=True)
class FixedPayload:
    """The table `payload` of a vehicle file."""

    mass: Any = quantity("kg", above=0.0)
    """Its mass."""
    position: Any = quantity("m", (3,))
    """Its centre, in the axes of `rotor_position`."""


def with_payload(vehicle: Vehicle, mass: float, position: Any) -> Vehicle:
    """The vehicle with a point mass fixed to it: its mass, centre of mass, and inertia about the new centre.

    By the parallel-axis theorem (Huygens and Steiner), a mass m at r from an axis' point adds m (r.r 1 - r r^T) to the
    inertia tensor. The height over the feet, and the sphere that encloses the vehicle, follow the centre of mass.

    Args:
        vehicle: one vehicle.
        mass: mass of the payload, kg.
        position: (3,) its place in the axes of `rotor_position`, m.

    Raises:
        ValueError: for a mass that is not positive, and for a centre of mass that would be under the feet.
    """
    if not mass > 0:
        raise ValueError(f"payload mass is {mass} kg; accepted: more than 0")
    own = np.zeros(3) if vehicle.centre_of_mass is None else np.asarray(vehicle.centre_of_mass, np.float64)
    place, total = np.asarray(position, np.float64), vehicle.mass + mass
    centre = (vehicle.mass * own + mass * place) / total
    moved = centre - own
    height = vehicle.feet_height + moved[2]
    if height <= 0:
        raise ValueError(
            f"payload of {mass} kg at {place.tolist()} m puts the centre of mass {-height:.3g} m under the feet; "
            "accepted: one that leaves it above them"
        )
    tensor = inertia_tensor(vehicle) + _of_point(vehicle.mass, own - centre) + _of_point(mass, place - centre)
    products = tensor[(0, 0, 1), (1, 2, 2)]
    return dataclasses.replace(
        vehicle,
        mass=total,
        centre_of_mass=centre,
        inertia=np.diag(tensor).copy(),
        inertia_products=products if products.any() or vehicle.inertia_products is not None else None,
        feet_height=float(height),
        radius=float(vehicle.radius + np.linalg.norm(moved)),
    )


def _of_point(mass: float, away: np.ndarray) -> np.ndarray:
    """Inertia of a point mass about a point from which it is `away`, (3, 3), kg*m^2."""
    return mass * (away @ away * np.eye(3) - np.outer(away, away))
