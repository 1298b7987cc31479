"""Policies that command each rotor: as many numbers as the vehicle has rotors, from the training to the C code."""

import dataclasses
import json
from pathlib import Path

import gymnasium
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.adapters.gym import QuadrotorEnv, QuadrotorVectorEnv
from e2efly.config import ALGORITHMS, DAggerConfig, EnvConfig, TrainConfig
from e2efly.environment import Env, random_key
from e2efly.learning.algorithm import TrainState
from e2efly.learning.devices import OWN, SAME, on_each, own, stacked
from e2efly.learning.programs import start_program
from e2efly.learning.setup import Setup
from e2efly.policy.contract import Contract
from e2efly.policy.loader import load_policy
from e2efly.policy.random_inputs import random_observations
from e2efly.runs import presets
from e2efly.validation.evaluation import evaluate
from e2efly.viewing.web.exported import course
from tests.policy.c_export.compiled import compiled
from tests.policy.c_export.test_compiled_cc import without_past
from tests.policy.made import made

ROTORS = {"hexa": 6, "octo": 8}


def configured(vehicle: str, algo: str = "ppo", mode: str = "rotor_share") -> tuple[TrainConfig, Env]:
    config = presets.preset("hover", algo)
    config = dataclasses.replace(config, env=EnvConfig(vehicle=vehicle, command_mode=mode, past_actions=2))
    return config, Env.of(config.task, config.reward, config.env)


def policy_of(folder: Path, vehicle: str, mode: str = "rotor_share") -> Path:
    config, env = configured(vehicle, mode=mode)
    return made(folder / "policy.onnx", 0.3, env, config)


@pytest.mark.parametrize("vehicle", ROTORS)
@pytest.mark.parametrize("mode", ["rotor_share", "rotor_thrust"])
def test_a_policy_has_a_command_for_each_rotor(tmp_path: Path, vehicle: str, mode: str) -> None:
    policy, count = load_policy(policy_of(tmp_path, vehicle, mode)), ROTORS[vehicle]
    c = policy.contract
    assert c.action.size == count == len(c.hover_action) and c.action.fields[-1] == f"rotor_{count - 1}"
    assert c.past_actions == 2 and c.slices["past_actions"].stop - c.slices["past_actions"].start == 2 * count
    assert Contract.from_json(c.to_json()) == c
    seen = random_observations(np.random.default_rng(0), c.observation, 5)
    action, _ = policy.act(seen)
    assert action.shape == (5, count) and policy.command(action).shape == (5, count)
    with pytest.raises(ValueError, match=rf"action has shape \(4,\); accepted: \({count},\)"):
        policy.command(np.zeros(4))


@pytest.mark.parametrize("key, value, told", [
    ("fields", [f"rotor_{i}" for i in range(5)], r"action.units is .*; accepted: \['1', '1', '1', '1', '1'\]"),
    ("low", [0.0] * 4, r"action.low is .*; accepted: a list of 6 numbers"),
    ("fields", ["rear_right"] * 6, r"action.fields is .*; accepted: \['rotor_0', 'rotor_1'"),
])  # fmt: skip
def test_a_contract_whose_commands_do_not_fit_together_is_refused(
    tmp_path: Path, key: str, value: list, told: str
) -> None:
    content = json.loads(load_policy(policy_of(tmp_path, "hexa")).contract.to_json())
    content["action"][key] = value
    with pytest.raises(ValueError, match=told):
        Contract.from_json(json.dumps(content))


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("vehicle", ROTORS)
def test_its_c_code_is_the_policy(tmp_path: Path, vehicle: str) -> None:
    file = policy_of(tmp_path, vehicle)
    policy, program = load_policy(file), compiled(file, tmp_path)
    c = policy.contract
    seen = random_observations(np.random.default_rng(1), c.observation, 6)
    program.begin()
    past = np.tile(np.asarray(c.hover_action, np.float32), 2)
    for row in seen:
        row[c.slices["past_actions"]] = past
        status, action = program.act(without_past(c, row))
        wanted, _ = policy.act(row)
        assert status == 0
        np.testing.assert_allclose(action, wanted, atol=2e-6)
        np.testing.assert_allclose(program.command(action), policy.command(action), rtol=1e-5, atol=1e-6)
        past = np.concatenate([action, past[: len(action)]])


@pytest.mark.whole(but=2)
@pytest.mark.parametrize("algo", list(ALGORITHMS))
def test_each_algorithm_learns_a_number_for_each_rotor(tmp_path: Path, algo: str) -> None:
    """Its update is traced, which finds every array of another shape."""
    config = configured("hexa", algo)[0]
    if isinstance(config.algo, DAggerConfig):
        teacher = dataclasses.replace(config.algo, teacher=str(policy_of(tmp_path, "hexa")))
        config = dataclasses.replace(config, algo=teacher)
    setup = Setup.of(config)
    parameters = setup.parameters()
    assert parameters.policy.head[-1][1].shape == (6,)
    state = start_program(setup).trace(setup.env, parameters, random_key(0)).out_info

    def update(env: Env, state: TrainState) -> TrainState:
        return stacked(setup.algorithm.update(env, setup.config.algo, own(state), jnp.float32(0.0))[0])

    after = jax.eval_shape(on_each(update, setup.devices, (SAME, OWN), OWN), setup.env, state)
    assert jax.tree.map(jnp.shape, after) == jax.tree.map(jnp.shape, state)


def test_gymnasium_acts_for_each_rotor() -> None:
    config, _ = configured("octo")
    one, many = QuadrotorEnv(config), QuadrotorVectorEnv(config, 3)
    assert one.action_space.shape == (8,) and many.action_space.shape == (3, 8)
    assert isinstance(one.action_space, gymnasium.spaces.Box)
    many.reset(seed=0)
    _, reward, *_ = many.step(many.action_space.sample())
    assert reward.shape == (3,)
    with pytest.raises(ValueError, match=r"actions have the shape \(3, 4\); accepted: \(3, 8\)"):
        many.step(np.zeros((3, 4), np.float32))


def test_it_is_judged_as_any_other(tmp_path: Path) -> None:
    found = evaluate(policy_of(tmp_path, "hexa"), 20, env={"lost_rotor": 1.0})
    assert found.candidate.changes["env.lost_rotor"] == (0.0, 1.0) and 0 <= found.success <= 1


def test_what_knows_four_commands_only_refuses_it() -> None:
    config, env = configured("hexa")
    with pytest.raises(ValueError, match=r"env.command_mode is 'rotor_share' with 6 rotors; accepted: four commands"):
        course(env, config.task)
    narrow = dataclasses.replace(config.env, command_range=((0.0,) * 4, (1.0,) * 4))
    with pytest.raises(ValueError, match=r"env.command_range is .* a command of hexa has 6 numbers.*accepted: None"):
        Env.of(config.task, config.reward, narrow)
