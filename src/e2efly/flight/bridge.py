"""The bridge: at each control step, it turns poses and what the autopilot reports into commands."""

import dataclasses
import math
from collections import deque
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from e2efly.control import Ctbr, Quat, Vec3
from e2efly.flight.attitude import Attitude, turned
from e2efly.flight.autopilot import Autopilot, AutopilotState
from e2efly.flight.filter.filter import Filter
from e2efly.flight.filter.guard import Keeper
from e2efly.flight.log_record import (
    Log,
    Sent,
    record_filter,
    record_map,
    record_mode,
    record_odometry,
    record_policy,
    record_sent,
)  # fmt: skip
from e2efly.flight.pilot import estimate, guidance, inertial, state_machine
from e2efly.flight.pilot.estimate import LATE_S, StateEstimate, height_of
from e2efly.flight.pilot.flight_state import AIRBORNE, GROUNDED, Flight, Inputs, Mode
from e2efly.flight.pilot.hover import LIFTED, controlled, flight_gains, rates_of
from e2efly.flight.pilot.hovering import DEFAULT, HoverController, Seen, UnderWay, hover_controller, sent, thrust_of
from e2efly.flight.pilot.inertial import FRESH_S, Measurement
from e2efly.flight.pilot.landing import has_stood
from e2efly.flight.pilot.sensing import WATCHED_S, sensing_problem
from e2efly.flight.pilot.throttle_map import ThrottleHistory, ThrottleMap, learn
from e2efly.flight.pilot.touch import LAGS
from e2efly.flight.pose.conditions import Checks
from e2efly.flight.pose.neighbours import Neighbours
from e2efly.flight.pose.pace import pace_problem
from e2efly.flight.pose.pose_source import AidedSource, PoseSource, drifts
from e2efly.flight.settings import FlightSettings
from e2efly.flight.sight import quality
from e2efly.flight.sight.image_source import ImageSource
from e2efly.flight.sight.quality import SeenImages
from e2efly.policy.odometry import Odometry, Sample, yaw_of
from e2efly.policy.runtime import Decision, Imu
from e2efly.policy.worker import Sensed, Worker
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle
from e2efly.vehicles.vehicle_rules import check_level

ATTITUDE_S, BLIND_ATTITUDE_S = 0.1, 0.5
"""Largest age of the controller's attitude, s: for the estimates of heading and velocity, and for a descent without
poses."""
MEASURE_STEPS = 50
"""Lags and age of the poses are measured and judged every so many control steps."""
SILENT_S = 0.1
"""If the controller has said nothing for this time, it may hold the next command for as long as its silence lasts,
s."""
DEAF_S = 0.5
"""After a silence, the accelerometer has this time to be heard again, s."""
CUT = Ctbr(0.0, Vec3(0.0, 0.0, 0.0))
"""The command that stands for a closed throttle."""
ACTING_S = 0.25
"""A measured force is compared with a throttle only if the commands of this time before it have arrived, s."""
RARELY_S = 0.3
"""If a stick frame was acknowledged as often as this in a silence, s, the others have arrived, too."""
ANEW_S = 1.0
"""After a silence as long as `link_timeout`, acknowledgements may belong to other frames for this time, s."""
HISTORY_S = 30.0
"""How long the sent throttles are remembered, s. The link may be silent for a long time."""


