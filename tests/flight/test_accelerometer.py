"""What an accelerometer's numbers are worth: at rest, and in the air beside poses."""

import math

import numpy as np
import pytest

from e2efly.flight.attitude import Attitude, level
from e2efly.flight.pilot.accelerometer import RANGE, Scale, learn, standing_problem
from e2efly.vehicles.gravity import GRAVITY

DT = 0.02


@pytest.mark.parametrize("counts", [(0, 0, 512), (30, -20, 2048), (0, 600, 2000), (0, 0, 256)])
def test_what_shows_gravity_upright_is_accepted(counts: tuple[float, ...]) -> None:
    assert standing_problem(np.array(counts, float)) is None


@pytest.mark.parametrize(
    ("counts", "says"),
    [
        ((0, 0, 0), "0 counts in all"),
        ((0, 0, -2048), "180 deg from the body's z axis"),
        ((2048, 0, 0), "90 deg"),
        ((0, 0, 32767), "accepted: 200 to 9000"),
    ],
)
def test_what_does_not_is_refused_with_its_numbers(counts: tuple[float, ...], says: str) -> None:
    assert says in str(standing_problem(np.array(counts, float)))


@pytest.mark.parametrize("true", [0.93, 1.0, 1.08])
def test_the_scale_is_learned_from_poses_whatever_the_motion(true: float) -> None:
    random, scale, climb = np.random.default_rng(1), Scale(), 0.0
    for k in range(round(6.0 / DT)):
        push = 1.5 * math.sin(2.0 * k * DT)
        climb += push * DT
        force = np.array([0.0, 0.0, (GRAVITY + push) / true])
        scale = learn(scale, Attitude(0.0, 0.0, 0.0), force, climb + random.normal(0, 0.01), DT)
    assert scale.value == pytest.approx(true, abs=0.01)


@pytest.mark.parametrize(("told", "value"), [(0.78, RANGE[1]), (1.23, RANGE[0]), (-1.0, 1.0), (0.0, 1.0)])
def test_the_scale_stays_within_bounds_and_is_not_learned_from_what_is_broken(told: float, value: float) -> None:
    scale = Scale()
    for _ in range(500):
        scale = learn(scale, Attitude(0.0, 0.0, 0.0), np.array([0.0, 0.0, told * GRAVITY]), 0.0, DT)
    assert scale.value == value


@pytest.mark.parametrize("push", [-8.0, -2.4, 2.4, 8.0])
@pytest.mark.parametrize("late", [0, 2, 4])
def test_a_hard_brake_or_pull_leaves_the_scale_though_the_poses_are_late(push: float, late: int) -> None:
    """After a silence, a vehicle that climbs is stopped with all that it has."""
    scale, climb = Scale(), [0.0] * (late + 1)
    for k in range(round(1.5 / DT)):
        pushed = push if 0.5 <= k * DT < 0.8 else 0.0
        climb.append(climb[-1] + pushed * DT)
        scale = learn(scale, Attitude(0.0, 0.0, 0.0), np.array([0.0, 0.0, GRAVITY + pushed]), climb[-1 - late], DT)
        assert scale.value == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(("roll", "pitch"), [(0.0, 0.0), (0.4, -0.3), (-1.2, 0.9)])
def test_gravity_is_up_in_level_axes(roll: float, pitch: float) -> None:
    cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
    felt = GRAVITY * np.array([-sp, cp * sr, cp * cr])  # R^T (0, 0, g) of R = Ry(pitch) Rx(roll)
    assert level(Attitude(roll, pitch, 1.0), felt) == pytest.approx([0.0, 0.0, GRAVITY], abs=1e-12)
