"""Windows whose gradient is followed, by their gradients."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import SHACConfig
from e2efly.environment import Env, random_key
from e2efly.learning.rollout import RolloutState, advance, window
from e2efly.runs import presets
from tests.learning.probe import Probe

CONFIG = SHACConfig(gamma=0.9, horizon=1)


def value(images: Any, observation: jax.Array, privileged: jax.Array, memory: jax.Array, noise: Any) -> jax.Array:
    """Of the probe's privileged observation, which is the last action."""
    del images, observation, memory, noise
    return privileged[:, 0]


def test_what_follows_a_time_out_is_followed_and_nothing_follows_an_end() -> None:
    def gained(action: jax.Array, ends_for_good: bool) -> tuple[jax.Array, jax.Array]:
        probe: Any = Probe(length=1, ends_for_good=ends_for_good, told=True)
        first = RolloutState(*probe.reset(random_key(0), 2), jnp.zeros((2, 0)), jnp.ones(2))
        gain, end, (_, follows, _) = window(
            probe, CONFIG, first, lambda at, z: (action, at.memory, None), value, jnp.zeros((1, 2, 4)),
            jnp.zeros(1, bool),
        )  # fmt: skip
        return gain["value"] - end.value(probe, value), follows[0]

    action, expected = jnp.full((2, 4), 0.25), np.zeros((2, 4))
    for ends_for_good, slope in ((True, 0.0), (False, 0.9 / 2)):
        expected[:, 0] = slope
        gradient, follows = jax.grad(gained, has_aux=True)(action, ends_for_good)
        np.testing.assert_allclose(gradient, expected, rtol=1e-6)
        np.testing.assert_array_equal(follows, [0.25, 0.25])


@pytest.mark.whole
def test_the_decay_of_a_gradient_is_the_same_whether_others_start_anew() -> None:
    task = presets.preset("hover", "shac")
    env, action, memory = Env.of(task.task, task.reward, task.env), jnp.zeros((2, 4)), jnp.zeros((2, 0))
    state, observation = env.reset(random_key(0), 2)

    def after(velocity: jax.Array, height: float, decay: float) -> tuple[tuple[jax.Array, jax.Array], jax.Array]:
        """The velocity that vehicle 0 has, and sees, after a step; vehicle 1 is lost where it is too low."""
        low = state.vehicle.position.at[1, 2].add(height)
        vehicle = dataclasses.replace(state.vehicle, velocity=velocity, position=low)
        at = RolloutState(dataclasses.replace(state, vehicle=vehicle), observation, memory, jnp.ones(2))
        after, out = advance(env, dataclasses.replace(CONFIG, gradient_decay=decay), at, action, memory, critic=True)
        return (after.env.vehicle.velocity[0], after.observation[0]), out.done

    keep = np.exp(-10.0 * env.control_period)
    slopes = jax.jacobian(after, has_aux=True)
    (exact, seen), _ = slopes(state.vehicle.velocity, 0.0, 0.0)
    for height in (0.0, -100.0):
        (had, saw), done = slopes(state.vehicle.velocity, height, 10.0)
        np.testing.assert_array_equal(done, [False, height < 0])
        np.testing.assert_allclose(had[:, 0], keep * exact[:, 0], rtol=1e-5)
        np.testing.assert_allclose(saw[:, 0], seen[:, 0], rtol=1e-5)
