"""What the policy is told of the vehicle: late, turned, jumping and repeated poses."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import EnvConfig, EstimateConfig, LinkConfig, NoiseConfig, RewardConfig
from e2efly.environment import Env, random_key
from e2efly.environment.pose_errors import PoseErrors, draw
from e2efly.simulation.physics import State
from e2efly.tasks.hover import HoverConfig

DT = 0.005


def state(position: Any = (0.0, 0.0, 1.0), velocity: Any = (0.0, 0.0, 0.0), body_rate: Any = (0.0, 0.0, 0.0)) -> State:
    rows = [jnp.broadcast_to(jnp.asarray(x, jnp.float32), (4, 3)) for x in (position, velocity, body_rate)]
    level = jnp.broadcast_to(jnp.asarray([1.0, 0.0, 0.0, 0.0]), (4, 4))
    return State(rows[0], rows[1], level, rows[2], jnp.zeros((4, 4)))


def errors(seen: State, **given: Any) -> PoseErrors:
    usual = {"lag": np.zeros((4, 4)), "turned": np.zeros((4, 3)), "jump": np.zeros((4, 3)), "hold": np.zeros(4)}
    return PoseErrors.of(**{k: jnp.asarray(v, jnp.float32) for k, v in (usual | given).items()}, seen=seen)


@jax.jit
def told(e: PoseErrors, motion: State) -> State:
    """What is told of a motion, whose leaves have a leading axis of control steps."""

    def step(carry: tuple[PoseErrors, Any], seen: State) -> tuple[tuple[PoseErrors, Any], State]:
        e, i = carry
        e = e.after(jax.random.fold_in(jax.random.key(1), i), seen, DT)
        return (e, i + 1), e.shown(seen)

    return jax.lax.scan(step, (e, jnp.zeros((), jnp.int32)), motion)[1]


def moving(steps: int, **rates: Any) -> State:
    """A motion whose named parts grow evenly, by 1 in each step along the first axis, from 1 on."""
    still = jax.tree.map(lambda x: jnp.broadcast_to(x, (steps, *x.shape)), state())
    along = jnp.arange(1.0, steps + 1)[:, None, None] * jnp.asarray([1.0, 0.0, 0.0])
    return dataclasses.replace(still, **{name: jnp.broadcast_to(along, (steps, 4, 3)) for name in rates})


def test_each_field_follows_a_step_by_its_own_first_order_lag() -> None:
    lag = np.broadcast_to([0.02, 0.05, 0.03, 0.01], (4, 4))
    still, moved = state(), state(position=(1.0, 0.0, 1.0), velocity=(0.0, 2.0, 0.0), body_rate=(0.0, 0.0, 3.0))
    turn = np.array([np.cos(0.1), 0, 0, np.sin(0.1)])
    moved = dataclasses.replace(moved, quaternion=jnp.broadcast_to(-turn, (4, 4)).astype(jnp.float32))  # the other sign
    last = jax.tree.map(
        lambda x: x[-1], told(errors(still, lag=lag), jax.tree.map(lambda x: jnp.stack([x] * 8), moved))
    )
    share = 1 - np.exp(-8 * DT / np.array([0.02, 0.05, 0.03, 0.01]))
    np.testing.assert_allclose(last.position[0, 0], share[0], rtol=1e-4)
    np.testing.assert_allclose(last.velocity[0, 1], 2 * share[1], rtol=1e-4)
    np.testing.assert_allclose(2 * np.arctan2(last.quaternion[0, 3], last.quaternion[0, 0]) % (2 * np.pi),
                               0.2 * share[2], rtol=1e-2)  # fmt: skip
    np.testing.assert_allclose(last.body_rate[0, 2], 3 * share[3], rtol=1e-4)


def test_without_errors_the_policy_is_told_the_state() -> None:
    motion = moving(5, position=1, velocity=1)
    shown = told(errors(state()), motion)
    for name in ("position", "velocity", "quaternion", "body_rate"):
        np.testing.assert_array_equal(getattr(shown, name), getattr(motion, name))


def test_poses_are_repeated_and_body_rates_are_not() -> None:
    shown = told(errors(state(), hold=np.full(4, 3.0)), moving(2000, position=1, body_rate=1))
    at = np.asarray(shown.position[..., 0])
    np.testing.assert_array_equal(shown.body_rate[:, 0, 0], np.arange(1, 2001))
    new = np.concatenate([np.ones((1, 4), bool), np.diff(at, axis=0) != 0])
    np.testing.assert_array_equal(at[new], np.broadcast_to(np.arange(1, 2001)[:, None], at.shape)[new])
    for i in range(4):
        times = np.diff(np.flatnonzero(new[:, i])) - 1
        assert set(times) == {0, 1, 2, 3}
        assert np.mean(times) == pytest.approx(1.5, abs=0.2)


def test_heading_and_tilt_are_off_by_what_is_said() -> None:
    shown = told(errors(state(), turned=np.tile([0.1, 0.0, 0.0], (4, 1))), moving(1))
    np.testing.assert_allclose(shown.quaternion[0, 0], [np.cos(0.05), 0, 0, np.sin(0.05)], atol=1e-6)
    shown = told(errors(state(), turned=np.tile([0.0, 0.03, 0.04], (4, 1))), moving(1))
    w, x, y, z = np.asarray(shown.quaternion[0, 0], float)
    up = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    assert np.arccos(up[2]) == pytest.approx(0.05, rel=1e-3)


def test_positions_jump_for_a_short_time_now_and_then() -> None:
    jump = np.tile([0.0, 0.3, 0.4], (4, 1))
    shown = told(errors(state(), jump=jump), moving(20_000))
    off = np.linalg.norm(np.asarray(shown.position) - [0, 0, 1], axis=-1)
    assert set(np.round(np.unique(off), 5)) == {0.0, 0.5}
    assert np.mean(off > 0) == pytest.approx(0.2 / 4.2, rel=0.25)
    begun = np.sum(np.diff((off > 0).astype(int), axis=0) > 0)
    assert np.sum(off > 0) * DT / begun == pytest.approx(0.2, rel=0.25)


def test_half_of_the_episodes_lack_each_effect_and_the_others_draw_up_to_the_largest() -> None:
    largest = EstimateConfig(0.04, 0.08, 0.03, 0.02, 0.09, 0.035, 0.1, 4.0)
    seen = jax.tree.map(lambda x: jnp.broadcast_to(x[:1], (20_000, *x.shape[1:])), state())
    e = draw(largest, random_key(0), seen)
    tilt, jump = np.linalg.norm(e.turned[:, 1:], axis=1), np.linalg.norm(e.jump, axis=1)
    strengths = [*np.asarray(e.lag).T, np.abs(e.turned[:, 0]), tilt, jump, np.asarray(e.hold)]
    for found, most in zip(strengths, dataclasses.astuple(largest), strict=True):
        assert np.mean(found == 0) == pytest.approx(0.5, abs=0.02)
        assert np.mean(found[found > 0]) == pytest.approx(most / 2, rel=0.03)
        assert np.max(found) == pytest.approx(most, rel=0.01)
    assert np.mean(e.turned[:, 0] < 0) == pytest.approx(0.25, abs=0.02)


def made(**config: Any) -> Env:
    return Env.of(HoverConfig(), RewardConfig({"prog2": 1.0}), EnvConfig(action_latency=(0.02, 0.02), **config))


def test_an_environment_that_draws_none_of_it_is_the_same_as_before() -> None:
    plain, zero = made(), made(estimate=EstimateConfig(hold=1e-9), link=LinkConfig(silence=1e-9))
    assert plain.reset(random_key(0), 4)[0].estimate is None
    results = []
    for env in (plain, zero):
        state, seen = env.reset(random_key(0), 4)
        state, out = env.step(state, seen[:, :4])
        results.append((seen, out.observation, out.reward, state.vehicle.velocity))
    for a, b in zip(*results, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-6)


def test_it_is_the_observation_that_is_late_not_the_reward() -> None:
    slow = made(estimate=EstimateConfig(velocity_lag=1.0))
    state, _ = slow.reset(random_key(0), 4)
    assert state.estimate is not None
    late = dataclasses.replace(state, estimate=dataclasses.replace(state.estimate, lag=jnp.full((4, 4), 0.5)))
    action = jnp.full((4, 4), 0.3)
    outs = [jax.jit(slow.step)(x, action)[1] for x in (state, late)]
    np.testing.assert_array_equal(outs[0].reward, outs[1].reward)
    assert np.abs(outs[0].observation - outs[1].observation).max() > 1e-4


def test_the_gradient_goes_through_a_lag_and_a_repetition() -> None:
    e = errors(state(), lag=np.full((4, 4), 0.02), hold=np.full(4, 2.0))

    def seen(moves: Any) -> Any:
        motion = moving(6)
        motion = dataclasses.replace(motion, velocity=jnp.swapaxes(moves.reshape(-1, 6, 3), 0, 1)[:, :4])
        return jnp.swapaxes(told(e, motion).velocity, 0, 1).reshape(4, -1)

    moves = jnp.asarray(np.random.default_rng(0).normal(size=(4, 18)), jnp.float32)
    found = jax.jacobian(lambda x: seen(x)[0])(moves)[:, 0]
    for k in range(18):
        way = jnp.zeros_like(moves).at[0, k].set(0.5)
        np.testing.assert_allclose(found[:, k], (seen(moves + way) - seen(moves - way))[0], atol=1e-4)
    assert 0 < np.count_nonzero(np.abs(np.asarray(found)).sum(axis=0) < 1e-6) < 18  # skipped poses do not count


def test_an_undisturbed_environment_has_none_of_it() -> None:
    env = made(estimate=EstimateConfig(velocity_lag=0.1, hold=2.0), link=LinkConfig(dropped=0.3))
    assert env.is_disturbed and not env.undisturbed().is_disturbed
    half = env.eased(0.5)
    assert half.estimate == EstimateConfig(velocity_lag=0.05, hold=1.0) and half.link == LinkConfig(dropped=0.15)
    noisy = made(estimate=EstimateConfig(velocity_lag=0.1), noise=NoiseConfig(position=0.01, velocity=0.2))
    assert noisy.eased(0.5).noise == NoiseConfig(position=0.005, velocity=0.1)
    assert noisy.undisturbed().noise == NoiseConfig()
