"""PX4 or ArduCopter as the bridge's autopilot: body rates and thrust by SET_ATTITUDE_TARGET.

The pilot's mode switch decides: the autopilot follows this program only in OFFBOARD (PX4) or GUIDED_NOGPS (ArduCopter).
Commands are sent from the start, with no thrust on the ground, because PX4 refuses OFFBOARD without a stream.
Nothing but this process sends commands or heartbeats. If it dies, they end, and the autopilot's own failsafe lands:
`check` reads the parameters that decide so. MAVLink's frames are FRD and NED; all that leaves this module is FLU.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from e2efly.control import Quat, Vec3
from e2efly.flight.attitude import Attitude, attitude_of
from e2efly.flight.autopilot import HOLE, AutopilotState, InertialReading, Outgoing
from e2efly.flight.clock import MONOTONIC, Clock
from e2efly.flight.link import Link
from e2efly.flight.mavlink.dialect import PX4, MavlinkDialect, dialect_of, release_row
from e2efly.flight.mavlink.station import (
    REQUEST_MESSAGE,
    SET_MESSAGE_INTERVAL,
    STREAMS,
    Station,
    interval_us,
)
from e2efly.flight.mavlink.wire import BY_NAME
from e2efly.flight.pilot.flight_state import Mission, Pilot
from e2efly.flight.pilot.receiver import deflection, mission_of
from e2efly.flight.row import Row
from e2efly.flight.settings import FlightSettings
from e2efly.policy.contract import Contract
from e2efly.policy.odometry import Odometry
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

RATES_AND_THRUST = 128
"""Type mask of SET_ATTITUDE_TARGET: the attitude is ignored."""
ARMED, CRITICAL = 128, 5
"""MAV_MODE_FLAG_SAFETY_ARMED, and MAV_STATE_CRITICAL: a failsafe is active."""
RECEIVER = 1 << 16
"""MAV_SYS_STATUS_SENSOR_RC_RECEIVER."""
STATUS_S, SLOW_S, BATTERY_S = 2.5, 0.125, 3.0
"""Largest ages of heartbeat and battery, s, and the largest time of an echo, s."""
RECEIVER_S = 0.3
"""Largest age of the receiver's channels, s."""
POSE_S = 1 / 40
"""Interval of the poses that are passed on, s. PX4 asks for 30 to 50 Hz."""
LOCAL_FRD, BODY_FRD, VISION = 20, 12, 2
"""MAV_FRAME_LOCAL_FRD, MAV_FRAME_BODY_FRD, MAV_ESTIMATOR_TYPE_VISION."""
CELL_V = 4.25
"""Largest voltage of a cell, V: from it the number of cells is known where no parameter tells it."""
ASK_S = 0.25
"""What was asked for and did not come is asked for again after this time, s."""
RPM = 2 * math.pi / 60


