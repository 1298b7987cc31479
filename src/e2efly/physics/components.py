"""Vectors and quaternions taken apart into components.

Inside the physics every component is an array of the batch's shape. On whole batches of scalars XLA vectorises over
the batch, which is 1.7 times faster on a CPU than the same formulas on arrays of shape (batch, 3).
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jax import Array


def safe_sqrt(x: Array) -> Array:
    """sqrt(max(x, 0)) with gradient 0, not infinity, at and below zero."""
    positive = x > 0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, x, 1.0)), 0.0)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Vec3:
    """A 3-vector; each component has the batch's shape."""

    x: Array
    y: Array
    z: Array

    @staticmethod
    def of(array: Array) -> "Vec3":
        """Take apart an array of shape (*n, 3)."""
        return Vec3(array[..., 0], array[..., 1], array[..., 2])

    def stack(self) -> Array:
        """The array of shape (*n, 3)."""
        return stack(self.x, self.y, self.z)

    def __add__(self, other: "Vec3") -> "Vec3":
        return Vec3(self.x + other.x, self.y + other.y, self.z + other.z)

    def __sub__(self, other: "Vec3") -> "Vec3":
        return Vec3(self.x - other.x, self.y - other.y, self.z - other.z)

    def __mul__(self, scale: Array | float) -> "Vec3":
        return Vec3(self.x * scale, self.y * scale, self.z * scale)

    def times(self, other: "Vec3") -> "Vec3":
        """Product an axis."""
        return Vec3(self.x * other.x, self.y * other.y, self.z * other.z)

    def abs(self) -> "Vec3":
        """Absolute value an axis."""
        return Vec3(jnp.abs(self.x), jnp.abs(self.y), jnp.abs(self.z))

    def clip(self, limit: "Vec3") -> "Vec3":
        """Each axis clipped to [-limit, limit]."""
        return Vec3(
            jnp.clip(self.x, -limit.x, limit.x),
            jnp.clip(self.y, -limit.y, limit.y),
            jnp.clip(self.z, -limit.z, limit.z),
        )

    def dot(self, other: "Vec3") -> Array:
        """Inner product."""
        return self.x * other.x + self.y * other.y + self.z * other.z

    def cross(self, other: "Vec3") -> "Vec3":
        """Vector product."""
        return Vec3(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )

    def norm(self) -> Array:
        """Euclidean length; gradient 0 at zero."""
        return safe_sqrt(self.dot(self))


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Quat:
    """A unit quaternion w + xi + yj + zk that turns body vectors into world vectors."""

    w: Array
    x: Array
    y: Array
    z: Array

    @staticmethod
    def of(array: Array) -> "Quat":
        """Take apart an array of shape (*n, 4), wxyz."""
        return Quat(array[..., 0], array[..., 1], array[..., 2], array[..., 3])

    def stack(self) -> Array:
        """The array of shape (*n, 4), wxyz."""
        return stack(self.w, self.x, self.y, self.z)

    def __add__(self, other: "Quat") -> "Quat":
        return Quat(self.w + other.w, self.x + other.x, self.y + other.y, self.z + other.z)

    def __mul__(self, scale: Array | float) -> "Quat":
        return Quat(self.w * scale, self.x * scale, self.y * scale, self.z * scale)

    def compose(self, other: "Quat") -> "Quat":
        """Hamilton product: turn by `other`, then by `self`."""
        a, b = self, other
        return Quat(
            a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
            a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
            a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
        )

    def conjugate(self) -> "Quat":
        """The inverse turn."""
        return Quat(self.w, -self.x, -self.y, -self.z)

    def normalized(self) -> "Quat":
        """Scaled to unit length."""
        return self * jax.lax.rsqrt(self.w**2 + self.x**2 + self.y**2 + self.z**2)

    def derivative(self, body_rate: Vec3) -> "Quat":
        """dq/dt = q (0, body_rate) / 2."""
        r = body_rate * 0.5
        return Quat(
            -self.x * r.x - self.y * r.y - self.z * r.z,
            self.w * r.x + self.y * r.z - self.z * r.y,
            self.w * r.y + self.z * r.x - self.x * r.z,
            self.w * r.z + self.x * r.y - self.y * r.x,
        )

    def rotate(self, v: Vec3) -> Vec3:
        """Body to world."""
        u = Vec3(self.x, self.y, self.z)
        t = u.cross(v) * 2.0
        return v + t * self.w + u.cross(t)

    def unrotate(self, v: Vec3) -> Vec3:
        """World to body."""
        return self.conjugate().rotate(v)

    def z_axis(self) -> Vec3:
        """The body's z axis in the world."""
        return Vec3(
            2.0 * (self.x * self.z + self.w * self.y),
            2.0 * (self.y * self.z - self.w * self.x),
            1.0 - 2.0 * (self.x**2 + self.y**2),
        )


def stack(*parts: Array) -> Array:
    """Stack components behind the batch axes, broadcast against each other."""
    return jnp.stack(jnp.broadcast_arrays(*parts), axis=-1)
