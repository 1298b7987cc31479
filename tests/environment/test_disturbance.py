"""What a vehicle file does not know: gusts, pushes, uneven rotors, sag, an offset centre of mass, drifting poses."""

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import DisturbanceConfig, EnvConfig, RewardConfig
from e2efly.environment import Env, EnvState, random_key
from e2efly.environment.disturbance import Disturbance, advance, draw
from e2efly.tasks.hover import HoverConfig
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle
from tests.gradients import central, reverse

STILL = HoverConfig(position=0.0, velocity=0.0, tilt=0.0, body_rate=0.0)
ACTS = ("gust", "rotor_share", "sag", "drift", "push")
"""What acts in a flight, through which gradients go."""
step = jax.jit(partial(Env.step, restart=False))


def make(**config: Any) -> Env:
    return Env.of(STILL, RewardConfig({"prog2": 1.0}), EnvConfig(action_latency=(0.0, 0.0), **config))


def disturbed(**largest: float) -> Env:
    return make(disturbance=DisturbanceConfig(**largest))


def flown(env: Env, steps: int, n: int = 4) -> EnvState:
    """Hovering without feedback, the throttle at the nominal vehicle's hover."""

    def run(state: EnvState) -> EnvState:
        hover = jnp.broadcast_to(env.hover, (n, 4))
        return jax.lax.scan(lambda s, _: (env.step(s, hover, restart=False)[0], None), state, length=steps)[0]

    return jax.jit(run)(env.reset(random_key(0), n)[0])


def test_nothing_is_drawn_where_nothing_is_asked_for() -> None:
    assert make().reset(random_key(0), 2)[0].disturbance is None


def test_each_episode_draws_within_what_is_asked_for() -> None:
    config = DisturbanceConfig(gust=2.0, rotor=0.1, sag=0.2, drift=0.05, ceiling=0.25, push=0.1)
    d = draw(config, random_key(0), 20_000)
    for drawn, low, high in (
        (d.gust_speed, 0, 2.0), (d.rotor_share, 0.9, 1.1), (d.sag, 0, 0.2), (d.drift_rate, 0, 0.05),
        (d.ceiling, 0.75, 1.0), (jnp.linalg.norm(d.push, axis=1) / GRAVITY, 0, 0.1), (d.push / GRAVITY, -0.1, 0.1),
    ):  # fmt: skip
        assert low <= float(drawn.min()) < low + 0.02 * (high - low)
        assert high - 0.02 * (high - low) < float(drawn.max()) <= high + 1e-6


def test_a_rotor_that_is_told_its_highest_thrust_reaches_its_ceiling() -> None:
    """And no ceiling of its own leaves it as it was."""
    config = EnvConfig(
        command_mode="rotor_thrust", action_latency=(0.0, 0.0), disturbance=DisturbanceConfig(ceiling=0.3)
    )
    env = Env.of(STILL, RewardConfig({"prog2": 1.0}), config)
    state = env.reset(random_key(0), 4)[0]
    told = jax.lax.fori_loop(0, 15, lambda _, s: env.step(s, jnp.ones((4, 4)), restart=False)[0], state)
    vehicle = load_vehicle("vis_r")
    reached = np.vectorize(vehicle.rotor_thrust)(np.asarray(told.vehicle.rotor_speed, np.float64))
    np.testing.assert_allclose(reached / vehicle.thrust_range[1], state.disturbance.ceiling, rtol=1e-3)


def test_gusts_keep_their_strength_and_forget_within_their_time() -> None:
    n, dt = 50_000, 0.1
    d = draw(DisturbanceConfig(gust=3.0, gust_time=0.5), random_key(1), n)
    later = advance(d, random_key(2), dt)
    strength = np.asarray(d.gust_speed)[:, None]
    before, after = np.asarray(d.gust) / strength, np.asarray(later.gust) / strength
    assert before.std() == pytest.approx(1.0, abs=0.02)
    assert after.std() == pytest.approx(1.0, abs=0.02)
    assert np.mean(before * after) == pytest.approx(np.exp(-dt / 0.5), abs=0.02)


