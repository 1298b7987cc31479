"""The algorithms on probe problems with known answers; GAE by hand."""

import dataclasses
from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import ABPTConfig, AlgorithmConfig, BPTTConfig, FOPPOConfig, NetworkConfig, PPOConfig, SHACConfig
from e2efly.environment import random_key
from e2efly.learning.algorithm import TrainState, annealed, gradient_cuts, make_algorithm
from e2efly.learning.critic import gae
from e2efly.learning.devices import OWN, on_each, own, stacked
from e2efly.learning.networks import Actor, mlp
from tests.learning.probe import Probe

ACTOR = Actor.of(Probe.fields, (), NetworkConfig((16,), "tanh"))
PPO_CONFIG = PPOConfig(envs=64, horizon=16, minibatch=256, epochs=4, learning_rate=1e-2, learning_rate_end=1e-3)
BPTT_CONFIG = BPTTConfig(envs=4, horizon=8, learning_rate=2e-2, learning_rate_end=1e-3, max_grad_norm=10.0)

SHAC_CONFIG = SHACConfig(
    envs=32, horizon=8, minibatch=128, learning_rate=2e-2, learning_rate_end=1e-3, gamma=0.9, max_grad_norm=10.0
)
ABPT_CONFIG = ABPTConfig(
    envs=32, horizon=8, collect=8, buffer=4096, places=128, minibatch=256, fits=4, learning_rate=2e-2,
    learning_rate_end=1e-3, gamma=0.9, max_grad_norm=10.0, target_share=0.1,
)  # fmt: skip

FOPPO_CONFIG = FOPPOConfig(
    envs=32, horizon=8, minibatch=128, learning_rate=1e-2, learning_rate_end=1e-3, gamma=0.9, max_grad_norm=10.0,
    exact_rate=1.0, log_std=-1.0,
)  # fmt: skip


def learn(
    probe: Probe, config: AlgorithmConfig, updates: int, devices: int = 2
) -> tuple[Any, TrainState, dict[str, jax.Array]]:
    algorithm = make_algorithm(config, ACTOR)
    parameters = jax.tree.map(jnp.asarray, algorithm.init(probe, config, 0))  # type: ignore[arg-type]
    optimizer = algorithm.optimizer(config, parameters)
    n = config.envs // devices
    first = probe.reset(random_key(0), n)
    replay = algorithm.replay(probe, config, *first)  # type: ignore[arg-type]
    states = [TrainState(parameters, optimizer, *first, ACTOR.memory(n), random_key(i), replay) for i in range(devices)]

    def run(state: TrainState) -> tuple[TrainState, dict[str, jax.Array]]:
        def update(state: TrainState, i: jax.Array) -> tuple[TrainState, dict[str, jax.Array]]:
            return algorithm.update(probe, config, state, i / updates)  # type: ignore[arg-type]

        return stacked(jax.lax.scan(update, own(state), jnp.arange(updates)))

    state, metrics = on_each(run, devices, (OWN,), OWN)(jax.tree.map(lambda *x: jnp.stack(x), *states))
    for leaf in jax.tree.leaves(state.parameters):
        np.testing.assert_array_equal(leaf[:1], leaf[-1:], err_msg="devices learn the same")
    return algorithm, jax.tree.map(lambda x: x[0], state), jax.tree.map(lambda x: x[0], metrics)


def learned_action(state: TrainState) -> np.ndarray:
    action, _ = ACTOR(state.parameters.policy, ACTOR.features(state.observation[:1]), state.memory[:1])
    return np.asarray(action[0])


def learned_value(state: TrainState) -> float:
    known = ACTOR.features(state.observation[:1])
    return float(mlp(state.parameters.critic, known, ACTOR.network.activation)[0, 0])


@pytest.mark.parametrize("delay", [0, 1])
@pytest.mark.parametrize(
    ("config", "updates", "atol"),
    [(BPTT_CONFIG, 300, 0.01), (ABPT_CONFIG, 200, 0.05), (FOPPO_CONFIG, 200, 0.05), (SHAC_CONFIG, 200, 0.02)],
    ids=["bptt", "abpt", "foppo", "shac"],
)
def test_it_finds_the_action_that_pays_best(config: AlgorithmConfig, updates: int, atol: float, delay: int) -> None:
    _, state, _ = learn(Probe(delay=delay, length=1000), config, updates)
    np.testing.assert_allclose(learned_action(state), Probe.target, atol=atol)


