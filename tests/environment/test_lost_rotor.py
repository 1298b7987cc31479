"""A rotor that stops without notice."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import EnvConfig, RewardConfig
from e2efly.environment import Env, EnvState, random_key
from e2efly.environment.lost_rotor import LostRotor, draw
from e2efly.tasks.hover import HoverConfig
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle

REWARD = RewardConfig({"prog2": 1.0})
HEXA = load_vehicle("hexa")


def env_of(vehicle: str = "hexa", **options: Any) -> Env:
    return Env.of(HoverConfig(), REWARD, EnvConfig(vehicle=vehicle, **options))


def hovered(env: Env, steps: int, n: int = 6, stops: np.ndarray | None = None) -> EnvState:
    """The state after some steps of the action that hovers; from level starts at rest if the rotors that stop are
    given.
    """
    state, _ = env.reset(random_key(0), n)
    if stops is not None:
        still = {name: jnp.zeros((n, 3)) for name in ("velocity", "body_rate")}
        level = jnp.broadcast_to(jnp.array([1.0, 0, 0, 0]), (n, 4))
        vehicle = dataclasses.replace(state.vehicle, quaternion=level, **still)
        state = dataclasses.replace(state, vehicle=vehicle, lost_rotor=LostRotor(jnp.asarray(stops)))
    step = jax.jit(lambda s: env.step(s, jnp.broadcast_to(env.hover, (n, env.action_size)), restart=False)[0])
    for _ in range(steps):
        state = step(state)
    return state


class TestDraw:
    def test_each_vehicle_loses_at_most_one_of_its_rotors_and_each_as_often(self) -> None:
        stops = np.asarray(draw(0.7, np.array([0.5, 3.0]), random_key(0), 20_000, 6).stops)
        lost = np.isfinite(stops)
        assert lost.sum(axis=1).max() == 1
        np.testing.assert_allclose(lost.mean(axis=0), 0.7 / 6, atol=0.01)
        assert np.all((stops[lost] >= 0.5) & (stops[lost] <= 3.0))
        assert np.mean(stops[lost]) == pytest.approx(1.75, abs=0.03)

    @pytest.mark.parametrize("chance, share", [(0.0, 0.0), (1.0, 1.0)])
    def test_never_and_always(self, chance: float, share: float) -> None:
        stops = np.asarray(draw(chance, np.array([1.0, 1.0]), random_key(0), 500, 4).stops)
        assert np.isfinite(stops).any(axis=1).mean() == share
        assert np.all(stops[np.isfinite(stops)] == 1.0)


class TestStep:
    def test_until_a_rotor_stops_nothing_differs_by_a_bit(self) -> None:
        for vehicle in ("vis_r", "hexa"):
            with_one, without = (
                hovered(env_of(vehicle, **options), 10, 16)
                for options in ({"lost_rotor": 1.0, "lost_rotor_time": (1.0, 2.0)}, {})
            )
            assert without.lost_rotor is None
            for a, b in zip(jax.tree.leaves(with_one.vehicle), jax.tree.leaves(without.vehicle), strict=True):
                np.testing.assert_array_equal(a, b)

    def test_it_runs_down_with_the_lag_of_its_motor(self) -> None:
        stops = np.where(np.eye(6, dtype=bool), 0.0, np.inf)
        env = env_of(lost_rotor=1.0, command_mode="rotor_share")
        reached = np.asarray(hovered(env, 3, stops=stops).vehicle.rotor_speed)
        left = HEXA.hover_rotor_speed * np.exp(-3 * env.control_period / HEXA.motor_time_constant)
        np.testing.assert_allclose(reached[np.eye(6, dtype=bool)], left, rtol=1e-4)
        np.testing.assert_allclose(reached[~np.eye(6, dtype=bool)], HEXA.hover_rotor_speed, rtol=1e-5)

    def test_what_is_left_pushes_and_turns_as_the_sum_over_the_other_rotors(self) -> None:
        """By hand: five rotors at a sixth of the weight each."""
        stops = np.where(np.eye(6, dtype=bool), 0.0, np.inf)
        env = env_of(lost_rotor=1.0, command_mode="rotor_share")
        state = hovered(env, 0, stops=stops)
        stopped = dataclasses.replace(
            state.vehicle, rotor_speed=jnp.where(np.eye(6, dtype=bool), 0.0, state.vehicle.rotor_speed)
        )
        state = dataclasses.replace(state, vehicle=stopped)
        after = env.step(state, jnp.broadcast_to(env.hover, (6, 6)), restart=False)[0].vehicle
        each = HEXA.mass * GRAVITY / 6
        for i, (x, y) in enumerate(HEXA.rotor_position):
            torque = -each * np.array([y, -x, HEXA.torque_ratio * HEXA.rotor_spin[i]])
            turned = np.asarray(after.body_rate[i]) / env.control_period
            np.testing.assert_allclose(turned, torque / HEXA.inertia, rtol=0.03, atol=0.03)
            assert after.velocity[i, 2] == pytest.approx(-GRAVITY / 6 * env.control_period, rel=0.03)

    def test_the_vehicles_own_ceiling_stays(self) -> None:
        weak = dataclasses.replace(HEXA, rotor_speed_ceiling=np.full(6, 300.0))
        found = LostRotor(jnp.array([[1.0] + 5 * [jnp.inf]] * 2)).weaker(weak, jnp.array([0.5, 1.5]))
        np.testing.assert_array_equal(found.rotor_speed_ceiling, [[300.0] * 6, [0.0] + [300.0] * 5])

    def test_the_gradient_of_what_is_left_is_that_of_finite_differences(self) -> None:
        env = env_of("vis_r", lost_rotor=1.0, lost_rotor_time=(0.05, 0.05), command_mode="rotor_share")
        begun, _ = env.reset(random_key(0), 1)

        def height(action: jax.Array) -> jax.Array:
            def one(state: EnvState, _: None) -> tuple[EnvState, None]:
                return env.step(state, action, restart=False)[0], None

            return jax.lax.scan(one, begun, length=6)[0].vehicle.velocity[0, 2]

        action, size = jnp.asarray(env.hover)[None] + 0.05, 1e-2
        slope, flown = np.asarray(jax.jit(jax.grad(height))(action))[0], jax.jit(height)
        for i in range(4):
            ends = [float(flown(action.at[0, i].add(s))) for s in (size, -size)]
            assert slope[i] == pytest.approx((ends[0] - ends[1]) / (2 * size), rel=0.05, abs=5e-3)


def test_it_is_one_of_the_things_that_an_undisturbed_environment_leaves_out() -> None:
    env = env_of(lost_rotor=0.9)
    assert env.is_disturbed and not env_of().is_disturbed and not env.undisturbed().is_disturbed
    stops = np.asarray(env.undisturbed().reset(random_key(0), 200)[0].lost_rotor.stops)  # type: ignore[union-attr]
    assert np.all(np.isinf(stops))
    eased = np.asarray(env.eased(0.5).reset(random_key(0), 5000)[0].lost_rotor.stops)  # type: ignore[union-attr]
    assert np.isfinite(eased).any(axis=1).mean() == pytest.approx(0.45, abs=0.03)


@pytest.mark.parametrize("options", [{"lost_rotor": 1.5}, {"lost_rotor_time": (3.0, 1.0)}])
def test_what_is_no_chance_or_time_is_refused(options: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=rf"env.{next(iter(options))} is .*; accepted: "):
        env_of(**options)