@pytest.mark.whole
def test_poses_drift_as_a_random_walk_and_the_vehicle_does_not() -> None:
    d = Disturbance.none(20_000)
    d = Disturbance(**{**vars(d), "drift_rate": jnp.full(20_000, 0.05)})
    for i in range(40):
        d = advance(d, random_key(3, i), 0.1)
    assert float(d.drift.std()) == pytest.approx(0.05 * 2.0, rel=0.03)  # after 4 s
    env = disturbed(drift=0.1)
    state = flown(env, 30)
    clean = flown(make(), 30)
    np.testing.assert_allclose(state.vehicle.position, clean.vehicle.position, atol=1e-6)
    assert state.disturbance is not None
    shown = step(env, state, jnp.broadcast_to(env.hover, (4, 4)))[1].observation
    true = step(make(), clean, jnp.broadcast_to(env.hover, (4, 4)))[1].observation
    assert np.abs(shown - true)[:, :3].max() > 1e-3
    np.testing.assert_allclose(shown[:, 3:], true[:, 3:], atol=1e-5)


def test_a_sagging_battery_lets_the_vehicle_sink_more_and_more() -> None:
    """At hover throttle the acceleration is -g times the share that is lost."""
    env = disturbed(sag=0.2)
    state, seconds = flown(env, 60), 2.0
    assert state.disturbance is not None
    lost = np.asarray(state.disturbance.sag) / float(env.task.episode_s)  # per second
    fallen = np.asarray(state.vehicle.position)[:, 2] - STILL.target[2]
    np.testing.assert_allclose(fallen, -GRAVITY * lost * seconds**3 / 6, rtol=0.06)


def test_a_push_accelerates_a_level_vehicle_along_the_ground() -> None:
    """A force of p times the weight gives p g, less the little drag of a second."""
    state, seconds = flown(disturbed(push=0.1), 30), 1.0
    assert state.disturbance is not None
    moved = np.asarray(state.vehicle.position) - np.asarray(STILL.target)
    push = np.asarray(state.disturbance.push)
    np.testing.assert_allclose(moved[:, :2], push * seconds**2 / 2, rtol=0.03)
    np.testing.assert_allclose(moved[:, 2], 0.0, atol=1e-3)


def test_an_offset_centre_of_mass_and_a_weak_rotor_turn_the_vehicle() -> None:
    """Against a rate loop that holds its rates by an error: J K w = the torque of the thrust."""
    vehicle = load_vehicle("vis_r")
    state = flown(disturbed(centre_of_mass=0.005), 30)
    offset = np.asarray(vehicle.rotor_position - state.plant["rotor_position"])[:, 0]
    assert np.abs(offset).max() <= 0.005
    weight = vehicle.mass * GRAVITY
    torque = np.stack([-offset[:, 1], offset[:, 0]], axis=1) * weight
    rate = np.asarray(state.vehicle.body_rate)[:, :2]
    np.testing.assert_allclose(rate, torque / (vehicle.inertia * vehicle.rate_gain)[:2], rtol=0.15, atol=2e-3)
    weak = flown(disturbed(rotor=0.1), 30)
    assert weak.disturbance is not None
    lift = (np.asarray(weak.disturbance.rotor_share) - 1) * weight / 4
    roll = lift @ np.asarray(vehicle.rotor_position)[:, 1]
    found = np.asarray(weak.vehicle.body_rate)[:, 0] * (vehicle.inertia * vehicle.rate_gain)[0]
    np.testing.assert_allclose(found, roll, rtol=0.15, atol=3e-3)