@pytest.mark.parametrize("delay", [0, 1])
def test_ppo_finds_the_action_that_pays_best(delay: int) -> None:
    probe = Probe(delay=delay, length=1000, ends_for_good=False)
    _, state, _ = learn(probe, dataclasses.replace(PPO_CONFIG, gamma=0.9), 150)
    np.testing.assert_allclose(learned_action(state), probe.target, atol=0.08)


def test_each_half_of_foppo_learns_alone() -> None:
    probe = Probe(length=1000)
    by_epochs = dataclasses.replace(FOPPO_CONFIG, exact_rate=0.0, epochs=4)
    by_gradient = dataclasses.replace(FOPPO_CONFIG, clip=0.0, exact_rate=2.0)  # clipped at once: no step of PPO's
    for config in (by_epochs, by_gradient):
        _, state, _ = learn(probe, config, 200)
        np.testing.assert_allclose(learned_action(state), probe.target, atol=0.1)


def test_the_critic_of_shac_sees_beyond_the_window() -> None:
    # each action pays a step later: in a window of one step its gradient is the critic's alone
    probe = Probe(delay=1, length=1000, told=True)
    short = dataclasses.replace(SHAC_CONFIG, horizon=1, minibatch=32, learning_rate=2e-3, critic_rate=10.0, noise=0.3)
    _, state, _ = learn(probe, short, 2000)
    np.testing.assert_allclose(learned_action(state), probe.target, atol=0.1)
    _, blind, _ = learn(probe, dataclasses.replace(BPTT_CONFIG, horizon=1), 300)
    assert np.abs(learned_action(blind) - np.array(probe.target)).max() > 0.3


def test_critics_know_what_follows_a_time_out_and_that_nothing_follows_an_end() -> None:
    for config in (SHAC_CONFIG, FOPPO_CONFIG):
        for for_good, worth in ((False, 2.0), (True, 1.0)):
            probe = Probe(constant=1.0, weight=0.0, length=1, ends_for_good=for_good)
            _, state, _ = learn(probe, dataclasses.replace(config, gamma=0.5), 150)
            assert learned_value(state) == pytest.approx(worth, abs=0.05)


def test_the_pieces_of_a_window_grow_over_the_run() -> None:
    config = dataclasses.replace(BPTT_CONFIG, horizon=16, horizon_start=4)
    cuts = {p: np.flatnonzero(np.asarray(gradient_cuts(config, jnp.float32(p)))).tolist() for p in (0.0, 0.5, 1.0)}
    assert cuts == {0.0: [4, 8, 12], 0.5: [8], 1.0: []}
    assert not np.asarray(gradient_cuts(BPTT_CONFIG, jnp.float32(0.0))).any()


@pytest.mark.parametrize("config", [BPTT_CONFIG, SHAC_CONFIG], ids=["bptt", "shac"])
def test_a_cut_keeps_the_gradient_from_what_came_before(config: Any) -> None:
    # each action pays a step later, critics are not told it: with a cut before every step nothing is learned of it
    probe, algorithm = Probe(delay=1, length=1000), make_algorithm(config, ACTOR)
    for start, learns in ((1, False), (0, True)):
        one = dataclasses.replace(config, horizon_start=start)
        parameters = jax.tree.map(jnp.asarray, algorithm.init(probe, one, 0))  # type: ignore[arg-type]
        first = probe.reset(random_key(0), 32)
        state = TrainState(
            parameters, algorithm.optimizer(one, parameters), *first, ACTOR.memory(32), random_key(0),
            algorithm.replay(probe, one, *first),  # type: ignore[arg-type]
        )  # fmt: skip

        def run(state: TrainState, one: Any = one) -> jax.Array:
            return algorithm.update(probe, one, own(state), jnp.float32(0.0))[1]["loss/gradient_norm"][None]  # type: ignore[arg-type]

        norm = on_each(run, 1, (OWN,), OWN)(stacked(state))
        assert (float(norm[0]) > 1e-3) == learns


@pytest.mark.parametrize(
    "config", [BPTT_CONFIG, SHAC_CONFIG, ABPT_CONFIG, FOPPO_CONFIG], ids=["bptt", "shac", "abpt", "foppo"]
)
def test_the_gradient_of_each_term_is_told_apart_and_they_add_up(config: Any) -> None:
    probe = Probe(constant=1.0, length=1000)
    _, together, _ = learn(probe, config, 3)
    _, apart, metrics = learn(probe, dataclasses.replace(config, term_gradients=True), 3)
    for a, b in zip(jax.tree.leaves(together.parameters), jax.tree.leaves(apart.parameters), strict=True):
        np.testing.assert_allclose(a, b, atol=2e-5)
    assert float(metrics["gradient/constant"][0]) == 0.0
    assert float(metrics["gradient/error"][0]) > 1e-3


