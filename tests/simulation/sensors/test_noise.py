"""Noise of the observed state."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import NoiseConfig
from e2efly.control import Quat
from e2efly.environment import random_key
from e2efly.simulation.physics import State, rotation
from e2efly.simulation.sensors.noise import add_noise

N = 20_000
NOISE = NoiseConfig(position=0.02, velocity=0.1, attitude=0.03, body_rate=0.2)


@pytest.fixture(scope="module")
def state() -> State:
    q = rotation.from_euler(*(jnp.full(N, x) for x in (0.3, -0.5, 2.0)))
    return State(jnp.ones((N, 3)), -jnp.ones((N, 3)), q, 2 * jnp.ones((N, 3)), 2000 * jnp.ones((N, 4)))


def test_standard_deviations(state: State) -> None:
    seen = add_noise(NOISE, random_key(0), state)
    turn = 2 * Quat.of(state.quaternion).conjugate().compose(Quat.of(seen.quaternion)).stack()[:, 1:]
    for error, std in (
        (seen.position - state.position, 0.02),
        (seen.velocity - state.velocity, 0.1),
        (turn, 0.03),
        (seen.body_rate - state.body_rate, 0.2),
    ):
        np.testing.assert_allclose(np.std(error, axis=0), std, rtol=0.03)
        np.testing.assert_allclose(np.mean(error, axis=0), 0, atol=4 * std / np.sqrt(N))
        assert np.max(np.abs(np.corrcoef(np.asarray(error).T) - np.eye(3))) < 0.03
    np.testing.assert_allclose(np.linalg.norm(seen.quaternion, axis=-1), 1, rtol=1e-6)
    np.testing.assert_array_equal(seen.rotor_speed, state.rotor_speed)


def test_no_noise_changes_nothing(state: State) -> None:
    seen = add_noise(NoiseConfig(), random_key(0), state)
    jax.tree.map(np.testing.assert_array_equal, seen, state)


def test_seeds(state: State) -> None:
    a, b, c = (add_noise(NOISE, random_key(s), state) for s in (3, 3, 4))
    jax.tree.map(np.testing.assert_array_equal, a, b)
    assert np.mean(np.asarray(a.position) == np.asarray(c.position)) < 0.01
