"""What each task judges, by hand-made flights; references and tracks."""

import dataclasses
import subprocess
import sys

import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.courses.references import Lissajous
from e2efly.courses.tracks import load_track, track_names
from e2efly.environment import random_key
from e2efly.simulation.physics.rotation import from_euler
from e2efly.tasks import TASKS
from e2efly.tasks.hover import HoverConfig
from e2efly.tasks.hover.world import Hover
from e2efly.tasks.land import LandConfig
from e2efly.tasks.land.world import Land
from e2efly.tasks.task import Outcome, Shape, at_rest
from e2efly.tasks.track import TrackConfig
from e2efly.tasks.track.splines import polynomial
from e2efly.tasks.track.world import Track

SHAPE = Shape(0.05, 0.12)
LATER, NOW = jnp.zeros(1, bool), jnp.ones(1, bool)


@pytest.mark.parametrize("name", track_names())
def test_shipped_tracks_meet_each_gate_from_behind(name: str) -> None:
    track = load_track(name)
    points = np.vstack([track.start, track.position])
    for before, gate, yaw in zip(points, track.position, track.yaw, strict=False):
        assert np.dot(gate - before, [np.cos(yaw), np.sin(yaw), 0]) > 0.5


def land(position: list[float], velocity: list[float], tilt: float) -> Outcome:
    task = Land(LandConfig(), SHAPE)
    state = dataclasses.replace(
        at_rest(jnp.array([position])),
        velocity=jnp.array([velocity]),
        quaternion=from_euler(jnp.array([tilt]), jnp.zeros(1), jnp.zeros(1)),
    )
    return task.advance(jnp.zeros((1, 0)), state, state, jnp.zeros(1), LATER)[1]


@pytest.mark.parametrize(
    ("position", "velocity", "tilt", "ended", "success"),
    [
        ([0.05, 0.05, 0.04], [0.1, 0, -0.3], 0.1, True, True),
        ([0.08, 0.08, 0.04], [0.1, 0, -0.3], 0.1, True, False),  # 0.113 m off
        ([0.05, 0.05, 0.04], [0.4, 0, -0.4], 0.1, True, False),  # 0.57 m/s
        ([0.05, 0.05, 0.04], [0.1, 0, -0.3], 0.3, True, False),  # 17 degrees
        ([0.05, 0.05, -0.01], [0.1, 0, -0.3], 0.1, True, False),  # 6 cm under
        ([0.05, 0.05, 0.06], [0.1, 0, -0.3], 0.1, False, False),  # not there yet
        ([7.0, 0.0, 1.0], [0.0, 0, 0], 0.0, True, False),  # lost
    ],
)
def test_a_touch_is_judged(
    position: list[float], velocity: list[float], tilt: float, ended: bool, success: bool
) -> None:
    out = land(position, velocity, tilt)
    assert (bool(out.terminated[0]), bool(out.success[0])) == (ended, success)


def test_hovering_counts_the_last_second_only() -> None:
    task = Hover(HoverConfig(), SHAPE, 1 / 30)
    there, away = (at_rest(jnp.array([[0.0, 0.0, z]])) for z in (3.05, 3.2))
    memory = jnp.zeros(1)
    for _ in range(29):
        memory, out = task.advance(memory, there, there, jnp.zeros(1), LATER)
    assert not task.advance(memory, away, away, jnp.zeros(1), NOW)[1].success[0]
    _, out = task.advance(memory, there, there, jnp.zeros(1), NOW)
    assert out.success[0]
    assert not task.advance(memory - 1 / 30, there, there, jnp.zeros(1), NOW)[1].success[0]
    far = at_rest(jnp.array([[0.0, 6.1, 3.0]]))
    assert task.advance(memory, far, far, jnp.zeros(1), LATER)[1].terminated[0]


def test_tracking_is_judged_by_the_mean_error_after_it_settled() -> None:
    task = Track.of(TrackConfig(reference="circle", mean_error=0.08), SHAPE)
    _, memory = task.start(random_key(0), 1)
    for time, off in ((1.0, 2.0), (3.0, 0.05), (4.0, 0.10)):
        t = jnp.array([time])
        state = at_rest(task.goal(memory, t) + jnp.array([0.0, 0.0, off]))
        memory, _ = task.advance(memory, state, state, t, LATER)
    t = jnp.array([5.0])
    for off, success in ((0.06, True), (0.2, False)):
        state = at_rest(task.goal(memory, t) + jnp.array([0.0, 0.0, off]))
        assert bool(task.advance(memory, state, state, t, NOW)[1].success[0]) == success


def test_the_lemniscate_reaches_its_speed() -> None:
    t = jnp.linspace(0, 8, 8001)[None]
    p = np.asarray(Lissajous.lemniscate(2.0, 3.0).spline((0.0, 0.0, 3.0), jnp.zeros(1), 23).position(t)[0], np.float64)
    assert np.linalg.norm(np.diff(p, axis=0), axis=-1).max() / 0.001 == pytest.approx(3.0, rel=0.02)


def test_random_polynomials_are_smooth_and_stay_in_their_box() -> None:
    spline = polynomial(random_key(0), (0.0, 0.0, 3.0), 2.0, 2.5, 50, 23)
    t = jnp.broadcast_to(jnp.linspace(0, 10.9, 2000), (50, 2000))
    p = np.asarray(spline.position(t)) - np.array([0, 0, 3.0])
    assert np.abs(p).max() < 3.0
    velocity = np.diff(p, axis=1) / (10.9 / 1999)
    assert 2.0 < np.linalg.norm(velocity, axis=-1).max() < 6.0
    acceleration = np.diff(velocity, axis=1) / (10.9 / 1999)
    assert np.abs(acceleration).max() < 20  # no jumps of the velocity


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("name", list(TASKS))
def test_each_task_starts_in_a_process_that_knows_no_other(name: str) -> None:
    made = f"import jax, e2efly; env = e2efly.make_env({name!r}); n = env.whole(2)"
    code = f"{made}; jax.eval_shape(lambda k: env.reset(k, n), jax.random.key(0))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
