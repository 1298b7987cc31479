"""Vectors and quaternions split into components, with NumPy in flight and JAX in the simulator.

Inside the physics every component is an array of the batch's shape. On whole batches of scalars XLA vectorises over the
batch, which is 1.7 times faster on a CPU than the same formulas on arrays of shape (batch, 3).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

Array = Any
"""A number or an array of the batch's shape, from NumPy or JAX. The formulas are the same."""


def namespace(*values: Array) -> Any:
    """The array library of the values: JAX if any of them is a JAX array, otherwise NumPy."""
    for value in values:
        if not isinstance(value, (float, int, np.ndarray, np.generic)):
            return value.__array_namespace__()
    return np


def safe_sqrt(x: Array) -> Array:
    """sqrt(max(x, 0)) with gradient 0, not infinity, at and below zero."""
    xp, positive = namespace(x), x > 0
    return xp.where(positive, xp.sqrt(xp.where(positive, x, 1.0)), 0.0)


@dataclass(frozen=True)
class Vec3:
    """A 3-vector; each component has the batch's shape."""

    x: Array
    y: Array
    z: Array

    @staticmethod
    def of(array: Array) -> "Vec3":
        """Split an array of shape (*n, 3)."""
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
        """Product per axis."""
        return Vec3(self.x * other.x, self.y * other.y, self.z * other.z)

    def abs(self) -> "Vec3":
        """Absolute value per axis."""
        return Vec3(abs(self.x), abs(self.y), abs(self.z))

    def clip(self, limit: "Vec3") -> "Vec3":
        """Each axis clipped to [-limit, limit]."""
        xp = namespace(self.x, limit.x)
        return Vec3(
            xp.clip(self.x, -limit.x, limit.x), xp.clip(self.y, -limit.y, limit.y), xp.clip(self.z, -limit.z, limit.z)
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
        """Euclidean length. Its gradient is 0 at zero."""
        return safe_sqrt(self.dot(self))


@dataclass(frozen=True)
class Quat:
    """A unit quaternion w + xi + yj + zk that rotates body vectors into world vectors."""

    w: Array
    x: Array
    y: Array
    z: Array

    @staticmethod
    def of(array: Array) -> "Quat":
        """Split an array of shape (*n, 4), wxyz."""
        return Quat(array[..., 0], array[..., 1], array[..., 2], array[..., 3])

    def stack(self) -> Array:
        """The array of shape (*n, 4), wxyz."""
        return stack(self.w, self.x, self.y, self.z)

    def __add__(self, other: "Quat") -> "Quat":
        return Quat(self.w + other.w, self.x + other.x, self.y + other.y, self.z + other.z)

    def __mul__(self, scale: Array | float) -> "Quat":
        return Quat(self.w * scale, self.x * scale, self.y * scale, self.z * scale)

    def compose(self, other: "Quat") -> "Quat":
        """Hamilton product: rotation by `other`, then by `self`."""
        a, b = self, other
        return Quat(
            a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
            a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
            a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
        )

    @staticmethod
    def of_euler(roll: Array, pitch: Array, yaw: Array) -> "Quat":
        """R = Rz(yaw) Ry(pitch) Rx(roll), angles in rad."""
        xp = namespace(roll, pitch, yaw)
        cr, sr = xp.cos(roll / 2), xp.sin(roll / 2)
        cp, sp = xp.cos(pitch / 2), xp.sin(pitch / 2)
        cy, sy = xp.cos(yaw / 2), xp.sin(yaw / 2)
        return Quat(
            cy * cp * cr + sy * sp * sr,
            cy * cp * sr - sy * sp * cr,
            cy * sp * cr + sy * cp * sr,
            sy * cp * cr - cy * sp * sr,
        )

    def conjugate(self) -> "Quat":
        """The inverse rotation."""
        return Quat(self.w, -self.x, -self.y, -self.z)

    def normalized(self) -> "Quat":
        """Scaled to unit length."""
        return self * (1 / namespace(self.w).sqrt(self.w**2 + self.x**2 + self.y**2 + self.z**2))

    def derivative(self, body_rate: Vec3) -> "Quat":
        """dq/dt = q (0, body_rate) / 2."""
        r = body_rate * 0.5
        return Quat(
            -self.x * r.x - self.y * r.y - self.z * r.z,
            self.w * r.x + self.y * r.z - self.z * r.y,
            self.w * r.y + self.z * r.x - self.x * r.z,
            self.w * r.z + self.x * r.y - self.y * r.x,
        )

    def turned(self, angle: Vec3) -> "Quat":
        """The attitude after a small rotation about the body axes, rad."""
        one = namespace(angle.x).ones_like(angle.x)
        return self.compose(Quat(one, angle.x / 2, angle.y / 2, angle.z / 2)).normalized()

    def rotate(self, v: Vec3) -> Vec3:
        """Rotate from body to world."""
        u = Vec3(self.x, self.y, self.z)
        t = u.cross(v) * 2.0
        return v + t * self.w + u.cross(t)

    def unrotate(self, v: Vec3) -> Vec3:
        """Rotate from world to body."""
        return self.conjugate().rotate(v)

    def z_axis(self) -> Vec3:
        """The body's z axis in the world."""
        return Vec3(
            2.0 * (self.x * self.z + self.w * self.y),
            2.0 * (self.y * self.z - self.w * self.x),
            1.0 - 2.0 * (self.x**2 + self.y**2),
        )

    def yaw(self) -> Array:
        """Heading: the angle about world z of the body's x axis, rad in [-pi, pi].

        If the axis points straight up or down, the angle is 0 and its gradient is finite.
        """
        sine, cosine = 2.0 * (self.w * self.z + self.x * self.y), 1.0 - 2.0 * (self.y**2 + self.z**2)
        xp, defined = namespace(sine), sine**2 + cosine**2 > 1e-12
        angle = xp.arctan2(xp.where(defined, sine, 0.0), xp.where(defined, cosine, 1.0))
        return xp.where(defined, angle, 0.0)

    def tilt(self) -> Array:
        """The angle between the body's z axis and up, rad in [0, pi]. Its gradient is not finite at either end."""
        up = 1.0 - 2.0 * (self.x**2 + self.y**2)
        return namespace(up).arccos(namespace(up).clip(up, -1.0, 1.0))


def rotate(quaternion: Array, vector: Array) -> Array:
    """Rotate vectors (..., 3) from body to world by quaternions (..., 4)."""
    return Quat.of(quaternion).rotate(Vec3.of(vector)).stack()


def unrotate(quaternion: Array, vector: Array) -> Array:
    """Rotate vectors (..., 3) from world to body by quaternions (..., 4)."""
    return Quat.of(quaternion).unrotate(Vec3.of(vector)).stack()


def stack(*parts: Array) -> Array:
    """Stack components behind the batch axes, broadcast against each other."""
    xp = namespace(*parts)
    return xp.stack(xp.broadcast_arrays(*parts), axis=-1)
