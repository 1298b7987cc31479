"""From collective thrust and torque to rotor thrusts, with the flight controller's nominal vehicle."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from e2efly.control.allocation import THRUST, TILT, YAW, Allocation, ThrustLimits, nearest, shifted
from e2efly.control.vectors import Vec3
from e2efly.simulation.physics.airframe import Rotors, Tilt
from e2efly.simulation.physics.state import split
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.rotor_frames import smallest_norm
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
        """The mixers of a batch of vehicles that a family draws.

        Level rotors of a family lie symmetrically about both axes, so the rows of the allocation matrix are orthogonal.
        Its inverse is its transpose, with each column divided by the squared norm of its row. For tilted rotors, by the
        rule `qp`, a gradient step is up to 4 % shorter than that of `of`: it is by a bound of the largest eigenvalue.
        """
        k2, k1, k0 = (vehicle.thrust_map[..., i] for i in range(3))
        idle = vehicle.rotor_speed_min
        low, high = (k2 * idle + k1) * idle + k0, vehicle.rotor_thrust_max
        if (tilt := Tilt.of(vehicle)) is not None:
            wrench = jnp.stack([jnp.stack(row, axis=-1) for row in (tilt.axis[2], *tilt.moment)], axis=-2)
            matrix = jnp.stack(smallest_norm([wrench[..., i, :] for i in range(4)]), axis=-1)
            return Mixer(matrix, low, high, None, "qp", *_gradient_step(vehicle, wrench))
        x, y = vehicle.rotor_position[..., 0], vehicle.rotor_position[..., 1]
        yaw = vehicle.rotor_spin * vehicle.torque_ratio[..., None]
        rows = [jnp.ones_like(x), y, -x, yaw]
        matrix = jnp.stack([row / jnp.sum(row**2, axis=-1, keepdims=True) for row in rows], axis=-1)
        return Mixer(matrix, low, high)

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


def _gradient_step(vehicle: Vehicle, wrench: Array) -> tuple[Array, Array]:
    """`descent` and `pull` of an `Allocation`, for a batch of vehicles with these wrench matrices, (*n, 4, N)."""
    has = jnp.any(vehicle.rotor_axis != 0, axis=-1)
    count, weight = has.sum(-1), vehicle.mass * GRAVITY
    arm = jnp.sum(jnp.linalg.norm(vehicle.rotor_position[..., :2], axis=-1), axis=-1) / count
    units = weight * jnp.stack([jnp.ones_like(arm), arm, arm, jnp.abs(wrench[..., 3, :]).sum(-1) / count])
    pace = jnp.moveaxis(jnp.array([THRUST, TILT, TILT, YAW])[:, None] / units**2, 0, -1)
    root = wrench * jnp.sqrt(pace)[..., None]
    power, steepest = _times(root, root), jnp.ones(())
    for i in range(5):  # the norm of a matrix's power 2^i is at most twice the largest eigenvalue to that power
        size = jnp.sqrt(jnp.sum(power**2, axis=(-2, -1), keepdims=True))
        power, steepest = _times(power / size, power / size), steepest * size ** (0.5**i)
    pull = jnp.swapaxes(wrench * pace[..., None], -2, -1) / steepest
    return jnp.eye(wrench.shape[-1]) - _times(pull, jnp.swapaxes(wrench, -2, -1)), pull


def _times(a: Array, b: Array) -> Array:
    """The product of a and the transpose of b, both (*n, i, k), of small matrices."""
    return jnp.sum(a[..., :, None, :] * b[..., None, :, :], axis=-1)


def _rows(matrix: np.ndarray | Array) -> list[Rotors]:
    return [split(jnp.asarray(matrix[..., i, :])) for i in range(matrix.shape[-2])]


def _scan(step: Callable[[Any, Any], Any], first: Any, numbers: Sequence[float]) -> Any:
    paces = jnp.asarray(numbers, first[0][0].dtype)
    return jax.lax.scan(lambda carry, pace: (step(carry, pace), None), first, paces)[0]
