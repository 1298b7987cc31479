"""What the state machine knows, remembers and says: its inputs, its state, its reasons."""

import math
from dataclasses import dataclass, replace
from enum import StrEnum

from e2efly.deploy.odometry import Odometry


class Mode(StrEnum):
    """Who flies."""

    INIT = "init"
    """On the ground; the throttle is closed."""
    TAKEOFF = "takeoff"
    """The hover controller, its target rising."""
    HOVER = "hover"
    """The hover controller; the pilot's sticks move its target."""
    POLICY = "policy"
    """The policy."""
    LAND = "land"
    """The hover controller, its target sinking; without odometry: level and a gentle descent."""
    PILOT = "pilot"
    """The pilot, by the override switch."""
    DONE = "done"
    """Landed, throttle closed, until disarmed."""


AIRBORNE = (Mode.TAKEOFF, Mode.HOVER, Mode.POLICY, Mode.LAND)
"""Modes in which the bridge flies the vehicle."""
GROUNDED = (Mode.INIT, Mode.DONE)
"""Modes in which the throttle is closed."""


class Mission(StrEnum):
    """The pilot's three-position switch."""

    LAND = "land"
    """Stay on the ground, or land."""
    HOVER = "hover"
    """Take off and hover."""
    POLICY = "policy"
    """Let the policy fly."""


class Reason(StrEnum):
    """Every reason there is; some are followed by a colon and numbers."""

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
    NO_OVERRIDE = "MSP override is off"
    SETTINGS = "settings"
    LINK = "no link to the flight controller"
    ATTITUDE = "the controller's attitude is unlike the odometry's"
    ACCELEROMETER = "the accelerometer is wrong"
    MOTION = "poses and sensors contradict each other"
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
    """What the pilot's receiver says."""

    mission: Mission
    roll: float = 0.0
    """Stick, -1 to 1, right positive."""
    pitch: float = 0.0
    """Forward positive."""
    throttle: float = 0.0
    """Up positive."""
    yaw: float = 0.0
    """Right positive."""

    @property
    def deflection(self) -> float:
        """The stick that is farthest from its centre."""
        return max(abs(self.roll), abs(self.pitch), abs(self.throttle), abs(self.yaw))


@dataclass(frozen=True)
class Inputs:
    """What is known at a control step."""

    odometry: Odometry | None = None
    """The newest that passed the checks."""
    odometry_problem: str | None = None
    """Why there is none that is fresh and good."""
    link_problem: str | None = None
    """Why the flight controller is not heard."""
    silent: bool = False
    """It says nothing at all: it may hold the last command, and hear nothing."""
    armed: bool = False
    override: bool = False
    """The controller takes its sticks from here."""
    pilot: Pilot | None = None
    """None: the receiver is not heard."""
    voltage: float | None = None
    """Of a cell, V."""
    settings_problems: tuple[str, ...] = ()
    """How the controller's settings are unlike what the policy needs."""
    attitude_error: float | None = None
    """Between the controller's roll and pitch and the odometry's, rad; None: the controller's are not heard."""
    accelerometer_problem: str | None = None
    """Why the controller's accelerometer cannot be flown by."""
    motion_problem: str | None = None
    """How the poses contradict what the controller's sensors feel."""
    buried: bool = False
    """Without odometry: what is reckoned is far under the ground, and no sensor can feel whether it stands."""
    touched: bool = False
    """In a landing without odometry the ground was felt."""
    supported: bool = False
    """Something carries the vehicle: it feels more force than its rotors give."""
    heading_error: float | None = None
    """The odometry's heading minus the one that the flight shows, rad; None: it shows none now."""
    policy_problem: str | None = None
    """Why the policy must not fly, or must stop: failed, late, non-finite, outside its envelope."""
    policy_done: bool = False
    """Its task is over."""
    policy_lands: bool = False
    """Its task is to land: the floor of the fence is open to it."""
    filtered: bool = False
    """A filter keeps the policy inside the fence: the guard ends its flight outside alone, not before."""
    missed_deadlines: int = 0
    """Late control steps within the last second."""

    @property
    def seen(self) -> Odometry | None:
        """The odometry, where it is fresh, good and finite; None: the flight is blind."""
        o = self.odometry
        if o is None or self.odometry_problem:
            return None
        finite = all(map(math.isfinite, (*o.position, *o.velocity, *o.quaternion, *o.body_rate)))
        return o if finite else None

    @property
    def blindness(self) -> str:
        """Why nothing is seen."""
        problem = self.odometry_problem or ("none came yet" if self.odometry is None else "not finite")
        return f"{Reason.NO_ODOMETRY}: {problem}"


@dataclass(frozen=True)
class Target:
    """Where the hover controller is to hold."""

    position: tuple[float, float, float]
    """World, m."""
    yaw: float
    """rad."""
    climb: float = 0.0
    """Vertical speed with which it moves, m/s."""


@dataclass(frozen=True)
class Flight:
    """The state of the machine."""

    mode: Mode = Mode.INIT
    since: float = 0.0
    """When the mode began, or in it the flight without odometry, s; moved along when the clock jumps."""
    lost: tuple[float, float, float] | None = None
    """Landing without odometry: when it was good last, s, and the height over home, m, and climb, m/s, of that time."""
    found_since: float | None = None
    """Landing without odometry: since when it has been good again, s."""
    standing_since: float | None = None
    """Landing: since when the newest odometry, good or just lost, has stayed at one place, s ..."""
    stood_at: tuple[float, float, float] | None = None
    """... which is this, m."""
    now: float = 0.0
    """Of the last step, s."""
    reasons: tuple[str, ...] = ()
    """Why this mode; in INIT: why no take-off yet."""
    target: Target | None = None
    """The hover controller's; None where it does not fly."""
    home: float = 0.0
    """Height at which it stood before take-off, m; start with that of the ground."""
    blind: bool = False
    """Landing without odometry."""
    rearm: bool = True
    """The mission switch must go to its low position before a take-off."""
    lock: bool = False
    """The mission switch must leave its policy position before the policy flies again."""
    still_since: float | None = None
    """Since when it has been still while landing, s."""
    fallen_since: float | None = None
    """Since when it has been still and far from level, s."""
    nearest: float = math.inf
    """How near the vehicle has come to the target, horizontally, m; infinite until it was slow there once."""
    turned: float | None = None
    """The error of the odometry's heading for which it counts as lost, rad."""
    misled: str | None = None
    """Why the odometry is not the vehicle's own: until it stands, it counts as lost; None: it is."""


def to(
    flight: Flight, mode: Mode, *reasons: str, target: Target | None = None, blind: bool = False, **changes: bool
) -> Flight:
    """The flight in another mode, for these reasons, with the target and the fields that are given."""
    return replace(flight, mode=mode, reasons=reasons, target=target, blind=blind, **changes)
