"""The other vehicles of a flight: who is near, and what is shown of one that is lost."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from e2efly.flight.pose.neighbours import AGILE, LEAST, LOST_S, Neighbours
from e2efly.flight.pose.pose_source import PlantSource
from e2efly.policy.goal import Shape
from e2efly.policy.loader import load_policy
from e2efly.policy.observation import Company
from e2efly.policy.odometry import Odometry, Sample
from e2efly.policy.others import FAR, USUAL, company_of
from e2efly.policy.runtime import Runtime
from e2efly.policy.zoo import policy_file
from e2efly.tasks.swap.goal import SwapRoute
from e2efly.vehicles.loading import load_vehicle

LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


def flying(place: Any, velocity: Any = (0.0, 0.0, 0.0), until: float = np.inf) -> PlantSource:
    """A vehicle that flies straight on from a place, and is seen until a time."""

    def samples(now: float) -> list[Sample]:
        if now > until:
            return []
        at = np.add(place, np.multiply(now, velocity)) + 1e-6 * np.sin(1e3 * now)  # no pose repeats bit for bit
        return [Sample(now, at, LEVEL, velocity=np.array(velocity, float))]

    return PlantSource(samples, "other")


def here(now: float, place: Any = (0.0, 0.0, 1.0)) -> Odometry:
    return Odometry(now, np.array(place, float), np.zeros(3), LEVEL, np.zeros(3))


def seen(*sources: PlantSource, until: float = 1.0, needs: Company = USUAL, rate: float = 100.0) -> Neighbours:
    """Others that were read at a rate, Hz."""
    found = Neighbours(sources, 0.1, needs)
    for i in range(1, round(rate * until) + 1):
        found.read(i / rate)
    return found


def test_the_nearest_come_first_and_who_is_not_there_is_far() -> None:
    found = seen(flying((3, 0, 1)), flying((0, 1, 1), (0, 0.5, 0)))
    others = found.nearest(here(1.0), 1.0, 3)
    np.testing.assert_allclose(others.position[0, :2], [[0, 1.5, 1], [3, 0, 1]], atol=0.02)
    np.testing.assert_allclose(others.velocity[0, :2], [[0, 0.5, 0], [0, 0, 0]], atol=0.05)
    np.testing.assert_allclose(others.position[0, 2], [0, 0, 1 + FAR])
    assert found.nearest(here(1.0), 1.0, 1).position.shape == (1, 1, 3)


def test_between_two_poses_it_flies_on() -> None:
    found = seen(flying((0, 0, 1), (2.0, 0, 0)))
    others = found.nearest(here(1.05, (5, 0, 1)), 1.05, 1)
    assert others.position[0, 0, 0] == pytest.approx(2.1, abs=0.02)


def lost_distance(age: float) -> float:
    found = seen(flying((4, 0, 1), until=0.5), until=0.5)
    others = found.nearest(here(0.5 + age), 0.5 + age, 1)
    return float(np.linalg.norm(others.position[0, 0] - [0, 0, 1]))


def test_one_that_is_lost_comes_nearer_and_never_vanishes() -> None:
    assert lost_distance(0.05) == pytest.approx(4.0, abs=0.01)
    assert lost_distance(0.3) == pytest.approx(4.0 - USUAL.speed_m_s * 0.2 - AGILE / 2 * 0.1**2, abs=0.02)
    assert lost_distance(20.0) == pytest.approx(LEAST, abs=1e-6)


def test_the_ball_of_a_lost_one_contains_it_wherever_it_flies() -> None:
    """A racer at 11 m/s, which then turns at any acceleration and speed that it can have."""
    random, racing = np.random.default_rng(0), company_of(1, 30.0, 20.0)
    for _ in range(100):
        found = seen(flying((0, 0, 1), (11.0, 0, 0), until=0.5), until=0.5, needs=racing)
        way = random.standard_normal(3)
        push, place, speed = AGILE * way / np.linalg.norm(way), np.array([5.5, 0, 1]), np.array([11.0, 0, 0])
        for i in range(90):
            speed = speed + 0.01 * push
            speed *= min(1.0, 20.0 / float(np.linalg.norm(speed)))
            place = place + 0.01 * speed
            (ball,) = found.balls(0.51 + 0.01 * i)
            away = float(np.linalg.norm(place - ball.position))
            assert i < 10 or away <= ball.ball + 0.03


def test_one_that_is_lost_far_away_is_no_problem() -> None:
    found = seen(flying((30, 0, 1), until=0.5), until=0.5, needs=company_of(1, 7.0, 5.0))
    assert "not seen" in str(found.problem(2.0))
    assert found.problem(2.0, np.array([0, 0, 1.0])) is None  # its ball is 7.6 m wide
    assert "not seen for 5.0 s" in str(found.problem(5.5, np.array([0, 0, 1.0])))


def test_a_source_that_is_too_slow_or_too_short_of_sight_is_told_by_name() -> None:
    needs = company_of(1, 7.1, 5.0)
    slow = seen(flying((3, 0, 1)), needs=needs, until=3.0, rate=4.0)
    told = r"another vehicle, by other, is seen every 0.25 s; accepted: seen up to 7.1 m, at most 0.1 s old"
    assert told in str(slow.problem(3.0, begins=True)) and slow.problem(3.0) is None
    assert seen(flying((3, 0, 1)), needs=needs, until=3.0).problem(3.0, begins=True) is None
    near = flying((3, 0, 1))
    near.range_m = 3.0  # type: ignore[attr-defined]
    with pytest.raises(ValueError, match=r"by other, is seen up to range_m 3 m; accepted: 7.1 m or more, as the pol"):
        seen(near, needs=needs)
    assert seen(near).problem(1.0) is None


@pytest.mark.parametrize(
    "found, now, told",
    [
        (lambda: seen(flying((3, 0, 1))), 1.0, None),
        (lambda: seen(flying((3, 0, 1), until=-1.0)), 1.0, "another vehicle, by other, was never seen"),
        (lambda: seen(flying((3, 0, 1), until=0.5)), 1.0, None),
        (lambda: seen(flying((3, 0, 1), until=0.5)), 2.0, "was not seen for 1.5 s; accepted: seen within 1 s"),
    ],
)
def test_a_policy_flies_only_among_those_that_are_seen(
    found: Callable[[], Neighbours], now: float, told: str | None
) -> None:
    problem = found().problem(now)
    assert LOST_S == 1.0 and ((problem is None) if told is None else told in str(problem))


def test_a_policy_that_observes_others_needs_their_poses() -> None:
    policy, course = load_policy(policy_file("hover")), SwapRoute().course(Shape(0.05, 0.12), 1 / 30)
    with pytest.raises(
        ValueError, match=r"the policy observes the 2 nearest other vehicles; accepted: with a pose .*, at most 0.1"
    ):
        Runtime.of(policy, course, load_vehicle("vis_r"), imu=True)
