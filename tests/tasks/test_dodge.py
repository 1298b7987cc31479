"""Dodging balls: the throws, what they hit, and the distance at which they pass."""

import math
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import e2efly
from e2efly.config import BPTTConfig, EnvConfig, RewardConfig
from e2efly.environment import Env, EnvState, random_key
from e2efly.runs.rundir import RunDirectory
from e2efly.simulation.physics import State
from e2efly.simulation.scenes.scene import gaps
from e2efly.tasks.dodge import DodgeConfig
from e2efly.tasks.dodge.goal import DodgeMemory, DodgeRoute
from e2efly.tasks.dodge.pilot import BACK, HASTE, HOMING
from e2efly.tasks.dodge.world import REACTION, Dodge, launch
from e2efly.tasks.task import Flier, Shape, at_rest
from e2efly.vehicles.gravity import GRAVITY

SHAPE = Shape(0.05, 0.12)
PERIOD, CHECKS = 1 / 30, 7
LATER, NOW = jnp.zeros(1, bool), jnp.ones(1, bool)
N = 2000
SHORT = BPTTConfig(envs=32, horizon=48, learning_rate=6e-3, learning_rate_end=1e-3, average=0.9)


def make(**changes: Any) -> Dodge:
    return Dodge(DodgeConfig(**changes), SHAPE, PERIOD, CHECKS)


def one(release: Any, velocity: Any, since: float, size: float = 0.12) -> DodgeMemory:
    """A world with one throw, as far back as time 0."""
    release, velocity, fall = (np.array([[x]], float) for x in (release, velocity, (0.0, 0.0, -GRAVITY)))
    parts = {"centre": release - since * velocity + since**2 / 2 * fall, "velocity": velocity - since * fall}
    given = {name: jnp.asarray(x, jnp.float32) for name, x in parts.items()}
    return DodgeMemory(jnp.zeros(1), jnp.full((1, 1), since), size=jnp.full((1, 1), size), failed=LATER, **given)


def still(*place: float) -> State:
    return at_rest(jnp.array([place]))


def step(task: Dodge, memory: DodgeMemory, state: State, time: float, over: jax.Array = LATER) -> tuple[Any, Any]:
    return task.advance(memory, state, state, jnp.full(1, time), over)


@pytest.fixture(scope="module")
def throws() -> dict[str, np.ndarray]:
    """Many random throws, as reports tell them."""
    task = make()
    _, memory = jax.jit(Dodge.start, static_argnums=2)(task, random_key(3), N)
    return {"yaw": np.asarray(memory.yaw)} | {k: np.asarray(v, float) for k, v in task.drawn(memory).items()}


@pytest.mark.parametrize("rise", [-0.5, 0.0, 1.0])
def test_a_ball_flies_through_the_point_that_it_is_aimed_at(rise: float) -> None:
    release, aim, speed = np.array([4.0, 1.0, 2.0 + rise]), np.array([0.1, -0.2, 2.0]), 8.0
    velocity, time = (np.asarray(x, float) for x in launch(jnp.asarray(release), jnp.asarray(aim), jnp.asarray(speed)))
    assert np.linalg.norm(velocity) == pytest.approx(speed, rel=1e-4)
    position, moving = release.copy(), velocity.copy()
    for _ in range(1000):  # Newton's law in small steps, semi-implicit about the middle
        moving[2] -= GRAVITY * time / 2000
        position += moving * time / 1000
        moving[2] -= GRAVITY * time / 2000
    np.testing.assert_allclose(position, aim, atol=2e-3)
    assert time < 0.75  # the flatter of the two ways


