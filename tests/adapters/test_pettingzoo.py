"""The vehicles of a world behind PettingZoo's interface, and behind Gymnasium's of many worlds."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from pettingzoo.test import parallel_api_test

import e2efly
from e2efly.adapters.gym import QuadrotorEnv, QuadrotorVectorEnv
from e2efly.adapters.pettingzoo import QuadrotorParallelEnv
from e2efly.config import TrainConfig
from e2efly.runs import presets
from e2efly.tasks.swap import SwapConfig


def short(agents: int = 3, seconds: float = 0.5) -> TrainConfig:
    """Exchanging places in episodes that end by time-out."""
    task = SwapConfig(agents=agents, episode_s=seconds, hold_s=0.0)
    return dataclasses.replace(presets.preset("swap", "ppo"), task=task)


def test_pettingzoos_own_test_accepts_it() -> None:
    parallel_api_test(QuadrotorParallelEnv(short()), num_cycles=60)


def test_a_seed_gives_the_same_world_and_all_end_together() -> None:
    env = QuadrotorParallelEnv(short(), raw=True)
    still = {name: np.zeros(4, np.float32) for name in env.possible_agents}
    first, again = (env.reset(seed=3)[0] for _ in range(2))
    assert all(np.array_equal(first[name], again[name]) for name in env.agents)
    assert not np.array_equal(first["vehicle_0"], env.reset(seed=4)[0]["vehicle_0"])
    steps = 0
    while env.agents:
        assert env.agents == env.possible_agents
        seen, rewards, ended, late, infos = env.step(still)
        assert set(seen) == set(rewards) == set(ended) == set(late) == set(infos) == set(env.possible_agents)
        steps += 1
    assert steps == 15 and all(late.values()) and not any(ended.values())
    with pytest.raises(ValueError, match="none, as the episode is over: call reset"):
        env.step(still)


def test_actions_for_others_are_refused() -> None:
    env = QuadrotorParallelEnv(short())
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"actions are for vehicle_7; accepted: one for each of vehicle_0, vehicle_1"):
        env.step({"vehicle_7": np.zeros(4, np.float32)})


def test_rows_of_a_batch_are_whole_worlds() -> None:
    env: Any = QuadrotorVectorEnv(short(), 6)
    env.reset(seed=0)
    *_, info = env.step(np.zeros((6, 4), np.float32))
    assert info["world"].tolist() == [0, 0, 0, 1, 1, 1]
    with pytest.raises(ValueError, match=r"num_envs is 4; accepted: a multiple of 3, the vehicles of a world of swap"):
        QuadrotorVectorEnv(short(), 4)
    with pytest.raises(ValueError, match=r"num_envs is 1; accepted: a multiple of 3"):
        QuadrotorEnv(short())


def test_make_env_asks_for_a_number_of_vehicles() -> None:
    assert e2efly.make_env("swap", agents=5).agents == 5
    with pytest.raises(ValueError, match="agents is 2; accepted: a task with several vehicles; hover has one"):
        e2efly.make_env("hover", agents=2)
