"""The bridge: at each control step, from poses and the flight controller's answers to the sticks that it is sent."""

import dataclasses
import math
from collections import deque

import numpy as np

from e2efly.control import Ctbr, Vec3
from e2efly.deploy import inertial, reckoning, state_machine
from e2efly.deploy.delay_watch import Delay, DelayWatch, delay_of, delay_problem, felt, turned
from e2efly.deploy.flight_state import AIRBORNE, Flight, Inputs, Mode, Target
from e2efly.deploy.goals import LandGoal
from e2efly.deploy.heading_watch import HeadingWatch, watched
from e2efly.deploy.hover import blind, controlled, flight_gains, roll_pitch
from e2efly.deploy.inertial import Inertial, Measurement
from e2efly.deploy.instruments import CLOSED, PROBE, ChannelProbe, Instruments, Reading
from e2efly.deploy.landing import has_stood
from e2efly.deploy.msp.client import Client
from e2efly.deploy.msp.controller import ControllerInfo
from e2efly.deploy.msp.messages import Attitude, RawImu, set_raw_rc
from e2efly.deploy.odometry import Odometry, Sample
from e2efly.deploy.policy_worker import PolicyWorker
from e2efly.deploy.pose.checks import Checks
from e2efly.deploy.pose.pace import Pace, pace_problem, paced
from e2efly.deploy.pose.source import PoseSource
from e2efly.deploy.pose.tracking import Track, age, track
from e2efly.deploy.record import (
    Log,
    Sent,
    rates_of,
    record_link,
    record_map,
    record_message,
    record_mode,
    record_odometry,
    record_policy,
    record_sent,
)  # fmt: skip
from e2efly.deploy.runtime import Imu
from e2efly.deploy.settings import FlightSettings
from e2efly.deploy.sticks import Sticks
from e2efly.deploy.throttle_map import ThrottleHistory, ThrottleMap, update
from e2efly.vehicles.vehicle import GRAVITY, Vehicle

