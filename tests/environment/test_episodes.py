"""What the environment promises to an algorithm: shapes, ends of episodes, nothing compiled twice."""

import dataclasses
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import EnvConfig, ImuConfig, NoiseConfig, RewardConfig, TaskConfig
from e2efly.control import COMMAND_MODES
from e2efly.environment import Env, EnvState, Step, random_key
from e2efly.environment.episodes import Act, run_episodes, run_stepwise
from e2efly.tasks import TASKS
from e2efly.tasks.hover import HoverConfig

REWARD = RewardConfig({"prog2": 1.0, "anglev": 0.1})
N = 5


@pytest.fixture(scope="module")
def advance() -> Any:
    """A step after which episodes go on."""
    return jax.jit(partial(Env.step, restart=False))


@pytest.fixture(scope="module")
def step() -> Any:
    return jax.jit(Env.step)


def make(task: TaskConfig | None = None, reward: RewardConfig = REWARD, **config: Any) -> Env:
    return Env.of(task or HoverConfig(), reward, EnvConfig(**config))


def reset(env: Env, n: int = N, seed: int = 0) -> tuple[EnvState, jax.Array]:
    return jax.jit(Env.reset, static_argnums=2)(env, random_key(seed), n)


STATE_TASKS = ("hover", "land", "track", "race")


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(
    ("name", "mode"),
    [(name, mode) for name in TASKS for mode in (COMMAND_MODES if name in STATE_TASKS else ("ctbr",))],
)
def test_every_task_flies_under_every_command_mode(name: str, mode: str) -> None:
    """Traced, not run: shapes and types go round, so that a rollout can be compiled."""
    config = {
        "observation_latency": (0.0, 0.05), "imu": ImuConfig(observed=True), "wind": 1.0,
        "noise": NoiseConfig(position=0.1), "randomize": {"mass": 0.1, "inertia": 0.1},
    }  # fmt: skip
    for options in ({}, config):
        env = make(TASKS[name].training(), command_mode=mode, **options)
        key, n = random_key(0), env.whole(N)
        state, observation = jax.eval_shape(lambda env=env, key=key, n=n: env.reset(key, n))
        after, out = jax.eval_shape(env.step, state, jax.ShapeDtypeStruct((n, 4), jnp.float32))
        assert jax.tree.structure(after) == jax.tree.structure(state)
        assert [(x.shape, x.dtype) for x in jax.tree.leaves(after)] == [
            (x.shape, x.dtype) for x in jax.tree.leaves(state)
        ]
        assert out.observation.shape == out.final_observation.shape == observation.shape == (n, env.observation_size)
        assert out.reward.shape == out.terminated.shape == out.success.shape == out.error.shape == (n,)
        assert env.observation_size == sum(f.size for f in env.fields)


@pytest.mark.parametrize(("name", "size"), [("hover", 13), ("land", 13), ("track", 40), ("race", 16)])
def test_observation_sizes_of_the_paper(name: str, size: int) -> None:
    assert make(TASKS[name].training(), past_actions=0).observation_size == size
    assert make(TASKS[name].training()).observation_size == size + 8  # VIS-R: two past actions


def test_what_is_observed(advance: Any) -> None:
    env = make()
    state, observation = reset(env)
    v = state.vehicle
    hover = np.broadcast_to(env.hover, (N, 4))
    expected = [np.array([0, 0, 3.0]) - v.position, v.quaternion, v.velocity, v.body_rate, hover, hover]
    np.testing.assert_allclose(observation, np.concatenate(expected, -1), rtol=1e-5, atol=1e-6)
    action = jnp.full((N, 4), 0.3)
    state, out = advance(env, state, action)
    v = state.vehicle
    expected = [np.array([0, 0, 3.0]) - v.position, v.quaternion, v.velocity, v.body_rate, action, hover]
    np.testing.assert_allclose(out.final_observation, np.concatenate(expected, -1), rtol=1e-5, atol=1e-6)


def moved(state: EnvState, **changes: Any) -> EnvState:
    return dataclasses.replace(state, vehicle=dataclasses.replace(state.vehicle, **changes))


