"""A flight controller's firmware on a test rig: the rigid body under it, a pilot with a transmitter, a pose source.

With virtual time the rig is a clock: sleeping on it lets the world and the firmware run.
"""

import dataclasses
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any, Generic, Protocol, Self, TypeVar

import numpy as np

from e2efly.policy.odometry import Sample
from e2efly.simulation.device import compute_at_once, one_core
from e2efly.validation.sitl import FirmwareState
from e2efly.validation.world import FlownBody, World
from e2efly.vehicles.vehicle import Vehicle

STEP_S = 0.002
"""Interval at which the firmware's sensors get a new state, s."""
LONGEST_LAG_S = 0.2
"""In real time: the longest delay of world and firmware on a busy machine that is made up for, s."""
RC_PERIOD_S = 0.02
"""Interval between frames of the pilot's receiver, s."""
POSE_PERIOD_S = 1 / 200.0
"""Interval between the poses of the motion capture system, s."""
POSE_NOISE = (0.0005, 0.01, 0.02, 0.001)
"""Standard deviations of a motion capture system: position, m; velocity, m/s; body rate, rad/s; attitude, rad."""
VIBRATION = 0.3
"""Standard deviation of the accelerometer's force while the rotors turn, before the firmware's own filter, m/s^2. The
value is that of a small quadrotor with good propellers."""


@dataclass(frozen=True)
class Transmitter:
    """The pilot's sticks and switches. Sticks range from -1 to 1."""

    armed: bool = False
    override: bool = False
    mission: str = "land"
    """land, hover or policy."""
    roll: float = 0.0
    pitch: float = 0.0
    throttle: float = -1.0
    """Throttle of the controller without override. In flight it rests in the middle. Its copy for the bridge is
    `lift`."""
    yaw: float = 0.0
    lift: float = 0.0
    """The copy of the throttle stick."""

    def channels(self) -> np.ndarray:
        """The receiver's 16 channels, us: roll, pitch, throttle, yaw; arm, override, none, mission; copies; rest."""
        sticks = [self.roll, self.pitch, self.throttle, self.yaw]
        switches = [1.0 if on else -1.0 for on in (self.armed, self.override)]
        mission = {"land": -1.0, "hover": 0.0, "policy": 1.0}[self.mission]
        copies = [self.roll, self.pitch, self.lift, self.yaw]
        return np.round(1500 + 500 * np.array([*sticks, *switches, -1.0, mission, *copies, 0, 0, 0, 0])).astype(int)


class SteppedFirmware(Protocol):
    """A firmware whose time is virtual: it runs only inside `advance`."""

    now: float
    """The firmware's time, s. It goes on while the firmware is off."""

    def start(self) -> None:
        """Start the process."""
        ...

    def stop(self) -> None:
        """Kill the process, like a loss of battery power."""
        ...

    def close(self) -> None:
        """Stop it and free its sockets."""
        ...

    def send_state(self, state: FirmwareState) -> None:
        """Give the sensors a new state."""
        ...

    def advance(self, dt: float) -> None:
        """Let the firmware run for `dt` s of its time. If it is off, only the time advances."""
        ...

    def exchange(self) -> None:
        """Wait until the firmware has read what was sent to it, and has sent its outputs."""
        ...

    def motors(self) -> np.ndarray:
        """(4,) the newest motor outputs, 0 to 1: rear right, front right, rear left, front left."""
        ...


Stepped = TypeVar("Stepped", bound=SteppedFirmware)


