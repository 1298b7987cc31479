"""The bridge flying the firmware on a rig, in one process and in virtual time: the pilot is a script."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from e2efly.flight.autopilot import Autopilot
from e2efly.flight.bridge import Bridge
from e2efly.flight.commander.commander import Commander, CommandSource
from e2efly.flight.filter.filter import Filter, fastest
from e2efly.flight.flight_loop import LOWEST_RATE, loop_rate
from e2efly.flight.log_record import Log
from e2efly.flight.pilot.flight_state import Mode
from e2efly.flight.pilot.hovering import HoverController
from e2efly.flight.pose.neighbours import Neighbours
from e2efly.flight.pose.pose_source import PlantSource, drifts
from e2efly.flight.settings import Fence, FlightSettings
from e2efly.flight.sight.image_source import ImageSource
from e2efly.policy.goal import Course
from e2efly.policy.odometry import Sample
from e2efly.policy.runtime import Acting, Envelope, Runtime
from e2efly.policy.worker import PolicyWorker
from e2efly.validation.world import FlownBody, World
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

REACH = 20.0
"""Usual size of the fence about the origin, m."""
PATIENCE_S = 60.0
"""Longest time that a step waits for the policy, s. With virtual time, the load of the machine must not matter."""


class FlightBench(Protocol):
    """A vehicle in its world under an autopilot, with a pilot and poses. Sleeping on it lets time pass."""

    state: FlownBody
    latency: float

    @property
    def world(self) -> World:
        """The rigid body."""
        ...

    def now(self) -> float:
        """Time, s."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let time pass, s."""
        ...

    def poses(self, now: float) -> list[Sample]:
        """The poses that have come since the last call."""
        ...

    def set(self, **changes: Any) -> None:
        """Move the pilot's sticks and switches: fields of `firmware_rig.Transmitter`."""
        ...

    def autopilot(
        self, settings: FlightSettings, hover: HoverController | None = None, *, aids: bool = False
    ) -> Autopilot:
        """The autopilot, identified, for a bridge with these settings. It `aids` a pose source by its IMU."""
        ...


@dataclass
class FlownSession:
    """The true record of a flight, sampled at every control step."""

    time: list[float] = field(default_factory=list)
    mode: list[str] = field(default_factory=list)
    position: list[np.ndarray] = field(default_factory=list)
    velocity: list[np.ndarray] = field(default_factory=list)
    tilt_cosine: list[float] = field(default_factory=list)
    goal: list[np.ndarray | None] = field(default_factory=list)
    """The position to be at for the policy, or the hover controller's target."""
    changes: list[tuple[float, str, tuple[str, ...]]] = field(default_factory=list)
    """Each mode with its time and its reasons."""

    def where(self, mode: str) -> np.ndarray:
        """The steps in a mode."""
        return np.flatnonzero(np.array(self.mode) == mode)


