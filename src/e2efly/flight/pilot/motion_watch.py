"""Whether poses and inertial sensors show the same motion: odometry is compared with accelerometer and gyroscope.

Over half a second, the accelerometer, rotated with the flight controller's attitude, shows how the velocity changes.
The gyroscope shows how the attitude changes. Wrong odometry differs from both as soon as the vehicle moves, whether it
is carried by hand or climbs its first decimetres. Such odometry is mirrored, is in another frame, has a swapped or
conjugated quaternion, or has a velocity that is negated, zero or drifting. The delay of the poses is not known, so the
best match with the last moments counts. If poses and accelerometer differ vertically, and the throttle agrees with the
poses, the accelerometer is wrong.
"""

import cmath
import math
from dataclasses import dataclass, replace

import numpy as np

from e2efly.flight.attitude import Attitude, level
from e2efly.flight.pose.tracking import rotation_between
from e2efly.policy.odometry import Odometry, yaw_of
from e2efly.vehicles.gravity import GRAVITY

MEMORY_S = 0.5
"""Time over which changes are compared, s."""
LATEST_S = 0.16
"""The largest delay of poses that is considered, s."""
STEADY_S, LARGEST_STEADY = 4.0, 0.8
"""A part of the difference that lasts longer than the first value, s, is taken for a tilted sensor. The second value is
its bound, m/s^2."""
SPEED, SPEED_SHARE = 0.3, 0.6
"""Accepted difference of velocity in flight: m/s, plus a share of all that the accelerometer measured."""
TURN, TURN_SHARE = 0.35, 0.6
"""Accepted difference of attitude in flight: rad, plus a share of all that the gyroscope measured."""
TILT = 0.5
"""Accepted difference between the controller's tilt and the odometry's, rad."""
BY_HAND, BY_HAND_SHARE = 0.4, 1.2
"""Accepted difference of velocity, m/s, or of attitude, rad, while the vehicle is carried. It may then knock against
something, so only opposite motions are reported."""
CARRIED = 0.25
"""While the vehicle is carried, differences are reported only if the sensors have measured more than this, m/s or rad.
Poses that jump while nothing moves are another problem."""
ALIKE, MOVED = 0.4, 0.6
"""Poses and sensors agree if the difference is less than the first value, a share of the measured motion, and this
motion is more than the second, m/s."""
LASTING_S, BLAMED_S = 0.03, 0.15
"""Time after which a difference is reported, s, and time after which it is attributed to the accelerometer, s."""
TELLING, BETTER = 0.4, 0.2
"""The delay of the poses can be measured while the measured velocity changes by more than the first value within
`LATEST_S`, m/s. The poses are too late if a larger delay than the accepted one fits better by the second value, m/s."""
LONGEST_STEP = 0.1
"""The longest time between two measurements, s. After a longer pause the comparison starts again."""


@dataclass(frozen=True)
class Felt:
    """What the inertial sensors measured up to a moment. Older parts fade with `MEMORY_S`."""

    time: float
    """Time, s."""
    speed: np.ndarray
    """(3,) change of velocity, world, with the heading of the poses, m/s."""
    lift: float
    """Change of the vertical velocity according to the throttle, m/s."""
    turn: np.ndarray
    """(3,) angle turned, body FLU, rad."""
    up: np.ndarray
    """(3,) the upward direction according to the controller's attitude at this moment, body FLU."""


@dataclass(frozen=True)
class Differs:
    """The differences between poses and sensors."""

    speed: np.ndarray
    """(3,) change of velocity, world, m/s."""
    lift: float = 0.0
    """Change of the vertical velocity, poses minus throttle, m/s."""
    turn: float = 0.0
    """Change of the attitude, rad."""
    tilt: float = 0.0
    """Angle between the two upward directions, rad."""


NOTHING = Differs(np.zeros(3))


