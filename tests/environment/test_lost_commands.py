"""Commands that do not reach the flight controller."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import LinkConfig
from e2efly.environment import random_key
from e2efly.environment.lost_commands import EVERY, LostCommands, draw

DT = 0.01


def arrived(link: LostCommands, steps: int) -> np.ndarray:
    """(t, n) what the controller has, of the commands 1, 2, 3, ..."""
    n = len(link.dropped)

    def step(link: LostCommands, i: jax.Array) -> tuple[LostCommands, jax.Array]:
        key = jax.random.fold_in(jax.random.key(0), i)
        link = link.after(key, jnp.full((n, 4), i + 1.0), jnp.full(n, i * DT))
        return link, link.arrived[:, 0, 0]

    return np.asarray(jax.lax.scan(step, link, jnp.arange(steps))[1])


def link(dropped: float, silence: float, phase: float = 1.0, n: int = 50) -> LostCommands:
    return LostCommands(*(jnp.full(n, x) for x in (dropped, silence, phase)), jnp.zeros((n, 3, 4)))


def test_without_losses_every_command_arrives_in_order() -> None:
    one = link(0.0, 0.0)
    np.testing.assert_array_equal(arrived(one, 20), np.broadcast_to(np.arange(1, 21)[:, None], (20, 50)))
    for i in (1.0, 2.0):
        one = one.after(random_key(0), jnp.full((50, 4), i), jnp.zeros(50))
    np.testing.assert_array_equal(one.arrived[0, :, 0], [2.0, 1.0, 0.0])


def test_a_share_is_dropped_and_the_last_one_goes_on() -> None:
    got = arrived(link(0.2, 0.0), 400)
    sent = np.arange(1, 401)[:, None]
    assert np.mean(got != sent) == pytest.approx(0.2, abs=0.01)
    previous = np.concatenate([np.zeros((1, 50)), got[:-1]])
    assert np.all((got == sent) | (got == previous))


def test_a_silence_comes_once_in_its_time_and_lasts_as_long_as_said() -> None:
    got = arrived(link(0.0, 0.2, phase=1.0), 700)[:, 0]
    lost = np.flatnonzero(got != np.arange(1, 701))
    begins = lost[np.concatenate([[True], np.diff(lost) > 1])]
    np.testing.assert_allclose(begins * DT, [EVERY - 1.0, 2 * EVERY - 1.0], atol=1.5 * DT)
    assert len(lost) == pytest.approx(2 * 0.2 / DT, abs=2)


def test_an_episode_does_not_begin_in_a_silence() -> None:
    drawn = draw(LinkConfig(dropped=0.1, silence=0.5), random_key(0), jnp.zeros((20_000, 2, 4)))
    assert np.all(np.asarray(drawn.phase) >= np.asarray(drawn.silence)) and np.max(drawn.phase) <= EVERY
    for found, most in ((drawn.dropped, 0.1), (drawn.silence, 0.5)):
        assert np.mean(np.asarray(found) == 0) == pytest.approx(0.5, abs=0.02)
        assert np.max(found) == pytest.approx(most, rel=0.01)