class Session:
    """A bridge on a started rig."""

    def __init__(
        self,
        rig: FlightBench,
        settings: FlightSettings,
        *,
        policy: Acting | None = None,
        course: Course | None = None,
        log: Log | None = None,
        autopilot: Autopilot | None = None,
        source: Any = None,
        cameras: Sequence[ImageSource] = (),
        commands: CommandSource | None = None,
        filtered: bool = False,
        hover: HoverController | None = None,
        vehicle: Vehicle | None = None,
        neighbours: Neighbours | None = None,
    ) -> None:
        """Put a bridge on an autopilot. Without one, the rig's firmware is identified.

        `vehicle` is the vehicle that the bridge is told of. None: the vehicle that flies.
        """
        vehicle = vehicle or rig.world.vehicle
        self.rig, self.settings = rig, settings
        self.autopilot: Any = autopilot or rig.autopilot(settings, hover)
        self.worker: PolicyWorker | None = None
        rate = LOWEST_RATE
        if policy is not None and course is not None:
            rate = loop_rate(policy.contract.control_rate_hz)
            runtime = Runtime.of(
                policy, course, vehicle, envelope=Envelope(speed=8.0), imu=True, images=bool(cameras),
                others=neighbours is not None,
            )  # fmt: skip
            runtime = dataclasses.replace(runtime, placed=not drifts(source))
            self.worker = PolicyWorker(runtime, PATIENCE_S)
        late = rig.latency + 0.01
        self.commander = None if commands is None else Commander(commands, vehicle, settings, latency=late)
        """The source of commands that flies in place of a policy."""
        self.period = 1 / rate
        self.source = source or PlantSource(rig.poses, "rig")
        self.bridge = Bridge(
            self.autopilot, self.source, vehicle, settings,
            worker=self.commander or self.worker, log=log, latency=late, cameras=cameras,
            filter=fastest(Filter.of(vehicle, settings.fence, late))[0] if filtered else None, hover=hover,
            neighbours=neighbours,
        )  # fmt: skip
        self.flown = FlownSession()
        self.lateness = 0.0
        """Lateness that is reported to the bridge at the next step, s."""

    def close(self) -> None:
        """End the policy's thread and the link."""
        if self.worker is not None:
            self.worker.close()
        self.autopilot.close()

    def step(self) -> None:
        """Run one control period."""
        self.rig.sleep(self.period)
        self.bridge.tick(self.rig.now(), self.lateness)
        self.lateness = 0.0
        flown, bridge, state = self.flown, self.bridge, self.rig.state
        mode = str(bridge.flight.mode)
        if not flown.mode or flown.mode[-1] != mode:
            flown.changes.append((self.rig.now(), mode, tuple(str(r) for r in bridge.flight.reasons)))
        flown.time.append(self.rig.now())
        flown.mode.append(mode)
        flown.position.append(np.array(state.position))
        flown.velocity.append(np.array(state.velocity))
        _, x, y, _ = np.asarray(state.quaternion)
        flown.tilt_cosine.append(float(1 - 2 * (x * x + y * y)))
        flown.goal.append(self._goal())

    def fly(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Run control steps for `seconds`, or until a condition holds. Returns whether it holds."""
        return run(self.rig, self.step, seconds, until)

    def in_mode(self, *modes: Mode) -> Callable[[], bool]:
        """A condition: the bridge is in one of these modes."""
        return lambda: self.bridge.flight.mode in modes

    def take_off(self, settle: float = 2.0) -> bool:
        """The pilot hands over control, arms, and requests a hover. Returns whether it is reached."""
        self.fly(0.3)
        self.rig.set(override=True, throttle=0.0)
        self.fly(0.3)
        self.rig.set(armed=True)
        self.fly(0.5)
        if not self.bridge.inputs.override:  # PX4 follows only after a second of commands
            self.fly(2.0, lambda: self.bridge.inputs.override)
        self.rig.set(mission="hover")
        height = self.settings.takeoff_height / self.settings.takeoff_speed
        return self.fly(height + 8.0, self.in_mode(Mode.HOVER)) and not self.fly(settle, self.in_mode(Mode.LAND))

    def land(self, patience: float = 30.0) -> bool:
        """The pilot requests a landing, and disarms after it. Returns whether the vehicle is landed and disarmed."""
        self.rig.set(mission="land")
        landed = self.fly(patience, self.in_mode(Mode.DONE))
        self.rig.set(armed=False)
        self.fly(0.5)
        return landed

    def _goal(self) -> np.ndarray | None:
        place, _ = self.bridge.setpoint
        return None if place is None else np.array(place)


def run(rig: FlightBench, step: Callable[[], None], seconds: float, until: Callable[[], bool]) -> bool:
    """Run steps for `seconds` of the rig's time, or until a condition holds. Returns whether it holds."""
    end = rig.now() + seconds
    while rig.now() < end:
        step()
        if until():
            return True
    return False


def rehearsal_settings(height: float, reach: float = REACH, fence: Fence | None = None) -> FlightSettings:
    """Settings of whole flights on the rig, at this height above the ground, m. The firmware on the rig has no battery.

    `reach` is the radius of the fence about the origin, m, if no fence is given.
    """
    wide = Fence(low=(-reach, -reach, 0.1), high=(reach, reach, 8.0), speed=20.0, tilt=3.1, braking=12.0)
    return dataclasses.replace(
        FlightSettings(), takeoff_height=height, takeoff_speed=0.8, land_speed=0.6, battery_unknown=True,
        fence=fence or wide,
    )  # fmt: skip


def open_fence(vehicle: Vehicle, reach: float) -> Fence:
    """A fence of a rehearsal that only ends what has gone astray: `reach` m in each direction, below the ground, too. A
    race dives so near to the ground that a guard at a floor would end good flights. What touches the ground is seen.
    """
    braking = (vehicle.thrust_to_weight - 1) * GRAVITY / 2  # half of what full thrust has over the weight
    return Fence(low=(-reach, -reach, -reach), high=(reach, reach, reach), speed=20.0, tilt=3.1, braking=braking)
