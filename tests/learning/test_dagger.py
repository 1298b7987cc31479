"""Imitation of a policy that is told more."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import BPTTConfig, DAggerConfig
from e2efly.environment import random_key
from e2efly.learning.algorithm import begin
from e2efly.learning.devices import OWN, on_each, own, stacked
from e2efly.learning.setup import Setup
from e2efly.learning.teacher import teacher_of
from e2efly.policy.loader import load_policy
from e2efly.policy.zoo import policy_file
from e2efly.runs.inputs import input_files
from e2efly.runs.presets import begun, for_vehicle, gentle, preset
from e2efly.simulation.physics import State


def setup(task: str = "hover", env: dict[str, Any] | None = None, recurrent: int = 0, **algo: Any) -> Setup:
    config = preset(task, "dagger", "nominal")
    settings = dataclasses.replace(config.algo, **({"envs": 64, "horizon": 16} | algo))
    network = dataclasses.replace(config.network, recurrent=recurrent or config.network.recurrent)
    env_config = dataclasses.replace(config.env, **(env or {}))
    return Setup.of(dataclasses.replace(config, algo=settings, env=env_config, network=network))


def learned(made: Setup, updates: int) -> dict[str, np.ndarray]:
    """The metrics of a short training."""
    algorithm, env, config = made.algorithm, made.env, made.config.algo

    def run(start: Any) -> Any:
        def update(state: Any, i: Any) -> Any:
            return algorithm.update(env, config, state, i / updates)

        state = begin(algorithm, env, config, made.parameters(), own(start))
        return stacked(jax.lax.scan(update, state, jnp.arange(updates))[1])

    metrics = on_each(run, 1, (OWN,), OWN)(stacked(random_key(0)))
    return {name: np.asarray(x[0]) for name, x in metrics.items()}


def test_it_learns_what_the_teacher_does_without_being_told_the_same() -> None:
    found = learned(setup(led=0.25, env={"past_actions": 4}, horizon=48), 400)  # five windows in an episode
    error, success = found["loss/imitation"], found["train_success"]
    assert error[-20:].mean() < 0.4 * error[:5].mean()
    assert success[-20:].max() > 0.9, "it flies by what it has learned"


def test_a_teacher_flies_as_its_file_does() -> None:
    env = setup("race_eyes").env
    guide, policy = teacher_of("race_any"), load_policy("race_any")
    state, _ = env.reset(random_key(3), 5)
    shaken = dataclasses.replace(state, vehicle=turned(state.vehicle))
    told = dataclasses.replace(env.showing([f.name for f in policy.contract.observation]), seen_actions=2)
    action, _ = guide.act(env, shaken, guide.memory(5))
    for one, row in zip(np.asarray(action), np.asarray(told.shown(shaken, shaken.vehicle)), strict=True):
        np.testing.assert_allclose(one, policy.act(row)[0], atol=1e-5)


def turned(body: State) -> State:
    velocity = jax.random.normal(random_key(4), body.velocity.shape)
    return dataclasses.replace(body, velocity=velocity, body_rate=0.3 * velocity)


@pytest.mark.parametrize(
    ("task", "algo", "said"),
    [
        ("hover", {"teacher": "race_clutter"}, "algo.teacher is race_clutter, which sees images"),
        (
            "hover",
            {"teacher": "race_any"},
            "algo.teacher observes gates with 9 numbers; accepted: a policy that observes",
        ),
        ("hover", {"teacher": "crazyflie/hover"}, "algo.teacher"),
        ("hover", {"teacher": "no/such"}, "no/such"),
        ("hover", {"teacher": "expert"}, "algo.teacher is expert; accepted: for a task with an expert"),
    ],
)
def test_a_teacher_that_cannot_fly_here_is_refused(task: str, algo: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        setup(task, **algo).parameters()


def test_an_expert_teaches_what_the_reward_imitates() -> None:
    env = setup("swap", teacher="expert").env
    state, _ = env.reset(random_key(5), 16)
    action, _ = teacher_of("expert").act(env, state, jnp.zeros((16, 0)))
    np.testing.assert_array_equal(action, env.expert_action(state))


def imitating(imitated: float | None, horizon: int = 64, task: str = "swap", **algo: Any) -> Setup:
    """BPTT that begins with imitation, of an expert whose vehicles come near to each other."""
    config = preset(task, "bptt", "nominal")
    options = {"envs": 64, "horizon": horizon, "imitated": imitated, "learning_rate": 1e-4, "learning_rate_end": 1e-4}
    settings = dataclasses.replace(config.algo, **(options | algo))
    return Setup.of(
        dataclasses.replace(config, algo=settings, network=dataclasses.replace(config.network, hidden=(64,)))
    )


def test_a_training_by_gradients_may_begin_with_imitation() -> None:
    found = learned(imitating(0.8, term_gradients=True, imitation_rate=4e-3), 250)
    error, avoided = found["loss/imitation"], found["gradient/avoid"]
    assert error[190:200].mean() < 0.4 * error[10:30].mean(), "it imitates"
    assert (error[200:] == 0).all() and (avoided[:200] == 0).all(), "then the reward decides"
    assert (avoided[200:] > 0).any() and np.isfinite(found["loss/gradient_norm"]).all()


def test_imitation_is_that_of_dagger() -> None:
    """An update is as many windows of dagger as fit into it, with a gradient step each."""
    both = imitating(0.99, horizon=32, imitation_rate=1e-3, learning_rate=1e-3, average=None)
    config = dataclasses.replace(
        preset("swap", "dagger", "nominal"), network=both.config.network, reward=both.config.reward,
        algo=DAggerConfig(teacher="expert", envs=64, learning_rate=1e-3, learning_rate_end=1e-3, led=0.15 * 0.99),
    )  # fmt: skip
    wanted, found = learned(Setup.of(config), 20), learned(both, 20)
    for name in ("loss/imitation", "loss/gradient_norm", "reward"):
        np.testing.assert_allclose(found[name][:6], wanted[name][:6], rtol=5e-3, err_msg=name)  # then rounding grows


def test_what_cannot_be_imitated_is_refused() -> None:
    with pytest.raises(ValueError, match=r"algo.imitated is 0.5; accepted: for a task with an expert"):
        imitating(0.5, task="hover").parameters()
    with pytest.raises(ValueError, match=r"algo.horizon is 48; accepted with algo.imitated: a multiple of 32"):
        imitating(0.5, horizon=48)
    with pytest.raises(ValueError, match=r"algo.imitated is 1.5; accepted"):
        imitating(1.5)


def test_a_run_that_starts_from_a_policy_imitates_nobody() -> None:
    config = preset("hall", "bptt", "robust")
    first, again = config.algo, gentle(config)
    assert isinstance(first, BPTTConfig) and isinstance(again.algo, BPTTConfig) and first.imitated is not None
    assert again.algo.imitated is None and again.steps == round(config.steps * (1 - first.imitated))
    assert again.algo.learning_rate == first.learning_rate_end


def test_by_default_the_teacher_is_the_zoos_policy_of_the_task() -> None:
    assert DAggerConfig().teacher == ""
    assert setup("hover", env={"past_actions": 4}).parameters()
    with pytest.raises(ValueError, match=r"observes 4 past actions; accepted: at most 3, .* or env.past_actions 4"):
        setup("hover").parameters()


def test_a_run_keeps_the_file_of_its_teacher_that_of_its_vehicle() -> None:
    config = preset("race_eyes", "dagger", "nominal")
    assert input_files(begun(config))["algo.teacher"] == policy_file("race_told").absolute()
    other = for_vehicle(preset("race", "dagger", "nominal"), "crazyflie")
    assert input_files(begun(other))["algo.teacher"] == policy_file("race", "crazyflie").absolute()
    taught = dataclasses.replace(config, algo=DAggerConfig(teacher="expert"))
    assert begun(taught) == taught and "algo.teacher" not in input_files(taught)
