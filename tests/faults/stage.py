"""Where faults are injected: firmware on its rig, bridge, policy, a scripted pilot, and parts that misbehave."""

import dataclasses
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.flight.betaflight.watchdog import TIMEOUT_S, StickLander
from e2efly.flight.descent_plan import plan_of
from e2efly.flight.flight_loop import PLAN_PERIOD
from e2efly.flight.link import open_link
from e2efly.flight.pilot.flight_state import Mode, Reason
from e2efly.flight.pose.pose_source import PlantSource
from e2efly.flight.row import problems
from e2efly.flight.settings import Fence, FlightSettings
from e2efly.flight.sight.image_source import ImageSource
from e2efly.logs.telemetry import Telemetry
from e2efly.policy.goal import Course
from e2efly.policy.loader import Policy
from e2efly.policy.odometry import tilt_of
from e2efly.validation.bridge_session import Session, run
from e2efly.validation.rig import Rig
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle
from tests.faults.faulty import FaultyImages, FaultyLink, FaultyNetwork, FaultyPoses
from tests.faults.virtual_watchdog import VirtualWatchdog
from tests.flight.command_streams import Loopback, encode

FENCE = Fence(low=(-3.0, -3.0, 0.1), high=(3.0, 3.0, 3.0))
"""Of all flights with faults."""
TARGET = (0.6, -0.4, 1.0)
"""Where the hovering policy is to fly, m."""
HEIGHT = 0.7
"""Of the hover, m."""
SETTINGS = FlightSettings(
    takeoff_height=HEIGHT, takeoff_speed=1.0, land_speed=0.6, land_settle=0.3, battery_unknown=True, fence=FENCE
)
"""The firmware on the rig has no battery."""
POSE_S, LATENCY_S = 0.005, 0.02
"""Between two poses, and their age when they arrive, s."""
PATIENCE_S = 60.0
"""How long a step waits for the policy, s of real time: how busy the machine is must not matter."""
SINK_SPEED = 0.5
"""Of a pilot who lands, m/s."""
CLOSED, RANGE = 1000, 1000
"""Pulse of a closed throttle, and from there to the full one, us."""


@dataclass(frozen=True)
class Gear:
    """What a flight has beyond firmware, poses and a policy."""

    cameras: tuple[ImageSource, ...] = ()
    """What the policy sees."""
    commands: bool = False
    """Another program flies in place of the policy."""
    filtered: bool = False
    """The filter is on."""
    believed: Vehicle | None = None
    """The vehicle whose file the bridge was given. None: that which flies."""
    watched: bool = False
    """The link goes through the watchdog."""
    log: Path | None = None
    """The file of the flight's log. None: without."""


@dataclass
class Trace:
    """What the world saw at each control step."""

    time: list[float] = field(default_factory=list)
    position: list[np.ndarray] = field(default_factory=list)
    velocity: list[np.ndarray] = field(default_factory=list)
    tilt: list[float] = field(default_factory=list)
    armed: list[bool] = field(default_factory=list)
    throttle: list[float] = field(default_factory=list)
    """The bridge's."""
    motor: list[float] = field(default_factory=list)
    """Mean output of the firmware's motors, 0 to 1."""


