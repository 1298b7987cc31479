"""A load that hangs from the vehicle on a cable: a point mass, and a massless cable that pulls but does not push.

The cable is a spring and a damper in parallel while it is longer than its length at rest, and slack otherwise. It is
integrated inside the sub-steps, together with the vehicle. Its stiffness is no option: `Cable.of` derives it from the
sub-step, as stiff as an integrator resolves.
"""

import math
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from e2efly.control.vectors import Quat, Vec3
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

RESOLVED = 10
"""Sub-steps in a period of the cable's stretching. On a cable that carries a load of mass m under a vehicle of mass M,
the stretch in hover is g (1 + m / M) (RESOLVED h / 2 pi)^2 for sub-steps h: 0.9 mm at 5 ms and half of the vehicle's
mass. It falls with the square of the sub-step."""
DAMPING = 0.5
"""Damping ratio of the stretching."""
SHORTEST = 1e-6
"""Distances between hook and load count as at least this, m, where a direction is divided by them."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Load:
    """A load and its cable. It has no drag. Position and velocity change in a step; the other values stay.

    Inside a step, position and velocity are `Vec3` of their components.
    """

    position: Any
    """World, m, (*n, 3)."""
    velocity: Any
    """World, m/s, (*n, 3)."""
    mass: Float[Array, "*n"]
    """Mass, kg."""
    length: Float[Array, "*n"]
    """Length of the cable at rest, m."""
    hook: Float[Array, "*n"]
    """Distance of the cable's upper end below the vehicle's centre of mass, along body -z, m."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Hanging:
    """What of a load changes in a step: position and velocity, world."""

    position: Vec3
    velocity: Vec3


@dataclass(frozen=True)
class Cable:
    """A load and its cable in the form in which the sub-steps compute with it."""

    length: Array
    """Length at rest, m."""
    hook: Array
    """As in `Load`, m."""
    specific: Array
    """One divided by the load's mass, 1/kg."""
    stiffness: Array
    """Tension divided by stretch, N/m."""
    damping: Array
    """Tension divided by the rate of stretching, N*s/m."""

    @staticmethod
    def of(load: Load, vehicle: Vehicle, dt: float) -> "Cable":
        """The cable of a load under a vehicle, for sub-steps of `dt` s.

        A pull at the hook moves the load, the vehicle, and turns the vehicle. Their mobilities add up to at most 1 / M
        + 1 / m + d^2 / J for a hook that is d below the centre of mass, with the smaller moment of inertia J about a
        horizontal axis. A spring k with them has the angular frequency sqrt(k (1 / M + 1 / m + d^2 / J)).
        """
        turning = 1 / jnp.minimum(vehicle.inertia[..., 0], vehicle.inertia[..., 1])
        mobility = 1 / vehicle.mass + 1 / load.mass + load.hook**2 * turning
        frequency = 2 * math.pi / (RESOLVED * dt)
        return Cable(
            load.length,
            load.hook,
            1 / load.mass,
            stiffness=frequency**2 / mobility,
            damping=2 * DAMPING * frequency / mobility,
        )

    def pull(self, attitude: Quat, position: Vec3, velocity: Vec3, body_rate: Vec3, load: Hanging) -> Vec3:
        """Force of the cable on the vehicle, world, N: along the cable, never away from the load, zero when slack."""
        down = Vec3(0.0 * self.hook, 0.0 * self.hook, -self.hook)
        away = load.position - position - attitude.rotate(down)
        receding = load.velocity - velocity - attitude.rotate(body_rate.cross(down))
        length = jnp.maximum(away.norm(), SHORTEST)
        along = away * (1 / length)
        stretch = length - self.length
        tension = jnp.maximum(self.stiffness * stretch + self.damping * along.dot(receding), 0.0)
        return along * jnp.where(stretch > 0, tension, 0.0)

    def torque(self, pull: Vec3) -> Vec3:
        """Torque about the vehicle's centre of mass, body, N*m, of a pull at the hook, body, N."""
        return Vec3(self.hook * pull.y, -self.hook * pull.x, 0.0 * pull.z)

    def falling(self, pull: Vec3) -> Vec3:
        """Acceleration of the load, world, m/s^2, while the cable pulls so at the vehicle, world, N."""
        own = pull * -self.specific
        return Vec3(own.x, own.y, own.z - GRAVITY)


def hung(
    position: Float[Array, "*n 3"],
    velocity: Float[Array, "*n 3"],
    quaternion: Float[Array, "*n 4"],
    direction: Float[Array, "*n 3"],
    mass: Float[Array, "*n"],
    length: Float[Array, "*n"],
    hook: Float[Array, "*n"],
) -> Load:
    """A load on a taut cable that does not pull yet, as fast as the vehicle.

    Args:
        position: the vehicle's centre of mass, world, m.
        velocity: the vehicle's, world, m/s.
        quaternion: the vehicle's attitude.
        direction: unit vector from the hook to the load, world.
        mass: the load's mass, kg.
        length: the cable's length, m.
        hook: distance of the hook below the centre of mass, m.
    """
    up = Quat.of(quaternion).z_axis().stack()
    place = position - hook[..., None] * up + length[..., None] * direction
    return Load(place, velocity, mass, length, hook)
