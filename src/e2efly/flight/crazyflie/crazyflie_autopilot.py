"""A Crazyflie as the bridge's autopilot: body rates and thrust by the generic commander's manual set-points.

These need no parameter and no unlocking: body rates, thrust and the mode are in each packet. A Crazyflie has no
receiver: its pilot types words (`words.py`). Its firmware has no landing for the loss of set-points: it levels after
0.5 s, and stops the motors after 2 s. For the loss of this program there is `crazyflie_watchdog.py`.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from e2efly.flight.attitude import Attitude, attitude_of
from e2efly.flight.autopilot import HOLE, AutopilotState, InertialReading, Outgoing
from e2efly.flight.clock import MONOTONIC, Clock
from e2efly.flight.crazyflie.crazyflie_needs import NEEDS, PROTOCOL, behaviour, firmware_row
from e2efly.flight.crazyflie.crtp import FULL, LOGS, PARAMETERS, arming, external_pose, setpoint
from e2efly.flight.crazyflie.crtp_station import CrtpStation, LogBlock
from e2efly.flight.crazyflie.words import TypedWish, Wishes
from e2efly.flight.link import Link
from e2efly.flight.pilot.flight_state import Mission, Pilot
from e2efly.flight.row import Row
from e2efly.flight.settings import FlightSettings
from e2efly.policy.contract import Contract
from e2efly.policy.odometry import Odometry
from e2efly.vehicles.vehicle import Vehicle

MOTION = LogBlock(
    1, 0.01,
    ("stateEstimate.qw", "stateEstimate.qx", "stateEstimate.qy", "stateEstimate.qz", "supervisor.info"),
)  # fmt: skip
SENSORS = LogBlock(2, 0.01, ("acc.x", "acc.y", "acc.z", "gyro.x", "gyro.y", "gyro.z"))
BATTERY = LogBlock(3, 0.1, ("pm.vbat",))
CAN_ARM, IS_ARMED, ARMS_ITSELF, CAN_FLY, TUMBLED, LOCKED, CRASHED = 1, 2, 4, 8, 32, 64, 128
"""Bits of supervisor.info."""
STOPPED = TUMBLED | LOCKED | CRASHED
"""With one of these, the motors do not turn, whatever is sent."""
STATUS_S, BATTERY_S, SLOW_S = 0.5, 1.0, 0.125
"""Largest ages of the supervisor's state and of the voltage, and the largest time of an echo, s."""
POSE_S = 1 / 50
"""Interval of the poses that are passed on, s."""
ARM_S = 0.25
"""Interval of requests to arm or to disarm, s."""
COMPLEMENTARY = 1
"""The estimator that takes no poses."""
CELL_V = 4.3
"""Largest voltage of a cell, V: from it the number of cells is known."""
MILLI_G = 1000.0
"""The accelerometer tells multiples of gravity; readings are in thousandths."""


