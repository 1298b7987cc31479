"""A race over whole laps, strange crossings, and what a track file must say."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.courses.defaults import ROOMS
from e2efly.courses.tracks import load_track, track_names
from e2efly.environment import random_key
from e2efly.tasks.hover import HoverConfig
from e2efly.tasks.race import RaceConfig
from e2efly.tasks.race.world import Race
from e2efly.tasks.race_speed import RaceSpeedConfig
from e2efly.tasks.task import Outcome, Shape, at_rest, make_task
from e2efly.tasks.track import TrackConfig
from e2efly.tasks.track.world import Track

SHAPE = Shape(0.05, 0.12)


def cross(race: Race, memory: np.ndarray, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, Outcome]:
    """Rows of steps from a to b."""
    n, none = len(memory), jnp.zeros(len(memory), bool)
    states = (at_rest(jnp.asarray(x, jnp.float32).reshape(n, 3)) for x in (a, b))
    after, out = race.advance(jnp.asarray(memory, jnp.int32), *states, jnp.zeros(n), none)
    return np.asarray(after), out


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("name", track_names())
@pytest.mark.parametrize("laps", [1, 2, 0])
def test_a_whole_race(name: str, laps: int) -> None:
    """Through the middle of every gate in order: each is a goal, nothing is struck, and the last one is the end.

    A closed track has none where laps is 0.
    """
    track = load_track(name)
    if laps > 1 and not track.closed:
        with pytest.raises(ValueError, match=f"laps is 2; accepted: 0 or 1, as track '{name}' is not closed"):
            Race.of(RaceConfig(track=name, laps=laps), SHAPE)
        return
    race = Race.of(RaceConfig(track=name, laps=laps), SHAPE)
    order = np.tile(np.arange(race.count), max(laps, 1))
    forward = 0.2 * np.stack([np.cos(track.yaw), np.sin(track.yaw), 0 * track.yaw], -1)[order]
    after, out = cross(race, np.arange(len(order)), track.position[order] - forward, track.position[order] + forward)
    last = (np.arange(len(order)) == len(order) - 1) & (laps > 0 or not track.closed)
    np.testing.assert_array_equal(after, np.arange(len(order)) + 1)
    np.testing.assert_array_equal(out.arrived, True)
    np.testing.assert_array_equal(out.success, last)
    np.testing.assert_array_equal(out.terminated, last)
    np.testing.assert_array_equal(out.crashed, False)


@pytest.mark.parametrize("name", track_names())
def test_the_policy_is_shown_the_next_two_gates(name: str) -> None:
    track = load_track(name)
    race = Race.of(RaceConfig(track=name), SHAPE)
    n = race.count
    shown = np.asarray(race.targets(jnp.arange(n), jnp.zeros(n)))
    np.testing.assert_allclose(shown[:, 0], track.position, rtol=1e-6)
    np.testing.assert_allclose(shown[:-1, 1], track.position[1:], rtol=1e-6)
    straight_on = track.position[-1] + 3 * np.array([np.cos(track.yaw[-1]), np.sin(track.yaw[-1]), 0])
    np.testing.assert_allclose(shown[-1, 1], track.position[0] if track.closed else straight_on, rtol=1e-5, atol=1e-6)


def test_crossings() -> None:
    race = Race.of(RaceConfig(), SHAPE)  # gate 0 at (4, 4, 1) along x, opening 1 m, frame 0.1 m, sphere 0.12 m
    steps = {
        "over the frame, gate 0 is not next": (1, [3.9, 4.0, 1.8], [4.1, 4.0, 1.8], False, 1),
        "through a gate that is not next": (1, [3.9, 4.0, 1.0], [4.1, 4.0, 1.0], False, 1),
        "frame of a gate that is not next": (1, [3.9, 4.0, 1.55], [4.1, 4.0, 1.55], True, 1),
        "frame backward": (0, [4.1, 4.6, 1.0], [3.9, 4.6, 1.0], True, 0),
        "backward through the opening": (0, [4.1, 4.0, 1.0], [3.9, 4.0, 1.0], False, 0),
        "slanted: inside where it crosses the plane": (0, [3.5, 3.2, 1.0], [4.5, 4.8, 1.0], False, 1),
        "slanted: inside only where it ends": (0, [3.9, 4.9, 1.0], [5.0, 4.0, 1.0], True, 0),
        "not yet": (0, [3.5, 4.0, 1.0], [3.9, 4.0, 1.0], False, 0),
        "beyond the fence of 10 m": (0, [-6.0, 4.0, 1.0], [-6.2, 4.0, 1.0], True, 0),
        "along the plane": (0, [4.0, 3.8, 1.0], [4.0, 3.9, 1.0], False, 0),
        "off the middle": (0, [3.9, 4.2, 1.1], [4.1, 4.2, 1.1], False, 1),
        "into the left side": (0, [3.9, 4.5, 1.1], [4.1, 4.5, 1.1], True, 0),
        "beside it, left": (0, [3.9, 6.0, 1.1], [4.1, 6.0, 1.1], True, 0),
        "beside it, right": (0, [3.9, -3.0, 1.1], [4.1, -3.0, 1.1], True, 0),
        "the sphere fits": (0, [3.9, 4.37, 1.0], [4.1, 4.37, 1.0], False, 1),
        "its centre fits, and the sphere does not": (0, [3.9, 4.39, 1.0], [4.1, 4.39, 1.0], True, 0),
        "backward beside it": (0, [4.1, 6.0, 1.1], [3.9, 6.0, 1.1], False, 0),
        "frame of the gate two before, backward": (2, [4.1, 4.55, 1.0], [3.9, 4.55, 1.0], True, 2),
        "the ground": (0, [0.0, 0.0, 0.1], [0.0, 0.0, 0.05], True, 0),
    }
    memory, a, b, crashed, expected = (list(column) for column in zip(*steps.values(), strict=True))
    after, out = cross(race, np.array(memory), np.array(a), np.array(b))
    assert dict(zip(steps, np.asarray(out.crashed).tolist(), strict=True)) == dict(zip(steps, crashed, strict=True))
    assert dict(zip(steps, after.tolist(), strict=True)) == dict(zip(steps, expected, strict=True))
    np.testing.assert_array_equal(out.terminated, out.crashed)
    assert not np.any(out.success)


def test_starts_are_off_the_ground_and_behind_the_first_gate() -> None:
    for name in track_names():
        radius = RaceSpeedConfig.position if name in ROOMS else RaceConfig.position
        race, track = Race.of(RaceConfig(track=name, position=radius), SHAPE), load_track(name)
        state, memory = race.start(random_key(0), 500)
        assert np.all(np.asarray(memory) == 0)
        assert np.min(state.position[:, 2]) >= SHAPE.feet_height + 0.3 - 1e-6
        ahead = track.position[0] - np.asarray(state.position)
        assert np.min(ahead @ [np.cos(track.yaw[0]), np.sin(track.yaw[0]), 0]) > 0.5
        offset = np.linalg.norm(np.asarray(state.position) - track.start, axis=-1)
        assert offset.max() <= radius + 1e-5


def test_a_track_needs_two_gates(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    for gates in ("[]", "[{ position = [1.0, 0.0, 1.0], yaw = 0.0, opening = [1.0, 1.0] }]", "3"):
        path.write_text(f"closed = false\nstart = {{ position = [0.0, 0.0, 1.0], yaw = 0.0 }}\ngates = {gates}\n")
        with pytest.raises(ValueError, match=r"gates is .*; accepted: a list of at least 2"):
            load_track(str(path))


def test_names_that_are_not_there() -> None:
    for name, told in (("for_gates", "'for_gates'; did you mean 'four_gates'"), ("nowhere.toml", "'nowhere.toml'")):
        with pytest.raises(ValueError, match=rf"unknown track {told}.*path of a \.toml"):
            load_track(name)


def test_hover_has_arrived_once_and_fails_on_the_ground() -> None:
    task = make_task(HoverConfig(), SHAPE, 1 / 30)
    heights = jnp.asarray([3.2, 3.05, 3.0, 0.05, 0.051])
    state = at_rest(jnp.stack([0 * heights, 0 * heights, heights], -1))
    none = jnp.zeros(5, bool)
    held, out = task.advance(jnp.asarray([1.0, 0.0, 0.5, 0.0, 0.0]), state, state, jnp.zeros(5), none)
    np.testing.assert_allclose(held, [0, 1 / 30, 0.5 + 1 / 30, 0, 0], rtol=1e-6)
    np.testing.assert_array_equal(out.arrived, [False, True, False, False, False])
    np.testing.assert_array_equal(out.crashed, [False, False, False, True, False])
    np.testing.assert_allclose(out.error, [0.2, 0.05, 0.0, 2.95, 2.949], atol=1e-6)


@pytest.mark.whole
def test_tracking_fails_beyond_its_fence_and_on_the_ground() -> None:
    task = Track.of(TrackConfig(reference="circle"), SHAPE)
    _, memory = task.start(random_key(0), 3)
    t, none = jnp.full(3, 1.0), jnp.zeros(3, bool)
    position = task.goal(memory, t) + jnp.asarray([[0.0, 0, 2.9], [0, 0, 3.1], [0, 0, -2.96]])
    _, out = task.advance(memory, at_rest(position), at_rest(position), t, none)
    np.testing.assert_array_equal(out.crashed, [False, True, True])
    np.testing.assert_array_equal(out.terminated, out.crashed)
    points = np.asarray(task.targets(memory, t))
    np.testing.assert_allclose(points[:, 0], task.goal(memory, t), atol=1e-5)
    np.testing.assert_allclose(points[:, 7], task.goal(memory, t + 0.7), atol=1e-5)
    assert points.shape == (3, 10, 3)
