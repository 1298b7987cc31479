"""The expert that the term `imitate` compares with: it knows where it will be, and flies."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import DisturbanceConfig, EnvConfig, RewardConfig
from e2efly.environment import Env, EnvState, expert, random_key
from e2efly.environment.episodes import EpisodesUnderWay
from e2efly.simulation import rewards
from e2efly.tasks import TASKS

IMITATE = RewardConfig({"imitate": 1.0})


def forests(speed: float, **env: object) -> Env:
    task = dataclasses.replace(TASKS["avoid"](), speed=(speed, speed))
    return Env.of(task, IMITATE, EnvConfig(**env))


def begun(env: Env, seed: int, n: int) -> tuple[EnvState, jax.Array]:
    return jax.jit(env.reset, static_argnums=1)(random_key(seed), n)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("latency", [0.02, 0.06, 0.1])
def test_it_knows_where_the_vehicle_will_be_when_its_action_acts(latency: float) -> None:
    env, n = forests(5.0, control_rate=100.0, action_latency=(latency, latency)), 40
    state, _ = begun(env, 0, n)
    rng = np.random.default_rng(0)
    step, actions = jax.jit(env.step, static_argnames="restart"), np.tile(np.asarray(env.hover), (n, 1))
    for _ in range(30):
        actions = np.clip(actions + rng.normal(0, 0.1, (n, 4)) * [0.5, 1, 1, 1], -0.8, 0.8)
        state, _ = step(state, jnp.asarray(actions, jnp.float32), restart=False)
    told = expert.ahead(
        env.physics.nominal, state.vehicle, env.command(state.actions), state.action_latency, env.control_period
    )
    now = state.vehicle
    for _ in range(round(latency * 100)):
        state, _ = step(state, jnp.asarray(actions, jnp.float32), restart=False)
    for found, was, truth in (
        (told.position, now.position, state.vehicle.position),
        (told.velocity, now.velocity, state.vehicle.velocity),
        (told.attitude, now.quaternion, state.vehicle.quaternion),
    ):
        error = np.linalg.norm(found.stack() - truth, axis=1)
        assert error.mean() < 0.25 * np.linalg.norm(was - truth, axis=1).mean()


@pytest.mark.whole
def test_flown_as_a_pilot_it_passes_forests_at_the_commanded_speed() -> None:
    env, n = forests(8.0), 60
    state, observation = begun(env, 1, n)

    def fly(flight: EpisodesUnderWay, _: None) -> tuple[EpisodesUnderWay, None]:
        return flight.after(env, env.expert_action(flight.state), 0.0), None

    flight, _ = jax.jit(lambda f: jax.lax.scan(fly, f, None, length=300))(EpisodesUnderWay.of(state, observation))
    flown = flight.episodes(env)
    assert np.mean(flown.success) > 0.85
    assert np.mean(flown.mean_speed) > 0.85 * 8.0


def test_its_own_action_costs_nothing_and_any_other_does() -> None:
    env = forests(8.0)
    state, _ = begun(env, 2, 8)
    action = jax.jit(env.expert_action)(state)
    step = jax.jit(env.step)
    cost = [step(state, action + off)[1].terms["imitate"] for off in (0.0, 0.1)]
    np.testing.assert_allclose(cost[0], 0.0, atol=1e-6)
    assert (np.asarray(cost[1]) < -0.1).all()


def test_a_heavier_vehicle_is_given_more_thrust() -> None:
    env = forests(0.5, randomize={"mass": 0.2}, action_latency=(0.0, 0.0))
    state, _ = begun(env, 3, 16)
    even = dataclasses.replace(state, plant={"mass": jnp.full(16, env.physics.nominal.mass)})
    ratio = env.command(env.expert_action(state))[:, 0] / env.command(env.expert_action(even))[:, 0]
    np.testing.assert_allclose(ratio, state.plant["mass"] / env.physics.nominal.mass, rtol=1e-4)


def test_rotors_of_unequal_strength_around_another_centre_of_mass_turn_the_vehicle_by_as_much_as_it_says() -> None:
    env, n = forests(5.0, disturbance=DisturbanceConfig(thrust=0.2, rotor=0.1, centre_of_mass=0.004)), 30
    state, _ = begun(env, 5, n)
    hover = jnp.tile(jnp.array([9.81, 0.0, 0.0, 0.0]), (n, 1))
    assert state.disturbance is not None
    effect = expert.CommandEffect.of(env.physics.nominal, state.plant, state.disturbance.share(state.time))
    np.testing.assert_allclose(effect.given(effect.needed(hover)[:, None])[:, 0], hover, atol=1e-5)
    step, rates, falls = jax.jit(env.step, static_argnames="restart"), [], []
    for command in (hover, effect.needed(hover)):
        flown, action = state, (command - env.center) / env.half
        for _ in range(40):
            flown, _ = step(flown, action, restart=False)
        rates.append(np.linalg.norm(flown.vehicle.body_rate[:, :2], axis=1))
        falls.append(np.abs(flown.vehicle.velocity[:, 2]))
    assert np.median(rates[0]) > 0.3
    assert np.mean(rates[1]) < 0.05 * np.mean(rates[0])
    assert np.mean(falls[1]) < 0.3 * np.mean(falls[0])


@pytest.mark.parametrize(
    ("vehicle", "env"),
    [
        ("any", {}),
        ("crazyflie", {"randomize": {"mass": 0.3}, "disturbance": DisturbanceConfig(thrust=0.45)}),
    ],
)
def test_it_flies_vehicles_of_a_family_and_such_that_hardly_carry_themselves(vehicle: str, env: dict) -> None:
    task = Env.of(TASKS["avoid"](), IMITATE, EnvConfig(vehicle=vehicle, **env))
    state, _ = begun(task, 6, 203)
    assert np.isfinite(jax.jit(task.expert_action)(state)).all()


@pytest.mark.parametrize(("task", "mode"), [("hover", "ctbr"), ("avoid", "velocity")])
def test_where_there_is_no_expert_the_term_is_refused_by_name(task: str, mode: str) -> None:
    env = Env.of(TASKS[task](), IMITATE, EnvConfig(command_mode=mode))
    state, _ = jax.eval_shape(lambda key: env.reset(key, 2), random_key(4))
    with pytest.raises(ValueError, match="'imitate' needs expert_action, which this task does not have"):
        jax.eval_shape(env.step, state, jnp.zeros((2, 4)))


def test_the_term_is_known() -> None:
    assert rewards.TERMS["imitate"].inputs == ["action", "expert_action"]
