"""Features do not know the heading; networks start where they should."""

import jax
import numpy as np

from e2efly.config import NetworkConfig, RewardConfig
from e2efly.control.vectors import rotate
from e2efly.environment import Env
from e2efly.learning.networks import Actor, Features, init_mlp
from e2efly.policy.observation import ATTITUDE, VELOCITY
from e2efly.simulation.physics.rotation import from_euler, multiply
from e2efly.tasks.hover import HoverConfig


def test_features_do_not_change_with_the_heading() -> None:
    env = Env.of(HoverConfig(), RewardConfig({"prog2": 1.0}))
    features, rng = Features(env.fields), np.random.default_rng(0)
    offset, velocity, rate = rng.normal(size=(3, 3)).astype(np.float32)
    past = rng.uniform(-1, 1, 8).astype(np.float32)
    q = from_euler(*(np.float32(x) for x in (0.3, -0.4, 0.5)))
    turn = from_euler(*(np.float32(x) for x in (0.0, 0.0, 2.0)))
    plain = np.concatenate([offset, q, velocity, rate, past])
    turned = np.concatenate([rotate(turn, offset), multiply(turn, q), rotate(turn, velocity), rate, past])
    np.testing.assert_allclose(features(turned), features(plain), atol=1e-5)
    other_sign = np.concatenate([offset, -q, velocity, rate, past])
    np.testing.assert_allclose(features(other_sign), features(plain), atol=1e-6)
    assert features(plain).shape == (features.size,)


def test_a_fresh_policy_hovers() -> None:
    hover = np.array([-0.3, 0.0, 0.1, 0.0], np.float32)
    actor = Actor.of((ATTITUDE, VELOCITY), (), NetworkConfig((32, 32), recurrent=8))
    weights = actor.init(np.random.default_rng(0), hover)
    x = np.random.default_rng(1).normal(size=(5, actor.features.size)).astype(np.float32)
    action, memory = jax.jit(actor)(weights, x, actor.memory(5))
    np.testing.assert_allclose(action, np.tile(hover, (5, 1)), atol=0.05)
    assert memory.shape == (5, 8)


def test_hidden_layers_are_orthogonal() -> None:
    weight = init_mlp(np.random.default_rng(0), (8, 16, 2), 1.0)[0][0]
    np.testing.assert_allclose(weight @ weight.T, 2 * np.eye(8), atol=1e-5)
