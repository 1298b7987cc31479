"""Autopilots of ours that speak MAVLink as PX4 and ArduCopter document it, over the rigid body, in virtual time.

Frames are pymavlink's. Rate loop, mixer, modes, arming and time-outs are written here and share nothing with the
bridge. They prove format, order, signs and time-outs as they are documented, not the firmware.
"""

import struct
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mav

from e2efly.flight.mavlink.mavlink import Mavlink
from e2efly.flight.pilot.hovering import HoverController
from e2efly.flight.settings import FlightSettings
from e2efly.vehicles.vehicle import Vehicle
from tests.flight.peer_rig import STEP_S, FlownPeer

RATES_HZ = {"ATTITUDE_QUATERNION": 4.0, "HIGHRES_IMU": 4.0, "RAW_IMU": 4.0, "RC_CHANNELS": 4.0, "SYS_STATUS": 1.0}
"""Streams before anybody asks for more."""
OFFBOARD, PX4_LAND, PX4_POSITION, PX4_STABILIZED = 6 << 16, (4 << 16) | (6 << 24), 3 << 16, 7 << 16
GUIDED_NOGPS, COPTER_LAND, COPTER_STABILIZE = 20, 9, 0
FLU = np.array([1.0, -1.0, -1.0])
PX4_VALUES = {
    "COM_OF_LOSS_T": 0.3, "COM_OBL_RC_ACT": 4, "NAV_RCL_ACT": 3, "COM_RCL_EXCEPT": 0, "COM_RC_IN_MODE": 0,
    "MAV_FWDEXTSP": 1, "MC_AIRMODE": 1, "MC_BAT_SCALE_EN": 0, "THR_MDL_FAC": 0.3, "COM_DISARM_LAND": 2.0,
    "BAT1_N_CELLS": 4, "RC_MAP_ROLL": 1, "RC_MAP_PITCH": 2, "RC_MAP_THROTTLE": 3, "RC_MAP_YAW": 4, "EKF2_EV_CTRL": 15,
    "RC1_REV": 1.0, "RC2_REV": -1.0, "RC3_REV": 1.0, "RC4_REV": 1.0,
}  # fmt: skip
PX4_REALS = {"COM_OF_LOSS_T", "THR_MDL_FAC", "COM_DISARM_LAND", *(f"RC{n}_REV" for n in range(1, 5))}
COPTER_VALUES = {
    "GUID_OPTIONS": 9, "RC_OPTIONS": 0, "ATC_RATE_FF_ENAB": 1,
    "GUID_TIMEOUT": 0.3, "FS_GCS_ENABLE": 5, "FS_GCS_TIMEOUT": 2.0, "FS_THR_ENABLE": 3,
    "FS_OPTIONS": 0, "ATC_ANGLE_BOOST": 0, "PILOT_THR_FILT": 0, "MOT_THST_EXPO": 0.65, "MOT_BAT_VOLT_MAX": 0,
    "ATC_ACCEL_R_MAX": 0, "ATC_ACCEL_P_MAX": 0, "ATC_ACCEL_Y_MAX": 0, "RCMAP_ROLL": 1, "RCMAP_PITCH": 2,
    "RCMAP_THROTTLE": 3, "RCMAP_YAW": 4, "SYSID_MYGCS": 255, "VISO_TYPE": 0, "RC1_REVERSED": 0, "RC2_REVERSED": 0,
    "RC3_REVERSED": 0, "RC4_REVERSED": 0,
}  # fmt: skip


