"""Quaternion algebra: the axioms of a group, and SciPy's rotations as an independent implementation."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from e2efly.control.vectors import Quat, Vec3, rotate, unrotate
from e2efly.simulation.physics import rotation

pytestmark = pytest.mark.usefixtures("x64")

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def quaternions(seed: int, n: int = 50) -> jax.Array:
    return jnp.asarray(Rotation.random(n, rng=np.random.default_rng(seed)).as_quat(scalar_first=True))


def vectors(seed: int, n: int = 50) -> jax.Array:
    return jnp.asarray(np.random.default_rng(seed).normal(size=(n, 3)))


def scipy_rotation(q: jax.Array) -> Rotation:
    return Rotation.from_quat(np.array(q), scalar_first=True)


def close(a: jax.Array, b: object, atol: float = 1e-12) -> None:
    np.testing.assert_allclose(np.asarray(a), np.asarray(b), rtol=0, atol=atol)


def test_group_axioms() -> None:
    a, b, c = quaternions(0), quaternions(1), quaternions(2)
    multiply, conjugate = rotation.multiply, lambda q: Quat.of(q).conjugate().stack()
    close(multiply(multiply(a, b), c), multiply(a, multiply(b, c)))
    close(multiply(a, jnp.asarray(IDENTITY)), a)
    close(multiply(jnp.asarray(IDENTITY), a), a)
    close(multiply(a, conjugate(a)), np.broadcast_to(IDENTITY, a.shape))
    close(conjugate(multiply(a, b)), multiply(conjugate(b), conjugate(a)))
    close(jnp.linalg.norm(multiply(a, b), axis=-1), np.ones(len(a)))


def test_product_is_the_product_of_rotations() -> None:
    a, b, v = quaternions(3), quaternions(4), vectors(5)
    close(rotate(rotation.multiply(a, b), v), (scipy_rotation(a) * scipy_rotation(b)).apply(np.array(v)))
    close(rotate(rotation.multiply(a, b), v), rotate(a, rotate(b, v)))


def test_rotate_is_the_matrix() -> None:
    q, v = quaternions(6), vectors(7)
    matrix = rotation.to_matrix(q)
    close(matrix, scipy_rotation(q).as_matrix())
    close(rotate(q, v), jnp.einsum("nij,nj->ni", matrix, v))
    close(unrotate(q, v), jnp.einsum("nji,nj->ni", matrix, v))
    close(unrotate(q, rotate(q, v)), v)
    close(rotate(-q, v), rotate(q, v))
    close(Quat.of(q).z_axis().stack(), matrix[:, :, 2])


@pytest.mark.parametrize("axis", range(3))
def test_quarter_and_half_turns(axis: int) -> None:
    half = jnp.asarray(np.roll([0.0, 1.0, 0.0, 0.0], axis))
    quarter = rotation.normalize(half + IDENTITY)
    x, y, z = np.roll(np.eye(3), -axis, axis=0)  # the turn takes y to z
    close(rotate(quarter, jnp.asarray(y)), z)
    close(rotate(half, jnp.asarray(y)), -y)
    close(rotate(half, jnp.asarray(x)), x)
    close(rotation.multiply(quarter, quarter), half)
    close(rotation.multiply(half, half), -IDENTITY)


def test_euler_angles() -> None:
    rng = np.random.default_rng(8)
    yaw, pitch, roll = rng.uniform([-np.pi, -1.5, -np.pi], [np.pi, 1.5, np.pi], (50, 3)).T
    q = rotation.from_euler(jnp.asarray(roll), jnp.asarray(pitch), jnp.asarray(yaw))
    expected = Rotation.from_euler("ZYX", np.stack([yaw, pitch, roll], -1))
    close(rotation.to_matrix(q), expected.as_matrix())
    close(rotation.yaw(q), yaw, 1e-11)
    close(rotation.yaw_pitch_roll(q), np.stack([yaw, pitch, roll], -1), 1e-11)


def test_normalize() -> None:
    q = quaternions(9)
    close(rotation.normalize(3.7 * q), q)


def test_derivative_is_the_body_rates() -> None:
    """dq/dt at t = 0 of q exp(w t / 2)."""
    q, w, t = quaternions(10), vectors(11), 1e-6
    turned = [
        (scipy_rotation(q) * Rotation.from_rotvec(s * t * np.asarray(w))).as_quat(scalar_first=True) for s in (1, -1)
    ]
    for sign in turned:  # SciPy may give -q
        sign *= np.sign(np.sum(sign * np.asarray(q), -1, keepdims=True))
    close(Quat.of(q).derivative(Vec3.of(w)).stack(), (turned[0] - turned[1]) / (2 * t), 1e-9)


def test_yaw_has_a_finite_gradient_where_it_is_not_defined() -> None:
    up = rotation.from_euler(jnp.asarray(0.0), jnp.asarray(-jnp.pi / 2), jnp.asarray(0.0))
    gradient = jax.jit(jax.vmap(jax.grad(rotation.yaw)))(jnp.vstack([jnp.eye(4), up, -up]))
    assert np.all(np.isfinite(gradient))
    close(gradient[0], [0, 0, 0, 2])


def test_leading_axes() -> None:
    q, v = quaternions(12, 6).reshape(2, 3, 4), vectors(13, 6).reshape(2, 3, 3)
    assert rotation.multiply(q, q).shape == (2, 3, 4)
    assert rotation.to_matrix(q).shape == (2, 3, 3, 3)
    assert rotation.yaw(q).shape == (2, 3)
    close(rotate(q, v)[1, 2], rotate(q[1, 2], v[1, 2]))
