"""Stable-Baselines3 on our environment."""

from typing import Any

import numpy as np
import pytest
import torch
from stable_baselines3 import PPO

from e2efly.adapters.stable_baselines3 import SB3VecEnv


def flown(model: Any, n: int) -> float:
    """Success of one episode of each of n vehicles."""
    env = SB3VecEnv("hover", n)
    env.seed(1)
    observation, over, success = env.reset(), np.zeros(n, bool), np.zeros(n, bool)
    while not over.all():
        observation, _, done, told = env.step(model.predict(observation, deterministic=True)[0])
        for i in np.flatnonzero(done & ~over):
            success[i] = told[i]["is_success"]
        over |= done
    return float(success.mean())


@pytest.mark.whole
def test_its_ppo_learns_to_hover() -> None:
    torch.set_num_threads(1)
    model = PPO(
        "MlpPolicy", SB3VecEnv("hover", 64), n_steps=64, batch_size=512, n_epochs=4, gamma=0.96, learning_rate=3e-3,
        policy_kwargs={"log_std_init": -1.0, "net_arch": [64, 64]}, seed=0, device="cpu",
    )  # fmt: skip
    assert flown(model, 100) < 0.1
    model.learn(160_000)
    assert flown(model, 100) > 0.9


def test_what_was_reached_stands_in_the_infos_of_episodes_that_ended() -> None:
    env = SB3VecEnv("hover", 16, raw=True)
    env.seed(0)
    env.reset()
    ended = 0
    for _ in range(250):
        observation, reward, done, told = env.step(np.ones((16, 4), np.float32))  # all thrust: out of the fence
        assert reward.shape == (16,)
        for i in range(16):
            assert ("terminal_observation" in told[i]) == done[i]
            if done[i]:
                ended += 1
                assert not told[i]["TimeLimit.truncated"]
                assert np.abs(told[i]["terminal_observation"] - observation[i]).max() > 1.0
    assert ended >= 16


def test_returns_and_lengths_of_episodes_are_logged() -> None:
    env, sums, lengths, ended = SB3VecEnv("hover", 8), np.zeros(8), np.zeros(8), 0
    env.seed(0)
    env.reset()
    for _ in range(100):
        _, reward, done, told = env.step(np.ones((8, 4), np.float32))
        sums, lengths = sums + reward, lengths + 1
        for i in np.flatnonzero(done):
            assert told[i]["episode"]["r"] == pytest.approx(sums[i], rel=1e-5)
            assert told[i]["episode"]["l"] == lengths[i]
            sums[i], lengths[i], ended = 0, 0, ended + 1
    assert ended >= 8
    model = PPO("MlpPolicy", env, n_steps=64, batch_size=64, device="cpu", seed=0)
    model.learn(512)
    assert len(model.ep_info_buffer) > 0  # from which it logs ep_rew_mean


def test_the_same_seed_starts_the_same() -> None:
    env = SB3VecEnv("hover", 3)
    starts = []
    for seed in (5, 5, 6):
        env.seed(seed)
        starts.append(env.reset())
    np.testing.assert_array_equal(starts[0], starts[1])
    assert np.abs(starts[0] - starts[2]).max() > 0.01


def test_tasks_with_cameras_are_refused() -> None:
    with pytest.raises(ValueError, match="has cameras"):
        SB3VecEnv("avoid", 2)
