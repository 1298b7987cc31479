"""The rate loop between the steps of the physics: an independent plant whose loop really runs at 4 kHz."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.simulation.physics import Physics, State, step
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle

FLIGHTS, SECONDS, CHANGE, LOOP_HZ = 6, 2.0, 0.2, 4000


def rotated(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Body to world."""
    w, u = q[:, :1], q[:, 1:]
    return v + 2 * np.cross(u, np.cross(u, v) + w * v)


def ticking(vehicle: Vehicle, commands: np.ndarray) -> np.ndarray:
    """Positions at the end, (n, 3) m: float64, the loop's rotor commands held for one tick, explicit midpoint rule."""
    n, dt, v = commands.shape[1], 1 / LOOP_HZ, vehicle
    x, y = v.rotor_position.T
    effect = np.array([np.ones(4), y, -x, v.torque_ratio * v.rotor_spin])
    mixing, (low, high) = np.linalg.inv(effect), v.thrust_range
    k2, k1, k0 = v.thrust_map
    p, s, w = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3))
    q, turns = np.tile([1.0, 0, 0, 0], (n, 1)), np.full((n, 4), v.hover_rotor_speed)

    def slopes(s: np.ndarray, q: np.ndarray, w: np.ndarray, turns: np.ndarray) -> tuple[np.ndarray, ...]:
        push = np.maximum(k2 * turns**2 + k1 * turns + k0, 0) @ effect.T
        air = rotated(q * [1, -1, -1, -1], s)
        force = push[:, :1] * [0, 0, 1] - v.drag_linear * air - v.drag_quadratic * air * abs(air)
        spin = np.column_stack([-(q[:, 1:] * w).sum(1), q[:, :1] * w + np.cross(q[:, 1:], w)]) / 2
        return (
            s,
            rotated(q, force) / v.mass - [0, 0, 9.81],
            spin,
            (push[:, 1:] - np.cross(w, v.inertia * w)) / v.inertia,
        )

    for tick in range(round(SECONDS * LOOP_HZ)):
        c = commands[int(tick / LOOP_HZ / CHANGE + 1e-9)]
        asked = (v.inertia * v.rate_gain * (c[:, 1:] - w) + np.cross(w, v.inertia * w)) @ mixing[:, 1:].T
        asked /= np.maximum(np.ptp(asked, axis=1, keepdims=True) / (high - low), 1)
        asked += v.mass * c[:, :1] * mixing[:, 0]
        asked += np.maximum(low - asked.min(1, keepdims=True), 0)
        asked -= np.maximum(asked.max(1, keepdims=True) - high, 0)
        told = (np.sqrt(k1**2 + 4 * k2 * (np.clip(asked, low, high) - k0)) - k1) / (2 * k2)
        middle, end = (told + (turns - told) * np.exp(-t / v.motor_time_constant) for t in (dt / 2, dt))
        _, ds, dq, dw = slopes(s, q, w, turns)
        dp, ds, dq, dw = slopes(s + ds * dt / 2, q + dq * dt / 2, w + dw * dt / 2, middle)
        p, s, q, w, turns = p + dp * dt, s + ds * dt, q + dq * dt, w + dw * dt, end
        q = q / np.linalg.norm(q, axis=1, keepdims=True)
    return p


@pytest.mark.parametrize("name", ["vis_r", "crazyflie"])
def test_violent_flights_end_where_those_of_a_4_khz_rate_loop_end(name: str) -> None:
    """Another thrust and other body rates every 0.2 s, for 2 s: 5 mm apart in the mean. A held loop: 100 mm."""
    vehicle, rng = load_vehicle(name), np.random.default_rng(5)
    thrust = 9.81 * rng.uniform(0.3, 1.8, (round(SECONDS / CHANGE), FLIGHTS, 1))
    rates = rng.uniform(-1, 1, (*thrust.shape[:2], 3)) * vehicle.body_rate_max
    commands = np.concatenate([thrust, rates], axis=-1)
    physics = Physics.of(vehicle, control_rate=30.0)
    asked = jnp.asarray(commands.repeat(6, 0), jnp.float32)

    @jax.jit
    def fly(state: State) -> State:
        return jax.lax.scan(lambda s, c: (step(physics, physics.nominal, s, c), None), state, asked)[0]

    end = fly(State.hovering(vehicle, jnp.zeros((FLIGHTS, 3), jnp.float32)))
    off = np.linalg.norm(np.asarray(end.position, np.float64) - ticking(vehicle, commands), axis=1)
    assert off.mean() < 5e-3
