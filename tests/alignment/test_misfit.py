"""What a fit leaves over: noise and vibration count for nothing, missing structure by its share of the motion."""

import numpy as np
import pytest

from e2efly.alignment.misfit import PULLED_ELSE, left_over, white_by, widened

WINDOWS, POINTS = 60, 100
RNG = np.random.default_rng(0)
TIME = np.arange(POINTS) * 0.004
MOTION = np.linspace(0.1, 2.0, WINDOWS)[:, None, None] * np.stack(
    [np.sin(2 * np.pi * (f * TIME + RNG.uniform(size=(WINDOWS, 1)))) for f in (3.0, 4.0, 5.0)], -1
)
"""(n, m, 3) smooth motion, in some windows lively and in some calm."""
THERE = np.ones((WINDOWS, POINTS))
NOISE = 0.02 * RNG.standard_normal(MOTION.shape)
WHITE = np.array([0.01])


def test_noise_vibration_and_gusts_are_no_structure() -> None:
    vibration = 0.3 * np.abs(MOTION).max(1, keepdims=True) * RNG.choice([-1.0, 1.0], MOTION.shape)
    gusts = 0.1 * np.sin(2 * np.pi * (TIME[:, None] + RNG.uniform(size=(WINDOWS, 1, 3))))
    for left in (NOISE, NOISE + vibration, NOISE + gusts):
        found = left_over("body_rate", left, MOTION + NOISE, THERE, 0.02, WHITE)
        assert not found.alarming
        assert found.pull < 5


@pytest.mark.parametrize("share", [0.05, 0.2])
def test_the_share_of_the_motion_that_is_left_over_is_found_and_alarms(share: float) -> None:
    seen = THERE * (RNG.uniform(size=THERE.shape) > 0.2)
    left = (NOISE + share * MOTION) * seen[..., None]
    found = left_over("body_rate", left, (MOTION + NOISE) * seen[..., None], seen, 0.02, WHITE)
    assert found.share == pytest.approx(share, rel=0.15)
    assert found.alarming
    assert f"{100 * found.share:.0f} % of its motion" in str(found)


def test_the_error_by_a_hidden_regressor_is_within_the_bound() -> None:
    """y = 1 x + 0.1 z with z like x by 0.6; only x is fitted."""
    other = np.roll(MOTION, 1, -1)
    other *= np.linalg.norm(MOTION, axis=(1, 2), keepdims=True) / np.linalg.norm(other, axis=(1, 2), keepdims=True)
    z = 0.6 * MOTION + 0.8 * other
    y = MOTION + 0.1 * z + NOISE
    curvature = np.array([[np.sum(MOTION**2) / 0.02**2]])
    a = np.sum(MOTION * y) / np.sum(MOTION**2)
    white = white_by(np.linalg.inv(curvature), curvature)
    assert white[0] == pytest.approx(curvature[0, 0] ** -0.5)
    found = left_over("body_rate", y - a * MOTION, y, THERE, 0.02, white)
    assert abs(a - 1) < found.off[0] < 3 * abs(a - 1)
    assert widened([found], np.zeros(1), ["inertia"])[0] == pytest.approx(PULLED_ELSE * found.off[0])


def test_nothing_left_over_widens_nothing() -> None:
    found = left_over("body_rate", 0 * MOTION, MOTION, THERE, 0.02, WHITE)
    assert widened([found], np.array([0.3]), ["inertia"]) == pytest.approx([0.3])
    assert widened([], np.array([0.3]), ["inertia"]) == pytest.approx([0.3])
    few = left_over("body_rate", MOTION[:2], MOTION[:2], THERE[:2], 0.02, WHITE)
    assert few.pull == 0.0