def test_throws_are_as_they_are_said_to_be(throws: dict[str, np.ndarray]) -> None:
    c, since = DodgeConfig(), throws["throw_time_s"]
    np.testing.assert_allclose(np.linalg.norm(throws["throw_velocity_m_s"], axis=-1), 8.0, rtol=1e-3)
    away = throws["throw_from_m"] - np.asarray(c.target)
    level = np.hypot(away[..., 0], away[..., 1])
    for found, (low, high) in (
        (level, c.distance), (away[..., 2], c.rise), (throws["ball_radius_m"], c.size), (since[:, 0], c.first),
        (np.diff(since, axis=1), c.pause),
    ):  # fmt: skip
        slack = 0.03 * (high - low)
        assert low - 1e-3 <= found.min() < low + slack
        assert high - slack < found.max() <= high + 1e-3
    bearing = np.arctan2(away[..., 1], away[..., 0]) - throws["yaw"][:, None]
    bearing = np.abs((bearing + np.pi) % (2 * np.pi) - np.pi)
    assert 0.98 * c.sector < bearing.max() <= c.sector + 1e-3
    assert np.abs(throws["yaw"]).max() > 3.1  # from any side


def test_every_throw_is_aimed_at_the_place_with_some_scatter(throws: dict[str, np.ndarray]) -> None:
    """The ballistic formula, here in NumPy: how near each ball comes to the vehicle's place."""
    c, t = DodgeConfig(), np.linspace(0.0, 0.8, 801)[:, None, None, None]
    path = throws["throw_from_m"] + t * throws["throw_velocity_m_s"] - t**2 / 2 * np.array([0.0, 0.0, GRAVITY])
    nearest = np.linalg.norm(path - np.asarray(c.target), axis=-1).min(0)
    assert nearest.max() <= c.scatter + 0.01
    assert nearest.max() > 0.9 * c.scatter
    assert nearest.min() < 0.1 * c.scatter


def test_who_only_hovers_is_hit_by_most() -> None:
    task = make(throws=1)
    _, memory = task.start(random_key(5), N)
    state = at_rest(jnp.broadcast_to(jnp.asarray(task.config.target), (N, 3)))

    def fly(memory: DodgeMemory, time: jax.Array) -> tuple[DodgeMemory, None]:
        moved, _ = task.advance(memory, state, state, jnp.full(N, time), jnp.zeros(N, bool))
        return moved, None

    moved, _ = jax.lax.scan(fly, memory, PERIOD * (1 + jnp.arange(110)))
    assert 0.85 < float(jnp.mean(moved.failed)) < 1.0


def test_a_ball_in_the_air_is_where_newton_says_for_scene_and_observation() -> None:
    task, memory = make(shows_ball=True), one((4.0, 0.5, 2.0), (-7.5, 0.0, 2.5), since=1.0)
    age = task.config.ball_age
    for later in (0.0, 0.2, 0.45):
        t = later + 1.0
        path = np.array([4.0 - 7.5 * later, 0.5, 2.0 + 2.5 * later - GRAVITY * later**2 / 2])
        place = task.scene(memory).at(jnp.full(1, t)).solids["sphere"].centre[0, 0]
        np.testing.assert_allclose(place, path, atol=1e-4)
        shown = task.observe(memory, jnp.full(1, t + age + 1e-4), still(0.3, 0.2, 2.0))[0, 6:]
        np.testing.assert_allclose(shown[:3], path - [0.3, 0.2, 2.0], atol=2e-3)
        np.testing.assert_allclose(shown[3:], [-7.5, 0.0, 2.5 - GRAVITY * later], atol=2e-3)


def test_nobody_sees_a_ball_before_its_throw() -> None:
    task, memory = make(shows_ball=True), one((4.0, 0.0, 2.0), (-8.0, 0.0, 2.5), since=1.0)
    place = jnp.array([[4.0, 0.0, 2.0]])
    assert float(gaps(task.scene(memory), place, jnp.full(1, 0.99))[0, 1]) > 100
    assert float(gaps(task.scene(memory), place, jnp.full(1, 1.001))[0, 1]) < 0
    for time in (0.99, 1.0 + 0.9 * task.config.ball_age, 2.1):  # too early for its age, and long past
        assert not task.observe(memory, jnp.full(1, time), still(0.0, 0.0, 2.0))[0, 6:].any()
    assert make().observe(memory, jnp.full(1, 1.2), still(0.0, 0.0, 2.0)).shape == (1, 6)


