"""From collective thrust and torque to rotor thrusts, with the flight controller's nominal vehicle."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from e2efly.control.vectors import Vec3
from e2efly.simulation.physics.airframe import Rotors
from e2efly.vehicles.vehicle import Vehicle, allocation_matrix


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Mixer:
    """The inverse of the rotor geometry of the nominal vehicle, and its thrust limits."""

    matrix: np.ndarray | Array
    """(*n, 4, 4): rotor thrusts, N, from [collective, N; roll, pitch, yaw torque, N*m]."""
    thrust_min: float | Array
    """Thrust of a rotor at idle, N."""
    thrust_max: float | Array
    """Largest thrust of a rotor, N."""
    plain: Array | None = None
    """1: each rotor is clipped by itself. 0: attitude has priority over thrust. Shape (*n,). None: 0."""

    @staticmethod
    def of(vehicle: Vehicle, dtype: type = np.float32) -> "Mixer":
        """The mixer of a loaded (not traced) vehicle."""
        low, high = vehicle.thrust_range
        return Mixer(np.linalg.inv(allocation_matrix(vehicle)).astype(dtype), dtype(low), dtype(high))

    @staticmethod
    def of_each(vehicle: Vehicle) -> "Mixer":
        """The mixers of a batch of vehicles whose rotors lie symmetrically about both axes, as a family draws them.

        For them the rows of the allocation matrix are orthogonal. Its inverse is its transpose, with each column
        divided by the squared norm of its row.
        """
        x, y = vehicle.rotor_position[..., 0], vehicle.rotor_position[..., 1]
        yaw = vehicle.rotor_spin * vehicle.torque_ratio[..., None]
        rows = [jnp.ones_like(x), y, -x, yaw]
        matrix = jnp.stack([row / jnp.sum(row**2, axis=-1, keepdims=True) for row in rows], axis=-1)
        k2, k1, k0 = (vehicle.thrust_map[..., i] for i in range(3))
        idle = vehicle.rotor_speed_min
        return Mixer(matrix, (k2 * idle + k1) * idle + k0, vehicle.rotor_thrust_max)

    def limit(self, thrust: Rotors) -> Rotors:
        """The thrust of each rotor, clipped to the rotor's limits."""
        a, b, c, d = (jnp.clip(f, self.thrust_min, self.thrust_max) for f in thrust)
        return a, b, c, d

    def thrusts(self, collective: Array, torque: Vec3) -> Rotors:
        """Rotor thrusts within the limits, N. Attitude has priority over thrust, as in Betaflight's mixer.

        If the torque needs a larger span than a rotor has, the whole torque is scaled down. Then the collective thrust
        is shifted until every rotor is inside its limits.
        """
        m = self.matrix
        spread = [m[..., i, 1] * torque.x + m[..., i, 2] * torque.y + m[..., i, 3] * torque.z for i in range(4)]
        span = _max4(spread) - _min4(spread)
        available = self.thrust_max - self.thrust_min
        scale = available / jnp.maximum(span, available)
        if self.plain is not None:
            scale = scale + (1 - scale) * self.plain
        asked = [m[..., i, 0] * collective + scale * spread[i] for i in range(4)]
        shift = jnp.maximum(self.thrust_min - _min4(asked), 0.0) - jnp.maximum(_max4(asked) - self.thrust_max, 0.0)
        if self.plain is not None:
            shift = shift * (1 - self.plain)
        return self.limit((asked[0] + shift, asked[1] + shift, asked[2] + shift, asked[3] + shift))


def _max4(x: list[Array]) -> Array:
    return jnp.maximum(jnp.maximum(x[0], x[1]), jnp.maximum(x[2], x[3]))


def _min4(x: list[Array]) -> Array:
    return jnp.minimum(jnp.minimum(x[0], x[1]), jnp.minimum(x[2], x[3]))