class Bridge:
    """One flight controller, one pose source, one vehicle, and an optional policy.

    `tick` never raises because of data from the link or the pose source, or because of what the policy does.
    """

    def __init__(
        self,
        autopilot: Autopilot,
        source: PoseSource,
        vehicle: Vehicle,
        settings: FlightSettings,
        *,
        worker: Worker | None = None,
        log: Log | None = None,
        latency: float | None = None,
        settings_problems: tuple[str, ...] = (),
        throttle_map: ThrottleMap | None = None,
        cameras: Sequence[ImageSource] = (),
        filter: Filter | None = None,
        hover: HoverController | None = None,
        neighbours: Neighbours | None = None,
    ) -> None:
        """Create a bridge for a vehicle on the ground.

        Args:
            autopilot: the identified flight controller.
            source: delivers poses.
            vehicle: the loaded vehicle.
            settings: what the flight may do.
            worker: calls the policy, or listens to an external commander. None: the vehicle only hovers.
            log: the record of the flight. None: no record is kept.
            latency: the time from the vehicle's motion to its rate loop, s. None: the value of the vehicle file.
            settings_problems: why the controller's settings forbid a take-off.
            throttle_map: learned in earlier flights. None: the map of the vehicle file.
            cameras: what the policy sees, in the order of the images in its contract.
            filter: keeps the policy inside the fence. None: the guard ends the policy's flight at the fence.
            hover: the controller for take-off, hover and landing. None: the default controller, for this latency.
            neighbours: the other vehicles. None: nothing is known of any.

        Raises:
            ValueError: for a vehicle with tilted rotors; for a source whose poses drift, unless a policy flies that is
                told neither place nor velocity, without a filter.
        """
        check_level(vehicle, "a flight")
        delay: float = vehicle.latency if latency is None else latency
        self.autopilot, self.source, self.vehicle, self.settings = autopilot, source, vehicle, settings
        self.gentle = flight_gains(vehicle, delay)
        """The vehicle with gains that suit the latency."""
        self.hover = hover or hover_controller(DEFAULT, vehicle, delay)
        """The controller for take-off, hover and landing."""
        self.latency = delay
        """The time from the vehicle's motion to its rate loop, s."""
        self.worker, self.log, self.land_now = worker, log, False
        """`land_now`: the operator asks for a landing, as the pilot does with the mission switch."""
        self.cameras, self.neighbours = tuple(cameras), neighbours
        images = () if worker is None else worker.images
        self.seen = tuple(SeenImages(image) for image, _ in zip(images, self.cameras, strict=True))
        """What is known about each camera."""
        self.settings_problems = settings_problems
        """Why the autopilot's settings, as they were read, forbid a take-off."""
        self.flight, self.inputs = Flight(home=settings.ground_height), Inputs()
        self.estimate = StateEstimate(Checks(max_age=settings.odometry_timeout), delay + LATE_S)
        self.map = throttle_map or ThrottleMap.of(vehicle)
        self.trim = 0.0
        """Thrust that compensates for an error of the throttle map, m/s^2."""
        self.imu: Imu | None = None
        """The newest credible measurement of the inertial sensors."""
        self.sent = Sent("closed", None, 0.0, ())
        self.keeper = None if filter is None else Keeper(filter)
        self._hovering, self._under_way = self.hover.begin(), UnderWay()
        self._history = ThrottleHistory(HISTORY_S)
        self._turns: deque[tuple[float, tuple[float, float, float]]] = deque(maxlen=128)
        self._overdue: tuple[float, ...] = ()
        self._ticks, self._last, self._heard_since, self._broken = 0, 0.0, 0.0, -math.inf
        self._held, self._looked = self.sent, 0.0
        self._unlike: str | None = None
        self._levelled = -math.inf, -math.inf
        """When the newest attitude was requested, and when it was true, s."""
        self._aided = source if isinstance(source, AidedSource) else None
        self.placeless = drifts(source)
        """Whether the poses drift: nobody knows where the vehicle is."""
        if self.placeless and (worker is None or not worker.unplaced or filter is not None):
            raise ValueError(
                f"the pose source is {source.describe()}; accepted: for a policy that is told neither place nor "
                "velocity, such as race_eyes, and without --guard filter"
            )
        if self.placeless and settings.ground_height:
            raise ValueError(
                f"flight.ground_height is {settings.ground_height:g}; accepted with {source.describe()}: 0"
            )

    def tick(self, now: float, lateness: float = 0.0, slack: float = 0.004) -> Sent:
        """Run one control step at `now` s that began `lateness` s late. A policy that is due within `slack` s acts in
        it.
        """
        dt = min(max(now - self._last, 0.0), 0.1) if self._last else 0.0
        self._last, self._ticks = now, self._ticks + 1
        self._under_way = sent(self._under_way, self.sent.command or CUT, dt, self.vehicle, self.latency)
        late = (*self._overdue, now) if lateness > self.settings.lateness else self._overdue
        self._overdue = tuple(moment for moment in late if moment >= now - 1.0)
        _, report = self._perceive(now)
        self._decide(now, slack)
        self.sent = self._send(now, *self._kept(now, *self._command(now, dt)))
        if self.log is not None:
            self._record(self.log, now, report)
        return self.sent

    def look(self, now: float) -> list[Sample]:
        """Read poses and the autopilot, without deciding or sending anything. Returns the poses."""
        return self._perceive(now, sends=False)[0]

    @property
    def flying(self) -> bool:
        """Whether this bridge may have brought the vehicle into the air."""
        return self.flight.mode in AIRBORNE

    @property
    def odometry(self) -> Odometry | None:
        """The newest odometry that passed the checks."""
        return self.estimate.odometry

    @property
    def height(self) -> float:
        """Height over the place of take-off, from the last odometry, m."""
        return height_of(self.odometry, self.flight)

    @property
    def decision(self) -> Decision | None:
        """What the policy wants. None: the policy is not flying."""
        return self.worker.decision if self.worker is not None and self.flight.mode is Mode.POLICY else None

    @property
    def setpoint(self) -> tuple[list[float] | None, float | None]:
        """The position where the vehicle should be, world, m, and its yaw, rad."""
        if (decision := self.decision) is not None:
            return None if decision.position is None else decision.position.tolist(), None
        target = self.flight.target
        return (None, None) if target is None else (list(target.position), target.yaw)

    def _perceive(self, now: float, *, sends: bool = True) -> tuple[list[Sample], AutopilotState]:
        """Read poses and the autopilot, and combine them."""
        autopilot = self.autopilot
        autopilot.poll(now)
        if now - autopilot.heard > SILENT_S:
            self._heard_since = now
        if now - autopilot.heard > self.settings.link_timeout and not autopilot.uncertain(now):
            self._broken = now
        if autopilot.heard >= self._looked:
            self._held = self.sent  # a controller that is not heard from now on has at least this one
        self._looked = now
        samples, known = self.source.read(now), autopilot.attitude(now, ATTITUDE_S)
        attitude = None if known is None else known[0]
        self.estimate = estimate.see(self.estimate, samples, self.flight, attitude, now, self.source.problem or "")
        if samples and self.odometry is not None and not self.placeless:
            autopilot.pose(now, self.odometry)
        if self.worker is not None:
            self.worker.hear(self.odometry, now)
        if self.neighbours is not None:
            self.neighbours.read(now)
        odometry = self.odometry if self.flying else None
        self.seen = tuple(
            quality.see(seen, camera.read(now), now, odometry, self.settings.ground_height, camera.problem)
            for seen, camera in zip(self.seen, self.cameras, strict=True)
        )
        report = autopilot.read(now, land=self.land_now, sends=sends, grounded=self.flight.mode is Mode.INIT)
        self.inputs = self._judge(now, report)
        self._feel(now, report)
        return samples, report

    def _judge(self, now: float, report: AutopilotState) -> Inputs:
        """The inputs of the state machine."""
        flight, mode = self.flight, self.flight.mode
        begins = mode is not Mode.POLICY or now - flight.since < WATCHED_S
        measure = begins and self._ticks % MEASURE_STEPS == 0
        self.estimate = told = estimate.compare(self.estimate, mode, measure=measure)
        if measure or not begins:
            trained = None if self.worker is None or self.settings.untrained_sensing else self.worker.sensing
            self._unlike = sensing_problem(told, trained) if begins else None
        slow = pace_problem(told.pace, self.settings.odometry_timeout)
        return Inputs(
            odometry=told.odometry,
            odometry_problem=told.pose_problem,
            link_problem=report.link_problem,
            silent=now - self.autopilot.heard > SILENT_S,
            failsafe=report.failsafe,
            armed=report.armed,
            override=report.override,
            pilot=report.pilot,
            voltage=report.voltage,
            settings_problems=(*self.settings_problems, *report.problems, *((slow,) if slow else ())),
            policy_problem=report.policy_problem or self._blindness(now) or self._unfiltered,
            filtered=self.keeper is not None,
            placeless=self.placeless,
            attitude_error=told.attitude_error(report.attitude),
            heading_error=told.heading_error,
            missed_deadlines=len(self._overdue),
            accelerometer_problem=told.accelerometer_problem(mode),
            force=told.inertial.force,
            motion_problem=told.motion_problem(mode),
            sensing_problem=self._unlike,
            buried=flight.blind and told.inertial.buried(flight.home, now),
            stands=told.inertial.touch.stands(now),
            deaf=not told.inertial.touch.tells(now) and now - self._heard_since > DEAF_S,
        )

    def _blindness(self, now: float) -> str | None:
        """Why a policy must not act on the newest images, among the other vehicles, or by the controller's attitude.
        None: it may.
        """
        here, begins = None if self.odometry is None else self.odometry.position, self.flight.mode is not Mode.POLICY
        lost = None if self.neighbours is None else self.neighbours.problem(now, here, begins)
        if self.worker is not None and self.worker.unplaced and self.autopilot.attitude(now, ATTITUDE_S) is None:
            lost = f"the flight controller has told no attitude for {ATTITUDE_S:g} s"
        return next((problem for seen in self.seen if (problem := seen.problem(now))), lost)

    @property
    def _unfiltered(self) -> str | None:
        """Why the filter cannot keep a policy inside the fence. None: it can, or there is no filter."""
        return None if self.keeper is None else self.keeper.problem

    def _feel(self, now: float, report: AutopilotState) -> None:
        """Process the inertial sensors. In the air they teach the throttle map and propagate the velocity."""
        flight, inputs, autopilot = self.flight, self.inputs, self.autopilot
        attitude = autopilot.attitude(now, ATTITUDE_S)
        if (reading := report.inertial) is not None:
            flying = self.flying and abs(self.height) > LIFTED and inputs.armed
            seen = inputs.seen if flying and not flight.misled and not self.placeless else None
            asked = reading.asked
            known = now - self._broken > ANEW_S
            acts = known and autopilot.delivered(asked - ACTING_S, asked) and not report.failsafe
            came = known and autopilot.delivered(min(self.estimate.inertial.time, asked), asked, RARELY_S)
            sent = None if report.failsafe else self._history.felt(asked)
            before = [throttle for lag in LAGS if (throttle := self._history.felt(asked - lag)) is not None]
            measured = Measurement(
                np.array(reading.acceleration, float), np.array(reading.body_rate),
                None if attitude is None else attitude[0],
                None if sent is None else self.map.expected(sent, inputs.voltage),
                tuple(self.map.force(t, inputs.voltage) for t in before) if len(before) == len(LAGS) else (),
                asked,
                acts=acts, delivered=came,
                standing=flight.mode is Mode.INIT and not inputs.armed,
                flying=flying and flight.mode is not Mode.TAKEOFF,
                climb=None if seen is None else float(seen.velocity[2]),
            )  # fmt: skip
            if self.keeper is not None:
                self.keeper.feel(measured.gyro, asked)
            halfway = (asked + reading.time) / 2
            self.estimate = estimate.feel(self.estimate, measured, halfway, flight.mode, now)
            if (force := self.estimate.inertial.force) is not None:
                self.imu = Imu(measured.gyro, force)
                if self._aided is not None:
                    # the throttle of an armed vehicle is closed, too, while this program has it on the ground
                    held = flight.mode in GROUNDED and inputs.override
                    stands, own = measured.standing or held, None
                    if attitude is not None:
                        if attitude[1] != self._levelled[0]:
                            self._levelled = attitude[1], (attitude[1] + now) / 2  # between the question and its answer
                        own = self._levelled[1], _quaternion(attitude[0])
                    self._aided.feel(halfway, measured.gyro, force, standing=stands, attitude=own)
                if sent is not None and acts and flying and not flight.blind:
                    swing = self._history.swing(asked)
                    self.map = learn(self.map, sent, force, inputs.voltage, 0.02, swing)

        def lift(throttle: float | None) -> tuple[float, float] | None:
            if throttle is None or not self.flying or report.failsafe:
                return None
            thrust, doubt = self.map.expected(throttle, inputs.voltage)
            stood = flight.mode is Mode.TAKEOFF and self.height < LIFTED
            return (max(thrust, GRAVITY) if stood else thrust), doubt  # what is missing, the ground gives

        told = inertial.carry(
            self.estimate.inertial, self._attitude(now, ATTITUDE_S), lift(self._history.felt(now)), now,
            rate=self.sent.rate, held=lift(self._held.throttle), held_rate=self._held.rate,
        )  # fmt: skip
        self.estimate = dataclasses.replace(self.estimate, inertial=told)

    def _decide(self, now: float, slack: float) -> None:
        """Call the policy if it flies, step the state machine, and let a policy that takes over act at once."""
        worker, odometry = self.worker, self.inputs.odometry
        good = odometry is not None and not self.inputs.odometry_problem
        if self.flight.mode is Mode.POLICY and worker is not None and good and odometry is not None:
            self._ask(worker, now, slack, odometry)
        elif self.flight.mode is Mode.HOVER:
            problem = "none is loaded" if worker is None else self.inputs.policy_problem
            if worker is not None and good and odometry is not None:
                problem = problem or worker.readiness(odometry, now)
            self.inputs = dataclasses.replace(self.inputs, policy_problem=problem)
        self._step(now)
        if worker is None:
            return
        if self.flight.mode is Mode.POLICY and worker.state is None:
            assert odometry is not None
            worker.start(odometry, now)
            self._ask(worker, now, slack, odometry)
            if worker.problem:
                self._step(now)
        if self.flight.mode is not Mode.POLICY:
            worker.stop()

    def _ask(self, worker: Worker, now: float, slack: float, odometry: Odometry) -> None:
        if self._blindness(now) is None:
            frames = [seen.frame for seen in self.seen if seen.frame is not None]
            images = [frame.image.astype(np.float32) for frame in frames]
            near, count = self.neighbours, worker.neighbours
            others = None if near is None or not count else near.nearest(odometry, now, count)
            told = self.autopilot.attitude(now, ATTITUDE_S) if worker.unplaced else None
            attitude = None if told is None else _quaternion(told[0])
            sensed = Sensed(odometry, self.imu, images, others, attitude)
            if worker.step(sensed, now, slack) and self.log is not None:
                record_policy(self.log, now, worker, [now - frame.time for frame in frames])
        self.inputs = dataclasses.replace(
            self.inputs, policy_problem=self.inputs.policy_problem or worker.problem, policy_done=worker.done,
            policy_lands=worker.lands,
        )  # fmt: skip

    def _step(self, now: float) -> None:
        before = self.flight
        self.flight = state_machine.step(self.settings, before, self.inputs, now)
        self.estimate = estimate.enter(self.estimate, before, self.flight)
        if self.flight.mode is not before.mode:
            self.trim = 0.0 if self.flight.mode in (Mode.TAKEOFF, Mode.LAND) else self.trim
            self._hovering = self.hover.begin()
            if self.log is not None:
                record_mode(self.log, now, before, self.flight)

    def _command(self, now: float, dt: float) -> tuple[str, Ctbr | None]:
        """The source of the command, and the command. None: the throttle is closed."""
        flight, odometry, decision = self.flight, self.odometry, self.decision
        if flight.mode in GROUNDED:
            return "closed", None
        if decision is not None and self.worker is not None:
            assert odometry is not None
            return self.worker.name, controlled(self.vehicle, decision.mode, odometry, decision.command)
        if flight.target is None or odometry is None or flight.blind:
            attitude = self._attitude(now, BLIND_ATTITUDE_S)
            command, self.trim, told = guidance.descend(flight, self.estimate.inertial, attitude, self.trim, now, dt)
            self.estimate = dataclasses.replace(self.estimate, inertial=told)
            return "blind", command
        if self.inputs.link_problem and self.inputs.silent and has_stood(self.settings, flight, odometry):
            return "closed", None
        seen = self._motion(now, odometry)
        command, self._hovering, self.trim = guidance.hover(
            self.hover, self._hovering, flight, flight.target, seen, self._under_way, self.trim, dt,
            silent=self.inputs.silent,
        )  # fmt: skip
        return "hover", command

    def _attitude(self, now: float, oldest: float) -> Attitude | None:
        """The controller's attitude when the next command acts: the newest one, turned by what was sent since. None: it
        came more than `oldest` s ago.
        """
        known = self.autopilot.attitude(now, oldest)
        if known is None:
            return None
        attitude, asked = known
        for (time, rate), (until, _) in pairwise((*self._turns, (now, (0.0, 0.0, 0.0)))):
            attitude = turned(attitude, rate, until - max(time, asked)) if until > asked else attitude
        return attitude

    def _motion(self, now: float, odometry: Odometry) -> Seen:
        """The inputs of the hover controller."""
        inertial, speeds = self.estimate.inertial, self.autopilot.rotor_speeds(now, FRESH_S)
        force = inertial.force if now - inertial.time < FRESH_S else None
        return Seen(
            Vec3(*odometry.position.tolist()), Vec3(*odometry.velocity.tolist()), Quat(*odometry.quaternion.tolist()),
            Vec3(*odometry.body_rate.tolist()),
            force=None if force is None else Vec3(*force.tolist()),
            age=max(now - odometry.time, 0.0),
            thrust=None if speeds is None else thrust_of(self.vehicle, speeds),
        )  # fmt: skip

    def _kept(self, now: float, source: str, command: Ctbr | None) -> tuple[str, Ctbr | None]:
        """The command after the filter. If the filter fails, it is a command to stop, and the next step ends the
        policy's flight.
        """
        keeper, flight, odometry = self.keeper, self.flight, self.odometry
        if keeper is None:
            return source, command
        keeper.problem = None if flight.mode in GROUNDED else keeper.problem
        keeper.see(odometry, now, flying=self.flying and self.height > LIFTED and not flight.misled)
        if self.decision is not None and command is not None and odometry is not None:
            others = () if self.neighbours is None else self.neighbours.balls(now)
            command = keeper.keep(odometry, now, command, floor=not self.inputs.policy_lands, others=others)
            if command is None:
                stop = (0.0, 0.0, 0.0, yaw_of(odometry.quaternion))
                source, command = "hover", controlled(self.gentle, "velocity", odometry, stop)
        keeper.sent(command, now)
        return source, command

    def _send(self, now: float, source: str, command: Ctbr | None) -> Sent:
        throttle = None if command is None else self.map.throttle(float(command.thrust), self.inputs.voltage)
        rates = (0.0, 0.0, 0.0) if command is None else rates_of(command)
        out = self.autopilot.send(now, throttle, rates)
        sent = Sent(source, command, throttle or 0.0, out.channels, out.saturated)
        acts = sent if out.alive else self._held
        self._history.add(now, acts.throttle)
        self._turns.append((now, acts.rate))
        return sent

    def _record(self, log: Log, now: float, report: AutopilotState) -> None:
        if self.odometry is not None and self.inputs.odometry_problem is None:
            record_odometry(log, now, self.odometry)
        if self.keeper is not None and self.keeper.change is not None:
            record_filter(log, now, self.keeper.change)
        record_sent(log, now, self.sent, str(self.flight.mode), *self.setpoint)
        for channel, time, values in report.records:
            log.record(channel, time, values)
        if report.inertial is not None and self.imu is not None:
            force = self.imu.accelerometer.tolist()
            log.record("imu", report.inertial.time, {"gyro": list(report.inertial.body_rate), "specific_force": force})
        if self._ticks % 20 == 0:
            record_map(log, now, self.map)
        if self._ticks % 50 == 0:
            log.record("link", now, self.autopilot.link_record())


def _quaternion(attitude: Attitude) -> np.ndarray:
    return np.asarray(Quat.of_euler(attitude.roll, attitude.pitch, attitude.yaw).stack())
