"""Betaflight on a test rig: its settings, and how they reach it."""

import hashlib
import shutil
import socket
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from e2efly.flight.betaflight.autopilot import AIDING_SCHEDULE, Betaflight
from e2efly.flight.betaflight.client import SCHEDULE
from e2efly.flight.betaflight.firmware_gains import gain_lines, gains_of
from e2efly.flight.betaflight.mixers import mixer_of
from e2efly.flight.betaflight.throttle_curve import ThrottleCurve
from e2efly.flight.betaflight.versions import Release
from e2efly.flight.link import Link, open_link
from e2efly.flight.pilot.hovering import HoverController
from e2efly.flight.pilot.throttle_map import ThrottleMap
from e2efly.flight.settings import FlightSettings
from e2efly.validation.firmware_program import Firmware
from e2efly.validation.firmware_rig import FirmwareRig
from e2efly.validation.sitl import Sitl
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

BLACKBOX = ("set blackbox_device=VIRTUAL", "set blackbox_sample_rate=1/8", "set blackbox_high_resolution=ON")
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


class Rig(FirmwareRig[Sitl]):
    """Betaflight on a rig. `settings` are added to `SETTINGS` and to the lines of `vehicle`."""

    boot_s = 6.0

    def __init__(
        self, firmware: Firmware, folder: Path, vehicle: Vehicle, *, settings: tuple[str, ...] = (), **world: Any
    ) -> None:
        """Put a vehicle under the firmware; see `FirmwareRig` for the other arguments.

        Raises:
            ValueError: if the firmware has no mixer for its rotors.
        """
        motors = mixer_of(vehicle).motors
        super().__init__(Sitl(firmware, folder, vehicle.rotor_count), vehicle, motors=motors, **world)
        self._settings = (*vehicle_lines(vehicle, firmware.release), *SETTINGS, *settings)

    def prepare(self) -> None:
        """Put the settings into the folder of the firmware."""
        prepare(self.sitl, self._settings)

    def receive(self) -> None:
        """Send a frame of the pilot's receiver. Without a signal it sends none, or the switch that reports the loss."""
        channels = self.transmitter.channels()
        if not self.heard:
            if self.sitl.firmware.layout.hears_silence:
                return
            channels[LOST_CHANNEL - 1] = 2000
        self.sitl.send_rc(channels)

    def autopilot(
        self,
        settings: FlightSettings,
        hover: HoverController | None = None,
        *,
        link: Link | None = None,
        schedule: Mapping[int, float] = SCHEDULE,
        aids: bool = False,
    ) -> Betaflight:
        """The firmware as a bridge's autopilot. Without a link, over its own port. It `aids` a pose source by its
        IMU.
        """
        asked = AIDING_SCHEDULE if aids else schedule
        return Betaflight.connect(
            link or open_link(self.sitl.msp), settings, asked, hover=hover, timeout=3.0, clock=self
        )


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
