"""Delays of any number of seconds against a hand-made delay line."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import EnvConfig, RewardConfig
from e2efly.environment import Env, EnvState, random_key
from e2efly.simulation.physics import State
from e2efly.simulation.sensors.latency import acting_commands, delayed_state, frames
from e2efly.tasks.hover import HoverConfig
from e2efly.vehicles.loading import load_vehicle
from tests.gradients import central, reverse

PERIOD = 1 / 30
FRAMES = (0.0, 0.5, 1.0, 1.8, 2.7)
"""Latencies, in control periods: 1.8 is VIS-R's, 2.7 VIS-H's."""


def command_at(issued: np.ndarray, time: float, latency: float) -> np.ndarray:
    """What acts at a time: the last command issued at least `latency` ago; before the first, the first one."""
    return issued[max(int(np.floor((time - latency) / PERIOD + 1e-9)), 0)]


def mean_command(issued: np.ndarray, begin: float, end: float, latency: float) -> np.ndarray:
    """The time average of what acts, by fine sampling."""
    times = begin + (end - begin) * (np.arange(2100) + 0.5) / 2100
    return np.mean([command_at(issued, t, latency) for t in times], axis=0)


def test_frames_that_a_latency_touches() -> None:
    assert [frames(f * PERIOD, PERIOD) for f in FRAMES] == [0, 1, 1, 2, 3]
    assert frames(load_vehicle("vis_r").latency, PERIOD) == 2
    assert frames(load_vehicle("vis_h").latency, PERIOD) == 3


@pytest.mark.parametrize("late", FRAMES)
def test_acting_commands(late: float) -> None:
    issued = np.random.default_rng(0).normal(size=(10, 4)).astype(np.float32)
    for k in range(3, 10):
        queue = jnp.asarray(issued[k - 3 : k + 1][::-1][None])
        before, after, switch = acting_commands(queue, jnp.asarray([late * PERIOD]), PERIOD)
        switch = float(switch[0])
        assert -1e-6 <= switch <= PERIOD + 1e-6  # float32
        for share in (0.01, 0.25, 0.6, 0.99):
            acts = before[0] if share * PERIOD < switch else after[0]
            np.testing.assert_array_equal(acts, command_at(issued, (k + share) * PERIOD, late * PERIOD))


@pytest.fixture(scope="module")
def env() -> Env:
    """Rotors are commanded one by one; the latency of a row is set by hand."""
    config = EnvConfig(command_mode="rotor_thrust", action_latency=(0.0, 2.7 * PERIOD))
    return Env.of(HoverConfig(), RewardConfig({"prog2": 1.0}), config)


def start(env: Env, late: tuple[float, ...] = FRAMES) -> EnvState:
    state, _ = env.reset(random_key(0), len(late))
    state = dataclasses.replace(state, action_latency=jnp.asarray(late, env.center.dtype) * PERIOD)
    return jax.tree.map(jnp.asarray, state)


def flight(env: Env, state: EnvState, actions: jax.Array) -> EnvState:
    """The states under actions (t, n, 4), without new starts."""

    def one(state: EnvState, action: jax.Array) -> tuple[EnvState, State]:
        state, _ = env.step(state, action, restart=False)
        return state, state.vehicle

    return jax.lax.scan(one, state, actions)[1]


def test_rotors_answer_the_delayed_command(env: Env) -> None:
    """Each sub-step gets the time average of what acts in it; the motors lag behind that."""
    vehicle, steps = load_vehicle("vis_r"), 8
    actions = np.random.default_rng(1).uniform(-1, 1, (steps, 4)).astype(np.float32)
    path = jax.jit(flight)(env, start(env), jnp.broadcast_to(actions[:, None], (steps, len(FRAMES), 4)))
    hover = np.full((4, 4), vehicle.mass * 9.81 / 4)
    issued = np.concatenate([hover, env.command(jnp.asarray(actions))])  # 4 periods of hovering came before
    k2, k1, k0 = vehicle.thrust_map
    dt = PERIOD / env.physics.substeps
    for row, late in enumerate(FRAMES):
        speed = np.full(4, vehicle.hover_rotor_speed)
        for k in range(steps):
            for i in range(env.physics.substeps):
                begin = (4 + k) * PERIOD + i * dt
                thrust = mean_command(issued, begin, begin + dt, late * PERIOD)
                goal = (-k1 + np.sqrt(k1**2 + 4 * k2 * (thrust - k0))) / (2 * k2)
                speed = goal + (speed - goal) * np.exp(-dt / vehicle.motor_time_constant)
            np.testing.assert_allclose(path.rotor_speed[k, row], speed, rtol=1e-4, err_msg=f"{late} frames, step {k}")


def test_late_rows_do_not_move_at_first(env: Env) -> None:
    path = jax.jit(flight)(env, start(env), jnp.ones((8, len(FRAMES), 4)))
    hover = load_vehicle("vis_r").hover_rotor_speed
    moved = np.abs(np.asarray(path.rotor_speed[:, :, 0]) - hover) > 1
    np.testing.assert_array_equal(np.argmax(moved, axis=0), [0, 0, 1, 1, 2])


@pytest.mark.whole
@pytest.mark.usefixtures("x64")
def test_gradient_with_respect_to_the_latency() -> None:
    config = EnvConfig(command_mode="rotor_thrust", action_latency=(0.0, 2.7 * PERIOD))
    env = Env.of(HoverConfig(), RewardConfig({"prog2": 1.0}), config, dtype=np.float64)
    one = jax.tree.map(lambda x: x, start(env, (0.5,)))
    actions = jnp.asarray(np.random.default_rng(2).uniform(-1, 1, (5, 1, 4)))

    def end(late: jax.Array) -> jax.Array:
        """(n, 1) latencies in frames -> (n, 6) what the flight came to."""
        n = len(late)
        state = jax.tree.map(lambda x: jnp.broadcast_to(x, (n, *x.shape[1:])) if x.shape[:1] == (1,) else x, one)
        state = dataclasses.replace(state, action_latency=late[:, 0] * PERIOD)
        path = flight(env, state, jnp.broadcast_to(actions, (5, n, 4)))
        return jnp.concatenate([path.position[-1], path.body_rate[-1]], axis=-1)

    points = jnp.asarray([[0.25], [0.5], [1.8], [2.65]])
    exact = jax.jit(lambda x: reverse(end, x, 6))(points)
    numeric = jax.jit(lambda x: central(end, x, 1e-5))(points)
    assert np.min(np.abs(numeric).max((1, 2))) > 1e-3
    np.testing.assert_allclose(exact, numeric, rtol=1e-5, atol=1e-8)


def ramp(samples: int, n: int) -> State:
    """States newest first of vehicles that move by [1, 2, 3] m a period and turn by nothing."""
    age = np.arange(samples)[None, :, None] * np.ones((n, 1, 1))
    state = State(
        position=10 - age * [1.0, 2, 3],
        velocity=5 - age * [0.1, 0.2, 0.3],
        quaternion=np.broadcast_to([0.6, 0.8, 0, 0], (n, samples, 4)),
        body_rate=-age * [1.0, 1, 1],
        rotor_speed=2000 + age * np.ones(4),
    )
    return jax.tree.map(lambda x: jnp.asarray(x, jnp.float32), state)


def test_a_delayed_ramp_is_exact() -> None:
    late = np.array([*FRAMES, 3.0])
    seen = delayed_state(ramp(4, len(late)), jnp.asarray(late * PERIOD, jnp.float32), PERIOD)
    np.testing.assert_allclose(seen.position, 10 - late[:, None] * [1, 2, 3], rtol=1e-5)
    np.testing.assert_allclose(seen.velocity, 5 - late[:, None] * [0.1, 0.2, 0.3], rtol=1e-5)
    np.testing.assert_allclose(seen.rotor_speed, 2000 + late[:, None] * np.ones(4), rtol=1e-6)
    np.testing.assert_allclose(seen.quaternion, [[0.6, 0.8, 0, 0]] * len(late), rtol=1e-5)


def test_a_delayed_turn_lies_between_and_is_a_rotation() -> None:
    past = ramp(2, 1)
    past = dataclasses.replace(past, quaternion=jnp.asarray([[[1.0, 0, 0, 0], [np.cos(0.2), np.sin(0.2), 0, 0]]]))
    seen = delayed_state(past, jnp.asarray([0.5 * PERIOD]), PERIOD).quaternion
    np.testing.assert_allclose(seen, [[np.cos(0.1), np.sin(0.1), 0, 0]], rtol=1e-5)


def test_the_policy_sees_the_delayed_state() -> None:
    config = EnvConfig(observation_latency=(0.05, 0.05), past_actions=0)  # 1.5 periods
    env = Env.of(HoverConfig(), RewardConfig({"prog2": 1.0}), config)
    state, observation = env.reset(random_key(1), 3)
    first = state.vehicle
    np.testing.assert_allclose(observation[:, 7:10], first.velocity, rtol=1e-6)

    def one(state: EnvState, action: jax.Array) -> tuple[EnvState, tuple[State, jax.Array]]:
        state, out = env.step(state, action, restart=False)
        return state, (state.vehicle, out.final_observation)

    _, (path, seen) = jax.jit(lambda s, a: jax.lax.scan(one, s, a))(state, jnp.zeros((6, 3, 4)))
    for k in range(6):
        # 1.5 periods before the state k; the state before the first is taken to be the first
        newer, older = (path.velocity[i] if i >= 0 else first.velocity for i in (k - 1, k - 2))
        np.testing.assert_allclose(seen[k, :, 7:10], (newer + older) / 2, rtol=1e-4, atol=1e-5)


def test_every_latency_of_a_range_occurs() -> None:
    env = Env.of(HoverConfig(), RewardConfig({"prog2": 1.0}), EnvConfig(action_latency=(0.02, 0.08)))
    state, _ = env.reset(random_key(2), 500)
    late = np.asarray(state.action_latency)
    assert 0.02 <= late.min() < 0.023
    assert 0.077 < late.max() <= 0.08
    assert env.queue == 4


@pytest.mark.parametrize(("vehicle", "late", "seen"), [("vis_r", 0.060, 2), ("vis_h", 0.090, 3)])
def test_latency_is_the_vehicles_own_unless_given(vehicle: str, late: float, seen: int) -> None:
    def make(c: EnvConfig) -> Env:
        return Env.of(HoverConfig(), RewardConfig({"prog2": 1.0}), c)

    env = make(EnvConfig(vehicle=vehicle))
    np.testing.assert_allclose(env.latency_range, [late, late], rtol=1e-6)
    assert (env.seen_actions, env.queue) == (seen, seen + 1)
    onboard = make(EnvConfig(vehicle=vehicle, action_latency=(0.030, 0.030)))  # as the paper measured on VIS-R
    assert (onboard.seen_actions, onboard.queue) == (1, 2)
    none = make(EnvConfig(vehicle=vehicle, action_latency=(0.0, 0.0)))
    assert (none.seen_actions, none.observation_size) == (0, 13)
