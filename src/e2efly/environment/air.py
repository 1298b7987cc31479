"""The air that vehicles move: the downwash of others, and the cushion over the ground. Options, which cost nothing when
they are absent.
"""

import math
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from e2efly.control.vectors import Quat
from e2efly.simulation.physics import State
from e2efly.tasks.company import pairs
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

DENSITY = 1.2
"""Density of the air, kg/m^3."""
DECAY, SPREAD = 6.06, 0.096
"""A round turbulent jet: its velocity on the axis is `DECAY` times the velocity and the diameter of its mouth, over the
distance; its half-width is `SPREAD` times the distance (Panchapakesan and Lumley 1993; S. B. Pope, Turbulent Flows,
2000, section 5.1)."""
LOWEST = 0.5
"""Heights of a rotor below this part of its radius count as this height: the formula of the cushion ends there."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Jet:
    """The air below a vehicle that hovers: the flow of all rotors, merged to one jet (Bauersfeld et al. 2024, "Robotics
    meets Fluid Dynamics": the far field of quadrotors of all sizes). Far from it, only the thrust counts.
    """

    speed: Any
    """Velocity at its mouth, the fully contracted wake of the rotors, m/s."""
    diameter: Any
    """Diameter of the mouth, m."""

    @staticmethod
    def of(vehicle: Vehicle) -> "Jet":
        """The jet of a vehicle's own weight: thrust T through the rotors' discs of area A leaves a wake of area A / 2
        with velocity sqrt(2 T / (density A)).
        """
        arms = jnp.linalg.norm(jnp.asarray(vehicle.rotor_position), axis=-1)
        area = len(arms) * math.pi * propeller(vehicle) ** 2
        thrust = vehicle.mass * GRAVITY
        return Jet(jnp.sqrt(2 * thrust / (DENSITY * area)), jnp.sqrt(2 * area / math.pi))

    def velocity(self, along: Array, beside_squared: Array) -> Array:
        """Mean velocity of the air, m/s, at a distance behind the mouth, m, and a squared distance from the axis, m^2.
        Zero before the mouth.
        """
        behind = jnp.maximum(along, 1e-3)
        middle = self.speed * jnp.minimum(1.0, DECAY * self.diameter / behind)
        half = jnp.maximum(SPREAD * behind, self.diameter / 2)
        return jnp.where(along > 0, middle / (1 + (math.sqrt(2) - 1) * beside_squared / half**2) ** 2, 0.0)


def propeller(vehicle: Vehicle) -> Any:
    """Radius of a propeller, m: what the sphere around the vehicle has beyond its arms."""
    arms = jnp.linalg.norm(jnp.asarray(vehicle.rotor_position), axis=-1)
    return jnp.maximum(jnp.asarray(vehicle.radius) - jnp.max(arms, axis=-1), 0.01)


def downwash(jet: Jet, state: State, agents: int) -> Float[Array, "n 3"]:
    """Velocity of the air that the others of its world blow at each vehicle, world, m/s. Each jet leaves its vehicle
    against its thrust, as fast as in hover.
    """
    away = pairs(state.position, agents)  # from the vehicle i that is blown at to the vehicle j that blows
    up = Quat.of(state.quaternion).z_axis()
    axis = tuple(part.reshape(-1, 1, agents) for part in (up.x, up.y, up.z))
    (x, y, z), (nx, ny, nz) = away, axis
    along = x * nx + y * ny + z * nz
    beside = x * x + y * y + z * z - along**2
    blown = jet.velocity(along, jnp.maximum(beside, 0.0))
    return jnp.stack([-jnp.sum(blown * n, axis=-1).reshape(-1) for n in axis], axis=-1)


def cushion(radius: Any, height: Float[Array, " n"]) -> Float[Array, " n"]:
    """Thrust of a rotor over the ground divided by that far from it, for a height of its disc, m (Cheeseman and Bennett
    1955). For one rotor; those of a multirotor differ.
    """
    ratio = radius / (4 * jnp.maximum(height, LOWEST * radius))
    return 1 / (1 - ratio**2)
