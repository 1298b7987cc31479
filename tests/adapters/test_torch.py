"""PyTorch's gradients through our steps."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import torch

from e2efly.adapters.torch import TorchEnv
from e2efly.environment import Env, random_key
from e2efly.learning.networks import Features
from e2efly.runs import presets

N, STEPS = 32, 12


@pytest.fixture(scope="module")
def hover() -> TorchEnv:
    """An environment for most of the tests, as its programs take long to compile."""
    return TorchEnv(presets.preset("hover", "bptt"), N)


def weights(size: int) -> np.ndarray:
    return np.random.default_rng(0).normal(scale=0.1, size=(size, 4)).astype(np.float32)


@pytest.mark.whole
@pytest.mark.parametrize("task", ["hover", "race"])
def test_gradients_through_a_flight_are_those_of_jax(task: str, hover: TorchEnv) -> None:
    """Of race, too: its memory has whole numbers, which have no gradient."""
    config = presets.preset(task, "bptt")
    env = Env.of(config.task, config.reward, config.env)
    features = Features(env.fields)

    def loss(w: jax.Array) -> jax.Array:
        def step(carry: Any, _: None) -> tuple[Any, jax.Array]:
            state, observation = carry
            state, out = env.step(state, jnp.tanh(features.of_state(observation) @ w) + env.hover)
            return (state, out.observation), jnp.mean(out.reward)

        return jnp.sum(jax.lax.scan(step, env.reset(random_key(5), N), None, length=STEPS)[1])

    w = weights(features.state_size)
    value, gradient = jax.jit(jax.value_and_grad(loss))(w)

    learned = torch.tensor(w, requires_grad=True)
    ours = hover if task == "hover" else TorchEnv(config, N)
    state, observation = ours.reset(5)
    total = torch.tensor(0.0)
    for _ in range(STEPS):
        state, step = ours.step(state, torch.tanh(observation @ learned) + torch.tensor(env.hover))
        observation, total = step.observation, total + step.reward.mean()
    total.backward()
    assert total.item() == pytest.approx(float(value), rel=1e-5)
    assert learned.grad is not None
    np.testing.assert_allclose(learned.grad, gradient, rtol=1e-3, atol=1e-4 * float(np.abs(gradient).max()))
    assert np.abs(gradient).max() > 1e-3


@pytest.mark.whole
def test_a_torch_policy_learns_by_it(hover: TorchEnv) -> None:
    torch.manual_seed(0)
    env = hover
    policy = torch.nn.Sequential(torch.nn.Linear(env.observation_size, 32), torch.nn.Tanh(), torch.nn.Linear(32, 4))
    torch.nn.init.zeros_(policy[2].weight)
    with torch.no_grad():
        policy[2].bias.copy_(torch.tensor(np.asarray(env.stepper.env.hover)))
    adam = torch.optim.Adam(policy.parameters(), 4e-3)
    state, observation = env.reset(0)
    windows = []
    for _ in range(25):
        state, observation, total = state.detach(), observation.detach(), torch.tensor(0.0)
        for _ in range(24):
            state, step = env.step(state, policy(observation))
            observation, total = step.observation, total + step.reward.mean()
        adam.zero_grad()
        (-total).backward()
        torch.nn.utils.clip_grad_norm_(policy.parameters(), 0.5)
        adam.step()
        windows.append(total.item())
    assert np.mean(windows[-5:]) > np.mean(windows[:5]) + 0.2 * abs(np.mean(windows[:5]))


def test_nothing_is_copied_on_the_way(hover: TorchEnv) -> None:
    state, _ = hover.reset(0)
    for x in state.moving:
        assert jax.dlpack.from_dlpack(x).unsafe_buffer_pointer() == x.data_ptr()


def test_actions_of_another_shape_or_type_are_refused(hover: TorchEnv) -> None:
    state, _ = hover.reset(0)
    with pytest.raises(ValueError, match=r"torch.float64 of shape \(32, 4\); accepted: torch.float32"):
        hover.step(state, torch.zeros(N, 4, dtype=torch.float64))
    with pytest.raises(ValueError, match=r"shape \(3, 4\)"):
        hover.step(state, torch.zeros(3, 4))
