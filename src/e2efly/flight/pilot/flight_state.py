"""What the state machine knows, remembers and reports: its inputs, its state, its reasons."""

import math
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from e2efly.policy.odometry import Odometry


class Mode(StrEnum):
    """Who flies."""

    INIT = "init"
    """On the ground. The throttle is closed."""
    TAKEOFF = "takeoff"
    """The hover controller flies, and its target rises."""
    HOVER = "hover"
    """The hover controller flies. The pilot's sticks move its target."""
    POLICY = "policy"
    """The policy flies."""
    LAND = "land"
    """The hover controller flies, and its target sinks. Without odometry: a level attitude and a gentle descent."""
    PILOT = "pilot"
    """The pilot flies, through the override switch."""
    DONE = "done"
    """Landed. The throttle is closed until the vehicle is disarmed."""


AIRBORNE = (Mode.TAKEOFF, Mode.HOVER, Mode.POLICY, Mode.LAND)
"""Modes in which the bridge flies the vehicle."""
GROUNDED = (Mode.INIT, Mode.DONE)
"""Modes in which the throttle is closed."""


DRIFTED = "nobody knows where it is: poses by the IMU alone"
"""Reported for odometry that drifts, once the flight has been too long for it."""


class Mission(StrEnum):
    """The pilot's three-position switch."""

    LAND = "land"
    """Stay on the ground, or land."""
    HOVER = "hover"
    """Take off and hover."""
    POLICY = "policy"
    """Let the policy fly."""


class Reason(StrEnum):
    """All reasons. Some are followed by a colon and numbers."""

    NO_ODOMETRY = "no good odometry"
    MOVING = "moving"
    NOT_ON_GROUND = "not on the ground"
    TILTED = "not level"
    BATTERY_LOW = "battery low"
    BATTERY_UNKNOWN = "battery voltage unknown"
    STICKS = "sticks off centre"
    NO_PILOT = "the pilot's receiver is not heard"
    MISSION_NOT_LOW = "the mission switch must be low first"
    NOT_ARMED = "not armed"
    NO_OVERRIDE = "the autopilot does not take commands"
    SETTINGS = "settings"
    LINK = "no link to the flight controller"
    ATTITUDE = "the controller's attitude is unlike the odometry's"
    ACCELEROMETER = "the accelerometer is wrong"
    MOTION = "poses and sensors contradict each other"
    SENSING = "the sensing is not what the policy was trained with"
    OUTSIDE_FENCE = "outside the fence"
    WAITING = "ready: waiting for the mission switch"
    MISSION = "mission switch"
    REACHED = "height reached"
    STICK_INPUT = "stick input"
    POLICY = "policy"
    POLICY_DONE = "the policy's task is over"
    NOT_CLIMBING = "does not climb"
    CRASHED = "lies on its side or its back"
    DEADLINES = "missed deadlines"
    GUARD = "would leave the fence"
    LANDED = "landed"
    TOUCHED = "landed: the ground was felt"
    DISARMED = "disarmed"
    OVERRIDE_OFF = "the pilot took over"
    OVERRIDE_ON = "the pilot handed over"
    LOCKED = "the mission switch must leave its policy position first"


@dataclass(frozen=True)
class Pilot:
    """What the pilot's receiver reports."""

    mission: Mission
    roll: float = 0.0
    """Stick, -1 to 1, right positive."""
    pitch: float = 0.0
    """Stick, forward positive."""
    throttle: float = 0.0
    """Stick, up positive."""
    yaw: float = 0.0
    """Stick, right positive."""

    @property
    def deflection(self) -> float:
        """The deflection of the stick that is farthest from its centre."""
        return max(abs(self.roll), abs(self.pitch), abs(self.throttle), abs(self.yaw))


