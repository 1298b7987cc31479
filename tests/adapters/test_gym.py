"""The environment behind Gymnasium's interfaces."""

import dataclasses
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import jax
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

from e2efly.adapters.gym import QuadrotorEnv, QuadrotorVectorEnv
from e2efly.config import TrainConfig
from e2efly.environment import Env, random_key
from e2efly.runs import presets
from e2efly.tasks import TASKS


def short(seconds: float = 0.2) -> TrainConfig:
    """Hover in episodes that end by time-out."""
    config = presets.preset("hover", "ppo")
    return dataclasses.replace(config, task=dataclasses.replace(config.task, episode_s=seconds, hold_s=0.0))


def vector(task: Any = "hover", n: int = 4, **given: Any) -> QuadrotorVectorEnv:
    return QuadrotorVectorEnv(task, n, **given)


@pytest.mark.whole(but=1)
@pytest.mark.filterwarnings("ignore:.*Box observation space.*")
@pytest.mark.parametrize("task", ["hover", "avoid"])
def test_gymnasiums_checker_accepts_it(task: str) -> None:
    check_env(gymnasium.make(f"e2efly/{task}-v0", render_mode="rgb_array").unwrapped)  # which draws, too


def test_every_task_is_registered_both_ways() -> None:
    for task in TASKS:
        assert f"e2efly/{task}-v0" in gymnasium.registry
    told = "import gymnasium as g; print(g.make('e2efly.adapters.gym:e2efly/hover-v0').spec.id)"
    alone = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=False)
    assert alone.stdout.strip() == "e2efly/hover-v0", alone.stderr  # without another import
    envs = gymnasium.make_vec("e2efly/land-v0", num_envs=3, vectorization_mode="vector_entry_point")
    observations, _ = envs.reset(seed=0)
    assert observations.shape == (3, envs.single_observation_space.shape[0])  # type: ignore[index]
    assert envs.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP


@pytest.mark.whole
def test_a_task_of_ones_own_is_made_by_its_reference(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(TASKS, "_known", dict(TASKS._known))  # its name goes with the test
    task = f"{Path(__file__).parents[2] / 'examples' / '06_own_task.py'}:OrbitConfig"
    env: Any = gymnasium.make("e2efly/task-v0", task=task, render_mode="rgb_array").unwrapped
    assert type(env.stepper.config.task).__name__ == "OrbitConfig"
    env.reset(seed=0)
    assert env.render().shape == (320, 480, 3)
    kind = {"vectorization_mode": "vector_entry_point", "render_mode": "rgb_array"}
    envs: Any = gymnasium.make_vec("e2efly/task-v0", 3, task=task, **kind)
    envs.reset(seed=0)
    assert envs.step(np.zeros((3, 4), np.float32))[0].shape == (3, *env.observation_space.shape)
    assert len(envs.render()) == 3
    with pytest.raises(ValueError, match="unknown task 'orbitt'"):
        gymnasium.make("e2efly/task-v0", task="orbitt")


@pytest.mark.whole
def test_it_steps_as_our_own_environment_does() -> None:
    config = presets.preset("hover", "ppo")
    envs, actions = vector(raw=True), np.random.default_rng(0).uniform(-1, 1, (5, 4, 4)).astype(np.float32)
    first, _ = envs.reset(seed=7)
    seed = int(np.random.default_rng(np.random.PCG64(7)).integers(2**32))
    env = Env.of(config.task, config.reward, config.env)
    state, observation = jax.jit(env.reset, static_argnums=1)(random_key(seed), 4)
    np.testing.assert_allclose(first, observation, atol=1e-6)
    step = jax.jit(env.step)
    for action in actions:
        observations, rewards, terminated, truncated, info = envs.step(action)
        state, out = step(state, action)
        np.testing.assert_allclose(observations, out.observation, atol=1e-5)
        np.testing.assert_allclose(rewards, out.reward, atol=1e-5)
        np.testing.assert_array_equal(terminated, out.terminated)
        np.testing.assert_array_equal(truncated, out.truncated)
        np.testing.assert_allclose(info["reward/near"], out.terms["near"], atol=1e-5)


def test_the_same_seed_starts_the_same_and_no_seed_goes_on() -> None:
    env = QuadrotorEnv()
    (a, _), (b, _), (c, _), (d, _) = env.reset(seed=1), env.reset(), env.reset(seed=1), env.reset()
    np.testing.assert_array_equal(a, c)
    np.testing.assert_array_equal(b, d)
    assert np.abs(a - b).max() > 0.01


def test_an_episode_that_ends_goes_on_with_a_new_one_and_tells_what_was_reached() -> None:
    envs = vector(short(), raw=True)
    envs.reset(seed=0)
    steps = round(0.2 / envs.stepper.env.control_period)
    for i in range(steps):
        before = envs.stepper.state
        observations, _, terminated, truncated, info = envs.step(np.zeros((4, 4), np.float32))
        assert truncated.all() == (i == steps - 1) and not terminated.any()
    assert before is not None
    assert info["_final_obs"].all()
    reached = info["final_obs"]
    moved = np.linalg.norm(reached[:, :3] - observations[:, :3], axis=-1)
    assert (moved > 0.05).all()  # what to act on next is of the new episode
    one = QuadrotorEnv(short(), raw=True)
    one.reset(seed=0)
    for _ in range(steps):
        *_, truncated_one, _ = one.step(np.zeros(4, np.float32))
    assert truncated_one


@pytest.mark.whole
def test_images_come_beside_the_state() -> None:
    envs = vector("avoid", 2)
    observations, _ = envs.reset(seed=0)
    assert set(observations) == {"state", "image_0"}
    assert observations["image_0"].shape == (2, 12, 32)
    assert envs.observation_space.contains(observations)
    assert np.ptp(observations["image_0"]) > 1.0  # metres


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: QuadrotorVectorEnv("hoover"), "hover"),
        (lambda: QuadrotorVectorEnv("hover", 0), "num_envs is 0"),
        (lambda: vector().step(np.zeros((4, 4))), "before the first reset"),
    ],
)
def test_what_cannot_be_is_refused_by_name(make: Any, message: str) -> None:
    with pytest.raises((ValueError, RuntimeError), match=message):
        make()