def test_the_gradient_of_bptt_is_the_mean_over_devices() -> None:
    probe = Probe(delay=1, length=1000)
    _, one, _ = learn(probe, BPTT_CONFIG, 20, devices=1)
    _, two, _ = learn(probe, BPTT_CONFIG, 20, devices=2)
    for a, b in zip(jax.tree.leaves(one.parameters), jax.tree.leaves(two.parameters), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-5)


def test_a_time_out_keeps_the_value_of_what_would_follow() -> None:
    # reward 1 a step, gamma 1/2: 1 + 1/2 + 1/4 + ... = 2 although every episode is cut after one step
    probe = Probe(constant=1.0, weight=0.0, length=1, ends_for_good=False)
    _, state, _ = learn(probe, dataclasses.replace(PPO_CONFIG, gamma=0.5), 100)
    assert learned_value(state) == pytest.approx(2.0, abs=0.05)


def test_nothing_follows_a_termination() -> None:
    probe = Probe(constant=1.0, weight=0.0, length=1, ends_for_good=True)
    _, state, _ = learn(probe, dataclasses.replace(PPO_CONFIG, gamma=0.5), 100)
    assert learned_value(state) == pytest.approx(1.0, abs=0.05)


def test_gae_by_hand() -> None:
    # gamma 1/2, lambda 1/2; a termination after the second step, a time-out after the fourth
    reward = jnp.array([1.0, 2.0, 3.0, 4.0])[:, None]
    value = jnp.array([10.0, 20.0, 30.0, 40.0])[:, None]
    next_value = jnp.array([20.0, 99.0, 40.0, 50.0])[:, None]
    terminated = jnp.array([0.0, 1.0, 0.0, 0.0])[:, None]
    done = jnp.array([0.0, 1.0, 0.0, 1.0])[:, None]
    got = gae(reward, value, next_value, terminated, done, 0.5, 0.5)[:, 0]
    d0, d1, d2, d3 = 1 + 10 - 10, 2 - 20, 3 + 20 - 30, 4 + 25 - 40
    np.testing.assert_allclose(got, [d0 + d1 / 4, d1, d2 + d3 / 4, d3])


def test_gradient_decay_changes_the_gradient_and_not_the_flight() -> None:
    probe = Probe(delay=1, length=1000)
    _, exact, exact_metrics = learn(probe, BPTT_CONFIG, 1)
    _, damped, damped_metrics = learn(probe, dataclasses.replace(BPTT_CONFIG, gradient_decay=2.0), 1)
    np.testing.assert_array_equal(exact_metrics["reward"], damped_metrics["reward"])
    assert damped_metrics["loss/gradient_norm"][0] < 0.5 * exact_metrics["loss/gradient_norm"][0]
    del exact, damped


def test_what_is_shipped_is_the_running_mean_of_what_learns() -> None:
    config = dataclasses.replace(BPTT_CONFIG, learning_rate_end=BPTT_CONFIG.learning_rate)
    learners = []
    for updates in (1, 2, 3):
        plain = learn(Probe(), config, updates)[1].parameters
        jax.tree.map(np.testing.assert_array_equal, plain.policy, plain.learner)
        learners.append(plain.learner)
    # two count the same, with the third the share of the old ends at a half
    mean = jax.tree.map(lambda a, b, c: (a + b) / 4 + c / 2, *learners)
    averaged = learn(Probe(), dataclasses.replace(config, average=0.5), 3)[1].parameters
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, atol=1e-6), averaged.policy, mean)
    jax.tree.map(np.testing.assert_array_equal, averaged.learner, learners[-1])


@pytest.mark.parametrize(("decay", "middle"), [("exponential", 1e-3), ("linear", 5.05e-3)])
def test_learning_rate_falls_as_the_options_say(decay: Literal["exponential", "linear"], middle: float) -> None:
    config = PPOConfig(learning_rate=1e-2, learning_rate_end=1e-4, decay=decay)
    rates = [float(annealed(config, jnp.float32(p))) for p in (0.0, 0.5, 1.0)]
    np.testing.assert_allclose(rates, [1e-2, middle, 1e-4], rtol=1e-5)
