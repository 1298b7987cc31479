"""From collective thrust and torque to rotor thrusts, with the flight controller's nominal vehicle."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from e2efly.control.allocation import Allocation, ThrustLimits, nearest, shifted
from e2efly.control.vectors import Vec3
from e2efly.simulation.physics.airframe import Rotors
from e2efly.simulation.physics.state import split
from e2efly.vehicles.vehicle import MixerRule, Vehicle


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["matrix", "thrust_min", "thrust_max", "plain", "descent", "pull"],
    meta_fields=["rule"],
)
@dataclass(frozen=True)
class Mixer:
    """The inverse of the rotor geometry of the nominal vehicle, its thrust limits, and how they are kept."""

    matrix: np.ndarray | Array
    """(*n, N, 4): rotor thrusts, N, from [collective, N; roll, pitch, yaw torque, N*m]."""
    thrust_min: float | Array
    """Thrust of a rotor at idle, N."""
    thrust_max: float | Array
    """Largest thrust of a rotor, N."""
    plain: Array | None = None
    """1: each rotor is clipped by itself. 0: `rule`. Shape (*n,). None: 0."""
    rule: MixerRule = "betaflight"
    descent: np.ndarray | Array | None = None
    """(N, N), and `pull` (N, 4): as of `Allocation`, for the rule `qp`."""
    pull: np.ndarray | Array | None = None

    @staticmethod
    def of(vehicle: Vehicle, dtype: type = np.float32) -> "Mixer":
        """The mixer of a loaded (not traced) vehicle."""
        (low, high), found = vehicle.thrust_range, Allocation.of(vehicle)
        descent, pull = (None if x is None else x.astype(dtype) for x in (found.descent, found.pull))
        return Mixer(found.matrix.astype(dtype), dtype(low), dtype(high), None, found.rule, descent, pull)

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
        return self._limits.clip(thrust)

    def thrusts(self, collective: Array, torque: Vec3) -> Rotors:
        """Rotor thrusts within the limits, N. Attitude has priority over thrust."""
        wrench = collective, torque.x, torque.y, torque.z
        if self.rule == "qp" and self.descent is not None and self.pull is not None:
            matrices = _rows(self.matrix), _rows(self.descent), _rows(self.pull)
            return nearest(matrices, jnp.broadcast_arrays(*wrench), self._limits, self.plain, _scan)
        return shifted(self.rule, _rows(self.matrix), wrench, self._limits, self.plain)

    @property
    def _limits(self) -> ThrustLimits:
        return ThrustLimits(self.thrust_min, self.thrust_max, jnp.maximum, jnp.minimum)


def _rows(matrix: np.ndarray | Array) -> list[Rotors]:
    return [split(jnp.asarray(matrix[..., i, :])) for i in range(matrix.shape[-2])]


def _scan(step: Callable[[Any, Any], Any], first: Any, numbers: Sequence[float]) -> Any:
    paces = jnp.asarray(numbers, first[0][0].dtype)
    return jax.lax.scan(lambda carry, pace: (step(carry, pace), None), first, paces)[0]
