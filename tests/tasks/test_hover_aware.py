"""Perception-aware hovering: the pixel and its velocity, and when all is well."""

import dataclasses
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import CameraConfig
from e2efly.control.vectors import Quat, Vec3
from e2efly.environment import random_key
from e2efly.simulation import rewards
from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import from_euler, normalize
from e2efly.simulation.scenes.camera import look, mount
from e2efly.simulation.scenes.scene import OBSTACLE
from e2efly.tasks.hover_aware import HoverAwareConfig
from e2efly.tasks.hover_aware.goal import OUTSIDE, HoverAwareMemory
from e2efly.tasks.hover_aware.world import HoverAware
from e2efly.tasks.task import Shape, at_rest

SHAPE = Shape(0.05, 0.12)
PERIOD = 1 / 30
LATER, NOW = jnp.zeros(1, bool), jnp.ones(1, bool)
LEVEL = jnp.array([[1.0, 0.0, 0.0, 0.0]])


advance = jax.jit(HoverAware.advance)


def make(**changes: Any) -> HoverAware:
    return HoverAware(HoverAwareConfig(**changes), SHAPE, PERIOD)


def ball(place: Any, rate: float = 0.0, held: float = 0.0) -> HoverAwareMemory:
    """What to look at, at (x, y, z) from the world's origin, and turning about it."""
    x, y, z = (jnp.array([v], jnp.float32) for v in place)
    away, angle = jnp.hypot(x, y), jnp.arctan2(y, x)
    centre = jnp.stack([0 * x, 0 * x, z], axis=-1)
    return HoverAwareMemory(centre, away, angle, jnp.array([rate]), jnp.zeros(1), jnp.array([held]))


def turned(roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0) -> jax.Array:
    return from_euler(*(jnp.array([x]) for x in (roll, pitch, yaw)))


@pytest.mark.parametrize(
    ("point", "pixel"),
    [
        ((4.0, 0.0, 0.0), (0.0, 0.0)),
        ((4.0, -4.0 * math.tan(0.5), 0.0), (1.0, 0.0)),  # to the right: the image's right edge
        ((4.0, 4.0 * math.tan(0.5), 0.0), (-1.0, 0.0)),
        ((4.0, 0.0, -4.0 * math.tan(0.4)), (0.0, 1.0)),  # down: its lower edge
        ((-4.0, 0.1, 0.0), (OUTSIDE, OUTSIDE)),  # behind
        ((0.01, 4.0, 0.0), (-OUTSIDE, 0.0)),  # far to the left
    ],
)
def test_pixels_by_hand(point: Any, pixel: Any) -> None:
    task = make(fov=(1.0, 0.8))
    np.testing.assert_allclose(task.pixel(jnp.zeros((1, 3)), LEVEL, jnp.array([point])), [pixel], atol=1e-5)


def test_the_pixel_is_where_a_rendered_camera_sees_the_ball() -> None:
    task = make(camera_pitch=0.2, camera_position=(0.1, 0.02, 0.03))
    c = task.config
    memory, state = (
        ball((4.0, 0.8, 2.6)),
        dataclasses.replace(at_rest(jnp.array([[0.0, 0, 3]])), quaternion=turned(0.1, 0.1, 0.3)),
    )
    camera = CameraConfig("label", width=96, height=64, fov=c.fov, pitch=c.camera_pitch, position=c.camera_position)
    image = np.asarray(
        look(camera, task.scene(memory).at(jnp.zeros(1)), mount(camera, 1), state.position, state.quaternion)[0]
    )
    rows, columns = np.nonzero(image == OBSTACLE)
    assert len(rows) > 8
    seen = [(columns.mean() + 0.5) / 96 * 2 - 1, (rows.mean() + 0.5) / 64 * 2 - 1]
    wanted = task.pixel(state.position, state.quaternion, task.look_at(memory, jnp.zeros(1)))[0]
    np.testing.assert_allclose(seen, wanted, atol=0.02)


@pytest.mark.usefixtures("x64")
def test_the_pixels_velocity_against_differences() -> None:
    task = make(camera_pitch=0.2, camera_position=(0.1, 0.02, 0.03))
    double = lambda tree: jax.tree.map(lambda x: x.astype(jnp.float64) if x.dtype == jnp.float32 else x, tree)  # noqa: E731
    memory = double(ball((4.0, 1.0, 2.5), rate=0.4))
    state = double(
        dataclasses.replace(
            at_rest(jnp.array([[0.2, -0.1, 3.0]])),
            velocity=jnp.array([[1.0, -0.5, 0.3]]),
            quaternion=turned(0.1, -0.2, 0.3),
            body_rate=jnp.array([[0.5, -1.0, 0.8]]),
        )
    )
    time, h = jnp.array([0.4], jnp.float64), 1e-5

    def later(dt: float) -> State:
        turning = Quat.of(state.quaternion).derivative(Vec3.of(state.body_rate)).stack()
        return dataclasses.replace(
            state,
            position=state.position + dt * state.velocity,
            quaternion=normalize(state.quaternion + dt * turning),
        )

    pixel, velocity = task.projection(memory, state, time)
    ends = [task.projection(memory, later(dt), time + dt)[0] for dt in (h, -h)]
    assert np.abs(pixel).max() < 1
    assert np.abs(velocity).min() > 0.1
    np.testing.assert_allclose(velocity, (ends[0] - ends[1]) / (2 * h), rtol=1e-6)