class Crazyflie:
    """One Crazyflie, identified."""

    def __init__(
        self, link: Link, vehicle: Vehicle, settings: FlightSettings, wishes: Wishes, clock: Clock = MONOTONIC
    ) -> None:
        """Fly the Crazyflie at the other end of a link; see `connect`."""
        self.station, self.settings, self.wishes = CrtpStation(link, clock), settings, wishes
        self.parameters: dict[str, float] = {}
        self.firmware, self.protocol = "", 0
        self._idle, self._full = float(vehicle.rotor_speed_min), float(vehicle.full_rotor_speed)
        self._map = tuple(float(k) for k in vehicle.thrust_map)
        self._posed = self._asked = -math.inf
        self._armed = self._refused = False
        self._wish: TypedWish | None = None
        self._land, self._closed = False, True
        self._logged: dict[int, float] = {}
        self._felt = -math.inf

    @staticmethod
    def connect(
        link: Link,
        vehicle: Vehicle,
        settings: FlightSettings,
        wishes: Wishes,
        timeout: float = 5.0,
        clock: Clock = MONOTONIC,
    ) -> "Crazyflie":
        """Identify the Crazyflie at the other end of a link.

        Args:
            link: the link to it, which carries framed packets.
            vehicle: its thrust map turns throttle into thrust.
            settings: the limits of the flight.
            wishes: what the pilot wants.
            timeout: how long an answer may take, s.
            clock: gives the time.

        Raises:
            ValueError: its firmware cannot be flown.
            TimeoutError: nothing answers.
        """
        autopilot = Crazyflie(link, vehicle, settings, wishes, clock)
        autopilot.identify(timeout)
        return autopilot

    def identify(self, timeout: float) -> None:
        """Read versions and parameters, and request the telemetry. This is not for flight."""
        station = self.station
        told = station.read_versions(timeout)
        if told is None:
            why = f" ({station.link.reason})" if station.link.reason else ""
            raise TimeoutError(f"Crazyflie: no answer within {timeout:g} s{why}; accepted: firmware 2025.09 or later")
        self.protocol = told["protocol"][0] if told["protocol"] else 0
        texts = (told[name].split(b"\0")[0].decode("ascii", "replace") for name in ("device", "firmware"))
        self.firmware = " ".join(texts)
        if self.protocol < PROTOCOL:
            raise ValueError(
                f"Crazyflie: its firmware {self.firmware!r} speaks CRTP {self.protocol}; accepted: {PROTOCOL} or later "
                "(firmware 2025.09): set-points of rates and thrust came with it"
            )
        tables = [station.read_table(port, timeout) for port in (PARAMETERS, LOGS)]
        parameters, logs = tables
        if parameters is None or logs is None:
            raise TimeoutError(f"Crazyflie: its tables of parameters and logs do not come within {timeout:g} s")
        wanted = [parameters[need.name] for need in NEEDS if need.name in parameters]
        self.parameters = station.read_parameters(wanted, timeout)
        if problem := station.start((MOTION, SENSORS, BATTERY), logs, timeout):
            raise ValueError(f"Crazyflie: {problem}; accepted: firmware 2025.09 or later, as Bitcraze publishes it")

    @property
    def versions(self) -> Mapping[str, str]:
        """Device and firmware, and version of CRTP."""
        return {"firmware": self.firmware, "crtp": str(self.protocol)}

    @property
    def connections(self) -> int:
        """How often the link has connected."""
        return self.station.link.connections

    @property
    def heard(self) -> float:
        """When a packet came last, s."""
        return self.station.heard

    @property
    def statuses(self) -> int:
        """How often the supervisor's state has come so far."""
        return self.station.counts.get(MOTION.id, 0)

    def check(self, vehicle: Vehicle, settings: FlightSettings, contract: Contract | None) -> tuple[Row, ...]:
        """The parameters that matter to a flight, and what it does when link, poses or this program end."""
        del vehicle, settings, contract
        return (
            firmware_row(self.protocol, self.firmware),
            *(need.row(self.parameters) for need in NEEDS),
            *behaviour(self.parameters),
        )

    def poll(self, now: float) -> None:
        """Read what has come, and send time stamps."""
        self.station.poll(now)

    def read(self, now: float, *, land: bool, sends: bool, grounded: bool) -> AutopilotState:
        """Evaluate what has come until `now`, s."""
        del sends, grounded
        self._land, self._wish = land, self.wishes()
        found = self.station.newest(MOTION, now, STATUS_S)
        info = 0 if found is None else int(found[0]["supervisor.info"])
        turns = info & (IS_ARMED | CAN_FLY) == IS_ARMED | CAN_FLY
        if self._wish is not None and not self._wish.armed:
            self._refused = False
        elif self._armed and found is not None and not turns:
            self._refused = True  # it has disarmed by itself: only a new word may arm it
        if found is not None:
            self._armed = turns and self._wanted
        known = self.attitude(now, self.settings.link_timeout)
        return AutopilotState(
            link_problem=self._link_problem(now, found is not None),
            armed=self._armed,
            override=found is not None and not info & STOPPED,
            pilot=None if self._wish is None else Pilot(Mission.LAND if land else self._wish.mission),
            failsafe=bool(info & STOPPED),
            voltage=self._voltage(now),
            attitude=None if known is None else known[0],
            inertial=self._inertial(),
            records=self._records(now),
        )

    def attitude(self, now: float, oldest: float) -> tuple[Attitude, float] | None:
        """The newest attitude, and when it was requested, s: what was sent before then had arrived."""
        found = self.station.newest(MOTION, now, oldest)
        if found is None:
            return None
        return attitude_of(*(found[0][name] for name in MOTION.names[:4])), found[1] - self.station.echoes.late

    def rotor_speeds(self, now: float, oldest: float) -> Sequence[float] | None:
        """None: a Crazyflie measures none that it tells here."""
        del now, oldest

    def send(self, now: float, throttle: float | None, rates: tuple[float, float, float]) -> Outgoing:
        """Send body rates and thrust. The motors stop with a closed throttle, and whenever the pilot wants them to."""
        if not all(map(math.isfinite, (throttle or 0.0, *rates))):
            raise ValueError(f"command: throttle and body rate are {(throttle, *rates)}; accepted: finite numbers")
        self._closed = throttle is None
        self._request_arming(now)
        if throttle is None or not self._armed:
            return Outgoing(self.station.send(setpoint((0.0, 0.0, 0.0), 0)))
        share = min(max(throttle, 0.0), 1.0)
        speed = self._idle + share * (self._full - self._idle)
        thrust = max(round(FULL * self._thrust(speed) / self._thrust(self._full)), 1)
        return Outgoing(
            self.station.send(setpoint(rates, min(thrust, FULL))), saturated=("throttle",) if throttle != share else ()
        )

    def pose(self, now: float, odometry: Odometry) -> None:
        """Pass a pose on, unless its estimator takes none."""
        if self.parameters.get("stabilizer.estimator") == COMPLEMENTARY or now - self._posed < POSE_S:
            return
        self._posed = now
        self.station.send(external_pose(odometry.position.tolist(), odometry.quaternion.tolist()))

    def delivered(self, start: float, end: float, hole: float = HOLE) -> bool:
        """Whether it has echoed time stamps that were sent together with these commands."""
        return self.station.echoes.delivered(start, end, hole)

    def uncertain(self, now: float) -> bool:
        """Never: an echo names the moment at which it was sent."""
        del now
        return False

    def link_record(self) -> dict[str, Any]:
        """Counts of time stamps and echoes, and how long the newest took."""
        station = self.station
        return station.echoes.record(station.malformed, station.link.connections)

    def close(self) -> None:
        """Close the link."""
        self.station.link.close()

    @property
    def _wanted(self) -> bool:
        """Whether the motors may turn. A pilot who is not heard cannot ask for the end of a flight: it lands first. So
        does an operator who ends the program.
        """
        if self._wish is None or self._land:
            return self._armed and not self._closed
        return self._wish.armed and not self._refused

    def _request_arming(self, now: float) -> None:
        """Ask to arm or to disarm where that is not as wanted. One that arms itself is never disarmed."""
        found = self.station.newest(MOTION, now, STATUS_S)
        if found is None or now - self._asked < ARM_S:
            return
        info = int(found[0]["supervisor.info"])
        arms = self._wanted and bool(info & CAN_ARM) and not info & IS_ARMED
        disarms = not self._wanted and bool(info & IS_ARMED) and not info & ARMS_ITSELF
        if arms or disarms:
            self._asked = now
            self.station.send(arming(arms, self.protocol))

    def _thrust(self, speed: float) -> float:
        k2, k1, k0 = self._map
        return max((k2 * speed + k1) * speed + k0, 0.0)

    def _voltage(self, now: float) -> float | None:
        found = self.station.newest(BATTERY, now, BATTERY_S)
        volts = 0.0 if found is None else found[0]["pm.vbat"]
        return volts / math.ceil(volts / CELL_V) if 0 < volts < math.inf else None

    def _link_problem(self, now: float, told: bool) -> str | None:
        if not self.station.link.alive:
            return self.station.link.reason
        if now - self.station.heard > self.settings.link_timeout:
            return f"no packet within {self.settings.link_timeout:g} s"
        if not told:
            return "its supervisor tells nothing"
        if self.station.echoes.round_trip > SLOW_S:
            return f"it answers {1e3 * self.station.echoes.round_trip:.0f} ms late"
        return None

    def _inertial(self) -> InertialReading | None:
        """A new measurement of the inertial sensors."""
        found = self.station.latest.get(SENSORS.id)
        if found is None or found[1] <= self._felt:
            return None
        told, self._felt = found
        x, y, z = (MILLI_G * told[f"acc.{axis}"] for axis in "xyz")
        p, q, r = (math.radians(told[f"gyro.{axis}"]) for axis in "xyz")
        return InertialReading((x, y, z), (p, q, r), found[1] - self.station.echoes.late, found[1])

    def _records(self, now: float) -> tuple[tuple[str, float, dict[str, Any]], ...]:
        """What came since the last call, for the log."""
        records = []
        for number, (told, at) in self.station.latest.items():
            if self._logged.get(number) == at:
                continue
            self._logged[number] = at
            if number == MOTION.id and (known := self.attitude(now, math.inf)) is not None:
                records.append(("imu", at, {"attitude": [known[0].roll, known[0].pitch, known[0].yaw]}))
                records.append(("status", at, {
                    "armed": self._armed, "modes": [f"supervisor {int(told['supervisor.info']):#x}"], "cpu_load": None,
                    "arming_disabled": [], "cycle_time": None,
                }))  # fmt: skip
            elif number == BATTERY.id:
                records.append(("battery", at, {"voltage": told["pm.vbat"], "current": None, "cells": None}))
        return tuple(records)