class FirmwareRig(Generic[Stepped]):
    """One firmware in its world. Use it as a context manager: inside, the thread and the firmware share one core.

    Time is virtual. With `real_time` it follows the machine's clock, as for a bridge in another process. `step` is the
    interval at which sensors are updated and motors are read, s, a whole number of ms. `pose_noise` replaces
    `POSE_NOISE`. `motors` are the firmware's motors, one for each rotor of the vehicle file. A subclass has `prepare`,
    `receive` and `autopilot`.
    """

    boot_s: float
    """Time for which the firmware stands still before it can be armed, s."""

    def __init__(
        self,
        sitl: Stepped,
        vehicle: Vehicle,
        *,
        real_time: bool = False,
        latency: float = 0.0,
        seed: int = 0,
        step: float = STEP_S,
        pose_noise: tuple[float, ...] = POSE_NOISE,
        motors: Sequence[int] | None = None,
    ) -> None:
        compute_at_once()
        self.motors = list(range(vehicle.rotor_count) if motors is None else motors)
        """For each rotor of the vehicle file, its motor in the order of the firmware. None: the same order."""
        self._step = step
        self.sitl = sitl
        self.thrust_shares = np.ones(vehicle.rotor_count)
        """Thrust of each rotor divided by the thrust from the vehicle's thrust map."""
        self.carry(vehicle)
        self.state: FlownBody = self.world.at_rest()
        self.transmitter = Transmitter()
        self.latency = latency
        """Age of the poses when they are delivered, s."""
        self.wind = np.zeros(3)
        self.held = False
        """Whether the body is held in place, so that the rotors do not move it."""
        self.shares = np.ones(vehicle.rotor_count)
        """Share of each motor's output that its rotor follows. It is below 1 for a flat battery or a weak motor."""
        self.felt: Callable[[FirmwareState], FirmwareState] | None = None
        """Function from the true state to the readings of the firmware's sensors. None: the sensors are exact."""
        self.heard = True
        """Whether the pilot's receiver receives the transmitter."""
        self._pose_noise = pose_noise
        self._poses: deque[Sample] = deque()
        self._next_pose = self._next_rc = 0.0
        self._left = 0.0
        self._real_time = real_time
        self._epoch = 0.0
        self._on = True
        self._noise, self._shaking = np.random.default_rng(seed), np.random.default_rng([seed, 1])
        self._open = ExitStack()

    def carry(self, vehicle: Vehicle) -> None:
        """Put a vehicle under the firmware, with as many rotors as before. The state stays the same."""
        self.world = World(vehicle)
        self.world.advance(self.world.at_rest(), np.ones(vehicle.rotor_count), STEP_S)  # compile while it has all cores

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def prepare(self) -> None:
        """Give the firmware its settings, before it starts."""
        raise NotImplementedError

    def receive(self) -> None:
        """Send a frame of the pilot's receiver, if it hears the transmitter."""
        raise NotImplementedError

    def start(self) -> None:
        """Start the firmware and wait until it can be armed. `close`, in the same thread, ends it."""
        with ExitStack() as opened:
            opened.callback(self.sitl.close)
            opened.enter_context(one_core())
            self._boot()
            self._open = opened.pop_all()

    def close(self) -> None:
        """End the firmware."""
        self._open.close()
        self.sitl.close()

    def _boot(self) -> None:
        self.prepare()
        self.sitl.start()
        self._next_pose = self._next_rc = self.now()
        self._run(self.boot_s)  # nobody needs this part in real time
        self._poses.clear()
        self._epoch = time.monotonic() - self.now()

    def now(self) -> float:
        """The firmware's time, s."""
        return self.sitl.now

    def machine_time(self, moment: float) -> float:
        """Convert the firmware's time, s, to the machine's monotonic clock. Only with `real_time`."""
        return self._epoch + moment

    def sleep(self, seconds: float) -> None:
        """Let the world and the firmware run."""
        if self._real_time:
            end = time.monotonic() + seconds
            while (now := time.monotonic()) < end:
                self._epoch = max(self._epoch, now - LONGEST_LAG_S - self.now())
                while self.now() + self._step <= now - self._epoch:
                    self.step(self._step)
                time.sleep(min(end - now, self._step))
        else:
            self._run(seconds)

    def _run(self, seconds: float) -> None:
        """Run steps for `seconds`, as fast as possible."""
        self.sitl.exchange()
        self._left += seconds
        while self._left > self._step / 2:
            self.step(self._step)
            self._left -= self._step
        self.sitl.exchange()

    def step(self, dt: float) -> None:
        """Run one step of the world and of the firmware."""
        motors = self.sitl.motors()[self.motors] if self._on else np.zeros(len(self.motors))
        after = self.state if self.held else self._moved(motors, dt)
        if self._on:
            sensed = self._shaken(self.world.sensed(self.state, after, dt), after)
            self.sitl.send_state(sensed if self.felt is None else self.felt(sensed))
        self.sitl.advance(dt)
        self.state = after
        now = self.now()
        if now >= self._next_rc:
            self._next_rc += RC_PERIOD_S
            self.receive()
        if now >= self._next_pose:
            self._next_pose += POSE_PERIOD_S
            self._poses.append(self._sample(now))

    def _moved(self, motors: np.ndarray, dt: float) -> FlownBody:
        return self.world.advance(self.state, motors * self.shares, dt, self.wind, self.thrust_shares)

    def _shaken(self, sensed: FirmwareState, after: FlownBody) -> FirmwareState:
        if not after.rotor_speed.any():
            return sensed
        noise = VIBRATION * self._shaking.standard_normal(3)
        return dataclasses.replace(sensed, specific_force=sensed.specific_force + noise)

    def poses(self, now: float) -> list[Sample]:
        """The poses that have arrived since the last call, `latency` s old."""
        ready = []
        while self._poses and self._poses[0].received + self.latency <= now:
            sample = self._poses.popleft()
            ready.append(dataclasses.replace(sample, received=now))
        return ready

    def set(self, **changes: Any) -> None:
        """Move the pilot's sticks and switches: fields of `Transmitter`."""
        self.transmitter = dataclasses.replace(self.transmitter, **changes)

    def power(self, on: bool) -> None:
        """Cut the controller's power, which stops the motors, or restore it, which boots the controller."""
        if on and not self._on:
            self.sitl.start()
            self._epoch = time.monotonic() - self.now()
        elif not on:
            self.sitl.stop()
        self._on = on

    def _sample(self, now: float) -> Sample:
        s, noise = self.state, self._noise
        position, velocity, rate = (
            np.asarray(x) + sigma * noise.normal(size=3)
            for x, sigma in zip((s.position, s.velocity, s.body_rate), self._pose_noise[:3], strict=True)
        )
        quaternion = np.asarray(s.quaternion) + self._pose_noise[3] / 2 * noise.normal(size=4)
        return Sample(now, position, quaternion / np.linalg.norm(quaternion), now, velocity, rate)
