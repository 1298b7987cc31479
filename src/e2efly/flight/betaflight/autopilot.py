"""Betaflight as the bridge's autopilot: sticks over MSP, while the pilot's switch for the override is on."""

from collections.abc import Mapping, Sequence
from typing import Any

from e2efly.flight.attitude import Attitude
from e2efly.flight.autopilot import HOLE, AutopilotState, InertialReading, Outgoing
from e2efly.flight.betaflight.allowed_modes import ARM
from e2efly.flight.betaflight.client import SCHEDULE, Client, Reply
from e2efly.flight.betaflight.controller import ControllerInfo, identify
from e2efly.flight.betaflight.instruments import CLOSED, PROBE, ChannelProbe, Instruments
from e2efly.flight.betaflight.messages import (
    AttitudeReply,
    BatteryState,
    Motor,
    MotorTelemetry,
    RawImu,
    Rc,
    StatusEx,
    set_raw_rc,
)
from e2efly.flight.betaflight.settings_check import SPEED_HZ, examine
from e2efly.flight.betaflight.sticks import sticks_of
from e2efly.flight.clock import MONOTONIC, Clock
from e2efly.flight.link import Link
from e2efly.flight.pilot.hovering import HOVERS, ROTOR_SPEED, HoverController
from e2efly.flight.row import Row
from e2efly.flight.settings import FlightSettings
from e2efly.policy.contract import Contract
from e2efly.policy.odometry import Odometry
from e2efly.vehicles.vehicle import Vehicle

EXCITATION_SCHEDULE = SCHEDULE | {RawImu.CODE: 100.0, Motor.CODE: 100.0}
"""What a flight of identification requests, and how often, Hz: inertia and motor lag show only in the gyroscope and the
motor outputs."""

AIDING_SCHEDULE = EXCITATION_SCHEDULE | {RawImu.CODE: 250.0}
"""What is requested for a pose source that the IMU carries on: a measurement in each control step."""


class Betaflight:
    """One flight controller with Betaflight, identified."""

    def __init__(
        self, client: Client, info: ControllerInfo, settings: FlightSettings, clock: Clock = MONOTONIC
    ) -> None:
        """Fly a controller with these settings; see `connect`.

        Raises:
            ValueError: with the controller's settings, sticks do not mean body rates and a throttle.
        """
        self.client, self.instruments = client, Instruments(client, settings)
        self._clock, self._now, self._armed = clock, 0.0, False
        self.adopt(info)

    @staticmethod
    def connect(
        link: Link,
        settings: FlightSettings,
        schedule: Mapping[int, float] = SCHEDULE,
        *,
        hover: HoverController | None = None,
        timeout: float = 1.0,
        clock: Clock = MONOTONIC,
    ) -> "Betaflight":
        """Identify the controller at the other end of a link.

        Args:
            link: the link to it.
            settings: the limits of the flight, with the pilot's channels.
            schedule: how often each message is requested, Hz. What `hover` needs is added.
            hover: the hover controller that will fly. None: one that needs nothing more.
            timeout: how long an answer may take, s.
            clock: gives the time.

        Raises:
            ValueError: the firmware is not known, or its settings cannot be flown.
            TimeoutError: it does not answer.
        """
        client = Client(link, dict(schedule) | ({} if hover is None else hover_schedule(hover)))
        return Betaflight(client, identify(client, timeout, clock=clock), settings, clock)

    def identify(self, timeout: float) -> None:
        """Read the settings anew: nothing that was read on an earlier connection is valid any more."""
        self.adopt(identify(self.client, timeout, clock=self._clock))

    def adopt(self, info: ControllerInfo) -> None:
        """Fly with these settings from now on."""
        self.info, self.sticks, self.probe = info, sticks_of(info), ChannelProbe()

    @property
    def versions(self) -> Mapping[str, str]:
        """Firmware and MSP version."""
        return {"firmware": self.info.firmware, "msp": ".".join(map(str, self.info.api))}

    @property
    def connections(self) -> int:
        """How often the link has connected."""
        return self.client.link.connections

    @property
    def heard(self) -> float:
        """When a reply came last, s."""
        return self.client.heard

    @property
    def statuses(self) -> int:
        """Number of replies so far that tell whether it is armed."""
        return self.instruments.statuses

    def check(self, vehicle: Vehicle, settings: FlightSettings, contract: Contract | None) -> tuple[Row, ...]:
        """The settings that matter to a flight."""
        return examine(self.info, vehicle, settings, contract)

    def poll(self, now: float) -> None:
        """Read what has come, and request what is due."""
        self._now = now
        self.client.poll(now)

    def read(self, now: float, *, land: bool, sends: bool, grounded: bool) -> AutopilotState:
        """Evaluate the replies that have come until `now`, s."""
        reading = self.instruments.read(now, self.info, land=land, sends=sends)
        probed = self.probe.look(now, reading, self.sticks, grounded=grounded) if sends else ()
        self._armed = reading.armed
        imu: Reply | None = reading.fresh.get(RawImu.CODE)
        return AutopilotState(
            reading.link_problem, reading.armed, reading.override, reading.pilot, reading.failsafe, reading.voltage,
            problems=(*probed, *reading.meddling, *reading.armed_with),
            policy_problem=reading.meddling[0] if reading.meddling else None,
            attitude=reading.attitude,
            inertial=None if imu is None else InertialReading(
                imu.message.acceleration, imu.message.body_rate, imu.time - self._late(imu, now), imu.time
            ),
            records=tuple(
                record for code, reply in reading.fresh.items() if (record := _record(self.info, code, reply))
            ),
        )  # fmt: skip

    def attitude(self, now: float, oldest: float) -> tuple[Attitude, float] | None:
        """The newest attitude, and when it was requested, s."""
        reply = self.client.latest.get(AttitudeReply.CODE)
        if reply is None or now - reply.time > oldest:
            return None
        return reply.message, reply.time - self._late(reply, now)

    def rotor_speeds(self, now: float, oldest: float) -> Sequence[float] | None:
        """The newest speeds of the rotors, rad/s."""
        told = self.client.message(MotorTelemetry.CODE, now, oldest)
        return None if told is None else told.speed

    def send(self, now: float, throttle: float | None, rates: tuple[float, float, float]) -> Outgoing:
        """Send sticks. Before arming, those of a closed throttle differ slightly from their centre, for the probe."""
        saturated: tuple[str, ...] = ()
        if throttle is None:
            apart = (0, 0, 0) if self._armed or self.probe.seen else PROBE
            channels = self.sticks.arrange((*(self.sticks.centre + offset for offset in apart), CLOSED), ())
        else:
            stick = self.sticks.channels_of(min(throttle, self.sticks.throttle.largest), rates, ())
            channels, saturated = stick.channels, stick.saturated
        return Outgoing(self.client.set_raw_rc(set_raw_rc(channels), now), channels, saturated)

    def pose(self, now: float, odometry: Odometry) -> None:
        """Betaflight has no estimator that takes poses."""

    def delivered(self, start: float, end: float, hole: float = HOLE) -> bool:
        """Whether the controller has acknowledged the frames of this time, and nobody else sends sticks."""
        return not self.client.steered(self._now) and self.client.delivered(start, end, hole)

    def uncertain(self, now: float) -> bool:
        """Whether the line loses replies."""
        return self.client.lossy(now)

    def link_record(self) -> dict[str, Any]:
        """Counts of requests and replies, and the longest time that a reply took."""
        client = self.client
        return {
            "requests": client.requests,
            "replies": client.replies,
            "timeouts": client.timeouts,
            "errors": client.decoder.bad_checksums + client.decoder.skipped + client.run_together,
            "reconnects": max(client.link.connections - 1, 0),
            "round_trip": max((reply.latency for reply in client.latest.values()), default=None),
        }

    def close(self) -> None:
        """Close the link."""
        self.client.link.close()

    def _late(self, reply: Reply, now: float) -> float:
        """How long ago a reply was asked for when it came, s."""
        return min(reply.latency, self.client.quickest) if self.client.lossy(now) else reply.latency