def test_the_rate_loop_is_the_plants_and_the_rest_of_the_controller_is_nominal() -> None:
    """A rate command answers with the time constants of the loop: half the gain, half as fast at first."""
    rates = {}
    for name, width in (("slow", 0.5), ("nominal", 0.0)):
        env = make(randomize={"rate_gain": width})
        state = env.reset(random_key(0), 1)[0]
        gain = np.asarray(load_vehicle("vis_r").rate_gain) * (1 - width)
        state.plant["rate_gain"] = jnp.asarray(gain, jnp.float32)[None]
        state = step(env, state, env.hover + jnp.array([[0.0, 0.2, 0.0, 0.0]]))[0]
        rates[name] = float(state.vehicle.body_rate[0, 0])
    assert rates["slow"] == pytest.approx(0.5 * rates["nominal"], rel=0.15)


@pytest.fixture(scope="module")
def jacobians() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Of the observation two steps later by each disturbance: by reverse mode and by central differences."""
    with jax.enable_x64(True):
        config = EnvConfig(action_latency=(0.0, 0.0), disturbance=DisturbanceConfig(gust=1.0, sag=0.1))
        env = Env.of(HoverConfig(), RewardConfig({"prog2": 1.0}), config, np.float64)
        state = env.reset(random_key(0), 1)[0]
        state = jax.tree.map(lambda x: x.astype(np.float64) if x.dtype == np.float32 else x, state)
        state = EnvState(**{**vars(state), "time": state.time + 2.0})  # a battery that has sagged
        assert state.disturbance is not None
        values = [getattr(state.disturbance, what) for what in ACTS]
        ends = np.cumsum([value.size for value in values])

        @jax.jit
        def shown(x: jax.Array) -> jax.Array:
            def one(row: jax.Array) -> jax.Array:
                parts = [part.reshape(v.shape) for part, v in zip(jnp.split(row, ends[:-1]), values, strict=True)]
                changed = Disturbance(**{**vars(state.disturbance), **dict(zip(ACTS, parts, strict=True))})

                def forward(s: EnvState, _: None) -> tuple[EnvState, jax.Array]:
                    s, out = env.step(s, env.hover[None], restart=False)
                    return s, out.observation[0]

                begun = EnvState(**{**vars(state), "disturbance": changed})
                return jax.lax.scan(forward, begun, length=2)[1][-1]

            return jax.vmap(one)(x)

        x = jnp.concatenate([value.reshape(1, -1) for value in values], axis=1)
        exact, numeric = np.asarray(reverse(shown, x, env.observation_size)), np.asarray(central(shown, x))
    split = (np.split(each, ends[:-1], axis=2) for each in (exact, numeric))
    return dict(zip(ACTS, zip(*split, strict=True), strict=True))


@pytest.mark.whole
@pytest.mark.parametrize("what", ACTS)
def test_gradients_reach_through_each_disturbance(
    what: str, jacobians: dict[str, tuple[np.ndarray, np.ndarray]]
) -> None:
    exact, numeric = jacobians[what]
    np.testing.assert_allclose(exact, numeric, rtol=1e-5, atol=1e-7)
    assert np.abs(exact).max() > 1e-4


def test_a_share_of_the_episodes_has_a_mixer_that_gives_up_torque_at_full_thrust() -> None:
    d = draw(DisturbanceConfig(plain_mixer=0.3), random_key(1), 20_000)
    assert set(np.unique(d.plain_mixer)) == {0.0, 1.0}
    assert float(d.plain_mixer.mean()) == pytest.approx(0.3, abs=0.02)
    rates = {}
    for share in (0.0, 1.0):
        env = disturbed(plain_mixer=share, sag=1e-6)
        state = env.reset(random_key(0), 4)[0]
        for _ in range(5):
            state = step(env, state, jnp.broadcast_to(jnp.array([1.0, 0.5, 0.0, 0.0]), (4, 4)))[0]
        rates[share] = float(state.vehicle.body_rate[0, 0])
    assert 0 < rates[1.0] < 0.9 * rates[0.0]