def test_actions_of_another_shape_are_refused() -> None:
    envs = vector()
    envs.reset(seed=0)
    with pytest.raises(ValueError, match=r"\(3, 4\); accepted: \(4, 4\)"):
        envs.step(np.zeros((3, 4)))


@pytest.mark.whole
@pytest.mark.parametrize("task", ["race", "avoid"])
def test_it_is_drawn_from_behind_with_its_goal(task: str) -> None:
    env = gymnasium.make(f"e2efly/{task}-v0", render_mode="rgb_array")
    with pytest.raises((RuntimeError, gymnasium.error.ResetNeeded)):
        env.render()
    env.reset(seed=0)
    first: Any = env.render()
    assert (first.shape, first.dtype) == ((320, 480, 3), np.uint8)
    middle = first[130:230, 190:290].astype(int)
    red = (middle[..., 0] > 1.6 * middle[..., 1]) & (middle[..., 0] > 1.6 * middle[..., 2])
    assert red.sum() > 20  # the rotors in front
    for _ in range(20):
        env.step(np.array([1.0, 0.0, 0.0, 0.0], np.float32))
    later: Any = env.render()
    assert np.mean(first != later) > 0.05
    assert env.metadata["render_fps"] == 30


@pytest.mark.whole
def test_all_of_a_batch_are_drawn_and_other_modes_are_refused() -> None:
    envs = QuadrotorVectorEnv("hover", 3, render_mode="rgb_array")
    with pytest.raises(RuntimeError, match="render before the first reset"):
        envs.render()
    envs.reset(seed=0)
    pictures = envs.render()
    assert pictures is not None
    assert [picture.shape for picture in pictures] == [(320, 480, 3)] * 3
    assert np.any(pictures[0] != pictures[1])
    gates = QuadrotorVectorEnv("race_clutter", 6, render_mode="rgb_array")  # of as many gates as vehicles
    gates.reset(seed=0)
    assert len(gates.render() or ()) == 6
    assert QuadrotorEnv("hover").render() is None
    with pytest.raises(ValueError, match="render_mode is 'human'; accepted: None, rgb_array"):
        QuadrotorEnv("hover", render_mode="human")
