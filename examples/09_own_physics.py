"""Your own plant with the complete physics, and a flight loop, in NumPy, written only from docs/own-plant.md.

`python examples/09_own_physics.py` flies the zoo's hover here and in the training simulator;
`e2efly validate hover --plant examples/09_own_physics.py:Quadrotor` flies it here from the starts of `e2efly eval`.
"""

from dataclasses import dataclass, replace

import numpy as np

import e2efly
from e2efly.policy.loader import Policy
from e2efly.vehicles.vehicle import Vehicle

LARGEST_STEP = 0.005
HOLD = 0.00025
GRAVITY = np.array([0.0, 0.0, -9.81])


@dataclass(frozen=True)
class Motion:
    """Vehicles in flight, (..., k); world ENU, body FLU, SI units."""

    position: np.ndarray
    velocity: np.ndarray
    quaternion: np.ndarray
    body_rate: np.ndarray
    rotor_speed: np.ndarray

    def plus(self, rate: "Motion", dt: float) -> "Motion":
        """The state after `dt` s at this rate of change. The rotor speeds do not change."""
        return Motion(
            self.position + dt * rate.position, self.velocity + dt * rate.velocity,
            self.quaternion + dt * rate.quaternion, self.body_rate + dt * rate.body_rate, self.rotor_speed,
        )  # fmt: skip


class Physics:
    """Rate loop, mixer, motors and rigid body of a vehicle."""

    def __init__(self, vehicle: Vehicle) -> None:
        """Read the needed values from a vehicle."""
        self.v = v = vehicle
        x, y = v.rotor_position.T
        self.allocation = np.stack([np.ones(4), y, -x, v.torque_ratio * v.rotor_spin])
        self.mixing = np.linalg.inv(self.allocation)
        self.low = self.thrust(v.rotor_speed_min)
        self.high = min(self.thrust(v.rotor_speed_max), v.rotor_thrust_max)
        self.hover = float(self.speed(v.mass * 9.81 / 4))

    def thrust(self, speed: float | np.ndarray) -> np.ndarray:
        """Thrust of a rotor, N."""
        k2, k1, k0 = self.v.thrust_map
        return np.maximum(k2 * speed**2 + k1 * speed + k0, 0.0)

    def speed(self, thrust: float | np.ndarray) -> np.ndarray:
        """Rotor speed for a thrust, rad/s."""
        k2, k1, k0 = self.v.thrust_map
        return (np.sqrt(k1**2 + 4 * k2 * (thrust - k0)) - k1) / (2 * k2)

    def wanted(self, m: Motion, command: np.ndarray) -> np.ndarray:
        """Rate loop and mixer. Returns the commanded rotor speeds, (..., 4)."""
        v, w = self.v, m.body_rate
        torque = v.inertia * v.rate_gain * (command[..., 1:] - w) + np.cross(w, v.inertia * w)
        spread = torque @ self.mixing[:, 1:].T
        span, room = np.ptp(spread, axis=-1, keepdims=True), self.high - self.low
        asked = v.mass * command[..., :1] * self.mixing[:, 0] + spread * room / np.maximum(span, room)
        lowest, highest = asked.min(-1, keepdims=True), asked.max(-1, keepdims=True)
        asked = asked + np.maximum(self.low - lowest, 0) - np.maximum(highest - self.high, 0)
        return self.speed(np.clip(asked, self.low, self.high))

    def rate(self, m: Motion, rotor_speed: np.ndarray) -> Motion:
        """The Newton-Euler equations: the rate of change at these rotor speeds."""
        v, w = self.v, m.body_rate
        wrench = self.thrust(rotor_speed) @ self.allocation.T
        air = _turn(m.quaternion * [1, -1, -1, -1], m.velocity)
        force = -air * (v.drag_linear + v.drag_quadratic * np.abs(air)) + wrench[..., :1] * [0, 0, 1]
        spin = 0.5 * _product(m.quaternion, np.concatenate([0 * w[..., :1], w], axis=-1))
        turning = (wrench[..., 1:] - np.cross(w, v.inertia * w)) / v.inertia
        return Motion(m.velocity, _turn(m.quaternion, force) / v.mass + GRAVITY, spin, turning, 0 * rotor_speed)

    def substep(self, m: Motion, command: np.ndarray, dt: float) -> Motion:
        """One step of Kutta's third-order method, with the exact solution for the rotors' lag."""
        a = self.rate(m, m.rotor_speed)
        ahead = m.plus(a, (dt - min(HOLD, dt)) / 2)
        goal, left = self.wanted(ahead, command), np.exp(-dt / 2 / self.v.motor_time_constant)
        middle = goal + (m.rotor_speed - goal) * left
        end = goal + (middle - goal) * left
        b = self.rate(m.plus(a, dt / 2), middle)
        c = self.rate(m.plus(b, 2 * dt).plus(a, -dt), end)
        m = m.plus(a, dt / 6).plus(b, 4 * dt / 6).plus(c, dt / 6)
        unit = m.quaternion / np.linalg.norm(m.quaternion, axis=-1, keepdims=True)
        return replace(m, quaternion=unit, rotor_speed=end)


