"""The firmware on a test rig: its world, a pilot with a transmitter, and a pose source.

With virtual time the rig is a clock: sleeping on it lets the world and the firmware run.
"""

import dataclasses
import hashlib
import shutil
import socket
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.flight.betaflight.autopilot import Betaflight
from e2efly.flight.betaflight.client import SCHEDULE
from e2efly.flight.betaflight.firmware_gains import gain_lines, gains_of
from e2efly.flight.betaflight.mixers import mixer_of
from e2efly.flight.betaflight.throttle_curve import ThrottleCurve
from e2efly.flight.betaflight.versions import Release
from e2efly.flight.link import Link, open_link
from e2efly.flight.pilot.hovering import HoverController
from e2efly.flight.pilot.throttle_map import ThrottleMap
from e2efly.flight.settings import FlightSettings
from e2efly.policy.odometry import Sample
from e2efly.simulation.device import compute_at_once, one_core
from e2efly.validation.firmware_program import Firmware
from e2efly.validation.sitl import FirmwareState, Sitl
from e2efly.validation.world import FlownBody, World
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

STEP_S = 0.002
"""Interval at which the firmware's sensors get a new state, s."""
LONGEST_LAG_S = 0.2
"""In real time: the longest delay of world and firmware on a busy machine that is made up for, s."""
RC_PERIOD_S = 0.02
"""Interval between frames of the pilot's receiver, s."""
POSE_PERIOD_S = 1 / 200.0
"""Interval between the poses of the motion capture system, s."""
CALIBRATION_S = 6.0
"""Time for which the firmware stands still before it can be armed, s."""
POSE_NOISE = (0.0005, 0.01, 0.02, 0.001)
"""Standard deviations of a motion capture system: position, m; velocity, m/s; body rate, rad/s; attitude, rad."""
VIBRATION = 0.3
"""Standard deviation of the accelerometer's force while the rotors turn, before the firmware's own filter, m/s^2. The
value is that of a small quadrotor with good propellers."""
BLACKBOX = (
    "set blackbox_device=VIRTUAL",
    "set blackbox_sample_rate=1/8",
    "set blackbox_high_resolution=ON",
)
"""Settings with which the firmware writes its blackbox into its folder, with a thousand frames per second."""
LOST_CHANNEL = 13
"""AUX9, a channel of the receiver itself. It tells of a lost signal to firmware that does not detect it."""
LANDING_S = 10
"""Time after which a failsafe landing stops the motors, s."""
SETTINGS = (
    "aux 0 0 0 1700 2100 0 0",  # arm: AUX1
    "aux 1 50 1 1700 2100 0 0",  # MSP override: AUX2
    "aux 2 1 2 925 2100 0 0",  # angle: AUX3, at any position of the pilot's switch; the bridge sends 900 there
    "set msp_override_channels_mask=79",
    "rxfail 6 s 2000",  # without the receiver: angle, and a throttle that sinks slowly (`vehicle_lines`)
    "aux 3 27 8 1700 2100 0 0",  # FAILSAFE: AUX9, for firmware that takes a lost signal for the last frame
    "set failsafe_procedure=AUTO-LAND",
    "set failsafe_delay=5",
    "set max_aux_channels=14",  # otherwise the copies of throttle and yaw on channels 11 and 12 are not read
    "set rates_type=ACTUAL",
    *(f"set {axis}_rc_rate=67" for axis in ("roll", "pitch", "yaw")),
    *(f"set {axis}_srate=67" for axis in ("roll", "pitch", "yaw")),
    *(f"set {axis}_expo=0" for axis in ("roll", "pitch", "yaw")),
    "set rc_smoothing=OFF",
    "set feedforward_transition=0",
    *(f"set f_{axis}=0" for axis in ("roll", "pitch", "yaw")),  # noise of the setpoint must not be amplified
    "set iterm_relax=RPY",
    "set small_angle=180",
    "set acc_calibration=0,0,0,1",
    "set serial_update_rate_hz=1000",
    "set deadband=0",
    "set yaw_deadband=0",
)
"""Settings of the firmware, as lines of its own command line. docs/hardware requires the same of a real controller.
What differs from vehicle to vehicle is in `vehicle_lines`."""
FAILSAFE_STEP = 25
"""Steps of the throttle without a receiver, us. It is one to two steps below hovering."""


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


