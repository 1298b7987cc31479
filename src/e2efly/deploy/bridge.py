"""The bridge: at each control step, from poses and the flight controller's answers to the sticks that it is sent."""

import dataclasses
import math
from collections import deque
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from e2efly.control import Ctbr, Vec3
from e2efly.deploy import reckoning, state_machine
from e2efly.deploy.flight_state import AIRBORNE, Flight, Inputs, Mission, Mode, Pilot, Target
from e2efly.deploy.goals import LandGoal
from e2efly.deploy.hover import blind, blind_time, controlled, flight_gains, roll_pitch
from e2efly.deploy.msp.client import Client
from e2efly.deploy.msp.controller import ControllerInfo
from e2efly.deploy.msp.messages import Attitude, BatteryState, Motor, RawImu, Rc, StatusEx, set_raw_rc
from e2efly.deploy.odometry import Odometry, Sample
from e2efly.deploy.policy_worker import PolicyWorker
from e2efly.deploy.pose.checks import Checks
from e2efly.deploy.pose.source import PoseSource
from e2efly.deploy.pose.tracking import Track, age, track
from e2efly.deploy.runtime import Imu
from e2efly.deploy.settings import FlightSettings
from e2efly.deploy.sticks import Sticks
from e2efly.deploy.throttle_map import ThrottleHistory, ThrottleMap, update
from e2efly.vehicles.vehicle import GRAVITY, Vehicle

ARM, FAILSAFE, OVERRIDE = 0, 27, 50
"""Permanent ids of Betaflight's modes."""
MEDDLING = {1: "ANGLE", 2: "HORIZON", 3: "ALTHOLD", 6: "HEADFREE", 11: "POS HOLD", 46: "GPS RESCUE", 47: "ACRO TRAINER"}
"""Modes in which sticks do not mean body rates, by permanent id."""
RECEIVER_LOST = frozenset({"RXLOSS", "FAILSAFE"})
"""Reasons against arming by which the controller tells that it does not hear the pilot."""
VOLTAGE_SHARE = 0.4
"""Weight of a new battery reading: a moment's sag under full throttle is no empty battery."""
CLOSED = 1000
"""The throttle channel that lets the controller arm, us."""
PROBE = (20, 40, 60)
"""How far off centre roll, pitch and yaw are sent before arming, to see where each goes, us."""
AFRESH_S = 1.0
"""After so long without a good pose, on the ground, tracking begins afresh, s."""
OUTLIERS_S = 0.03
"""Poses are refused for so long before the odometry counts as lost, s: an outlier or two end no flight."""
RC_PATIENCE = 1.2
"""The pilot's channels may be so much older than the link's time-out: a lost link is to be told as one, whichever
answer came last."""
BEHIND = 50
"""Stick frames without an answer, for each second of the link's time-out, with which the link is too slow to fly by:
half of the time-out at 100 Hz."""
THRUST_DELAY = (0.015, 0.075)
"""How long before a measured force its throttle was sent, s: the link, the rate loop and the motors' lag."""
TRIM = (-3.0, 5.0)
"""Bounds of the thrust that a take-off adds while the throttle map is still wrong, m/s^2."""
TRIM_GAIN = 3.0
"""Of the climb's speed error, 1/s."""
TRIM_FADE = 1.0
"""Time constant with which it fades as the map learns, s."""
LIFTED = 0.12
"""So high over the ground the vehicle flies, m: below, nothing is learned and no tilt is asked."""


class Log(Protocol):
    """What keeps the flight's record; it never raises."""

    def record(self, channel: str, time: float, values: dict[str, Any]) -> None:
        """Keep a message of a channel."""
        ...


@dataclass(frozen=True)
class Sent:
    """What a control step sent."""

    source: str
    """Who asked for it."""
    command: Ctbr | None
    """None: the throttle is closed."""
    throttle: float
    """0 to 1."""
    channels: tuple[int, ...]
    """us."""
    saturated: tuple[str, ...] = ()