class Stage:
    """A rig that has been started, and the bridge on it. Close it with `close`."""

    def __init__(
        self,
        rig: Rig,
        policy: Policy,
        course: Course,
        seed: int = 0,
        settings: FlightSettings = SETTINGS,
        gear: Gear = Gear(),
    ) -> None:
        self.settings, self.gear = settings, gear
        self.rig, self.random = rig, np.random.default_rng(seed)
        self.network = FaultyNetwork(policy.session)
        self.cameras = tuple(map(FaultyImages, gear.cameras))
        self.link: FaultyLink
        self.poses: FaultyPoses
        self.watchdog: VirtualWatchdog | None = None
        self.session: Session
        self.stopped = False
        """Whether the bridge's process stands still."""
        x, y, _ = TARGET
        self.command: dict[str, Any] = {"mode": "position", "position": [x, y, settings.takeoff_height]}
        """What another program sends before each control step, if there is one."""
        self.log: Telemetry | None = None if gear.log is None else Telemetry(gear.log)
        self.pilot: Callable[[], None] | None = None
        """The pilot's hands, before each control step."""
        self.each: Callable[[], None] | None = None
        """What else happens before each control step."""
        self.undo = ExitStack()
        """Ends what a fault has changed elsewhere."""
        self._policy, self._course = dataclasses.replace(policy, session=self.network), course
        self._commander: Loopback | None = None
        self._stood, self._planned = 0.0, -np.inf
        self.trace = Trace()
        self.renew()
        self.open()

    def renew(self) -> None:
        self.link = FaultyLink(open_link(self.rig.sitl.msp), self.random)
        self.watchdog = None
        if self.gear.watched:
            self.watchdog = VirtualWatchdog(self.rig.now, self.link, StickLander(), TIMEOUT_S)
        self.poses = FaultyPoses(PlantSource(self.rig.poses, "rig"))

    def open(self) -> None:
        """Identify the controller and begin to fly it, as `e2efly fly` does."""
        gear, link = self.gear, self.watchdog or self.link
        self._commander = Loopback() if gear.commands else None
        try:
            session = Session(
                self.rig, self.settings, policy=None if gear.commands else self._policy, course=self._course,
                autopilot=self.rig.autopilot(self.settings, link=link), source=self.poses,
                cameras=self.cameras, commands=self._commander, filtered=gear.filtered,
                vehicle=gear.believed, log=self.log,
            )  # fmt: skip
        except (ValueError, OSError):
            link.close()
            raise
        contract = None if gear.commands else self._policy.contract
        session.bridge.settings_problems = problems(
            session.autopilot.check(session.bridge.vehicle, self.settings, contract)
        )
        self.session = session
        self.patience(PATIENCE_S)

    def reopen(self) -> None:
        """The same with new link and pose source, after `close`."""
        self.renew()
        self.open()

    def close(self) -> None:
        self.undo.close()
        self.session.close()
        if self._commander is not None:
            self._commander.close()
        self.rig.sleep(0.1)  # the firmware takes the next connection once it has seen the end of this one

    def end(self) -> None:
        """End the bridge and its log for good."""
        self.close()
        if self.log is not None:
            self.log.close()

    @property
    def mode(self) -> Mode:
        return self.session.bridge.flight.mode

    @property
    def policy_period(self) -> float:
        """Between two questions to the policy, s."""
        return 1 / self._policy.contract.control_rate_hz

    def patience(self, seconds: float) -> None:
        """How long the bridge waits for the policy, real time."""
        if self.session.worker is not None:
            self.session.worker.timeout = seconds

    def step(self) -> None:
        for act in (self.pilot, self.each):
            if act is not None:
                act()
        self._run()
        state, trace = self.rig.state, self.trace
        trace.time.append(self.rig.now())
        trace.position.append(np.array(state.position))
        trace.velocity.append(np.array(state.velocity))
        trace.tilt.append(tilt_of(state.quaternion))
        trace.armed.append(self.session.bridge.inputs.armed)
        trace.throttle.append(self.throttle)
        trace.motor.append(float(self.rig.sitl.motors().mean()))

    def _run(self) -> None:
        """The processes of a control step, as far as they do not stand still."""
        session, now = self.session, self.rig.now()
        if self._commander is not None:
            self._commander.send(encode(stamp=now, **self.command))
        if self.stopped:
            self.rig.sleep(session.period)
            self._stood += session.period
        else:
            session.lateness, self._stood = session.lateness + self._stood, 0.0
            session.step()
        if self.watchdog is not None:
            if not self.stopped and now >= self._planned + PLAN_PERIOD:
                self._planned = now
                self.watchdog.plan(plan_of(session.bridge, session.autopilot.sticks))
            self.watchdog.step()

    @property
    def taken_over(self) -> bool:
        return self.watchdog is not None and self.watchdog.has_taken_over

    @property
    def throttle(self) -> float:
        """Sent by whoever flies."""
        return (self.link.throttle - CLOSED) / RANGE if self.taken_over else self.session.bridge.sent.throttle

    def fly(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Control steps for so long, or until something holds; whether it did."""
        return run(self.rig, self.step, seconds, until)

    def ready(self, mode: Mode) -> None:
        """Bring the flight into INIT, HOVER or POLICY, at a moment of chance."""
        if mode is Mode.INIT:
            self._ground()
            return
        if self.mode is not Mode.HOVER:
            self._take_off()
        self.rig.set(mission="hover")
        turn = self.random.uniform(-1, 1, 2) * (not self.cameras)  # a policy that sees begins where its course does
        self.rig.set(roll=float(turn[0]), pitch=float(turn[1]))
        self.fly(0.6)
        self.rig.set(roll=0.0, pitch=0.0)
        self.fly(0.3)
        if mode is Mode.POLICY:
            self.rig.set(mission="policy")
            self._expect(2.0, Mode.POLICY)
        self.fly(self.random.uniform(0.2, 0.8))
        self._expect(0.0, mode)

    def heal(self) -> None:
        """End every fault, and put the pilot's hands back."""
        self.undo.close()
        self.pilot = self.each = None
        self.poses.alter, self.poses.delay, self.network.fault = None, 0.0, ""
        self.link.heal()
        self.rig.wind, self.rig.shares, self.rig.felt, self.rig.heard = np.zeros(3), np.ones(4), None, True
        self.rig.power(True)
        self.patience(PATIENCE_S)
        mission = "hover" if self.mode in (Mode.HOVER, Mode.POLICY, Mode.PILOT) else "land"
        armed = self.mode not in (Mode.DONE, Mode.INIT) and not self.standing
        self.rig.set(roll=0.0, pitch=0.0, mission=mission, override=True, throttle=0.0, armed=armed)
        self.fly(0.3)

    @property
    def standing(self) -> bool:
        return float(self.rig.state.position[2]) < self.rig.world.vehicle.feet_height + 0.01

    def pilot_holds(self) -> None:
        """The pilot takes over: level, holding the height."""
        self._by_hand(0.0)

    def pilot_lands(self) -> None:
        """The pilot takes over: level, sinking; on the ground the throttle is closed and the vehicle disarmed."""
        if self.standing:
            self.rig.set(throttle=-1.0, armed=False)
        else:
            self._by_hand(-SINK_SPEED)

    def _by_hand(self, climb: float) -> None:
        bridge = self.session.bridge
        thrust = GRAVITY + 2.0 * (climb - float(self.rig.state.velocity[2]))
        curve = self.session.autopilot.sticks.throttle
        pulse = curve.channel_for(min(bridge.map.throttle(thrust, None), curve.largest))
        self.rig.set(override=False, roll=0.0, pitch=0.0, throttle=(pulse - 1500) / 500)

    def _take_off(self) -> None:
        self._ground()
        self.rig.set(override=True, throttle=0.0)
        self.fly(0.2)
        self.rig.set(armed=True)
        self.fly(5.0, lambda: self.session.bridge.flight.reasons == (Reason.WAITING,))
        self.rig.set(mission="hover")
        self._expect(self.settings.takeoff_height / self.settings.takeoff_speed + 6.0, Mode.HOVER)

    def _ground(self) -> None:
        self.rig.set(mission="land")
        if self.mode not in (Mode.INIT, Mode.DONE):
            self._expect(15.0, Mode.DONE)
        self.rig.set(armed=False)
        self._expect(1.0, Mode.INIT)
        self.fly(1.0, lambda: Reason.MISSION_NOT_LOW not in self.session.bridge.flight.reasons)

    def _expect(self, seconds: float, mode: Mode) -> None:
        if self.mode is not mode and not self.fly(seconds, lambda: self.mode is mode):
            flight = self.session.bridge.flight
            came = [f"{m} ({'; '.join(why)})" for _, m, why in self.session.flown.changes[-4:]]
            raise RuntimeError(f"the flight is in {flight.mode} rather than in {mode}, by way of {', '.join(came)}")
