"""The environment: starts, new starts, latency, randomisation, gradients."""

import dataclasses
import math
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import EnvConfig, ForestConfig, ImuConfig, NoiseConfig, RewardConfig, TaskConfig
from e2efly.environment import UNSEEN, Env, numbers_of, random_key
from e2efly.environment.env_state import STARTS
from e2efly.learning.judge import CONFIRMED, REPORTED, WATCHED
from e2efly.runs import presets
from e2efly.simulation.physics.rotation import yaw_pitch_roll
from e2efly.tasks import TASKS
from e2efly.tasks.avoid import AvoidConfig
from e2efly.tasks.hover import HoverConfig
from e2efly.tasks.track import TrackConfig

REWARD = RewardConfig({"prog2": 1.0, "anglev": 0.1})
reset = jax.jit(Env.reset, static_argnums=2)


def make(task: TaskConfig | None = None, **config: Any) -> Env:
    return Env.of(task or HoverConfig(), REWARD, EnvConfig(**config))


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("name", [name for name, task in TASKS.items() if "world" in vars(task)])
def test_starts_are_where_the_task_says(name: str) -> None:
    env = make(TASKS[name].training())
    state, observation = reset(env, random_key(0), 2000)
    v = state.vehicle
    offset = np.asarray(v.position - env.task.goal(state.memory, state.time))
    speed, rate = np.abs(v.velocity), np.abs(v.body_rate)
    angles = np.asarray(yaw_pitch_roll(v.quaternion))
    assert observation.shape == (2000, env.observation_size)
    if name == "hover":
        assert 1.98 < np.abs(offset).max() <= 2.0
        assert 0.98 < speed.max() <= 1.0
        assert 0.98 < rate.max() <= 1.0
        assert 0.51 < np.abs(angles[:, 1:]).max() <= np.pi / 6 + 1e-5
        assert np.abs(angles[:, 0]).max() > 3.1
    if name == "land":
        assert 1.98 < np.abs(offset[:, :2]).max() <= 2.0
        assert 1.0 - 1e-6 <= offset[:, 2].min() < 1.02
        assert 2.98 < offset[:, 2].max() <= 3.0 + 1e-6
        assert 0.49 < speed.max() <= 0.5
    if name == "track":
        assert 0.98 < np.linalg.norm(offset, axis=-1).max() <= 1 + 1e-5
        assert 0.49 < speed.max() <= 0.5
    if name == "race":
        from_start = np.linalg.norm(v.position - np.array([0.0, 0.0, 1.5]), axis=-1)
        assert 0.98 < from_start.max() <= 1 + 1e-5
        assert speed.max() == 0
    if name == "hover_aware":
        assert 1.48 < np.abs(offset).max() <= 1.5
        assert 0.49 < speed.max() <= 0.5
        assert 0.25 < np.abs(angles[:, 1:]).max() <= np.pi / 12 + 1e-5
    if name == "dodge":
        assert 0.198 < np.abs(offset).max() <= 0.2 + 1e-6
        assert 0.198 < speed.max() <= 0.2
    if name == "hall":
        assert 1.97 < np.abs(v.position[:, 1]).max() <= 2.0
        np.testing.assert_array_equal(v.position[:, 0], 0.0)
    if name == "gap":
        assert -4.0 - 1e-6 <= offset[:, 0].min() < -3.97
        assert -2.53 < offset[:, 0].max() <= -2.5 + 1e-6
        assert 0.49 < np.abs(offset[:, 1:]).max() <= 0.5 + 1e-6
        assert speed.max() == 0
    if name == "land_visual":
        assert 0.98 < np.abs(offset[:, :2]).max() <= 1.0
        assert 1.0 - 1e-6 <= offset[:, 2].min() < 1.02
        assert 2.98 < offset[:, 2].max() <= 3.0 + 1e-6
        assert 0.49 < speed.max() <= 0.5
    if name == "avoid":
        assert 2.97 < np.abs(v.position[:, 1]).max() <= 3.0
        np.testing.assert_array_equal(v.position[:, 0], 0.0)
        assert speed.max() == 0
    if name == "race_clutter":
        from_start = np.linalg.norm(v.position - np.asarray(state.memory.tracks.gates.start), axis=-1)
        assert 0.49 < from_start.max() <= 0.5 + 1e-5
        assert speed.max() == 0


def test_the_same_seed_gives_the_same_flight_and_another_one_another() -> None:
    env = make(randomize={"mass": 0.1}, wind=1.0, noise=NoiseConfig(position=0.1))

    @jax.jit
    def fly(key: jax.Array) -> jax.Array:
        state, _ = env.reset(key, 8)
        return jax.lax.scan(
            lambda s, _: (lambda r: (r[0], r[1].observation))(env.step(s, jnp.zeros((8, 4)))), state, None, 40
        )[1]

    np.testing.assert_array_equal(fly(random_key(1)), fly(random_key(1)))
    assert not np.array_equal(fly(random_key(1)), fly(random_key(2)))