class Mavlink:
    """One autopilot that speaks MAVLink 2, identified."""

    def __init__(self, station: Station, settings: FlightSettings, clock: Clock = MONOTONIC) -> None:
        """Fly the autopilot at the other end of a station's link; see `connect`."""
        self.station, self.settings = station, settings
        self.dialect: MavlinkDialect = PX4
        """Known once it is identified."""
        self.version = 0, 0, 0
        self.parameters: dict[str, float] = {}
        self._clock, self._posed = clock, -math.inf
        self._logged: dict[str, float] = {}
        self._felt = -math.inf
        self._voltage: float | None = None

    @staticmethod
    def connect(link: Link, settings: FlightSettings, timeout: float = 5.0, clock: Clock = MONOTONIC) -> "Mavlink":
        """Identify the autopilot at the other end of a link.

        Args:
            link: the link to it.
            settings: the limits of the flight, with the pilot's channels.
            timeout: how long the first message and each group of answers may take, s.
            clock: gives the time.

        Raises:
            ValueError: it is none that is known.
            TimeoutError: nothing that is MAVLink 2 comes.
        """
        autopilot = Mavlink(Station(link), settings, clock)
        autopilot.identify(timeout)
        return autopilot

    def identify(self, timeout: float) -> None:
        """Read version and parameters, and request the telemetry. This is not for flight."""
        station = self.station
        station.parameters.clear()
        station.latest.clear()
        if not self._wait(timeout, lambda: "HEARTBEAT" in station.latest, lambda: None):
            old = " (MAVLink 1 comes: set MAV_PROTO_VER 2 or SERIALn_PROTOCOL 2)" if station.reader.old else ""
            raise TimeoutError(
                f"MAVLink: no heartbeat of an autopilot within {timeout:g} s{old}; accepted: MAVLink 2, component 1"
                + (f" ({station.link.reason})" if station.link.reason else "")
            )
        self.dialect = dialect = dialect_of(station.latest["HEARTBEAT"][0]["autopilot"])
        if not self._wait(
            timeout, lambda: "AUTOPILOT_VERSION" in station.latest,
            lambda: station.command(REQUEST_MESSAGE, BY_NAME["AUTOPILOT_VERSION"].id),
        ):  # fmt: skip
            raise TimeoutError(f"MAVLink: {dialect.name} does not tell its version within {timeout:g} s")
        number = station.latest["AUTOPILOT_VERSION"][0]["flight_sw_version"]
        self.version = number >> 24, number >> 16 & 0xFF, number >> 8 & 0xFF
        self.parameters = self._read(dialect.parameters, timeout)
        places = [int(self.parameters.get(name, i + 1)) for i, name in enumerate(dialect.sticks)]
        self.parameters |= self._read(tuple(dialect.reversed_name.format(n=place) for place in places), timeout)
        if dialect.ground_station in self.parameters:
            station.system = int(self.parameters[dialect.ground_station])
        elif not dialect.ground_station:
            station.system = station.target
        for name, rate in STREAMS.items():
            station.command(SET_MESSAGE_INTERVAL, BY_NAME[name].id, interval_us(rate))

    @property
    def versions(self) -> Mapping[str, str]:
        """Firmware and version of the protocol."""
        return {"firmware": f"{self.dialect.name} {'.'.join(map(str, self.version))}", "mavlink": "2"}

    @property
    def connections(self) -> int:
        """How often the link has connected."""
        return self.station.link.connections

    @property
    def heard(self) -> float:
        """When a message of the autopilot came last, s."""
        return self.station.heard

    @property
    def statuses(self) -> int:
        """Number of heartbeats so far."""
        return self.station.statuses

    def check(self, vehicle: Vehicle, settings: FlightSettings, contract: Contract | None) -> tuple[Row, ...]:
        """The parameters that matter to a flight, and what the autopilot does when link, poses or this program end."""
        del settings, contract
        dialect, told = self.dialect, self.parameters
        return (
            release_row(dialect, self.version),
            Row("mode", dialect.mode_name, "a position of the pilot's mode switch: it alone hands over", True),
            *(need.row(told) for need in dialect.needs),
            *dialect.tuned_rows(vehicle, told),
            dialect.poses_row(told),
        )

    def poll(self, now: float) -> None:
        """Read what has come, and send heartbeats and time stamps."""
        self.station.poll(now)

    def read(self, now: float, *, land: bool, sends: bool, grounded: bool) -> AutopilotState:
        """Evaluate the messages that have come until `now`, s."""
        del sends, grounded
        station = self.station
        beat = station.newest("HEARTBEAT", now, STATUS_S)
        status = station.newest("SYS_STATUS", now, BATTERY_S)
        override = beat is not None and beat[0]["custom_mode"] == self.dialect.mode
        critical = beat is not None and beat[0]["system_status"] >= CRITICAL
        self._measure(now, status)
        known = self.attitude(now, self.settings.link_timeout)
        return AutopilotState(
            link_problem=self._link_problem(now, beat is not None),
            armed=beat is not None and bool(beat[0]["base_mode"] & ARMED),
            override=override,
            pilot=self._pilot(now, None if status is None else status[0], land=land),
            failsafe=critical and not override,
            voltage=self._voltage,
            attitude=None if known is None else known[0],
            inertial=self._inertial(),
            records=self._records(now),
        )

    def attitude(self, now: float, oldest: float) -> tuple[Attitude, float] | None:
        """The newest attitude, and when it was requested, s: what was sent before then had arrived."""
        found = self.station.newest("ATTITUDE_QUATERNION", now, oldest)
        if found is None:
            return None
        q, at = found
        return attitude_of(q["q1"], q["q2"], -q["q3"], -q["q4"]), at - self.station.echoes.late

    def rotor_speeds(self, now: float, oldest: float) -> Sequence[float] | None:
        """The newest speeds of the rotors, rad/s."""
        found = self.station.newest("ESC_TELEMETRY_1_TO_4", now, oldest)
        return None if found is None or not any(found[0]["rpm"]) else [RPM * rpm for rpm in found[0]["rpm"]]

    def send(self, now: float, throttle: float | None, rates: tuple[float, float, float]) -> Outgoing:
        """Send body rates and thrust. A closed throttle is no thrust and no rates."""
        if not all(map(math.isfinite, (throttle or 0.0, *rates))):
            raise ValueError(f"command: throttle and body rate are {(throttle, *rates)}; accepted: finite numbers")
        share = min(max(throttle or 0.0, 0.0), 1.0)
        bend = min(max(self.parameters.get(self.dialect.curve, 0.0), 0.0), 1.0)
        p, q, r = (0.0, 0.0, 0.0) if throttle is None else rates
        alive = self.station.send("SET_ATTITUDE_TARGET", {
            "time_boot_ms": round(now * 1e3) & 0xFFFFFFFF, "q": (1.0, 0.0, 0.0, 0.0), "type_mask": RATES_AND_THRUST,
            "body_roll_rate": p, "body_pitch_rate": -q, "body_yaw_rate": -r,
            "thrust": (1 - bend) * share + bend * share * share,
        })  # fmt: skip
        return Outgoing(alive, saturated=("throttle",) if throttle is not None and throttle != share else ())

    def pose(self, now: float, odometry: Odometry) -> None:
        """Pass a pose on, if the estimator takes poses."""
        wanted = any(self.parameters.get(name) for name in self.dialect.passes_poses)
        if not wanted or now - self._posed < POSE_S:
            return
        self._posed = now
        x, y, z = (float(value) for value in odometry.position)
        w, i, j, k = (float(value) for value in odometry.quaternion)
        velocity = Quat(w, i, j, k).unrotate(Vec3(*odometry.velocity.tolist()))
        p, q, r = (float(value) for value in odometry.body_rate)
        unknown = (math.nan, *(0.0,) * 20)
        self.station.send("ODOMETRY", {
            "time_usec": round((now - max(now - odometry.time, 0.0)) * 1e6), "x": x, "y": -y, "z": -z,
            "q": (w, i, -j, -k), "vx": float(velocity.x), "vy": -float(velocity.y), "vz": -float(velocity.z),
            "rollspeed": p, "pitchspeed": -q, "yawspeed": -r, "pose_covariance": unknown,
            "velocity_covariance": unknown, "frame_id": LOCAL_FRD, "child_frame_id": BODY_FRD,
            "estimator_type": VISION,
        })  # fmt: skip

    def delivered(self, start: float, end: float, hole: float = HOLE) -> bool:
        """Whether the autopilot has echoed time stamps that were sent together with these commands."""
        return self.station.echoes.delivered(start, end, hole)

    def uncertain(self, now: float) -> bool:
        """Never: an echo names the moment at which it was sent."""
        del now
        return False

    def link_record(self) -> dict[str, Any]:
        """Counts of time stamps and echoes, and how long the newest took."""
        station = self.station
        return station.echoes.record(station.reader.bad_checksums + station.reader.skipped, station.link.connections)

    def close(self) -> None:
        """Close the link."""
        self.station.link.close()

    def _wait(self, timeout: float, done: Any, ask: Any) -> bool:
        """Poll until something holds, and ask again and again. Returns whether it holds."""
        start = asked = self._clock.now()
        ask()
        while not done():
            now = self._clock.now()
            if now - start > timeout:
                return False
            if now - asked > ASK_S:
                asked = now
                ask()
            self.station.poll(now)
            self._clock.sleep(0.002)
        return True

    def _read(self, names: Sequence[str], timeout: float) -> dict[str, float]:
        """The values of parameters. Those that are not told are left out."""
        station = self.station

        def missing() -> list[str]:
            return [name for name in names if name not in station.parameters]

        def ask() -> None:
            for name in missing():
                station.send("PARAM_REQUEST_READ", {"param_index": -1, "param_id": name.encode()})

        self._wait(min(timeout, 4 * ASK_S), lambda: not missing(), ask)
        return {name: self.dialect.value(*station.parameters[name]) for name in names if name in station.parameters}

    def _link_problem(self, now: float, beats: bool) -> str | None:
        silence = now - self.station.heard
        if not self.station.link.alive:
            return self.station.link.reason
        if silence > self.settings.link_timeout or not beats:
            return f"no message within {self.settings.link_timeout:g} s" if beats else "no heartbeat"
        if self.station.echoes.round_trip > SLOW_S:
            return f"it answers {1e3 * self.station.echoes.round_trip:.0f} ms late"
        return None

    def _pilot(self, now: float, status: dict[str, Any] | None, *, land: bool) -> Pilot | None:
        """What the pilot wants. None: the receiver is not heard."""
        found = self.station.newest("RC_CHANNELS", now, RECEIVER_S)
        lost = status is not None and status["sensors_present"] & RECEIVER and not status["sensors_health"] & RECEIVER
        if found is None or lost:
            return None
        told = found[0]
        channels = told["channels"][: told["chancount"]]
        mission = mission_of(channels, self.settings.channels)
        if mission is None:
            return None
        sticks = []
        for name, sign in zip(self.dialect.sticks, (1, self.dialect.forward, 1, 1), strict=True):
            place = int(self.parameters.get(name, 0))
            reverse = self.parameters.get(self.dialect.reversed_name.format(n=place)) == self.dialect.reversed_value
            known = 1 <= place <= len(channels)
            sticks.append(deflection(channels[place - 1]) * sign * (-1 if reverse else 1) if known else 0.0)
        return Pilot(Mission.LAND if land else mission, *sticks)

    def _measure(self, now: float, status: tuple[dict[str, Any], float] | None) -> None:
        """The voltage of a cell."""
        volts = 0.0 if status is None else status[0]["voltage_battery"] / 1000
        if status is None or not 0 < volts < 65:
            self._voltage = None
            return
        told = int(self.parameters.get(self.dialect.cells, 0)) if self.dialect.cells else 0
        cells = told or (math.ceil(volts / CELL_V) if not self.dialect.cells else 0)
        self._voltage = volts / cells if cells else None

    def _inertial(self) -> InertialReading | None:
        """A new measurement of the inertial sensors, its force in thousandths of gravity.

        The body rates are those beside the attitude: RAW_IMU has them in whole mrad/s, too coarse for a calm flight.
        """
        latest = self.station.latest
        turned = latest.get("ATTITUDE_QUATERNION")
        for name, force in (("HIGHRES_IMU", 1000 / GRAVITY), ("RAW_IMU", 1.0)):
            found = latest.get(name)
            if found is not None and turned is not None and found[1] > self._felt:
                told, self._felt = found
                x, y, z = (force * told[f"{axis}acc"] for axis in "xyz")
                p, q, r = (turned[0][f"{axis}speed"] for axis in ("roll", "pitch", "yaw"))
                return InertialReading((x, -y, -z), (p, -q, -r), found[1] - self.station.echoes.late, found[1])
        return None

    def _records(self, now: float) -> tuple[tuple[str, float, dict[str, Any]], ...]:
        """What came since the last call, for the log."""
        records = []
        for name, (told, at) in self.station.latest.items():
            if self._logged.get(name) == at:
                continue
            self._logged[name] = at
            if name == "HEARTBEAT":
                records.append(("status", at, {
                    "armed": bool(told["base_mode"] & ARMED), "modes": [str(told["custom_mode"])], "cpu_load": None,
                    "arming_disabled": self.station.said, "cycle_time": None,
                }))  # fmt: skip
                self.station.said = []
            elif name == "RC_CHANNELS":
                records.append(("rc", at, {"channels": list(told["channels"][: told["chancount"]])}))
            elif name == "SYS_STATUS":
                current = told["current_battery"]
                records.append(("battery", at, {
                    "voltage": told["voltage_battery"] / 1000, "current": None if current < 0 else current / 100,
                    "cells": None,
                }))  # fmt: skip
            elif name == "ATTITUDE_QUATERNION" and (known := self.attitude(now, math.inf)) is not None:
                records.append(("imu", at, {"attitude": [known[0].roll, known[0].pitch, known[0].yaw]}))
        return tuple(records)
