"""Racing at a commanded speed: the tracks of rooms, what an episode draws, and the options of a flight."""

from pathlib import Path

import jax
import numpy as np
import pytest

from e2efly.config.domain import outside, track_domain
from e2efly.courses.defaults import ROOMS, TRACKS
from e2efly.courses.gates import FRAME
from e2efly.courses.tracks import load_track, track_names
from e2efly.environment import random_key
from e2efly.policy.goal import Shape
from e2efly.policy.odometry import Odometry
from e2efly.tasks.race.goal import RaceRoute
from e2efly.tasks.race_speed import RaceSpeedConfig
from e2efly.tasks.race_speed.goal import QUICKEST, SLOW, RaceSpeedRoute
from e2efly.tasks.race_speed.world import RaceSpeed
from e2efly.tasks.task import make_task

SHAPE = Shape(0.05, 0.12)
APART = 0.4
"""Smallest distance of gates' middles, and of starts, from walls and ceiling, m."""


def test_the_default_tracks_are_those_that_are_shipped() -> None:
    assert sorted(TRACKS) == track_names()


@pytest.mark.parametrize("name", ROOMS)
def test_a_track_of_a_room_stands_in_the_room(name: str) -> None:
    """Its frames, and a ball about its start in which a race begins."""
    track, (side, ceiling) = load_track(name), ROOMS[name]
    radius = RaceSpeedConfig.position
    low, high = np.array([-side / 2, -side / 2, 0.0]), np.array([side / 2, side / 2, ceiling])
    half = track.opening / 2 + FRAME
    reach = np.stack([abs(np.sin(track.yaw)) * half[:, 0], abs(np.cos(track.yaw)) * half[:, 0], half[:, 1]], axis=-1)
    for near, far in ((track.position - reach, track.position + reach), (track.start - radius, track.start + radius)):
        assert np.all(near > low + 0.2)
        assert np.all(far < high - 0.2)
    for point in (*track.position, track.start):
        assert np.all(point > low + APART)
        assert np.all(point < high - APART)


def test_an_episode_draws_a_track_a_speed_and_where_its_gates_are() -> None:
    """All of it lies in the domain that the contract of a policy states."""
    config = RaceSpeedConfig()
    race = make_task(config, SHAPE, 1 / 30)
    assert isinstance(race, RaceSpeed)
    state, memory = jax.tree.map(np.asarray, jax.jit(RaceSpeed.start, static_argnums=2)(race, random_key(0), 200))
    assert (2.0 <= memory.speed.min() < 2.2, 11.8 < memory.speed.max() <= 12.0) == (True, True)
    assert set(memory.tracks.count) == {3, 4, 5, 6}
    for i in range(40):
        assert outside(config.domain(), track_domain(memory.tracks.track(i))) == ()
    assert np.all(np.linalg.norm(state.position - memory.tracks.gates.start, axis=-1) <= config.position + 1e-5)


def test_laps_of_an_open_track_are_refused() -> None:
    with pytest.raises(ValueError, match="laps is 2; accepted: 0 or 1, as not all of the tracks are closed"):
        make_task(RaceSpeedConfig(laps=2), SHAPE, 1 / 30)


def test_a_flight_is_told_a_speed(tmp_path: Path) -> None:
    """A slow one, unless another is given; and a file of what an episode has drawn gives the same flight."""
    course = RaceSpeedRoute().course(SHAPE, 1 / 30)
    body = Odometry(0.0, course.start, np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3)).batch
    shown = course.goal.observe(course.memory, np.zeros(1), body)[0]
    assert SLOW == 3.0
    assert np.linalg.norm(shown[-3:]) == pytest.approx(SLOW, rel=1e-3)
    ahead = load_track("four_gates").position[0] + [0.3, 0.0, 0.0] - course.start  # 0.3 m behind the gate
    np.testing.assert_allclose(shown[-3:], SLOW * ahead / np.linalg.norm(ahead), rtol=1e-3)
    close = RaceSpeedRoute(track="room_4", speed=12.0).course(SHAPE, 1 / 30)  # no faster than the gates allow
    asked = close.goal.observe(close.memory, np.zeros(1), body)[0, -3:]
    assert np.linalg.norm(asked) == pytest.approx(QUICKEST * 1.905, rel=1e-3)
    fast = RaceSpeedRoute(track="room_6", speed=5.0, laps=2)
    assert fast.notes == ["It is told to fly at 5 m/s (goal.speed)."]
    again = RaceSpeedRoute.drawn(fast.course(SHAPE, 1 / 30), tmp_path / "drawn.toml")
    assert (again.speed, again.laps) == (5.0, 2)
    np.testing.assert_allclose(load_track(again.track).position, load_track("room_6").position, atol=1e-6)
    trained = RaceSpeedConfig().domain()
    assert outside(trained, fast.domain()) == ()
    assert outside(trained, RaceSpeedRoute(speed=15.0).domain()) == ("speed is 15 m/s; trained for 2 to 12 m/s",)


def test_a_policy_that_obeys_no_speed_is_told_none() -> None:
    assert (RaceRoute().instead, RaceRoute(speed=3.0).instead) == (None, "race_speed")
    with pytest.raises(ValueError, match=r"goal.speed is 3; accepted: None, as this policy flies as fast as it can"):
        RaceRoute(speed=3.0).course(SHAPE, 1 / 30)