AFRESH_S = 1.0
"""After so long without a good pose, on the ground, tracking begins afresh, s."""
OUTLIERS_S = 0.03
"""Poses are refused for so long before the odometry counts as lost, s: an outlier or two end no flight."""
ATTITUDE_S = 0.1
"""The controller's attitude, by which heading and velocity are reckoned, may be so old, s."""
THRUST_DELAY = (0.015, 0.075)
"""How long before a measured force its throttle was sent, s: the link, the rate loop and the motors' lag."""
BLOWN = 3.0
"""Beyond this force across the body, m/s^2, the air pushes so hard that the force along it tells little of thrust."""
TRIM = (-3.0, 5.0)
"""Bounds of the thrust that a take-off adds while the throttle map is still wrong, m/s^2."""
TRIM_GAIN = 3.0
"""Of the climb's speed error, 1/s."""
TRIM_FADE = 1.0
"""Time constant with which it fades as the map learns, s."""
STEADY = 0.03
"""Body rates of a hover below this are sent as none, rad/s: should the link fall silent now, they are held for long."""
DELAY_TICKS = 50
"""How often, on the ground, the delay of the poses is looked for in how it was carried, control steps."""
SILENT_S = 0.1
"""A controller that has said nothing for so long may hold the next command for as long as it is silent, s."""
LATE_S = 0.05
"""Poses may be so much later than the latency for which the gains are, s."""
OVERDUE = 0.3
"""A blind descent whose height is reckoned so far under the ground feels for the ground, m, ..."""
WEIGHT, LIGHTER, LIGHTEST = 0.97, 0.04, 0.6
"""... and gives no more than this share of its weight, less with each metre, and the last at least."""
FROZEN = "its numbers do not change"
"""Said of an accelerometer that does not even feel the rotors turn."""
LIFTED = 0.12
"""So high over the ground the vehicle flies, m: below, nothing is learned and no tilt is asked."""


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
        self.latency = vehicle.latency if latency is None else latency
        """From the vehicle's motion to its rate loop, s."""
        self.gentle = flight_gains(vehicle, self.latency)
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
        self.probe = ChannelProbe()
        self.instruments = Instruments(client, settings)
        self.sent = Sent("closed", None, 0.0, self._closed())
        self.pace = Pace()
        self._track = Track()
        self._pose_problem: str | None = None
        self._good_pose = -math.inf
        self._heading = HeadingWatch()
        self._inertial = Inertial()
        self._opposed: str | None = None
        self._delays = DelayWatch()
        self._delay: Delay | None = None
        self._history = ThrottleHistory(30.0)  # a silence may last long
        self._trim = 0.0
        self._imu: Imu | None = None
        self._missed: deque[float] = deque()
        self._last = 0.0
        self._heard = -math.inf
        self._stale: str | None = None
        self._obeyed = False

    def tick(self, now: float, lateness: float = 0.0, slack: float = 0.004) -> Sent:
        """One control step at `now` s, which began `lateness` s after its time; a policy due within `slack` s acts."""
        dt = min(max(now - self._last, 0.0), 0.1) if self._last else 0.0
        self._last = now
        self.ticks += 1
        self.client.poll(now)
        self._read_poses(now)
        reading = self._read_controller(now)
        self._feel(now, reading)
        self._count_deadlines(now, lateness)
        self._decide(now, slack)
        self.sent = self._send(now, self._command(now, dt))
        self._record(now, reading)
        return self.sent

    def look(self, now: float) -> list[Sample]:
        """Take in poses and the controller's answers, decide and send nothing; returns the poses."""
        self.client.poll(now)
        poses = self._read_poses(now)
        self._feel(now, self._read_controller(now, sends=False))
        return poses

    def adopt(self, info: ControllerInfo, sticks: Sticks, settings_problems: tuple[str, ...]) -> None:
        """The controller's settings were read again."""
        self.info, self.sticks, self.settings_problems = info, sticks, settings_problems
        self.probe = ChannelProbe()

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
                self.pace = paced(self.pace, odometry.time, sample.received)
                self._inertial = inertial.see(
                    self._inertial, odometry, now,
                    moved=self._track.same_since == odometry.time,  # or it may be frozen, and the motion has gone on
                    trusted=not self.flight.misled or self.flight.turned is not None, turned=self.flight.turned or 0.0,
                    latest=self.latency + LATE_S,
                )  # fmt: skip
                self._watch_heading(odometry, now)
                if self.flight.mode is Mode.INIT:
                    self._delays = turned(self._delays, odometry)
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

    def _watch_heading(self, odometry: Odometry, now: float) -> None:
        attitude = self.client.message(Attitude.CODE, now, ATTITUDE_S)
        if attitude is not None:
            self._heading = watched(self._heading, odometry, attitude) if self.height > LIFTED else HeadingWatch()

    def _read_controller(self, now: float, *, sends: bool = True) -> Reading:
        """What the controller has said, and all of it as inputs of the state machine."""
        self._heard = max((reply.time for reply in self.client.latest.values()), default=self._heard)
        reading = self.instruments.read(now, self.info, land=self.land_now, sends=sends)
        self._obeyed = not reading.failsafe
        grounded = self.flight.mode is Mode.INIT
        probed = self.probe.look(now, reading, self.sticks, grounded=grounded) if sends else ()
        good = self._pose_problem is None and self._stale is None
        slow = pace_problem(self.pace, self.settings.odometry_timeout)
        self.inputs = Inputs(
            odometry=self.odometry,
            odometry_problem=None if good else self._pose_problem or self._stale,
            link_problem=reading.link_problem,
            silent=now - self._heard > SILENT_S,
            armed=reading.armed,
            override=reading.override,
            pilot=reading.pilot,
            voltage=reading.voltage,
            settings_problems=self.settings_problems + probed + reading.meddling + ((slow,) if slow else ()),
            policy_problem=reading.meddling[0] if reading.meddling else None,
            attitude_error=self._attitude_error(reading.attitude),
            heading_error=self._heading.error if good else None,
            missed_deadlines=len(self._missed),
            accelerometer_problem=self._accelerometer_problem(),
            motion_problem=self._motion_problem(),
            buried=self.flight.blind and self._inertial.buried(self.flight.home, now),
            touched=self._inertial.touch.carried,
            supported=self._inertial.touch.rests and now - self._inertial.time < inertial.FRESH_S,
        )
        return reading

    def _accelerometer_problem(self) -> str | None:
        """What stands against a take-off, or was found in flight: that stays until the vehicle has landed."""
        if self.flight.mode in (Mode.INIT, Mode.DONE):
            return self._inertial.rest_problem
        if self._inertial.frozen:
            return FROZEN
        if self.flight.mode is Mode.TAKEOFF:  # the throttle map is not known well enough to be another judge
            return None
        return self._inertial.watch.accelerometer_problem

    def _motion_problem(self) -> str | None:
        """On the ground: what was found while it was carried, until it was carried again and agreed."""
        watch = self._inertial.watch
        if self.flight.mode not in (Mode.INIT, Mode.DONE):
            velocity = self._pose_problem if (self._pose_problem or "").startswith("velocity") else None
            return watch.problem or velocity
        if watch.opposed is not None:
            self._opposed = f"{watch.opposed}, when it was carried; carry it again, once frames and axes are right"
        elif watch.agrees:
            self._opposed = None
        if self.flight.mode is Mode.INIT and self.ticks % DELAY_TICKS == 0:
            self._delay = delay_of(self._delays) or self._delay
        return self._opposed or delay_problem(self._delay, self.latency + LATE_S)

    def _attitude_error(self, attitude: Attitude | None) -> float | None:
        if attitude is None or self.odometry is None:
            return None
        roll, pitch = roll_pitch(self.odometry.quaternion)
        return max(abs(math.remainder(attitude.roll - roll, math.tau)), abs(attitude.pitch - pitch))

    def _feel(self, now: float, reading: Reading) -> None:
        """What the inertial sensors say, and from it the throttle map, in the air."""
        flying = self.flying and abs(self.height) > LIFTED and self.inputs.armed
        seen = self.inputs.seen if not self.flight.misled else None
        attitude = self.client.message(Attitude.CODE, now, ATTITUDE_S)
        if (reply := reading.fresh.get(RawImu.CODE)) is not None:
            asked = reply.time - reply.latency
            if self.flight.mode is Mode.INIT:
                self._delays = felt(self._delays, asked + reply.latency / 2, reply.message.body_rate)
            sent = self._history.between(asked - THRUST_DELAY[1], asked - THRUST_DELAY[0]) if self._obeyed else None
            self._inertial = inertial.measure(self._inertial, Measurement(
                np.array(reply.message.acceleration, float), np.array(reply.message.body_rate), attitude,
                None if sent is None else self._thrust(sent),
                asked,
                standing=self.flight.mode is Mode.INIT and not self.inputs.armed,
                flying=flying and self.flight.mode is not Mode.TAKEOFF,
                climb=float(seen.velocity[2]) if flying and seen is not None else None,
            ), now)  # fmt: skip
            self._learn(sent, flying)
        thrust, held = self._lift(now), self._lift(min(now, self._heard))
        self._inertial = inertial.carry(self._inertial, attitude, thrust, now, held=held)

    def _lift(self, moment: float) -> tuple[float, float] | None:
        """`_thrust` of what was sent for a moment, s, in the air; None: not known, or the ground may carry it."""
        throttle = self._history.between(moment - THRUST_DELAY[1], moment - THRUST_DELAY[0])
        lifts = self.flight.mode in (Mode.HOVER, Mode.POLICY, Mode.LAND) and self._obeyed
        return self._thrust(throttle) if lifts and throttle is not None else None

    def _thrust(self, throttle: float) -> tuple[float, float]:
        """Specific force of a throttle, and how far it may be off, m/s^2."""
        force = self.map.force(throttle, self.inputs.voltage)
        return force, force * self.map.doubt

    def _learn(self, throttle: float | None, flying: bool) -> None:
        """The throttle map."""
        force = self._inertial.force
        if force is None:
            return
        self._imu = Imu(self._inertial.gyro if self._inertial.gyro is not None else np.zeros(3), force)
        blown = math.hypot(force[0], force[1]) > BLOWN
        if throttle is not None and flying and not self.flight.blind and not blown:
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
        if worker.step(odometry, now, slack, self._imu) and self.log is not None:
            record_policy(self.log, now, worker)
        self.inputs = dataclasses.replace(
            self.inputs, policy_problem=self.inputs.policy_problem or worker.problem, policy_done=worker.done,
            policy_lands=isinstance(worker.runtime.goal, LandGoal),
        )  # fmt: skip

    def _step(self, now: float) -> None:
        before = self.flight
        self.flight = state_machine.step(self.settings, before, self.inputs, now)
        if self.flight.blind and not before.blind and self.flight.turned is None:
            self._inertial = inertial.alone(self._inertial, wrong=self.flight.misled is not None)
        if self.flight.mode is not before.mode:
            self._inertial = dataclasses.replace(self._inertial, touch=self._inertial.touch.afresh())
            self._delays = DelayWatch()
            if self.flight.mode is Mode.TAKEOFF:
                self._inertial = self._inertial.at_rest()
            self._trim = 0.0 if self.flight.mode in (Mode.TAKEOFF, Mode.LAND) else self._trim
            if self.log is not None:
                record_mode(self.log, now, before, self.flight)

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
            return self._blind(now, dt)
        if self.inputs.link_problem and self.inputs.silent and has_stood(self.settings, flight, odometry):
            return "closed", None
        return "hover", self._hover(flight.target, odometry, dt)

    def _blind(self, now: float, dt: float) -> tuple[str, Ctbr | None]:
        """The descent without odometry."""
        attitude = self.client.message(Attitude.CODE, now, 0.5)
        reckoned = self._inertial.reckoned
        overdue = True
        if reckoned is None:
            climb = 0.0 if self.flight.lost is None else self.flight.lost[2]
            command = blind(attitude, now - self.flight.since, climb)
            thrust = float(command.thrust)
        else:
            ground = self.flight.home
            self._trim = reckoning.trimmed(self._trim, reckoned, ground, dt)
            command = reckoning.settle(attitude, reckoned, ground, self._trim)
            under = ground - reckoned.height
            overdue = under > OVERDUE
            weight = GRAVITY * max(WEIGHT - LIGHTER * under, LIGHTEST)
            thrust = min(float(command.thrust), weight) if overdue else float(command.thrust)
        self._inertial = inertial.feel_for_ground(self._inertial, thrust, now, overdue=overdue)
        return "blind", Ctbr(thrust * self._inertial.touch.factor(now), command.rate)

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
        x, y, z = (0.0 if abs(r) < STEADY else r for r in rates_of(wanted))
        return Ctbr(wanted.thrust + self._trim, Vec3(x, y, z))

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
        apart = (0, 0, 0) if self.inputs.armed or self.probe.seen else PROBE
        return self.sticks.arrange((*(mid + offset for offset in apart), CLOSED), ())

    def _record(self, now: float, reading: Reading) -> None:
        log = self.log
        if log is None:
            return
        if self.odometry is not None and self.inputs.odometry_problem is None:
            record_odometry(log, now, self.odometry)
        record_sent(log, now, self.sent, str(self.flight.mode), *self._setpoint())
        for code, reply in reading.fresh.items():
            record_message(log, self.info, code, reply, self._imu)
        if self.ticks % 20 == 0:
            record_map(log, now, self.map)
        if self.ticks % 50 == 0:
            record_link(log, now, self.client)

    def _setpoint(self) -> tuple[list[float] | None, float | None]:
        """Where it is to be, world, m, and the yaw, rad."""
        if self.flight.mode is Mode.POLICY and self.worker is not None and self.worker.decision is not None:
            return self.worker.decision.position.tolist(), None
        if self.flight.target is not None:
            return list(self.flight.target.position), self.flight.target.yaw
        return None, None