@e2efly.register_plant("own_physics")
class Quadrotor(e2efly.Plant):
    """One vehicle, for `e2efly validate`."""

    def __init__(self, vehicle: Vehicle, command_mode: str) -> None:
        """Make the plant."""
        if command_mode != "ctbr":
            raise ValueError(f"command_mode is {command_mode}; accepted: ctbr")
        self._physics = Physics(vehicle)

    @property
    def state(self) -> e2efly.RigidState:
        """The current state of the vehicle."""
        m = self._motion
        return e2efly.RigidState(m.position, m.velocity, m.quaternion, m.body_rate)

    def reset(self, state: e2efly.RigidState) -> None:
        """Set the state of the vehicle, with the rotors at hover speed."""
        rotors = np.full(4, self._physics.hover)
        self._motion = Motion(state.position, state.velocity, state.quaternion, state.body_rate, rotors)

    def step(self, command: np.ndarray, dt: float) -> None:
        """Hold a command for `dt` s."""
        count = int(np.ceil(dt / LARGEST_STEP - 1e-9))
        for _ in range(count):
            self._motion = self._physics.substep(self._motion, command, dt / count)


def hover(policy: Policy, n: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Fly `n` starts of the task hover at once. Returns whether each succeeded, and its error at the end, m."""
    contract, random = policy.contract, np.random.default_rng(seed)
    vehicle = e2efly.load_vehicle(contract.vehicle)
    physics, period, target = Physics(vehicle), 1 / contract.control_rate_hz, np.array([0.0, 0.0, 3.0])
    substeps = int(np.ceil(period / LARGEST_STEP - 1e-9))
    dt = period / substeps
    roll, pitch, yaw = (random.uniform(-a, a, n) for a in (np.pi / 6, np.pi / 6, np.pi))
    m = Motion(
        target + random.uniform(-2, 2, (n, 3)), random.uniform(-1, 1, (n, 3)), _euler(roll, pitch, yaw),
        random.uniform(-1, 1, (n, 3)), np.full((n, 4), physics.hover),
    )  # fmt: skip
    latency = random.uniform(*contract.latency_range_s, (n, 1))
    shown = contract.slices["past_actions"]
    seen = (shown.stop - shown.start) // 4
    queue = [np.tile(np.asarray(contract.hover_action), (n, 1))] * max(seen, 10)  # newest first
    memory, held, failed = None, np.zeros(n), np.zeros(n, bool)
    for _ in range(round(8.0 / period)):
        observation = [target - m.position, m.quaternion, m.velocity, m.body_rate, *queue[:seen]]
        action, memory = policy.act(np.concatenate(observation, axis=-1), memory=memory)
        queue = [action, *queue[:-1]]
        commands = [policy.command(past) for past in queue]
        for i in range(substeps):
            # the fraction of this sub-step in which a command, or a newer one, acts
            begun = [np.clip(i + 1 - (latency - age * period) / dt, 0, 1) for age in range(len(commands))]
            command = sum((now - newer) * c for now, newer, c in zip(begun, [0, *begun], commands, strict=False))
            m = physics.substep(m, command, dt)
        error = np.linalg.norm(target - m.position, axis=-1)
        held = np.where(error < 0.1, held + period, 0.0)
        failed |= (error > 6.0) | (m.position[:, 2] <= vehicle.feet_height)
    return ~failed & (held >= 1.0 - 1e-4), error


def _product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    a, u, b, w = p[..., :1], p[..., 1:], q[..., :1], q[..., 1:]
    dot = np.sum(u * w, axis=-1, keepdims=True)
    return np.concatenate([a * b - dot, a * w + b * u + np.cross(u, w)], axis=-1)


def _turn(q: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Vectors rotated by unit quaternions wxyz."""
    twice = 2 * np.cross(q[..., 1:], vector)
    return vector + q[..., :1] * twice + np.cross(q[..., 1:], twice)


def _euler(roll: np.ndarray, pitch: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """R = Rz(yaw) Ry(pitch) Rx(roll) as quaternions wxyz."""
    zero = np.zeros_like(roll)
    about_x, about_y, about_z = (
        np.stack([np.cos(a / 2), *(np.sin(a / 2) if i == axis else zero for i in range(3))], axis=-1)
        for axis, a in enumerate((roll, pitch, yaw))
    )
    return _product(about_z, _product(about_y, about_x))


if __name__ == "__main__":
    N = 200
    success, error = hover(e2efly.load_policy("hover"), N)
    theirs = e2efly.evaluate("hover", episodes=N).as_json()["criteria"]["hover"]
    print(f"here:            {success.mean():.1%}, {100 * error.mean():.2f} cm off at the end")
    print(f"in the training: {theirs['success']:.1%}, {100 * theirs['final_error_m']:.2f} cm")
