"""The air that vehicles move, against the published curves."""

import dataclasses
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import EnvConfig, RewardConfig
from e2efly.environment import Env, random_key
from e2efly.environment.air import DENSITY, Jet, cushion, downwash, propeller
from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import from_euler
from e2efly.tasks.hover import HoverConfig
from e2efly.tasks.swap import SwapConfig
from e2efly.tasks.task import at_rest
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle

VEHICLE = load_vehicle("vis_r")
JET = Jet.of(VEHICLE)
REWARD = RewardConfig({"prog2": 1.0})


def two(offset: tuple[float, float, float], roll: float = 0.0) -> State:
    """A vehicle, and one at an offset from it, m, which is rolled by an angle, rad."""
    state = at_rest(jnp.array([[0.0, 0.0, 5.0], np.add(offset, (0.0, 0.0, 5.0)).tolist()]))
    turned = from_euler(jnp.array([0.0, roll]), jnp.zeros(2), jnp.zeros(2))
    return dataclasses.replace(state, quaternion=turned)


class TestJet:
    def test_its_mouth_carries_the_weight(self) -> None:
        area = math.pi / 4 * float(JET.diameter) ** 2
        assert DENSITY * area * float(JET.speed) ** 2 == pytest.approx(float(VEHICLE.mass) * GRAVITY, rel=1e-5)
        assert float(propeller(VEHICLE)) == pytest.approx(0.0445, abs=0.002)  # 3.5 inches across

    @pytest.mark.parametrize("distance", [15.0, 30.0, 60.0])
    def test_it_decays_as_panchapakesan_and_lumley_measured(self, distance: float) -> None:
        """Their table: U0 / Uc = (x / d) / 6.06, and half the velocity at r = 0.096 x."""
        x = distance * JET.diameter
        middle = float(JET.velocity(x, jnp.zeros(())))
        assert float(JET.speed) / middle == pytest.approx(distance / 6.06, rel=1e-5)
        assert float(JET.velocity(x, (0.096 * x) ** 2)) == pytest.approx(middle / 2, rel=1e-5)

    def test_it_does_not_gain_momentum(self) -> None:
        for distance in (10.0, 20.0, 40.0):  # the profile's own integral is 0.9 of the mouth's: what its tails miss
            x = distance * JET.diameter
            r = np.linspace(0.0, 2.0 * float(x), 20_001)
            flow = np.asarray(JET.velocity(x, jnp.asarray(r**2)), float)
            momentum = DENSITY * np.trapezoid(2 * np.pi * r * flow**2, r)
            assert momentum == pytest.approx(float(VEHICLE.mass) * GRAVITY, rel=0.15)


class TestDownwash:
    def test_who_is_above_blows_down_at_who_is_below(self) -> None:
        wind = np.asarray(downwash(JET, two((0.0, 0.0, 1.0)), 2))
        assert wind[0, 2] == pytest.approx(-float(JET.velocity(1.0, jnp.zeros(()))), rel=1e-4)
        assert np.abs(wind[0, :2]).max() < 1e-6 and not np.any(wind[1])

    def test_a_jet_leaves_against_the_thrust(self) -> None:
        level, towards, away = (
            np.asarray(downwash(JET, two((0.0, 1.0, 1.0), roll), 2))[0] for roll in (0.0, -math.pi / 4, math.pi / 4)
        )
        assert np.linalg.norm(level) < 0.01 and not np.any(away)
        assert towards[1] == pytest.approx(towards[2], rel=1e-3) and towards[2] < -3.0

    def test_worlds_are_apart(self) -> None:
        above = two((0.0, 0.0, 1.0))
        assert not np.any(downwash(JET, above, 1))
        four = jax.tree.map(lambda x: None if x is None else jnp.concatenate([x, x]), above)
        wind = np.asarray(downwash(JET, four, 2))
        np.testing.assert_allclose(wind[2:], wind[:2])

    def test_its_gradient_is_that_of_finite_differences(self) -> None:
        def blown(x: jax.Array) -> jax.Array:
            state = two((0.0, 0.0, 1.0))
            return downwash(JET, dataclasses.replace(state, position=state.position.at[0].add(x)), 2)[0, 2]

        at, step = jnp.array([0.05, 0.02, -0.1]), 1e-2
        slope = jax.grad(blown)(at)
        for i in range(3):
            ends = [float(blown(at.at[i].add(s))) for s in (step, -step)]
            assert float(slope[i]) == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=0.03, abs=0.05)

    def test_the_environment_pushes_the_lower_vehicle_down(self) -> None:
        falls = []
        for strength in (0.0, 1.0):
            env = Env.of(SwapConfig(agents=2), REWARD, EnvConfig(downwash=strength))
            state, _ = env.reset(random_key(0), 2)
            state = dataclasses.replace(state, vehicle=dataclasses.replace(
                state.vehicle, position=jnp.array([[0, 0, 2.0], [0, 0, 3.0]]), quaternion=two((0, 0, 1)).quaternion
            ))  # fmt: skip
            reached, _ = env.step(state, jnp.broadcast_to(env.hover, (2, 4)), restart=False)
            falls.append(np.asarray(reached.vehicle.velocity[:, 2]))
        assert falls[1][0] < falls[0][0] - 0.01 and falls[1][1] == pytest.approx(falls[0][1], abs=1e-5)

    def test_a_vehicle_alone_has_none(self) -> None:
        with pytest.raises(ValueError, match=r"env.downwash is 1.0; accepted: 0, as a world of hover has one vehicle"):
            Env.of(HoverConfig(), REWARD, EnvConfig(downwash=1.0))


@pytest.mark.parametrize("heights, gain", [(0.5, 4 / 3), (1.0, 16 / 15), (2.0, 64 / 63), (0.1, 4 / 3)])
def test_the_cushion_is_that_of_cheeseman_and_bennett(heights: float, gain: float) -> None:
    """1 / (1 - (R / 4 z)^2), for heights in radii; below half a radius it grows no more."""
    assert float(cushion(0.05, jnp.asarray(0.05 * heights))) == pytest.approx(gain, rel=1e-5)


def test_the_ground_lifts_a_vehicle_that_hovers_low() -> None:
    rises = []
    for height in (0.06, 2.0):
        env = Env.of(HoverConfig(target=(0.0, 0.0, 2.0)), REWARD, EnvConfig(cushion=1.0))
        state, _ = env.reset(random_key(0), 1)
        level = at_rest(jnp.array([[0.0, 0.0, height]]))
        state = dataclasses.replace(state, vehicle=dataclasses.replace(
            state.vehicle, position=level.position, velocity=level.velocity, quaternion=level.quaternion,
            body_rate=level.body_rate,
        ))  # fmt: skip
        reached, _ = env.step(state, jnp.broadcast_to(env.hover, (1, 4)), restart=False)
        rises.append(float(reached.vehicle.velocity[0, 2]))
    gain = 1 / (1 - (0.0445 / (4 * 0.06)) ** 2) - 1
    assert rises[0] - rises[1] == pytest.approx(gain * GRAVITY / 30, rel=0.15)