@dataclass(frozen=True)
class Inputs:
    """What is known at a control step."""

    odometry: Odometry | None = None
    """The newest odometry that passed the checks."""
    odometry_problem: str | None = None
    """Why there is no fresh and good odometry. None: there is."""
    link_problem: str | None = None
    """Why there is no working link to the flight controller. None: there is."""
    silent: bool = False
    """The controller sends nothing at all. It may hold the last command and receive nothing."""
    failsafe: bool = False
    """The controller flies its own failsafe, whatever it is sent."""
    armed: bool = False
    override: bool = False
    """The controller takes its stick inputs from this program."""
    pilot: Pilot | None = None
    """What the pilot wants. None: the receiver is not heard."""
    voltage: float | None = None
    """Voltage of a cell, V."""
    settings_problems: tuple[str, ...] = ()
    """How the controller's settings differ from what the flight needs."""
    attitude_error: float | None = None
    """Difference between the controller's and the odometry's roll and pitch, rad. None: the controller's attitude is
    not heard."""
    accelerometer_problem: str | None = None
    """Why the controller's accelerometer must not be used for flight. None: it may."""
    force: np.ndarray | None = None
    """(3,) newest specific force, body FLU, m/s^2. None: not known."""
    motion_problem: str | None = None
    """How the poses contradict the controller's sensors. None: they agree."""
    sensing_problem: str | None = None
    """How lags, age or holes of the poses differ from what the policy was trained with. None: they do not."""
    buried: bool = False
    """Without odometry: the estimated height is far under the ground."""
    stands: bool | None = None
    """What the accelerometer tells. True: something carries the vehicle. False: it flies. None: not known."""
    deaf: bool = False
    """The controller is heard, but its accelerometer cannot tell flight from standing."""
    heading_error: float | None = None
    """The odometry's heading minus the heading that the flight shows, rad. None: the flight shows none now."""
    policy_problem: str | None = None
    """Why the policy must not fly, or must stop: failed, late, non-finite, outside its envelope. None: it may fly."""
    policy_done: bool = False
    """The policy's task is over."""
    policy_lands: bool = False
    """The policy's task is to land, so the floor of the fence does not apply to it."""
    filtered: bool = False
    """A filter keeps the policy inside the fence. The guard then ends the policy's flight only outside the fence, not
    before."""
    placeless: bool = False
    """Nobody knows where the vehicle is, and the policy need not: its odometry drifts, and is good for a take-off, a
    short hover and the braking after the policy's flight."""
    missed_deadlines: int = 0
    """Number of late control steps within the last second."""

    @property
    def seen(self) -> Odometry | None:
        """The odometry, if it is fresh, good and finite. None: the flight is blind."""
        o = self.odometry
        if o is None or self.odometry_problem:
            return None
        finite = all(map(math.isfinite, (*o.position, *o.velocity, *o.quaternion, *o.body_rate)))
        return o if finite else None

    @property
    def blindness(self) -> str:
        """Why there is no usable odometry."""
        problem = self.odometry_problem or ("none came yet" if self.odometry is None else "not finite")
        return f"{Reason.NO_ODOMETRY}: {problem}"


@dataclass(frozen=True)
class Target:
    """The place that the hover controller has to hold."""

    position: tuple[float, float, float]
    """World, m."""
    yaw: float
    """rad."""
    climb: float = 0.0
    """Vertical speed with which the target moves, m/s."""


@dataclass(frozen=True)
class Flight:
    """The state of the machine."""

    mode: Mode = Mode.INIT
    since: float = 0.0
    """When the mode, or the flight without odometry within it, began, s. It is shifted when the clock jumps."""
    lost: tuple[float, float, float] | None = None
    """In a landing without odometry: when it was last good, s, and the height over home, m, and the climb, m/s, at that
    time."""
    found_since: float | None = None
    """In a landing without odometry: time since which it has been good again, s."""
    standing_since: float | None = None
    """In a hover or a landing: time since which the newest odometry, good or just lost, has stayed at one place ..."""
    stood_at: tuple[float, float, float] | None = None
    """... and this place; s and m."""
    now: float = 0.0
    """Time of the last step, s."""
    reasons: tuple[str, ...] = ()
    """Reasons for this mode. In INIT: why no take-off is possible yet."""
    target: Target | None = None
    """Target of the hover controller. None if it does not fly."""
    home: float = 0.0
    """Height at which the vehicle stood before take-off, m. At the start, this is the height of the ground."""
    blind: bool = False
    """The landing is without odometry."""
    rearm: bool = True
    """The mission switch must go to its low position before a take-off."""
    lock: bool = False
    """The mission switch must leave its policy position before the policy flies again."""
    still_since: float | None = None
    """In a landing: time since which the vehicle has been still, s."""
    fallen_since: float | None = None
    """Time since which the vehicle has been still and far from level, s."""
    nearest: float = math.inf
    """The smallest horizontal distance to the target so far, m. Infinite until the vehicle was slow there once."""
    turned: float | None = None
    """The error of the odometry's heading, because of which the odometry counts as lost, rad."""
    adrift: bool = False
    """Nobody knows where the vehicle is (`Inputs.placeless`)."""
    misled: str | None = None
    """Why the odometry is not that of this vehicle. It then counts as lost until the vehicle stands. None: it is."""


def to(
    flight: Flight, mode: Mode, *reasons: str, target: Target | None = None, blind: bool = False, **changes: bool
) -> Flight:
    """The flight in another mode, for these reasons, with the given target and fields."""
    return replace(flight, mode=mode, reasons=reasons, target=target, blind=blind, **changes)