def test_ends_of_an_episode(advance: Any, step: Any) -> None:
    """Rows: flying on, time out, crashed, crashed as the time runs out, flying on."""
    env = make()
    state, _ = reset(env)
    time = jnp.asarray([3.0, 8 - env.control_period, 3.0, 8 - env.control_period, 0.0])
    position = jnp.asarray([[0.0, 0, 3], [0, 0, 3], [0, 9, 3], [0, 9, 3], [1, 0, 3]])
    state = dataclasses.replace(moved(state, position=position), time=time)
    reached, out = advance(env, state, jnp.zeros((N, 4)))
    np.testing.assert_array_equal(out.terminated, [False, False, True, True, False])
    np.testing.assert_array_equal(out.truncated, [False, True, False, False, False])
    np.testing.assert_array_equal(out.done, [False, True, True, True, False])
    again, over = step(env, state, jnp.zeros((N, 4)))
    # what was reached is kept beside the new start
    np.testing.assert_array_equal(over.final_observation, out.final_observation)
    np.testing.assert_allclose(over.final_observation[:, :3], np.array([0, 0, 3]) - reached.vehicle.position, atol=1e-5)
    np.testing.assert_allclose(over.observation[:, :3], np.array([0, 0, 3]) - again.vehicle.position, atol=1e-5)
    assert np.abs(over.final_observation[2:4, 1]).min() > 8.5
    assert np.abs(over.observation[1:4, :3]).max() <= 2.0
    for f in dataclasses.fields(Step):
        if f.name not in ("observation", "terms", "final_privileged"):
            np.testing.assert_array_equal(getattr(over, f.name), getattr(out, f.name))
    # the others fly on, to the last bit
    for a, b in zip(jax.tree.leaves(again)[:-2], jax.tree.leaves(reached)[:-2], strict=True):
        np.testing.assert_array_equal(a[np.array([0, 4])], b[np.array([0, 4])])
    np.testing.assert_array_equal(again.time[1:4], 0)
    assert int(again.tick) == 1


def test_new_starts_differ_from_each_other_and_from_the_first(step: Any) -> None:
    env = make(HoverConfig(episode_s=0.03, hold_s=0.0))  # of one step
    state, _ = reset(env)
    starts = [np.asarray(state.vehicle.position)]
    for _ in range(3):
        state, _ = step(env, state, jnp.zeros((N, 4)))
        starts.append(np.asarray(state.vehicle.position))
    assert len(np.unique(np.concatenate(starts)[:, 0])) == 4 * N


@pytest.mark.parametrize(("rate", "seconds"), [(30.0, 12.0), (60.0, 20.0), (100.0, 60.0)])
def test_an_episode_has_as_many_steps_as_its_seconds_hold(rate: float, seconds: float) -> None:
    """Summed up in single precision, and yet neither a step more nor a step less."""
    env = make(HoverConfig(episode_s=seconds, fence=np.inf, position=0.0), control_rate=rate, largest_step=1.0)
    state, _ = reset(env, 1)

    def one(state: EnvState, _: None) -> tuple[EnvState, jax.Array]:
        after, out = env.step(state, jnp.broadcast_to(env.hover, (1, 4)), restart=False)
        return dataclasses.replace(after, vehicle=state.vehicle), out.truncated[0]

    ended = jax.jit(lambda s: jax.lax.scan(one, s, None, round(rate * seconds) + 5)[1])(state)
    assert int(np.argmax(ended)) + 1 == round(rate * seconds)


def test_numbers_of_a_configuration_do_not_recompile() -> None:
    """Built anew with other numbers, one program serves all."""
    traces = []

    @jax.jit
    def program(env: Env, key: jax.Array) -> jax.Array:
        traces.append(1)
        state, _ = env.reset(key, 4)
        return env.step(state, jnp.zeros((4, 4)))[1].reward

    base: dict[str, Any] = {"wind": 1.0, "noise": NoiseConfig(position=0.1), "randomize": {"mass": 0.1}}
    base["action_latency"] = (0.02, 0.06)
    rewards = []
    for task, reward, changes in (
        (HoverConfig(), REWARD, {}),
        (HoverConfig(position=1.0, target=(0.0, 1.0, 2.0), fence=9.0, episode_s=4.0), REWARD, {}),
        (HoverConfig(), RewardConfig({"prog2": 0.5, "anglev": 0.0}), {}),
        (HoverConfig(), REWARD, {"wind": 3.0}),
        (HoverConfig(), REWARD, {"noise": NoiseConfig(velocity=0.2)}),
        (HoverConfig(), REWARD, {"randomize": {"mass": 0.3}}),
        (HoverConfig(), REWARD, {"action_latency": (0.04, 0.05)}),
    ):
        rewards.append(np.asarray(program(make(task, reward, **{**base, **changes}), random_key(0))))
    assert len(traces) == 1
    assert not np.array_equal(rewards[0], rewards[1])
    assert not np.array_equal(rewards[0], rewards[2])


def test_randomised_parameters_are_drawn_entry_by_entry_and_the_rest_is_nominal() -> None:
    widths = {"mass": 0.2, "inertia": 0.1, "drag_linear": 0.5, "thrust_map": 0.2}
    env = make(randomize=widths)
    action = jnp.array([[0.2, -0.5, 0.1, 0.9]])
    np.testing.assert_array_equal(env.command(action), make().command(action))  # what an action asks for is nominal
    state, _ = reset(env, 1000)
    assert set(state.plant) == set(widths)
    nominal = env.physics.nominal
    for name, width in widths.items():
        factor = np.asarray(state.plant[name]) / np.asarray(getattr(nominal, name))
        assert 1 - width - 1e-6 <= factor.min() < 1 - 0.97 * width
        assert 1 + 0.97 * width < factor.max() <= 1 + width + 1e-6
        assert factor.mean() == pytest.approx(1, abs=0.1 * width)
        if factor.ndim == 2:
            assert np.abs(np.corrcoef(factor.T) - np.eye(3)).max() < 0.15


