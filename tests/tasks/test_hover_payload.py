"""Holding a load: what episodes draw, how the load is judged, where a gradient comes from, and what is refused."""

import dataclasses
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import PayloadConfig
from e2efly.environment import Env, EnvState, Step, random_key
from e2efly.policy.goal import Shape
from e2efly.runs import presets
from e2efly.simulation.physics import Load, State
from e2efly.tasks.hover_payload.goal import HoverPayloadRoute
from e2efly.validation.candidate import candidate
from e2efly.validation.starts import draw_starts
from e2efly.vehicles.loading import load_vehicle
from e2efly.viewing.web.exported import course

CONFIG = presets.preset("hover_payload", "bptt")
VEHICLE = load_vehicle("vis_r")


def of(**env: Any) -> Env:
    return Env.of(CONFIG.task, CONFIG.reward, dataclasses.replace(CONFIG.env, **env))


def load_of(state: State) -> Load:
    assert state.load is not None
    return state.load


@pytest.fixture(scope="module")
def env() -> Env:
    return of()


@pytest.fixture(scope="module")
def begun(env: Env) -> EnvState:
    return jax.jit(lambda e: e.reset(random_key(5), 256)[0])(env)


def test_every_episode_has_its_own_load(begun: EnvState) -> None:
    load, c = load_of(begun.vehicle), CONFIG.env.payload
    for drawn, (low, high) in ((load.mass / VEHICLE.mass, c.mass), (load.length, c.length)):
        assert low <= float(drawn.min()) < low + 0.1 * (high - low)
        assert high - 0.1 * (high - low) < float(drawn.max()) <= high
    away = np.asarray(load.position - begun.vehicle.position)
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), load.length, rtol=1e-5)
    angle = np.arccos(-away[:, 2] / np.asarray(load.length))
    assert math.radians(18) < angle.max() <= math.radians(20.01)
    assert np.mean(angle < math.radians(20) / math.sqrt(2)) == pytest.approx(0.5, abs=0.12)  # uniform in the disc
    np.testing.assert_array_equal(load.velocity, begun.vehicle.velocity)


