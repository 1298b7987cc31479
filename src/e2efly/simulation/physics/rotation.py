"""Quaternion algebra on arrays: unit quaternions wxyz, body to world, batched over leading axes."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from e2efly.control.vectors import Quat, rotate, stack

Quaternion = Float[Array, "*n 4"]
Vector = Float[Array, "*n 3"]


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Hamilton product: turn by `b`, then by `a`."""
    return Quat.of(a).compose(Quat.of(b)).stack()


def normalize(q: Quaternion) -> Quaternion:
    """Scale to unit length."""
    return Quat.of(q).normalized().stack()


def to_matrix(q: Quaternion) -> Float[Array, "*n 3 3"]:
    """Rotation matrix R_world_body."""
    axes = jnp.eye(3, dtype=q.dtype)
    return jnp.stack([rotate(q, jnp.broadcast_to(axis, (*q.shape[:-1], 3))) for axis in axes], axis=-1)


def from_euler(roll: Array, pitch: Array, yaw: Array) -> Quaternion:
    """R = Rz(yaw) Ry(pitch) Rx(roll), angles in rad."""
    return Quat.of_euler(roll, pitch, yaw).stack()


def yaw(q: Quaternion) -> Float[Array, "*n"]:
    """Heading: the angle about world z of the body's x axis, rad in [-pi, pi]; gradient finite when x points up."""
    return Quat.of(q).yaw()


def yaw_pitch_roll(q: Quaternion) -> Vector:
    """[yaw, pitch, roll] in rad, for people to read (not differentiable at pitch of +-90 deg)."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    pitch = jnp.arcsin(jnp.clip(2 * (w * y - z * x), -1, 1))
    roll = jnp.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    return stack(yaw(q), pitch, roll)
