"""The real ArduCopter, a user's program, as the faults of `mavlink_faults.py` want what they strike."""

from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from e2efly.flight.link import Link, open_link
from e2efly.flight.mavlink.mavlink import Mavlink
from e2efly.flight.pilot.hovering import HoverController
from e2efly.flight.settings import FlightSettings
from e2efly.validation.copter_rig import CopterRig
from e2efly.vehicles.vehicle import Vehicle
from tests.flight.peer_rig import Wire


class CopterBench(CopterRig):
    """ArduCopter on a rig, its link a wire that can be struck, and what it tells written down."""

    def __init__(self, program: Path, folder: Path, vehicle: Vehicle, **world: Any) -> None:
        super().__init__(program, folder, vehicle, **world)
        self.wire = Wire(self.now)
        self.log: list[str] = []
        """What it told, in order: modes, arming, failsafes."""
        self.said: list[str] = []
        """Every text that it told."""
        self._real = open_link(self.sitl.link)
        self._reader = mav.MAVLink(None)
        self._reader.robust_parsing = True  # texts of its start come, too
        self._told: tuple[int, bool] = (-1, False)

    @property
    def volts(self) -> float:
        return self.sitl.volts

    @volts.setter
    def volts(self, volts: float) -> None:
        self.sitl.volts = volts

    def step(self, dt: float) -> None:
        super().step(dt)
        self._real.poll(self.now())
        data = self._real.receive()
        self.wire.answer(data)
        for message in self._reader.parse_buffer(data) or []:
            self._write(message)
        if up := self.wire.arrived():
            self._real.send(up)

    def autopilot(
        self, settings: FlightSettings, hover: HoverController | None = None, *, link: Link | None = None,
        aids: bool = False,
    ) -> Mavlink:  # fmt: skip
        del aids
        return super().autopilot(settings, hover, link=link or self.wire)

    def close(self) -> None:
        self._real.close()
        super().close()

    def _write(self, message: Any) -> None:
        kind = message.get_type()
        if kind == "HEARTBEAT" and message.autopilot == mav.MAV_AUTOPILOT_ARDUPILOTMEGA:
            mode, armed = message.custom_mode, bool(message.base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED)
            if mode != self._told[0]:
                self.log.append(f"mode {mode}")
            if armed is not self._told[1]:
                self.log.append("armed" if armed else "disarmed")
            self._told = mode, armed
        elif kind == "STATUSTEXT":
            self.said.append(f"{self.now():.1f} {message.text}")
            if "failsafe" in message.text.lower():
                self.log.append(f"failsafe: {message.text}")
