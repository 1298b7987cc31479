"""What our stand-ins for firmware have in common: a wire, a pilot's hands, the rigid body, poses.

Nothing here is shared with the bridge.
"""

import random
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from e2efly.flight.bridge import Bridge
from e2efly.policy.odometry import Sample
from e2efly.validation.world import FlownBody, World
from e2efly.vehicles.vehicle import Vehicle

STEP_S = 0.002
"""Of rate loop and world, s."""
POSE_S, POSE_NOISE = 1 / 200, (0.0005, 0.01, 0.02, 0.001)
VIBRATION = 0.3
RATE_GAIN = np.array([22.0, 22.0, 11.0])
"""Angular acceleration over the error of the body rate, 1/s."""


@dataclass
class Wire:
    """Bytes both ways, late by `delay` s, and what may happen to them. It is the bridge's `Link`."""

    now: Callable[[], float]
    delay: float = 0.002
    alive: bool = True
    up: bool = True
    """Whether what the bridge sends arrives."""
    down: bool = True
    """Whether what the autopilot sends arrives."""
    loss: float = 0.0
    """Share of what is sent that does not arrive, either way."""
    connections: int = 1
    reason: str = ""
    _chance: random.Random = field(default_factory=lambda: random.Random(0))
    _up: deque[tuple[float, bytes]] = field(default_factory=deque)
    _down: deque[tuple[float, bytes]] = field(default_factory=deque)

    def poll(self, now: float) -> None:
        del now

    def send(self, data: bytes) -> None:
        if self.alive and self.up and not self._lost():
            self._up.append((self.now() + self.delay, data))

    def receive(self) -> bytes:
        return self._ready(self._down) if self.alive else b""

    def answer(self, data: bytes) -> None:
        if self.down and not self._lost():
            self._down.append((self.now() + self.delay, data))

    def arrived(self) -> bytes:
        return self._ready(self._up)

    def close(self) -> None:
        self.alive, self.reason = False, "closed"

    def _lost(self) -> bool:
        return self.loss > 0 and self._chance.random() < self.loss

    def _ready(self, queue: deque[tuple[float, bytes]]) -> bytes:
        data = b""
        while queue and queue[0][0] <= self.now():
            data += queue.popleft()[1]
        return data


@dataclass(frozen=True)
class Hand:
    """The pilot's transmitter."""

    armed: bool = False
    override: bool = False
    mission: str = "land"
    roll: float = 0.0
    pitch: float = 0.0
    throttle: float = 0.0
    yaw: float = 0.0

    def channels(self, forward: int) -> list[int]:
        mission = {"land": -1.0, "hover": 0.0, "policy": 1.0}[self.mission]
        sticks, switches = (
            (self.roll, forward * self.pitch, self.throttle, self.yaw),
            (self.armed, self.override, False),
        )
        return [round(1500 + 500 * at) for at in (*sticks, *(2 * on - 1 for on in switches), mission)]