@dataclass(frozen=True)
class MotionWatch:
    """The comparison so far. `MotionWatch()` before the first measurement."""

    felt: tuple[Felt, ...] = ()
    """What was measured within the last `LATEST_S`."""
    effort: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """The sum of all measured motion in any direction, fading: horizontal and vertical, m/s, and rotation, rad."""
    doubt: float = 0.0
    """The possible error of `Felt.lift`, fading, m/s."""
    pose: tuple[float, np.ndarray, np.ndarray] | None = None
    """Time, s, velocity (3,), m/s, and quaternion (4,) of the newest odometry."""
    speed: np.ndarray | None = None
    """(3,) change of velocity according to the odometry, fading, world, m/s."""
    turn: np.ndarray | None = None
    """(3,) angle turned according to the odometry, fading, body FLU, rad."""
    steady: np.ndarray | None = None
    """(3,) lasting part of the difference, world, m/s^2."""
    differs: Differs = NOTHING
    """The present differences."""
    lasting: float = 0.0
    """How long the differences have been too large, s."""
    late: float = 0.0
    """How late the poses were when this could last be measured, s, at most `LATEST_S`."""
    late_for: float = 0.0
    """How long the poses have been later than accepted, s. Only time in which this could be measured counts."""

    @property
    def problem(self) -> str | None:
        """How the poses contradict the sensors in flight, or how late they are. None: neither."""
        if self.late_for >= LASTING_S and not self._accelerometer:
            return f"poses are {self.late:.2f} s late or more, and the controller's gains are for less (--latency)"
        return self._text if self.lasting >= LASTING_S and not self._accelerometer else None

    @property
    def accelerometer_problem(self) -> str | None:
        """How the accelerometer contradicts poses and throttle, which agree. None: it does not."""
        if self.lasting < BLAMED_S or not self._accelerometer:
            return None
        return f"it contradicts poses and throttle, which agree, by {abs(float(self.differs.speed[2])):.1f} m/s"

    @property
    def opposed(self) -> str | None:
        """How the poses contradict the sensors while the vehicle is carried. None: they do not."""
        x, y, z = (float(d) for d in self.differs.speed)
        off = (math.hypot(x, y), abs(z), self.differs.turn)
        apart = any(
            d > BY_HAND + BY_HAND_SHARE * effort and effort > CARRIED
            for d, effort in zip(off, self.effort, strict=True)
        )
        return self._text if apart else None

    @property
    def agrees(self) -> bool:
        """Whether the vehicle was moved, and poses and sensors agreed."""
        return self.moved > MOVED and float(np.linalg.norm(self.differs.speed)) < ALIKE * self.moved

    @property
    def moved(self) -> float:
        """The sum of all measured changes of velocity, fading, m/s."""
        return math.hypot(*self.effort[:2])

    @property
    def _accelerometer(self) -> bool:
        """Whether the accelerometer causes the difference: the throttle agrees with the poses, and only the vertical
        velocity differs.
        """
        x, y, z = (abs(float(v)) for v in self.differs.speed)
        return math.hypot(x, y) < z / 2 and abs(self.differs.lift) + self.doubt < z / 2 and not self._turned

    @property
    def _turned(self) -> bool:
        return self.differs.turn > TURN + TURN_SHARE * self.effort[2] or self.differs.tilt > TILT

    @property
    def _text(self) -> str:
        if self._turned:
            angle = math.degrees(max(self.differs.turn, self.differs.tilt))
            return f"they turn otherwise than the gyroscope feels, by {angle:.0f} deg"
        return (
            f"they move otherwise than the accelerometer feels, by {float(np.linalg.norm(self.differs.speed)):.1f} m/s"
        )