class Rig:
    """One firmware in its world. Use it as a context manager: inside, the thread and the firmware share one core.

    Time is virtual. With `real_time` it follows the machine's clock, as for a bridge in another process. `step` is the
    interval at which sensors are updated and motors are read, s, a whole number of ms. `settings` are added to
    `SETTINGS` and to the lines of `vehicle`. `pose_noise` replaces `POSE_NOISE`.
    """

    def __init__(
        self,
        firmware: Firmware,
        folder: Path,
        vehicle: Vehicle,
        *,
        real_time: bool = False,
        latency: float = 0.0,
        seed: int = 0,
        step: float = STEP_S,
        settings: tuple[str, ...] = (),
        pose_noise: tuple[float, ...] = POSE_NOISE,
    ) -> None:
        compute_at_once()
        self.motors = list(mixer_of(vehicle).motors)
        """For each rotor of the vehicle file, its motor in the order of the firmware."""
        self._step = step
        self._settings = (*vehicle_lines(vehicle, firmware.release), *SETTINGS, *settings)
        self.sitl = Sitl(firmware, folder, vehicle.rotor_count)
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

    def __enter__(self) -> "Rig":
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def start(self) -> None:
        """Start the firmware with `SETTINGS` and wait until it can be armed. `close`, in the same thread, ends it."""
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
        prepare(self.sitl, self._settings)
        self.sitl.start()
        self._next_pose = self._next_rc = self.now()
        self._run(CALIBRATION_S)  # nobody needs this part in real time
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
            self._receive()
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

    def _receive(self) -> None:
        """Send a frame of the pilot's receiver. Without a signal it sends none, or the switch that reports the loss."""
        channels = self.transmitter.channels()
        if not self.heard:
            if self.sitl.firmware.layout.hears_silence:
                return
            channels[LOST_CHANNEL - 1] = 2000
        self.sitl.send_rc(channels)

    def poses(self, now: float) -> list[Sample]:
        """The poses that have arrived since the last call, `latency` s old."""
        ready = []
        while self._poses and self._poses[0].received + self.latency <= now:
            sample = self._poses.popleft()
            ready.append(dataclasses.replace(sample, received=now))
        return ready

    def autopilot(
        self,
        settings: FlightSettings,
        hover: HoverController | None = None,
        *,
        link: Link | None = None,
        schedule: Mapping[int, float] = SCHEDULE,
    ) -> Betaflight:
        """The firmware as a bridge's autopilot. Without a link, over its own port."""
        return Betaflight.connect(
            link or open_link(self.sitl.msp), settings, schedule, hover=hover, timeout=3.0, clock=self
        )

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


def vehicle_lines(vehicle: Vehicle, release: Release) -> tuple[str, ...]:
    """The firmware's settings for a vehicle: its mixer, the gains of the rate loop, and the throttle without a
    receiver.

    Raises:
        ValueError: if the firmware has no mixer for its rotors.
    """
    hover = ThrottleCurve().channel_for(ThrottleMap.of(vehicle).throttle(GRAVITY))
    sinks = (hover // FAILSAFE_STEP - 1) * FAILSAFE_STEP
    return (
        *mixer_of(vehicle).lines,
        *gain_lines(gains_of(vehicle), release),
        f"rxfail 3 s {sinks}",
        f"set failsafe_throttle={sinks}",
    )


def prepare(sitl: Sitl, settings: tuple[str, ...] = SETTINGS) -> None:
    """Put settings into the folder of a firmware that is not running.

    They are cached, because typing them takes a while.
    """
    firmware = sitl.firmware
    stops, steps = firmware.release.landing_time
    settings = (*settings, f"set {stops}={LANDING_S * steps}", *firmware.layout.settings)
    name = hashlib.sha256("\n".join(settings).encode()).hexdigest()[:12]
    kept = firmware.program.parent / f"settings-{name}.bin"
    mine = sitl.folder / "eeprom.bin"
    if kept.is_file():
        shutil.copy(kept, mine)
        return
    mine.unlink(missing_ok=True)
    sitl.start()
    try:
        _type(sitl, settings)
    finally:
        sitl.stop()
    draft = kept.with_suffix(f".{sitl.base}")
    shutil.copy(mine, draft)
    draft.replace(kept)


def _type(sitl: Sitl, settings: tuple[str, ...]) -> None:
    """Type lines into the firmware's command line, then `save`, which ends the firmware."""
    sitl.idle(1.0)
    with socket.create_connection(("127.0.0.1", sitl.base + 4), timeout=5.0) as line:
        line.setblocking(False)
        sitl.idle(0.2)
        for text in ("#", *(f"{setting}\n" for setting in settings)):
            line.sendall(text.encode())
            sitl.idle(0.3)
            answer = line.recv(65536).decode(errors="replace")
            if "#" not in answer or "ERROR" in answer.upper() or "INVALID" in answer.upper():
                raise ValueError(f"the firmware refuses {text!r}: {answer!r}")
        line.sendall(b"save\n")
        end = time.monotonic() + 20
        while sitl.alive and time.monotonic() < end:
            sitl.idle(0.1)
