"""ArduCopter on a test rig: its parameters, and how the pilot's receiver reaches it."""

from pathlib import Path
from typing import Any

from e2efly.flight.link import Link, open_link
from e2efly.flight.mavlink.copter_gains import copter_gains
from e2efly.flight.mavlink.mavlink import Mavlink
from e2efly.flight.pilot.hovering import HoverController
from e2efly.flight.settings import FlightSettings
from e2efly.validation.copter_sitl import DEFAULTS, CopterSitl
from e2efly.validation.firmware_rig import FirmwareRig
from e2efly.vehicles.vehicle import Vehicle
from e2efly.vehicles.vehicle_rules import check_quadrotor

STEP_S = 0.001
"""Interval at which the firmware's sensors get a new state, s: shorter than its loop of 2.5 ms."""
PARAMETERS: dict[str, float] = {
    # the pilot: mode by channel 6, arming by channel 5; the modes' switch rests on a mode that holds its height
    "FLTMODE_CH": 6, "FLTMODE1": 2, "FLTMODE6": 20, "RC5_OPTION": 153, "RC7_OPTION": 0, "RC8_OPTION": 0,
    "RC_OPTIONS": 0,  # or it arms only with the throttle stick low
    # what a flight needs: `e2efly fly --check` reads these
    "GUID_OPTIONS": 9, "GUID_TIMEOUT": 0.3, "FS_GCS_ENABLE": 5, "FS_GCS_TIMEOUT": 2, "FS_THR_ENABLE": 3,
    "FS_OPTIONS": 0, "ATC_ANGLE_BOOST": 0, "PILOT_THR_FILT": 0, "MOT_BAT_VOLT_MAX": 0, "ATC_ACCEL_R_MAX": 0,
    "ATC_ACCEL_P_MAX": 0, "ATC_ACCEL_Y_MAX": 0,
    # no satellites: a room
    "GPS1_TYPE": 0, "SIM_GPS_DISABLE": 1, "ARMING_CHECK": 1, "SIM_RC_FAIL": 1, "BATT_MONITOR": 4, "LOG_DISARMED": 0,
    "LOG_BACKEND_TYPE": 0, "FRAME_CLASS": 1,
}  # fmt: skip
"""Parameters of the firmware. What differs from vehicle to vehicle is in `copter_parameters`."""


class CopterRig(FirmwareRig[CopterSitl]):
    """ArduCopter on a rig. `parameters` replace those of `PARAMETERS` and of the vehicle."""

    boot_s = 30.0

    def __init__(
        self, program: Path, folder: Path, vehicle: Vehicle, *, parameters: dict[str, float] | None = None, **world: Any
    ) -> None:
        """Put a vehicle under the firmware; see `FirmwareRig` for the other arguments."""
        check_quadrotor(vehicle, "the rig of ArduCopter")
        super().__init__(CopterSitl(program, folder), vehicle, step=STEP_S, **world)
        self.parameters = PARAMETERS | copter_parameters(vehicle) | (parameters or {})

    def prepare(self) -> None:
        """Put the parameters into the folder of the firmware."""
        lines = "".join(f"{name} {value:g}\n" for name, value in self.parameters.items())
        (self.sitl.folder / DEFAULTS).write_text(lines, encoding="utf-8")

    def receive(self) -> None:
        """Send a frame of the pilot's receiver, its pitch stick low in front. Without a signal it sends none."""
        channels = self.transmitter.channels()
        channels[1] = 3000 - channels[1]
        self.sitl.channels = channels if self.heard else None

    def autopilot(
        self, settings: FlightSettings, hover: HoverController | None = None, *, link: Link | None = None,
        aids: bool = False,
    ) -> Mavlink:  # fmt: skip
        """The firmware as a bridge's autopilot. Without a link, over its own port. Its IMU is told often as it is."""
        del hover, aids
        held = link or open_link(self.sitl.link)
        while not held.alive:
            held.poll(self.now())
            self.sleep(0.01)
        return Mavlink.connect(held, settings, 5.0, self)


def copter_parameters(vehicle: Vehicle) -> dict[str, float]:
    """The parameters of a vehicle: its rate loop, and its motors in Betaflight's order of outputs."""
    gains = copter_gains(vehicle)
    turned = {"FRAME_TYPE": 12 if vehicle.rotor_spin[0] > 0 else 18}  # BetaFlightX, and with reversed rotors
    return gains | turned | {"MOT_SPIN_ARM": gains["MOT_SPIN_MIN"], "MOT_PWM_MIN": 1000, "MOT_PWM_MAX": 2000}