class Bridge:
    """One flight controller, one pose source, one vehicle, perhaps one policy.

    `tick` never raises for what comes over link or pose source, nor for what the policy does.
    """

    def __init__(
        self,
        client: Client,
        info: ControllerInfo,
        sticks: Sticks,
        source: PoseSource,
        vehicle: Vehicle,
        settings: FlightSettings,
        *,
        worker: PolicyWorker | None = None,
        checks: Checks | None = None,
        log: Log | None = None,
        latency: float | None = None,
        settings_problems: tuple[str, ...] = (),
        throttle_map: ThrottleMap | None = None,
    ) -> None:
        self.client, self.info, self.sticks, self.source, self.settings = client, info, sticks, source, settings
        self.vehicle = vehicle
        self.gentle = flight_gains(vehicle, vehicle.latency if latency is None else latency)
        """The vehicle with the gains of take-off, hover and landing."""
        self.worker, self.log, self.settings_problems = worker, log, settings_problems
        self.checks = checks or Checks(max_age=settings.odometry_timeout)
        self.flight = Flight(home=settings.ground_height)
        self.map = throttle_map or ThrottleMap.of(vehicle)
        self.odometry: Odometry | None = None
        self.inputs = Inputs()
        self.ticks = 0
        self.land_now = False
        """The operator asks for a landing, as the pilot does by the mission switch."""
        self.channels_seen = False
        """The controller has been seen to take every stick where it was sent; see `_probe`."""
        self.sent = Sent("closed", None, 0.0, self._closed())
        self._track = Track()
        self._pose_problem: str | None = None
        self._good_pose = -math.inf
        self._reckoned: reckoning.Reckoning | None = None
        self._history = ThrottleHistory()
        self._trim = 0.0
        self._gravity_counts = 0.0
        self._imu: Imu | None = None
        self._seen: dict[int, float] = {}
        self._missed: deque[float] = deque()
        self._last = 0.0
        self._stale: str | None = None
        self._override_since = 0.0
        self._voltage: float | None = None

    def tick(self, now: float, lateness: float = 0.0, slack: float = 0.004) -> Sent:
        """One control step at `now` s, which began `lateness` s after its time; a policy due within `slack` s acts."""
        dt = min(max(now - self._last, 0.0), 0.1) if self._last else 0.0
        self._last = now
        self.ticks += 1
        self.client.poll(now)
        self._read_poses(now)
        fresh = self._read_controller(now)
        self._learn(now, fresh)
        self._count_deadlines(now, lateness)
        self._decide(now, slack)
        self.sent = self._send(now, self._command(now, dt))
        self._record(now, fresh)
        return self.sent

    def look(self, now: float) -> list[Sample]:
        """Take in poses and the controller's answers, decide and send nothing; returns the poses."""
        self.client.poll(now)
        poses = self._read_poses(now)
        self._learn(now, self._read_controller(now))
        return poses

    def adopt(self, info: ControllerInfo, sticks: Sticks, settings_problems: tuple[str, ...]) -> None:
        """The controller's settings were read again."""
        self.info, self.sticks, self.settings_problems = info, sticks, settings_problems
        self.channels_seen = False

    @property
    def flying(self) -> bool:
        """Whether the vehicle may be in the air by this bridge's doing."""
        return self.flight.mode in AIRBORNE

    @property
    def height(self) -> float:
        """Over the place of take-off, by the last odometry, m."""
        return float(self.odometry.position[2]) - self.flight.home if self.odometry is not None else 0.0

    def _read_poses(self, now: float) -> list[Sample]:
        long = now - self._good_pose > AFRESH_S
        if self.flight.mode in (Mode.INIT, Mode.DONE) and (self._track.fault or (self._pose_problem and long)):
            self._track, self._good_pose = Track(), now  # it may have been carried elsewhere, its clock set
        samples = self.source.read(now)
        for sample in samples:
            self._track, odometry, problem = track(self.checks, self._track, sample)
            self._pose_problem = problem
            if odometry is not None:
                self.odometry, self._good_pose = odometry, now
                self._reckoned = reckoning.seen(odometry, now)
        said_frozen = (self._pose_problem or "").startswith("frozen")  # which lasts already
        if self._pose_problem and not self._track.fault and now - self._good_pose < OUTLIERS_S and not said_frozen:
            self._pose_problem = None
        old = age(self._track, now)
        if self._pose_problem is None and not old <= self.checks.max_age:
            said = self.source.problem
            self._stale = f"the newest is {old:.2f} s old" + (f" ({said})" if said else "")
        else:
            self._stale = None
        return samples

    def _read_controller(self, now: float) -> dict[int, Any]:
        """The messages that came since the last step, by code; and all of them as inputs of the state machine."""
        fresh = {}
        for code, reply in self.client.latest.items():
            if self._seen.get(code) != reply.time:
                self._seen[code] = reply.time
                fresh[code] = reply
        patience = self.settings.link_timeout
        status = self.client.message(StatusEx.CODE, now, patience)
        active = status.active(self.info.box_ids) if status is not None else frozenset()
        channels = self.client.message(Rc.CODE, now, RC_PATIENCE * patience)
        attitude = self.client.message(Attitude.CODE, now, patience)
        problem = None
        if status is None:
            link = self.client.link
            problem = link.reason if not link.alive else f"no answer within {patience:g} s"
        elif self.client.backlog > BEHIND * patience:
            problem = f"it is behind by {self.client.backlog} stick frames (set serial_update_rate_hz=1000)"
        meddling = tuple(f"{MEDDLING[box]} is on: sticks are no body rates" for box in MEDDLING.keys() & active)
        meddling = meddling if OVERRIDE in active else ()
        heard = channels is not None and FAILSAFE not in active
        heard = heard and not (status is not None and RECEIVER_LOST & set(status.arming_disabled))
        if (battery := fresh.get(BatteryState.CODE)) is not None:
            self._measure(battery.message)
        good = self._pose_problem is None and self._stale is None
        self.inputs = Inputs(
            odometry=self.odometry,
            odometry_problem=None if good else self._pose_problem or self._stale,
            link_problem=problem,
            armed=ARM in active,
            override=OVERRIDE in active,
            pilot=self._pilot(channels) if heard and channels is not None else None,
            voltage=self._voltage if self.client.message(BatteryState.CODE, now, 3.0) is not None else None,
            settings_problems=self.settings_problems + self._probe(channels, now) + meddling,
            policy_problem=meddling[0] if meddling else None,
            attitude_error=self._attitude_error(attitude),
            missed_deadlines=len(self._missed),
        )
        return fresh

    def _measure(self, battery: BatteryState) -> None:
        """Smooth the voltage of a cell; None: the controller does not know it."""
        if not (battery.cells and battery.voltage):
            self._voltage = None
            return
        cell = battery.voltage / battery.cells
        self._voltage = cell if self._voltage is None else self._voltage + VOLTAGE_SHARE * (cell - self._voltage)

    def _pilot(self, rc: Rc) -> Pilot | None:
        c = self.settings.channels
        if c.mission > len(rc.channels):
            return None  # the switch is not there: nobody's will is known

        def pulse(channel: int) -> int:
            return rc.channels[channel - 1] if channel <= len(rc.channels) else 1500

        def stick(channel: int | None) -> float:
            return 0.0 if channel is None else max(-1.0, min(1.0, (pulse(channel) - 1500) / 500))

        at = pulse(c.mission)
        mission = Mission.LAND if at < 1300 or self.land_now else Mission.POLICY if at > 1700 else Mission.HOVER
        return Pilot(mission, stick(c.roll), stick(c.pitch), stick(c.throttle), stick(c.yaw))

    def _probe(self, channels: Rc | None, now: float) -> tuple[str, ...]:
        """Until it is armed, the sticks are sent apart by `PROBE`: does the controller take each for what it is?"""
        if not self.inputs.override or self.channels_seen:
            if not self.inputs.override and self.flight.mode is Mode.INIT:
                self.channels_seen = False
            self._override_since = now
            return ()
        mid = self.sticks.centre
        sent = [mid + offset for offset in PROBE] + [CLOSED]
        got = list(channels.channels[:4]) if channels is not None else None
        self.channels_seen = got is not None and all(abs(a - b) <= 1 for a, b in zip(sent, got, strict=True))
        if self.channels_seen or now - self._override_since < 0.5:
            return ()
        return (
            f"roll, pitch, yaw, throttle were sent as {sent} us and taken as {got}; needed: the same "
            "(msp_override_channels_mask 15, rxrange as it comes; switch override on before arming)",
        )

    def _attitude_error(self, attitude: Attitude | None) -> float | None:
        if attitude is None or self.odometry is None:
            return None
        roll, pitch = roll_pitch(self.odometry.quaternion)
        return max(abs(math.remainder(attitude.roll - roll, math.tau)), abs(attitude.pitch - pitch))

    def _learn(self, now: float, fresh: dict[int, Any]) -> None:
        """The scale of the accelerometer on the ground, and the throttle map in the air."""
        if (reply := fresh.get(RawImu.CODE)) is None:
            return
        counts = np.array(reply.message.acceleration, float)
        if self.flight.mode is Mode.INIT and not self.inputs.armed:
            rest = float(np.linalg.norm(counts))
            self._gravity_counts += (rest - self._gravity_counts) * (0.05 if self._gravity_counts else 1.0)
        if self._gravity_counts <= 0:
            return
        force = counts * (GRAVITY / self._gravity_counts)
        self._imu = Imu(np.array(reply.message.body_rate), force)
        attitude = self.client.message(Attitude.CODE, now, 0.1)
        self._reckoned = reckoning.reckon(self._reckoned, attitude, tuple(force.tolist()), now)
        if self.flying and self.height > LIFTED and not self.flight.blind and self.inputs.armed:
            at = reply.time - reply.latency / 2
            throttle = self._history.between(at - THRUST_DELAY[1], at - THRUST_DELAY[0])
            if throttle is not None:
                self.map = update(self.map, throttle, float(force[2]), self.inputs.voltage, 0.02)

    def _count_deadlines(self, now: float, lateness: float) -> None:
        if lateness > self.settings.lateness:
            self._missed.append(now)
        while self._missed and self._missed[0] < now - 1.0:
            self._missed.popleft()
        self.inputs = dataclasses.replace(self.inputs, missed_deadlines=len(self._missed))

    def _decide(self, now: float, slack: float) -> None:
        """Ask the policy where it flies, let the state machine judge, and let a policy that takes over act at once."""
        worker, odometry = self.worker, self.inputs.odometry
        good = odometry is not None and not self.inputs.odometry_problem
        if self.flight.mode is Mode.POLICY and worker is not None and good and odometry is not None:
            self._ask(now, slack, odometry)
        elif self.flight.mode is Mode.HOVER:
            problem = "none is loaded" if worker is None else self.inputs.policy_problem
            if worker is not None and good and odometry is not None:
                problem = problem or worker.readiness(odometry, now)
            self.inputs = dataclasses.replace(self.inputs, policy_problem=problem)
        self._step(now)
        if self.flight.mode is Mode.POLICY and worker is not None and worker.state is None:
            assert odometry is not None
            worker.start(odometry, now)
            self._ask(now, slack, odometry)
            if worker.problem:
                self._step(now)
        if self.flight.mode is not Mode.POLICY and worker is not None:
            worker.stop()

    def _ask(self, now: float, slack: float, odometry: Odometry) -> None:
        worker = self.worker
        assert worker is not None
        if worker.step(odometry, now, slack, self._imu) and self.log is not None and worker.decision is not None:
            d, state = worker.decision, worker.state
            self.log.record("policy", now, {
                "observation": d.observation.tolist(), "action": d.action.tolist(), "inference_s": d.inference_s,
                "step": state.steps if state is not None else 0,
            })  # fmt: skip
        self.inputs = dataclasses.replace(
            self.inputs, policy_problem=self.inputs.policy_problem or worker.problem, policy_done=worker.done,
            policy_lands=isinstance(worker.runtime.goal, LandGoal),
        )  # fmt: skip

    def _step(self, now: float) -> None:
        before = self.flight
        self.flight = state_machine.step(self.settings, before, self.inputs, now)
        if self.flight.mode is not before.mode:
            self._trim = 0.0 if self.flight.mode is Mode.TAKEOFF else self._trim
            if self.log is not None:
                self.log.record("mode", now, {
                    "mode": str(self.flight.mode), "previous": str(before.mode),
                    "reasons": [str(reason) for reason in self.flight.reasons],
                })  # fmt: skip

    def _command(self, now: float, dt: float) -> tuple[str, Ctbr | None]:
        """Who asks for what; None: the throttle closed."""
        flight, odometry = self.flight, self.odometry
        if flight.mode in (Mode.INIT, Mode.DONE):
            return "closed", None
        if flight.mode is Mode.POLICY and self.worker is not None and self.worker.decision is not None:
            assert odometry is not None
            decision = self.worker.decision
            return "policy", controlled(self.vehicle, decision.mode, odometry, decision.command)
        if flight.target is None or odometry is None or flight.blind:
            elapsed = now - flight.since
            climb = float(odometry.velocity[2]) if odometry is not None else 0.0
            if elapsed > blind_time(self.height, climb):
                return "closed", None
            attitude, reckoned = self.client.message(Attitude.CODE, now, 0.5), self._reckoned
            known = reckoned is not None and now - reckoned.time < reckoning.LONGEST_STEP and not flight.misled
            if attitude is not None and reckoned is not None and known:
                return "blind", reckoning.settle(attitude, elapsed, reckoned.velocity)
            return "blind", blind(attitude, elapsed, climb)
        return "hover", self._hover(flight.target, odometry, dt)

    def _hover(self, target: Target, odometry: Odometry, dt: float) -> Ctbr:
        x, y, z = target.position
        on_ground = self.flight.mode is Mode.TAKEOFF and self.height < LIFTED
        if self.flight.mode is Mode.TAKEOFF:
            behind = target.climb - float(odometry.velocity[2])
            change = TRIM_GAIN * behind * dt if self.height < LIFTED else -self._trim * dt / TRIM_FADE
            self._trim = min(max(self._trim + change, TRIM[0]), TRIM[1])
        else:
            self._trim *= math.exp(-dt / TRIM_FADE)
        if on_ground:  # no tilt before the feet are free
            x, y = float(odometry.position[0]), float(odometry.position[1])
        wanted = controlled(self.gentle, "velocity", odometry, self._approach((x, y, z), target, odometry))
        if on_ground:
            zero = np.float64(0.0)
            return Ctbr(wanted.thrust + self._trim, Vec3(zero, zero, zero))
        return Ctbr(wanted.thrust + self._trim, wanted.rate)

    def _approach(self, point: tuple[float, float, float], target: Target, odometry: Odometry) -> tuple[float, ...]:
        """The velocity towards a point, and with it where it moves, world, m/s; and the yaw, rad."""
        v = self.gentle
        wanted = v.position_gain * (np.array(point) - odometry.position) + np.array([0.0, 0.0, target.climb])
        return (*np.clip(wanted, -v.speed_max, v.speed_max).tolist(), target.yaw)

    def _send(self, now: float, wanted: tuple[str, Ctbr | None]) -> Sent:
        source, command = wanted
        if command is None:
            sent = Sent(source, None, 0.0, self._closed())
        else:
            throttle = self.map.throttle(float(command.thrust), self.inputs.voltage)
            stick = self.sticks.channels_of(min(throttle, self.sticks.throttle.largest), rates_of(command), ())
            sent = Sent(source, command, throttle, stick.channels, stick.saturated)
        self._history.add(now, sent.throttle)
        self.client.set_raw_rc(set_raw_rc(sent.channels), now)
        return sent

    def _closed(self) -> tuple[int, ...]:
        mid = self.sticks.centre
        apart = (0, 0, 0) if self.inputs.armed or self.channels_seen else PROBE
        return self.sticks.arrange((*(mid + offset for offset in apart), CLOSED), ())

    def _record(self, now: float, fresh: dict[int, Any]) -> None:
        log, sent = self.log, self.sent
        if log is None:
            return
        if self.odometry is not None and self.inputs.odometry_problem is None:
            o = self.odometry
            log.record("odometry", now, {
                "time": o.time, "age": now - o.time, "position": o.position.tolist(), "velocity": o.velocity.tolist(),
                "quaternion": o.quaternion.tolist(), "body_rate": o.body_rate.tolist(),
            })  # fmt: skip
        setpoint, yaw = self._setpoint()
        command = sent.command
        log.record("command", now, {
            "source": f"{self.flight.mode}: {sent.source}",
            "collective_thrust": None if command is None else float(command.thrust),
            "body_rate": None if command is None else rates_of(command),
            "setpoint": setpoint, "yaw": yaw,
        })  # fmt: skip
        log.record("sticks", now, {
            "channels": list(sent.channels), "throttle": sent.throttle, "saturated": bool(sent.saturated),
        })  # fmt: skip
        for code, reply in fresh.items():
            record_message(log, self.info, code, reply, self._imu)
        if self.ticks % 20 == 0:
            log.record("throttle_map", now, {
                "scale": self.map.scale * self.map.nominal(1.0), "voltage_gain": self.map.learned[1],
                "residual": self.map.residual,
            })  # fmt: skip
        if self.ticks % 50 == 0:
            c = self.client
            log.record("link", now, {
                "timeouts": c.timeouts, "errors": c.decoder.bad_checksums + c.decoder.skipped + c.run_together,
                "reconnects": max(c.link.connections - 1, 0),
                "round_trip": max((reply.latency for reply in c.latest.values()), default=None),
            })  # fmt: skip

    def _setpoint(self) -> tuple[list[float] | None, float | None]:
        if self.flight.mode is Mode.POLICY and self.worker is not None and self.worker.decision is not None:
            return self.worker.decision.position.tolist(), None
        if self.flight.target is not None:
            return list(self.flight.target.position), self.flight.target.yaw
        return None, None