def test_the_plant_is_the_randomised_one(advance: Any) -> None:
    """Full thrust for two steps, level: a vehicle of half the mass leaves twice as fast."""
    env = make(action_latency=(0.0, 0.0), randomize={"mass": 0.5})
    state, _ = reset(make(HoverConfig(position=0, velocity=0, tilt=0, body_rate=0), randomize={"mass": 0.5}), 2)
    state = dataclasses.replace(state, plant={"mass": jnp.asarray([0.75, 0.375])})
    state = dataclasses.replace(state, actions=state.actions[:, : env.queue], action_latency=jnp.zeros(2))
    for _ in range(2):
        state, _ = advance(env, state, jnp.asarray([[1.0, 0, 0, 0]] * 2))
    climb = np.asarray(state.vehicle.velocity[:, 2]) + 9.81 * 2 * env.control_period
    assert climb[1] / climb[0] == pytest.approx(2.0, rel=0.01)


def test_action_map() -> None:
    env = make()
    low, high = [0, -10, -10, -4], [4 * 5.12 / 0.75, 10, 10, 4]
    np.testing.assert_allclose(env.command(-jnp.ones((1, 4)))[0], low, atol=1e-5)
    np.testing.assert_allclose(env.command(jnp.full((1, 4), 3.0))[0], high, rtol=1e-6)
    np.testing.assert_allclose(env.command(jnp.asarray(env.hover)[None])[0], [9.81, 0, 0, 0], atol=1e-5)


BROKEN: list[tuple[dict[str, Any], str]] = [
    ({"vehicle": "vis_x"}, "unknown vehicle 'vis_x'; did you mean 'vis_"),
    ({"command_mode": "ctbt"}, "unknown command mode 'ctbt'; did you mean 'ctbr'"),
    ({"largest_step": -0.01}, "largest_step is -0.01; accepted: a positive number"),
    ({"control_rate": float("nan")}, "control_rate is nan; accepted: a positive number"),
    ({"latency_spread": (0.0, 0.95)}, r"latency of vehicle vis_r is 0\.06 s, env\.latency_spread .*at most 1 s"),
    ({"integrator": "rk5"}, "unknown integrator 'rk5'; did you mean 'rk4'"),
    ({"randomize": {"mas": 0.1}}, "unknown vehicle parameter 'mas'; did you mean 'mass'"),
    ({"randomize": {"mass": 1.5}}, "randomize.mass is 1.5; accepted: at least 0 and below 1"),
    ({"randomize": {"mass": float("nan")}}, r"env\.randomize\.mass is nan; accepted: at least 0 and below 1"),
    ({"randomize": {"name": 0.1}}, "unknown vehicle parameter 'name'"),
]


@pytest.mark.parametrize(("config", "message"), BROKEN)
def test_a_broken_configuration(config: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make(**config)


def test_a_broken_task_or_reward() -> None:
    with pytest.raises(ValueError, match="unknown reward term 'prog22'; did you mean 'prog2'"):
        make(reward=RewardConfig({"prog22": 1.0}))
    with pytest.raises(ValueError, match="unknown reward parameter 'vzmin'; did you mean 'vz_min'"):
        make(reward=RewardConfig({"vz": 1.0}, {"vzmin": 1.0}))


@pytest.mark.whole
def test_step_by_step_they_go_as_in_one_program_and_stop_when_all_have_ended() -> None:
    """Of a policy that is no function of JAX, and with what is to be altered at the start."""
    env, asked = make(TASKS["race"](laps=1)), []

    def act(observation: Any, images: Any, memory: Any) -> Any:
        if isinstance(observation, np.ndarray):
            asked.append(len(observation))
        return 0.3 + 0.1 * observation[:, :4], memory

    def later(state: EnvState) -> EnvState:
        return dataclasses.replace(state, action_latency=0 * state.action_latency + 0.1)

    one = run_episodes(env, Act(act), random_key(1), 8, 120, 0.5, altered=later)
    other, begun = run_stepwise(env, Act(act), random_key(1), 8, 120, 0.5, altered=later)
    for name, value in vars(one).items():
        np.testing.assert_allclose(getattr(other, name), value, rtol=1e-4, atol=1e-4, err_msg=name)
    assert set(asked) == {8} and len(asked) < 120  # all have crashed before
    np.testing.assert_allclose(begun.action_latency, 0.1)