class FlownPeer:
    """An autopilot in its world, with a pilot and poses: what `Session` flies. A subclass has `hear`, `outputs`,
    `tell` and `autopilot`.
    """

    def __init__(self, vehicle: Vehicle, latency: float, seed: int) -> None:
        self.latency = latency
        self.world = World(vehicle)
        self.world.advance(self.world.at_rest(), np.ones(4), STEP_S)
        self.state: FlownBody = self.world.at_rest()
        self.time, self.wind, self.hand, self.heard = 1.0, np.zeros(3), Hand(), True
        self.volts = 15.6
        self.wire = Wire(self.now)
        self.log: list[str] = []
        """What it did, in order: modes, arming, failsafes."""
        self._noise = np.random.default_rng(seed)
        self._poses: deque[Sample] = deque()
        self._pose_due = 0.0
        self.force, self._motors = np.array([0.0, 0.0, 9.81]), np.zeros(4)
        self._left = 0.0

    def hear(self) -> None:
        """Take what has come over the wire."""
        raise NotImplementedError

    def outputs(self) -> np.ndarray:
        """Decide, and give the (4,) motor outputs."""
        raise NotImplementedError

    def tell(self) -> None:
        """Send telemetry."""
        raise NotImplementedError

    def plan(self, bridge: Bridge) -> None:
        """Let the bridge's watchdog know its plan, if there is one."""

    def stop_watchdog(self) -> None:
        """Let the watchdog's process stand still, if there is one."""

    # -- what a bench offers -------------------------------------------------------------------------------------------

    def now(self) -> float:
        return self.time

    def set(self, **changes: Any) -> None:
        self.hand = replace(self.hand, **changes)

    def sleep(self, seconds: float) -> None:
        self._left += seconds
        while self._left > STEP_S / 2:
            self._left -= STEP_S
            self._step()

    def poses(self, now: float) -> list[Sample]:
        ready = []
        while self._poses and self._poses[0].received + self.latency <= now:
            ready.append(replace(self._poses.popleft(), received=now))
        return ready

    # -- world ---------------------------------------------------------------------------------------------------------

    def _step(self) -> None:
        self.time += STEP_S
        self.hear()
        self._motors = self.outputs()
        before, self.state = self.state, self.world.advance(self.state, self._motors, STEP_S, self.wind)
        shaken = VIBRATION * self._noise.normal(size=3) * bool(self._motors.any())
        self.force = np.asarray(self.world.sensed(before, self.state, STEP_S).specific_force) + shaken
        if self.time >= self._pose_due:
            self._pose_due = self.time + POSE_S
            s, n = self.state, self._noise
            position, velocity, rate = (
                np.asarray(x) + sigma * n.normal(size=3)
                for x, sigma in zip((s.position, s.velocity, s.body_rate), POSE_NOISE[:3], strict=True)
            )
            q = np.asarray(s.quaternion) + POSE_NOISE[3] / 2 * n.normal(size=4)
            self._poses.append(Sample(self.time, position, q / np.linalg.norm(q), self.time, velocity, rate))
        self.tell()

    # -- control -------------------------------------------------------------------------------------------------------

    @property
    def standing(self) -> bool:
        return float(self.state.position[2]) <= self.world.vehicle.feet_height + 0.005

    def level(self, climb: float) -> tuple[float, np.ndarray]:
        """Thrust, N, and body rates that level the vehicle and reach a vertical speed."""
        w, x, y, z = np.asarray(self.state.quaternion)
        up = np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
        rates = np.array([-5.0 * up[1], 5.0 * up[0], 0.0])
        wanted = 9.81 + 3.0 * (climb - float(self.state.velocity[2]))
        return float(self.world.vehicle.mass) * max(wanted, 0.0) / max(up[2], 0.5), rates

    def thrust(self, speed: float) -> float:
        k2, k1, k0 = (float(k) for k in self.world.vehicle.thrust_map)
        return max((k2 * speed + k1) * speed + k0, 0.0)

    def torques(self, rates: np.ndarray) -> np.ndarray:
        """Shares (4,) of the rotors' thrust, N, that a proportional rate loop asks for. Their sum is 0."""
        vehicle = self.world.vehicle
        torque = np.asarray(vehicle.inertia, float) * RATE_GAIN * (rates - np.asarray(self.state.body_rate))
        places = np.asarray(vehicle.rotor_position, float)
        spin = np.asarray(vehicle.rotor_spin, float)
        effect = np.stack([np.ones(4), places[:, 1], -places[:, 0], spin * float(vehicle.torque_ratio)])
        return np.linalg.solve(effect, np.array([0.0, *torque]))

    def mixed(self, thrust: float, rates: np.ndarray) -> np.ndarray:
        """Motor outputs for a thrust, N, and body rates: torque before thrust."""
        vehicle, share = self.world.vehicle, self.torques(rates)
        low, top = self.thrust(float(vehicle.rotor_speed_min)), self.thrust(self.world.full_speed)
        spread = share.max() - share.min()
        share *= min(1.0, (top - low) / max(spread, 1e-9))
        base = np.clip(thrust / 4, low - share.min(), top - share.max())
        return self.turned(base + share)

    def turned(self, thrusts: np.ndarray) -> np.ndarray:
        """Motor outputs (4,) for the thrust of each rotor, N."""
        k2, k1, k0 = (float(k) for k in self.world.vehicle.thrust_map)
        speeds = (-k1 + np.sqrt(np.maximum(k1**2 + 4 * k2 * (thrusts - k0), 0.0))) / (2 * k2)
        return np.clip(speeds / self.world.full_speed, 0.0, 1.0)