def rates_of(command: Ctbr) -> list[float]:
    """The body rates of a command, rad/s."""
    return [float(rate) for rate in (command.rate.x, command.rate.y, command.rate.z)]


def record_message(log: Log, info: ControllerInfo, code: int, reply: Any, imu: Imu | None) -> None:
    """Keep what the controller answered."""
    m, at = reply.message, reply.time
    if code == StatusEx.CODE:
        log.record("status", at, {
            "armed": ARM in m.active(info.box_ids), "modes": [str(box) for box in sorted(m.active(info.box_ids))],
            "cpu_load": m.cpu_load, "arming_disabled": list(m.arming_disabled), "cycle_time": m.cycle_time,
        })  # fmt: skip
    elif code == Rc.CODE:
        log.record("rc", at, {"channels": list(m.channels)})
    elif code == Motor.CODE:
        log.record("motors", at, {"values": list(m.throttle)})
    elif code == BatteryState.CODE:
        log.record("battery", at, {"voltage": m.voltage, "current": m.current, "cells": m.cells})
    elif code == RawImu.CODE and imu is not None:
        log.record("imu", at, {"gyro": list(m.body_rate), "specific_force": imu.accelerometer.tolist()})
    elif code == Attitude.CODE:
        log.record("imu", at, {"attitude": [m.roll, m.pitch, m.yaw]})