def test_a_ball_that_passes_through_within_one_step_strikes() -> None:
    """At 30 m/s it is a metre before the vehicle at one end of the step, and behind it at the other."""
    at = 1.0 + 2 * PERIOD
    fast = one((1.5, 0.0, 2.0), (-30.0, 0.0, 0.0), since=1.0, size=0.1)
    task, state = make(ready=5.0), still(0.0, 0.0, 2.0)
    ends = [np.asarray(gaps(task.scene(fast), state.position, jnp.full(1, t)))[0, 1] for t in (at - PERIOD, at)]
    assert min(ends) > 0.12
    assert step(task, fast, state, at)[1].crashed[0]
    wide = one((1.5, 0.3, 2.0), (-30.0, 0.0, 0.0), since=1.0, size=0.1)
    assert not step(task, wide, state, at)[1].crashed[0]


def test_success_needs_all_of_it() -> None:
    task, memory = make(), one((4.0, 3.0, 2.0), (-8.0, 0.0, 0.0), since=1.0)
    here, away = still(0.1, 0.0, 2.0), still(0.4, 0.0, 2.0)
    for before, at_end, good in ((here, here, True), (away, here, False), (here, away, False)):
        moved, out = step(task, memory, before, 1.0 + PERIOD / 2)
        assert bool(out.terminated[0]) == bool(moved.failed[0]) == (before is away)
        _, out = step(task, moved, at_end, 7.5, NOW)
        assert bool(out.success[0]) == good
    assert not step(task, memory, here, 7.0)[1].success[0]  # the time is not over
    lenient, (moved, out) = make(collisions_end=False), step(make(collisions_end=False), memory, away, 1.0 + PERIOD / 2)
    assert bool(out.crashed[0])
    assert not out.terminated[0]
    assert not step(lenient, moved, here, 7.5, NOW)[1].success[0]
    for place in ((3.2, 0.0, 2.0), (0.0, 0.0, 0.04)):  # the fence, and the ground
        assert step(lenient, memory, still(*place), 0.5)[1].terminated[0]


@pytest.mark.usefixtures("x64")
def test_the_gradient_of_the_passing_distance_against_differences() -> None:
    task, rng, h = make(), np.random.default_rng(0), 1e-5
    throws = jax.tree.map(lambda x: jnp.asarray(x, jnp.float64), task.start(random_key(1), 6)[1])
    for k in range(2):
        time = throws.since[:, k] + 0.52
        ends = tuple(jnp.asarray(rng.normal([0.0, 0.0, 2.0], 0.1, (6, 3))) for _ in range(2))
        ways = tuple(jnp.asarray(rng.normal(size=(6, 3))) for _ in range(2))

        def gap(ends: Any, time: jax.Array = time, k: int = k) -> jax.Array:
            first, last = map(at_rest, ends)
            return jnp.sum(task.passing(throws, first, last, time)[:, k])

        gradient = jax.grad(gap)(ends)
        there, back = (gap(tuple(x + s * h * way for x, way in zip(ends, ways, strict=True))) for s in (1, -1))
        along = sum(float(jnp.sum(g * way)) for g, way in zip(gradient, ways, strict=True))
        assert abs(along) > 0.1
        assert along == pytest.approx(float(there - back) / (2 * h), rel=1e-4)


def test_the_passing_distance_is_that_of_many_points_of_the_step() -> None:
    task, n = make(), 500
    _, memory = task.start(random_key(2), n)
    rng, time = np.random.default_rng(1), memory.since[:, 0] + 0.5
    states = [at_rest(jnp.asarray(rng.normal([0, 0, 2], 0.2, (n, 3)), jnp.float32)) for _ in range(2)]
    found = np.asarray(task.passing(memory, *states, time))[:, 0]
    dense = np.full(n, np.inf)
    for share in np.linspace(0, 1, 101):
        place = states[0].position + share * (states[1].position - states[0].position)
        each = gaps(task.scene(memory), place, time - PERIOD * (1 - share))[:, 1] - SHAPE.radius
        dense = np.minimum(dense, np.asarray(each))
    np.testing.assert_allclose(found, dense, atol=5e-3)
    assert (found < 0).mean() > 0.1