class MavlinkRig(FlownPeer):
    """An autopilot in its world, with a pilot and poses: what `Session` flies."""

    def __init__(
        self,
        kind: str,
        vehicle: Vehicle,
        *,
        latency: float = 0.0,
        seed: int = 0,
        values: dict[str, float] | None = None,
    ) -> None:
        super().__init__(vehicle, latency, seed)
        self.px4 = kind == "px4"
        self.values = dict(PX4_VALUES if self.px4 else COPTER_VALUES) | (values or {})
        self.mav = mav.MAVLink(None, srcSystem=1, srcComponent=1)
        self.reader = mav.MAVLink(None)
        self.mode = PX4_STABILIZED if self.px4 else COPTER_STABILIZE
        self.armed = self.critical = self.received = self._arm = False
        self.poses_seen = 0
        self._streams = dict(RATES_HZ)
        self._due = dict.fromkeys((*RATES_HZ, "HEARTBEAT"), 0.0)
        self._streams["HEARTBEAT"] = 1.0
        self._setpoint: tuple[float, np.ndarray] | None = None
        self._since = self._at = self._beat = -np.inf
        self._radio = self.time
        self._landing = 0.0

    def autopilot(
        self, settings: FlightSettings, hover: HoverController | None = None, *, aids: bool = False
    ) -> Mavlink:
        del hover, aids
        return Mavlink.connect(self.wire, settings, 5.0, self)

    def hear(self) -> None:
        for message in self.reader.parse_buffer(self.wire.arrived()) or []:
            if message.get_type() != "BAD_DATA":
                self._take(message)
        self._decide()

    # -- autopilot -----------------------------------------------------------------------------------------------------

    def _take(self, m: Any) -> None:
        kind = m.get_type()
        if kind == "HEARTBEAT" and (self.px4 or m.get_srcSystem() == self.values["SYSID_MYGCS"]):
            self._beat = self.time
        elif kind == "TIMESYNC" and m.tc1 == 0:
            self._send(self.mav.timesync_encode(round(self.time * 1e9), m.ts1))
        elif kind == "COMMAND_LONG" and m.command == mav.MAV_CMD_REQUEST_MESSAGE and m.param1 == 148:
            version = (1 << 24 | 15 << 16 | 4 << 8 | 255) if self.px4 else (4 << 24 | 5 << 16 | 7 << 8 | 255)
            self._send(self.mav.autopilot_version_encode(0, version, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0))
        elif kind == "COMMAND_LONG" and m.command == mav.MAV_CMD_SET_MESSAGE_INTERVAL:
            name = mav.mavlink_map[int(m.param1)].msgname if int(m.param1) in mav.mavlink_map else ""
            if name in self._streams:
                self._streams[name] = 1e6 / m.param2
        elif kind == "PARAM_REQUEST_READ" and m.param_id in self.values:
            value, real = self.values[m.param_id], not self.px4 or m.param_id in PX4_REALS
            bits = float(value) if real else struct.unpack("<f", struct.pack("<i", int(value)))[0]
            type_ = mav.MAV_PARAM_TYPE_REAL32 if real else mav.MAV_PARAM_TYPE_INT32
            self._send(self.mav.param_value_encode(m.param_id.encode(), bits, type_, len(self.values), 0))
        elif kind == "ODOMETRY":
            self.poses_seen += 1
        elif kind == "SET_ATTITUDE_TARGET" and m.target_system == 1 and m.type_mask == 128:
            if self._setpoint is None or self.time - self._at > 0.5:
                self._since = self.time
            self._at = self.time
            rates = np.array([m.body_roll_rate, m.body_pitch_rate, m.body_yaw_rate]) * FLU
            self._setpoint = float(m.thrust), rates

    def _decide(self) -> None:
        """Modes, arming, and what ends each."""
        if self.heard:
            self._radio = self.time
        received = self._received
        mine = OFFBOARD if self.px4 else GUIDED_NOGPS
        land = PX4_LAND if self.px4 else COPTER_LAND
        manual = PX4_STABILIZED if self.px4 else COPTER_STABILIZE
        if received and self.hand.armed is not self._arm and (self.hand.armed or self.standing):  # moved, not held
            self._arm = self.hand.armed
            if self.armed is not self._arm and (self.armed or self._arms):
                self.armed = self._arm
                self.log.append("armed" if self.armed else "disarmed")
        if received and self.hand.override is not self.received:
            if not self.hand.override:
                self._to(manual, critical=False)
                self.received = False
            elif not self.px4 or (self._setpoint is not None and self.time - self._since > 1.0):
                self._to(mine, critical=False)
                self.received = True
        if self.mode == mine:
            loss = self.time - self._at
            if not received:
                self._fail("receiver", land)
            elif self.px4 and loss > self.values["COM_OF_LOSS_T"]:
                action = {4: PX4_LAND, 0: PX4_POSITION}[int(self.values["COM_OBL_RC_ACT"])]
                self._fail("set-points", action)
            elif not self.px4 and self.values["FS_GCS_ENABLE"] == 5 and self.armed and self._deserted:
                self._fail("ground station", land)
        if self.mode == land and self.standing and self.time - self._landing > 1.0 and self.armed:
            self.armed = False
            self.log.append("disarmed")

    @property
    def _arms(self) -> bool:
        """Whether the transmitter may arm it now: ArduCopter 4.6.3 asks two options."""
        guided, receiver = (int(self.values.get(name, 0)) for name in ("GUID_OPTIONS", "RC_OPTIONS"))
        allowed = self.mode != GUIDED_NOGPS or bool(guided & 1)
        return self.px4 or (allowed and not (receiver & 32 and self.hand.throttle > -1))

    def _to(self, mode: int, *, critical: bool) -> None:
        if mode != self.mode:
            self.log.append(f"mode {mode}")
        self.mode, self.critical, self._landing = mode, critical, self.time

    def _fail(self, why: str, mode: int) -> None:
        self.log.append(f"failsafe: {why}")
        self._to(mode, critical=True)

    @property
    def _received(self) -> bool:
        """Whether it takes the receiver for alive: PX4's COM_RC_LOSS_T, ArduCopter's RC_FS_TIMEOUT."""
        return self.time - self._radio < (0.5 if self.px4 else 1.0)

    @property
    def _deserted(self) -> bool:
        """Whether heartbeats came once, and do not any more."""
        return bool(np.isfinite(self._beat)) and self.time - self._beat > self.values["FS_GCS_TIMEOUT"]

    def outputs(self) -> np.ndarray:
        """Motor outputs of the active mode."""
        vehicle = self.world.vehicle
        if not self.armed:
            return np.zeros(4)
        mine = OFFBOARD if self.px4 else GUIDED_NOGPS
        if self.mode == mine and self._setpoint is not None:
            thrust, rates = self._setpoint
            if not self.px4 and self.time - self._at > self.values["GUID_TIMEOUT"]:
                return self.mixed(*self.level(0.0))
            bend = self.values["THR_MDL_FAC" if self.px4 else "MOT_THST_EXPO"]
            root = thrust if bend == 0 else ((bend - 1) + np.sqrt((1 - bend) ** 2 + 4 * bend * thrust)) / (2 * bend)
            speed = vehicle.rotor_speed_min + root * (self.world.full_speed - vehicle.rotor_speed_min)
            return self.mixed(4 * self.thrust(speed), rates)
        if self.mode in (PX4_LAND, COPTER_LAND):
            return self.mixed(*self.level(-0.6))
        stick = self.hand.throttle if self.heard else 0.0
        climb = 0.0 if abs(stick) < 0.1 else stick
        return self.mixed(*self.level(climb)) if not self.standing or climb > 0 else np.zeros(4)

    # -- telemetry -----------------------------------------------------------------------------------------------------

    def _send(self, message: Any) -> None:
        self.wire.answer(message.pack(self.mav))
        self.mav.seq = (self.mav.seq + 1) % 256

    def tell(self) -> None:
        for name, rate in self._streams.items():
            if self.time >= self._due[name]:
                self._due[name] = self.time + 1 / rate - STEP_S / 2
                message = self._message(name)
                if message is not None:
                    self._send(message)

    def _message(self, name: str) -> Any:
        ms, s = round(self.time * 1e3), self.state
        force, gyro = self.force * FLU, np.asarray(s.body_rate) * FLU
        if name == "HEARTBEAT":
            base = (mav.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0) | mav.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
            state = mav.MAV_STATE_CRITICAL if self.critical else mav.MAV_STATE_ACTIVE
            return self.mav.heartbeat_encode(2, 12 if self.px4 else 3, base, self.mode, state)
        if name == "ATTITUDE_QUATERNION":
            w, x, y, z = np.asarray(s.quaternion)
            return self.mav.attitude_quaternion_encode(ms, w, x, -y, -z, *gyro)
        if name == "HIGHRES_IMU" and self.px4:
            return self.mav.highres_imu_encode(ms * 1000, *force, *gyro, 0, 0, 0, 0, 0, 0, 0, 63)
        if name == "RAW_IMU" and not self.px4:
            counts = [*np.round(force / 9.80665 * 1000), *np.round(gyro * 1000)]
            return self.mav.raw_imu_encode(ms * 1000, *map(int, np.clip(counts, -32768, 32767)), 0, 0, 0)
        if name == "SYS_STATUS":
            health = 1 << 16 if self._received else 0
            volts = round(self.volts * 1000)
            return self.mav.sys_status_encode(1 << 16, 1 << 16, health, 200, volts, 500, 80, 0, 0, 0, 0, 0, 0)
        if name == "RC_CHANNELS" and self.heard:
            channels = self.hand.channels(-1)
            return self.mav.rc_channels_encode(ms, len(channels), *channels, *[65535] * (18 - len(channels)), 200)
        return None