def test_a_new_start_is_a_reset() -> None:
    options = {"wind": 1.0, "observation_latency": (0.0, 0.05), "imu": ImuConfig(observed=True)}
    env = make(HoverConfig(episode_s=0.03, hold_s=0.0), randomize={"mass": 0.1}, **options)  # of one step
    state, _ = reset(env, random_key(0), 16)
    again, out = jax.jit(env.step)(state, jnp.zeros((16, 4)))
    assert out.truncated.all()
    fresh, observation = reset(env, jax.random.fold_in(jax.random.fold_in(again.key, again.tick), STARTS), 16)
    np.testing.assert_allclose(out.observation, observation, rtol=2e-6, atol=1e-7)  # compiled apart: rounding differs
    for a, b in zip(jax.tree.leaves(again)[:-2], jax.tree.leaves(fresh)[:-2], strict=True):
        np.testing.assert_allclose(a, b, rtol=2e-6, atol=1e-7)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("name", ["hover", "land_visual"])
def test_what_a_critic_knows_is_of_what_was_reached_before_new_starts(name: str) -> None:
    env = make(TASKS[name].training(), cameras=presets.preset(name, "ppo").env.cameras)
    state, _ = reset(env, random_key(0), 3)
    state = dataclasses.replace(state, time=jnp.full(3, env.task.episode_s - env.control_period))
    _, out = jax.jit(partial(env.step, privileged=True))(state, jnp.zeros((3, 4)))
    reached, without = jax.jit(partial(env.step, restart=False))(state, jnp.zeros((3, 4)))
    assert out.done.all()
    assert without.final_privileged is None
    assert out.final_privileged.shape == (3, env.privileged_size)
    np.testing.assert_allclose(out.final_privileged, jax.jit(env.privileged)(reached), rtol=1e-5, atol=1e-6)


def test_wind_is_drawn_an_episode() -> None:
    strength = np.linalg.norm(reset(make(wind=2.0), random_key(0), 500)[0].wind, axis=-1)
    assert 1.9 < strength.max() <= 2 + 1e-5


@pytest.mark.whole
@pytest.mark.usefixtures("x64")
def test_gradient_of_a_rollout_against_differences() -> None:
    env = Env.of(HoverConfig(), REWARD, dtype=np.float64)
    start, _ = reset(env, random_key(3), 2)
    actions = jnp.asarray(np.random.default_rng(0).uniform(-0.6, 0.2, (10, 2, 4)))

    @jax.jit
    def gain(actions: jax.Array) -> jax.Array:
        def step(state: Any, action: jax.Array) -> Any:
            state, out = env.step(state, action)
            return state, out.reward.sum()

        return jax.lax.scan(step, start, actions)[1].sum()

    exact = jax.jit(jax.grad(gain))(actions)
    assert np.abs(exact[:8]).max() > 1e-3
    for index in [(0, 0, 0), (0, 1, 1), (3, 0, 2), (5, 1, 3), (7, 0, 0)]:
        step = jnp.zeros_like(actions).at[index].set(1e-6)
        numeric = (gain(actions + step) - gain(actions - step)) / 2e-6
        np.testing.assert_allclose(exact[index], numeric, rtol=1e-5, atol=1e-9)


def test_a_run_and_what_is_flown_for_a_purpose_draw_from_different_keys() -> None:
    streams = (WATCHED, CONFIRMED, REPORTED, UNSEEN)
    seeds = [(seed,) for seed in range(9)]
    seeds += [(seed, stream, batch) for seed in range(9) for stream in streams for batch in range(9)]
    assert len({tuple(np.asarray(numbers_of(random_key(*seed))).tolist()) for seed in seeds}) == len(seeds)
    with pytest.raises(ValueError, match="seed is -1; accepted: 0 or more"):
        random_key(-1, 0)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(
    "task",
    [
        HoverConfig(fence=math.inf),
        TrackConfig(reference="circle", circle_rate=-1.0),
        AvoidConfig(ceiling=math.inf, forest=ForestConfig(density=0.2, room=128)),
    ],
)
def test_what_makes_sense_is_accepted(task: TaskConfig) -> None:
    """No fence, a clockwise circle, a dense forest with places for it, a bias that stays."""
    env = Env.of(task, RewardConfig({"prog2": 1.0}), EnvConfig(imu=ImuConfig(gyro_bias=0.02, gyro_tau=math.inf)))
    state, _ = reset(env, random_key(0), 2)
    _, out = jax.jit(Env.step)(env, state, jnp.zeros((2, 4)))
    assert np.all(np.isfinite(out.observation)) and np.all(np.isfinite(out.reward))