def feel(
    before: MotionWatch,
    attitude: Attitude,
    force: np.ndarray,
    gyro: np.ndarray,
    thrust: tuple[float, float],
    now: float,
) -> MotionWatch:
    """Process a measurement of the inertial sensors. Only roll and pitch of the controller's attitude are used. `force`
    is (3,) specific force, body FLU, m/s^2, and `gyro` (3,) body rate, FLU, rad/s. `thrust` is the specific force
    according to the throttle, and its possible error, m/s^2. `now` is in s.
    """
    up = _up(attitude)
    last = before.felt[-1] if before.felt else None
    if last is None or before.pose is None or not 0 <= now - last.time <= LONGEST_STEP:
        begin = MotionWatch(steady=before.steady, pose=before.pose)
        return replace(begin, felt=(Felt(now, np.zeros(3), 0.0, np.zeros(3), up),))
    dt = now - last.time
    kept = math.exp(-dt / MEMORY_S)
    steady = np.zeros(3) if before.steady is None else before.steady
    forward, left, above = level(attitude, force)
    flat = complex(forward, left) * cmath.exp(1j * yaw_of(before.pose[2]))
    acceleration = np.array([flat.real, flat.imag, above - GRAVITY]) + steady
    lift = kept * last.lift + (thrust[0] * float(up[2]) - GRAVITY) * dt
    newest = Felt(now, kept * last.speed + acceleration * dt, lift, kept * last.turn + gyro * dt, up)
    x, y, z = (float(a) for a in acceleration)
    along, lifted, turned = (kept * effort for effort in before.effort)
    effort = (along + math.hypot(x, y) * dt, lifted + abs(z) * dt, turned + float(np.linalg.norm(gyro)) * dt)
    recent = tuple(felt for felt in before.felt if felt.time > now - LATEST_S)
    return replace(before, felt=(*recent, newest), effort=effort, doubt=kept * before.doubt + thrust[1] * dt)


def see(before: MotionWatch, odometry: Odometry, latest: float = math.inf) -> MotionWatch:
    """Compare the sensors with another odometry that passed the checks. `latest` is the largest accepted delay of
    poses, from the motion to their arrival, s.
    """
    velocity, quaternion = odometry.velocity, odometry.quaternion
    pose = (odometry.time, velocity, quaternion)
    begin = replace(before, pose=pose, speed=np.zeros(3), turn=np.zeros(3), differs=NOTHING, lasting=0.0)
    if before.pose is None or before.speed is None or before.turn is None:
        return begin
    time, last_velocity, last_quaternion = before.pose
    dt = odometry.time - time
    if not (0 <= dt <= LONGEST_STEP and before.felt and odometry.time - before.felt[-1].time <= LONGEST_STEP):
        return begin
    kept = math.exp(-dt / MEMORY_S)
    speed = kept * before.speed + (velocity - last_velocity)
    turn = kept * before.turn + rotation_between(last_quaternion, quaternion)
    off = [float(np.linalg.norm(speed - felt.speed)) for felt in before.felt]
    like, newest = before.felt[off.index(min(off))], before.felt[-1]
    late, late_for = before.late, before.late_for
    if float(np.linalg.norm(newest.speed - before.felt[0].speed)) > TELLING:
        late = newest.time - like.time
        in_time = [d for d, felt in zip(off, before.felt, strict=True) if newest.time - felt.time <= latest]
        explained = min(in_time) - min(off) > BETTER and min(off) < min(in_time) / 2
        late_for = late_for + dt if explained else 0.0
    differs = Differs(
        speed - like.speed,
        min((float(speed[2]) - felt.lift for felt in before.felt), key=abs),
        min(float(np.linalg.norm(turn - felt.turn)) for felt in before.felt),
        min(_angle(felt.up, quaternion) for felt in before.felt),
    )
    steady = np.zeros(3) if before.steady is None else before.steady
    steady = np.clip(steady + dt / STEADY_S * differs.speed / MEMORY_S, -LARGEST_STEADY, LARGEST_STEADY)
    after = replace(
        before, pose=pose, speed=speed, turn=turn, steady=steady, differs=differs, late=late, late_for=late_for
    )
    large = after._turned or float(np.linalg.norm(differs.speed)) > SPEED + SPEED_SHARE * before.moved
    return replace(after, lasting=before.lasting + dt if large else 0.0)


def _up(attitude: Attitude) -> np.ndarray:
    """(3,) the upward direction of the world in body FLU, for R = Rz(yaw) Ry(pitch) Rx(roll)."""
    cr, sr = math.cos(attitude.roll), math.sin(attitude.roll)
    cp, sp = math.cos(attitude.pitch), math.sin(attitude.pitch)
    return np.array([-sp, cp * sr, cp * cr])


def _angle(up: np.ndarray, quaternion: np.ndarray) -> float:
    """The angle between an upward direction and that of a quaternion, both body FLU, rad."""
    w, x, y, z = (float(q) for q in quaternion)
    seen = (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y))
    cosine = sum(float(a) * b for a, b in zip(up, seen, strict=True))
    return math.acos(max(-1.0, min(1.0, cosine)))