def hover_schedule(hover: HoverController) -> dict[int, float]:
    """The additional messages that a hover controller needs, and how often each is requested, Hz."""
    return {MotorTelemetry.CODE: SPEED_HZ} if ROTOR_SPEED in hover.needs else {}


def check_hover(name: str, hover: HoverController, info: ControllerInfo) -> None:
    """Refuse a hover controller that needs telemetry that the flight controller does not report.

    Raises:
        ValueError: telemetry is missing. The message names it, and what is accepted.
    """
    if ROTOR_SPEED in hover.needs and not info.motor.tells_speed:
        able = ", ".join(known for known, kind in HOVERS.items() if ROTOR_SPEED not in kind.needs)
        raise ValueError(
            f"--hover is {name!r}, which needs the speeds of the rotors, and this flight controller measures none; "
            f"accepted: `set dshot_bidir = ON` where its ESCs can, or {able}"
        )


def _record(info: ControllerInfo, code: int, reply: Reply) -> tuple[str, float, dict[str, Any]] | None:
    """What the log keeps of a reply: (channel, time, values). The bridge itself records the inertial sensors."""
    m, at = reply.message, reply.time
    if code == StatusEx.CODE:
        return "status", at, {
            "armed": ARM in m.active(info.box_ids), "modes": [str(box) for box in sorted(m.active(info.box_ids))],
            "cpu_load": m.cpu_load, "arming_disabled": list(m.arming_disabled), "cycle_time": m.cycle_time,
        }  # fmt: skip
    if code == Rc.CODE:
        return "rc", at, {"channels": list(m.channels)}
    if code == Motor.CODE:
        return "motors", at, {"values": list(m.throttle)}
    if code == BatteryState.CODE:
        return "battery", at, {"voltage": m.voltage, "current": m.current, "cells": m.cells}
    if code == AttitudeReply.CODE:
        return "imu", at, {"attitude": [m.roll, m.pitch, m.yaw]}
    return None