def test_the_expert_comes_back_and_goes_across_the_way_of_a_ball() -> None:
    task, memory = make(), one((4.0, 0.0, 2.0), (-7.6, 0.0, 2.45), since=1.0)
    for time, position in ((1.0 + 0.9 * REACTION, (0.0, 0.2, 2.0)), (2.0, (0.0, 0.2, 2.0)), (1.2, (0.0, 0.9, 2.0))):
        flier = Flier.usual(jnp.array([position]), jnp.zeros((1, 3)), time)
        velocity, yaw = task.expert(memory, flier)
        np.testing.assert_allclose(velocity, [[0.0, -min(BACK * position[1], HOMING), 0.0]], atol=1e-4)
        np.testing.assert_array_equal(yaw, memory.yaw)
    flier = Flier.usual(jnp.array([[0.0, 0.02, 2.0]]), jnp.zeros((1, 3)), 1.0 + 1.1 * REACTION)
    (velocity,), _ = task.expert(memory, flier)
    flying = task.flying(memory, jnp.full(1, 1.0 + 1.1 * REACTION))[1][0, 0]
    assert float(jnp.linalg.norm(velocity)) == pytest.approx(HASTE, rel=1e-3)
    assert abs(float(velocity @ flying)) < 0.05 * HASTE * 8.0


def test_the_expert_is_not_struck_in_the_simulator() -> None:
    """And who hovers is: the same throws, the vehicle of the file."""
    config = e2efly.preset("dodge", "bptt", "nominal")
    env = Env.of(config.task, RewardConfig({"imitate": 1.0}), EnvConfig())
    state, _ = jax.jit(env.reset, static_argnums=1)(random_key(5), 64)

    def fly(state: EnvState, _: None) -> tuple[EnvState, jax.Array]:
        after, out = env.step(state, env.expert_action(state), restart=False)
        return after, out.success

    _, success = jax.jit(lambda s: jax.lax.scan(fly, s, None, length=env.episode_steps))(state)
    assert float(jnp.mean(success[-1])) > 0.9


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"speed": (5.0, 8.0)},
            r"task.speed is \(5.0, 8.0\); accepted: at least 7.\d+ m/s, with which a ball comes 4.5 m",
        ),
        ({"episode_s": 4.0}, r"task.episode_s is 4.0; accepted: at least 5.3 s, the time of the last throw"),
        ({"throws": 0}, r"task.throws is 0; accepted: at least 1"),
        ({"target": (0.0, 0.0, 0.0)}, r"task.target is \(0.0, 0.0, 0.0\); accepted: a place"),
    ],
)
def test_options_that_do_not_fit_are_refused_by_name(changes: dict[str, Any], said: str) -> None:
    DodgeConfig().check(30.0, 0.05)
    with pytest.raises(ValueError, match=said):
        DodgeConfig(**changes).check(30.0, 0.05)


def test_in_flight_it_hovers_and_looks_where_balls_may_come_from() -> None:
    course = DodgeRoute(target=(1.0, 0.0, 1.2), thrower=(1.0, 3.0)).course(SHAPE, PERIOD)
    body = State(*(np.asarray(x) for x in (course.start[None], np.zeros((1, 3)), np.eye(1, 4), np.zeros((1, 3)), 0)))
    shown = course.goal.observe(course.memory, np.zeros(1), body)
    np.testing.assert_allclose(shown, [[0, 0, 0, 0, 4, 0]], atol=1e-9)
    assert course.heading == pytest.approx(math.pi / 2)
    _, outcome = course.goal.advance(course.memory, body, body, np.zeros(1), np.zeros(1, bool))
    assert not outcome.crashed[0]


@pytest.mark.whole
def test_a_short_training_improves(tmp_path: Path) -> None:
    """Told of the ball, with the vehicle of the file: it comes nearer to the expert."""
    e2efly.train(
        "dodge", "bptt", preset_name="told", out=tmp_path / "run", options=SHORT, steps=245_760, chunk=40,
        eval_episodes=20,
    )  # fmt: skip
    rows = RunDirectory(tmp_path / "run").rows()
    first, last = (np.mean([row["reward/imitate"] for row in part]) for part in (rows[8:24], rows[-16:]))
    assert first < 0
    assert last > 0.6 * first