@pytest.fixture(scope="module")
def held(env: Env, begun: EnvState) -> tuple[EnvState, list[Step], np.ndarray]:
    """Vehicles at their place, some loads of the second half aside, for three steps of the thrust that carries both."""
    n = begun.time.shape[0]
    target = jnp.broadcast_to(jnp.asarray(CONFIG.task.target), (n, 3))  # type: ignore[attr-defined]
    still, load = State.hovering(VEHICLE, target), load_of(begun.vehicle)
    aside = jnp.where(jnp.arange(n) < n // 2, 0.0, jnp.where(load.length > 0.4, 0.15, 0.0))
    below = jnp.stack([aside, 0 * aside, -jnp.sqrt(load.length**2 - aside**2)], axis=-1)
    load = dataclasses.replace(load, position=target + below, velocity=jnp.zeros((n, 3)))
    still = jax.tree.map(lambda x: x.astype(jnp.float32), dataclasses.replace(still, load=load))
    thrust = 9.81 * (1 + load.mass / VEHICLE.mass)
    action = jnp.zeros((n, 4)).at[:, 0].set((thrust - env.center[0]) / env.half[0])
    state = dataclasses.replace(begun, vehicle=still, actions=jnp.broadcast_to(action[:, None], begun.actions.shape))
    advance, steps = jax.jit(lambda s: env.step(s, action, restart=False)), []
    for _ in range(3):
        state, out = advance(state)
        steps.append(out)
    return state, steps, np.asarray(aside)


def test_the_load_is_judged(held: tuple[EnvState, list[Step], np.ndarray]) -> None:
    """Its distance from the place below the vehicle's is the error, and only a load near its place counts as held."""
    state, steps, aside = held
    np.testing.assert_allclose(steps[0].error[: len(aside) // 2], 0, atol=0.02)
    np.testing.assert_allclose(steps[0].error[aside > 0], 0.15, atol=0.03)
    assert np.all(np.asarray(state.memory)[aside == 0] > 0.09)
    assert np.all(np.asarray(state.memory)[aside > 0] == 0)
    assert not np.any(steps[-1].terminated)


def test_a_load_on_the_ground_ends_the_episode(env: Env, begun: EnvState) -> None:
    low = begun.vehicle.position.at[:, 2].set(load_of(begun.vehicle).length - 0.05)
    load = dataclasses.replace(load_of(begun.vehicle), position=low.at[:, 2].set(-0.05))
    there = dataclasses.replace(begun, vehicle=dataclasses.replace(begun.vehicle, position=low, load=load))
    out = env.step(there, jnp.zeros((len(low), 4)), restart=False)[1]
    assert np.all(out.terminated)
    assert not np.any(out.success)


def test_the_gradient_comes_through_the_cable(env: Env, begun: EnvState) -> None:
    """How the sum of the load's own reward changes with the actions agrees with a finite difference."""
    only = dataclasses.replace(env, weights={"prog2": 1.0})
    some = jax.tree.map(lambda x: x[:8] if x.shape[:1] == (256,) else x, begun)

    def total(share: jax.Array) -> jax.Array:
        def one(state: EnvState, _: None) -> tuple[EnvState, jax.Array]:
            action = jnp.asarray(env.hover) + share * jnp.array([0.1, 0.05, 0.08, 0.0])
            state, out = only.step(state, jnp.broadcast_to(action, (8, 4)), restart=False)
            return state, out.reward.sum()

        return jax.lax.scan(one, some, None, 12)[1].sum()

    value = jax.jit(total)
    slope = float(jax.jit(jax.grad(total))(jnp.asarray(1.0)))
    assert abs(slope) > 0.05
    assert slope == pytest.approx((float(value(jnp.asarray(1.02))) - float(value(jnp.asarray(0.98)))) / 0.04, rel=0.02)


def test_without_a_load_there_is_none() -> None:
    config = presets.preset("hover", "ppo")
    assert config.env.payload == PayloadConfig()
    bare = Env.of(config.task, config.reward, config.env)
    assert bare.payload is None
    state = jax.eval_shape(lambda: bare.reset(random_key(0), 2)[0])
    assert state.vehicle.load is None
    alone = of(payload=PayloadConfig())  # which is judged by where the vehicle is
    state, _ = alone.reset(random_key(0), 4)
    out = alone.step(state, jnp.zeros((4, 4)), restart=False)[1]
    away = np.linalg.norm(np.asarray(state.vehicle.position) - CONFIG.task.target, axis=1)  # type: ignore[attr-defined]
    np.testing.assert_allclose(out.error, away, atol=0.05)
    loaded = Env.of(config.task, config.reward, dataclasses.replace(config.env, payload=CONFIG.env.payload))
    assert jax.eval_shape(lambda: loaded.reset(random_key(0), 2)[0]).vehicle.load is not None


@pytest.mark.parametrize(
    ("env", "message"),
    [
        ({"payload": PayloadConfig((0.0, 0.5))}, r"env\.payload\.mass is \(0\.0, 0\.5\); accepted: 0, 0 for no load"),
        ({"payload": PayloadConfig((0.2, 0.1))}, r"env\.payload\.mass is \(0\.2, 0\.1\); accepted: 2 rising numbers"),
        ({"integrator": "euler"}, r"env\.integrator is 'euler'; accepted: semi_implicit, rk3, rk4, as env\.payload"),
        ({"randomize": {"thrust_map": 0.5}}, r"env\.payload has mass 0\.5: the weakest vehicle of these cannot hover"),
    ],
)
def test_what_cannot_fly_is_named(env: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        of(**env)


def test_plants_and_pages_have_no_loads(env: Env) -> None:
    with pytest.raises(ValueError, match=r"env\.payload has mass .*accepted: 0, 0, as no load hangs"):
        draw_starts(env, 2, 0)
    with pytest.raises(ValueError, match=r"env\.payload has mass .*accepted: 0, 0, as a page shows no load"):
        course(env, CONFIG.task, starts=2)


def test_a_flight_hovers_a_cables_length_over_the_loads_place() -> None:
    route = HoverPayloadRoute(target=(1.0, 2.0, 0.4), length=0.7)
    placed = route.course(Shape(VEHICLE.feet_height, VEHICLE.radius), 1 / 30)
    np.testing.assert_allclose(placed.goal.goal(placed.memory, np.zeros(1))[0], [1.0, 2.0, 1.1])
    assert [part.name for part in route.domain()] == ["cable_length"]


def test_a_policy_alone_flies_with_loads() -> None:
    """The zoo's policy has no run beside it: `eval` and `watch` hang the loads of the preset from its vehicle."""
    assert candidate("hover_payload").env.payload == CONFIG.env.payload
