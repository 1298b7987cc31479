"""The state of a vehicle."""

from dataclasses import dataclass, fields, replace
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from e2efly.control.vectors import Quat, Vec3, stack
from e2efly.simulation.physics.cable import Hanging, Load
from e2efly.vehicles.vehicle import Vehicle

for _kind in (Vec3, Quat):
    jax.tree_util.register_dataclass(_kind, data_fields=[f.name for f in fields(_kind)], meta_fields=[])


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class RateLoop:
    """The state of the rate loop between sub-steps, if the loop has an integral part or a filter.

    The fields are arrays, or inside a step `Vec3` of their components.
    """

    integral: Any
    """The integral part of the commanded angular acceleration, rad/s^2, (*n, 3). None: the loop has no integral
    part."""
    seen: Any
    """Filtered body rates, rad/s, (*n, 3). None: the loop has no filter."""

    @staticmethod
    def at_rest(vehicle: Vehicle, body_rate: Float[Array, "*n 3"]) -> "RateLoop | None":
        """The state at a start: zero integral, settled filter. None if the vehicle file has neither."""
        if vehicle.rate_integral_gain is None and vehicle.gyro_time_constant is None:
            return None
        return RateLoop(
            None if vehicle.rate_integral_gain is None else jnp.zeros_like(body_rate),
            None if vehicle.gyro_time_constant is None else body_rate,
        )


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class State:
    """The state of a vehicle in flight. World ENU (z up), body FLU, SI units."""

    position: Float[Array, "*n 3"]
    """Centre of mass, world, m."""
    velocity: Float[Array, "*n 3"]
    """Velocity of the centre of mass, world, m/s."""
    quaternion: Float[Array, "*n 4"]
    """Unit quaternion wxyz, body to world."""
    body_rate: Float[Array, "*n 3"]
    """Angular velocity in the body frame, rad/s."""
    rotor_speed: Float[Array, "*n r"]
    """Rotor speeds in the order of the vehicle file, rad/s. Of a quadrotor: rear right, front right, rear left, front
    left."""
    rate_loop: RateLoop | None = None
    """State of the rate loop, if the loop has one. None at the start of a flight."""
    load: Load | None = None
    """What hangs from the vehicle on a cable. None: nothing."""

    @staticmethod
    def hovering(vehicle: Vehicle, position: Float[Array, "*n 3"]) -> "State":
        """The state at rest and level at `position`, with rotors that carry the weight."""
        position = jnp.asarray(position)
        batch, dtype = position.shape[:-1], position.dtype
        return State(
            position=position,
            velocity=jnp.zeros_like(position),
            quaternion=jnp.broadcast_to(jnp.array([1.0, 0, 0, 0], dtype), (*batch, 4)),
            body_rate=jnp.zeros_like(position),
            rotor_speed=jnp.full((*batch, vehicle.rotor_count), vehicle.hover_rotor_speed, dtype),
        )


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Parts:
    """A `State` split into components."""

    position: Vec3
    velocity: Vec3
    attitude: Quat
    body_rate: Vec3
    rotor_speed: tuple[Array, ...]
    load: Hanging | None = None

    @staticmethod
    def of(state: State) -> "Parts":
        """Split a state."""
        return Parts(
            Vec3.of(state.position),
            Vec3.of(state.velocity),
            Quat.of(state.quaternion),
            Vec3.of(state.body_rate),
            split(state.rotor_speed),
            None if state.load is None else Hanging(Vec3.of(state.load.position), Vec3.of(state.load.velocity)),
        )

    def join(self, load: Load | None = None) -> State:
        """Join the components into a state. `load` has what stays of the load that hangs from the vehicle."""
        if load is not None and self.load is not None:
            load = replace(load, position=self.load.position.stack(), velocity=self.load.velocity.stack())
        return State(
            self.position.stack(),
            self.velocity.stack(),
            self.attitude.stack(),
            self.body_rate.stack(),
            stack(*self.rotor_speed),
            load=load,
        )


def split(array: Float[Array, "*n k"]) -> tuple[Array, ...]:
    """The entries along the last axis."""
    return tuple(array[..., i] for i in range(array.shape[-1]))