def signals(task: HoverAware, memory: HoverAwareMemory, state: State) -> dict[str, jax.Array]:
    return advance(task, memory, state, state, jnp.zeros(1), LATER)[1].signals


@pytest.mark.parametrize("place", [(-4.0, 0.0, 3.0), (0.0, 3.0, 3.0), (0.0, 0.0, 3.0), (4.0, 0.0, 3.0)])
def test_ori3_and_its_gradient_are_finite_everywhere(place: Any) -> None:
    """Behind, abeam, in the camera itself, in its middle."""
    task, memory = make(), ball(place)

    @jax.jit
    def term(quaternion: jax.Array, position: jax.Array, velocity: jax.Array, rate: jax.Array) -> jax.Array:
        s = signals(task, memory, State(position, velocity, quaternion, rate, jnp.zeros((1, 4))))
        return rewards.ori3(s["pixel"], s["pixel_velocity"])[0]

    given = (LEVEL, jnp.array([[0.0, 0.0, 3.0]]), jnp.array([[0.5, 0.1, 0.2]]), jnp.array([[0.3, 0.2, 0.4]]))
    value, gradients = jax.value_and_grad(term, argnums=(0, 1, 2, 3))(*given)
    assert all(np.isfinite(x).all() for x in (value, *gradients))
    if place[0] > 0:
        assert float(value) > 0.3
        assert np.abs(gradients[3]).max() > 0.01  # turning is what moves the image
    else:
        assert float(value) < 1e-6


def test_all_must_be_well_for_the_last_second() -> None:
    task = make()
    here, away = (at_rest(jnp.array([[x, 0.0, 3.0]])) for x in (0.05, 0.2))
    aside = dataclasses.replace(here, quaternion=turned(yaw=0.3))  # 0.33 of the half image
    memory = ball((4.0, 0.0, 3.0))
    for i in range(29):
        memory, out = advance(task, memory, here, here, (i + 1) * jnp.array([PERIOD]), LATER)
    assert float(memory.held[0]) == pytest.approx(29 * PERIOD, rel=1e-4)
    for state, good in ((here, True), (away, False), (aside, False)):
        after, out = advance(task, memory, here, state, jnp.array([1.0]), NOW)
        assert bool(out.success[0]) == good
        assert bool(after.held[0] > 0) == good
    late = dataclasses.replace(memory, held=memory.held - PERIOD)
    assert not advance(task, late, here, here, jnp.array([1.0]), NOW)[1].success[0]
    assert not advance(task, memory, here, here, jnp.array([1.0]), LATER)[1].terminated[0]


@pytest.mark.parametrize("place", [(0.0, 6.1, 3.0), (0.0, 0.0, 0.04), (3.7, 0.0, 3.0)])
def test_the_fence_the_ground_and_the_ball_end_it(place: Any) -> None:
    state = at_rest(jnp.array([place]))
    out = advance(make(), ball((4.0, 0.0, 3.0)), state, state, jnp.zeros(1), NOW)[1]
    assert (bool(out.terminated[0]), bool(out.crashed[0]), bool(out.success[0])) == (True, True, False)


def test_what_to_look_at_circles_slowly_around_where_to_hover() -> None:
    task, c, n = make(), HoverAwareConfig(), 300
    state, memory = task.start(random_key(1), n)
    again, _ = task.start(random_key(1), n)
    other, _ = task.start(random_key(2), n)
    np.testing.assert_array_equal(state.position, again.position)
    assert not np.array_equal(state.position, other.position)
    start, later = (np.asarray(task.look_at(memory, jnp.full(n, t)) - jnp.asarray(c.target)) for t in (0.0, 2.0))
    radius = np.hypot(*start[:, :2].T)
    assert c.distance[0] - 1e-3 <= radius.min() < c.distance[0] + 0.05
    assert c.distance[1] + 1e-3 >= radius.max() > c.distance[1] - 0.05
    np.testing.assert_allclose(np.hypot(*later[:, :2].T), radius, rtol=1e-4)
    turn = np.angle(np.exp(1j * (np.arctan2(later[:, 1], later[:, 0]) - np.arctan2(start[:, 1], start[:, 0])))) / 2.0
    assert -c.turn_rate - 1e-3 <= turn.min() < -0.9 * c.turn_rate
    assert c.turn_rate + 1e-3 >= turn.max() > 0.9 * c.turn_rate
    assert np.abs(start[:, 2]).max() <= c.elevation + 1e-5


def test_the_observation_and_the_wanted_heading() -> None:
    task = make()
    memory = ball((4.0, 4.0, 3.2), rate=0.5 * math.pi)
    state = at_rest(jnp.array([[1.0, 0.0, 2.0]]))
    np.testing.assert_allclose(task.observe(memory, jnp.ones(1), state), [[-1, 0, 1, -5, 4, 1.2]], atol=1e-5)
    np.testing.assert_allclose(task.desired_yaw(memory, state), [math.atan2(4, 3)], atol=1e-5)
