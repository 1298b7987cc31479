"""Splines: smooth, held at their ends, and through the user's points."""

import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.courses.references import KNOT_PERIOD, Lissajous, Spline, through_points
from e2efly.environment import random_key
from e2efly.tasks.track.splines import polynomial

pytestmark = pytest.mark.usefixtures("x64")

KNOTS = 23


def curves(seed: int) -> Spline:
    return polynomial(random_key(seed), (0.0, 0.0, 3.0), 2.0, 2.5, 20, KNOTS)


def at(spline: Spline, times: np.ndarray) -> np.ndarray:
    n = spline.knots.shape[0]
    return np.asarray(spline.position(jnp.broadcast_to(jnp.asarray(times, float), (n, len(times)))))


def test_a_spline_takes_its_knots_values_and_derivatives() -> None:
    knots = np.random.default_rng(0).normal(size=(3, 5, 3, 3))
    spline, h = Spline(jnp.asarray(knots)), 1e-4
    t = np.arange(1, 4) * KNOT_PERIOD
    before, here, after = at(spline, t - h), at(spline, t), at(spline, t + h)
    np.testing.assert_allclose(here, knots[:, 1:4, 0], atol=1e-12)
    np.testing.assert_allclose((after - before) / (2 * h), knots[:, 1:4, 1], atol=1e-3)
    np.testing.assert_allclose((after - 2 * here + before) / h**2, knots[:, 1:4, 2], atol=0.5)
    for side in (1, -1):  # from each side of the knot: the second derivative does not jump
        a, b = (at(spline, t + side * k * h) for k in (1, 2))
        np.testing.assert_allclose((here - 2 * a + b) / h**2, knots[:, 1:4, 2], atol=0.2)


def test_a_spline_is_held_at_its_ends() -> None:
    spline, last = curves(1), (KNOTS - 1) * KNOT_PERIOD
    np.testing.assert_array_equal(at(spline, np.array([-1.0])), at(spline, np.array([0.0])))
    np.testing.assert_array_equal(at(spline, np.array([last + 5])), at(spline, np.array([last])))


@pytest.mark.parametrize(
    ("curve", "bound"), [(Lissajous.circle(2.0, 0.2 * np.pi), 1e-5), (Lissajous.lemniscate(2.0, 3.0), 1e-4)]
)
def test_knots_of_a_curve_are_its_derivatives(curve: Lissajous, bound: float) -> None:
    """Against the formulas, at every phase: a circle within 0.01 mm, a lemniscate within 0.1 mm."""
    phase = np.array([-3.0, 0.0, 1.2])
    spline = curve.spline((1.0, -1.0, 3.0), jnp.asarray(phase), KNOTS)
    t = np.linspace(0, 11, 1500)
    angle = curve.rate * t + phase[:, None]
    x = 1 + curve.half_x * np.sin(angle + curve.shift)
    y = -1 + curve.half_y * np.sin(curve.ratio * angle)
    np.testing.assert_allclose(at(spline, t), np.stack([x, y, 3 + 0 * x], -1), atol=bound)


def test_circle_and_lemniscate_by_their_meaning() -> None:
    p = at(Lissajous.circle(2.0, 0.5).spline((0.0, 0.0, 3.0), jnp.zeros(1), KNOTS), np.linspace(0, 11, 200))[0]
    np.testing.assert_allclose(np.linalg.norm(p[:, :2], axis=-1), 2.0, atol=1e-5)
    assert np.all(np.diff(np.unwrap(np.arctan2(p[:, 1], p[:, 0]))) > 0)  # counter-clockwise
    p = at(Lissajous.lemniscate(2.0, 3.0).spline((0.0, 0.0, 3.0), jnp.zeros(1), KNOTS), np.linspace(0, 11, 500))[0]
    x, y = p[:, 0] / 2, p[:, 1] / 2
    np.testing.assert_allclose(y**2, x**2 * (1 - x**2), atol=1e-3)  # Gerono's equation
    assert np.abs(p[:, 0]).max() == pytest.approx(2.0, abs=1e-3)


def test_a_random_polynomial_is_one_polynomial_over_four_knots() -> None:
    """Its knots sample the coarse quintic pieces with their derivatives, so that they describe the same curve."""
    p = at(curves(2), np.linspace(0, 4 * KNOT_PERIOD, 41))
    s = np.linspace(0, 1, 41)
    for path in p.reshape(20, 41, 3).transpose(0, 2, 1).reshape(-1, 41):
        fit = np.polynomial.Polynomial.fit(s, path, 5)
        np.testing.assert_allclose(fit(s), path, atol=1e-9)


def test_the_mean_speed_of_a_random_polynomial_keeps_its_limit() -> None:
    ends = at(curves(3), np.arange(0, 11.1, 4 * KNOT_PERIOD))
    mean = np.linalg.norm(np.diff(ends, axis=1), axis=-1) / (4 * KNOT_PERIOD)
    assert mean.max() <= 2.5 + 1e-9
    assert np.abs(ends - [0, 0, 3]).max() <= 2.0 + 1e-9
    fastest = mean.max(1)
    assert fastest.max() > 1.5 > 0.5 > fastest.min()  # fast ones and slow ones


def test_a_users_path_is_held_after_its_last_row() -> None:
    """It arrives at 2 m/s and stays there: it does not swing past the end."""
    t = np.arange(0, 3.01, 0.5)
    table = np.stack([t, 2 * t, 0 * t, 0 * t + 2], -1)
    x = at(through_points(table), np.linspace(0, 11, 500))[0, :, 0]
    assert x[-1] == pytest.approx(6.0, abs=1e-6)
    assert x.max() <= 6.0 + 1e-3


def test_a_users_path_goes_through_points_closer_than_the_knots() -> None:
    t = np.arange(0, 10, 0.1)
    table = np.stack([t, np.sin(np.pi * t), np.cos(np.pi * t), 0 * t + 2], -1)
    path = at(through_points(table), t)[0]
    assert np.linalg.norm(path - table[:, 1:], axis=-1).max() < 0.01
