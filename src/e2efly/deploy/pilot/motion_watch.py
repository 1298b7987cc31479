"""Whether poses and inertial sensors tell of one motion: the odometry's against accelerometer and gyroscope.

Over half a second the accelerometer, turned by the flight controller's attitude, says how the velocity changes, and the
gyroscope how the attitude does. Odometry that is mirrored, has another frame, a swapped or conjugated quaternion, or a
velocity that is negated, zero or drifts says something else, as soon as the vehicle moves: carried by hand, or within
the first decimetres of a climb. How late the poses are is not known, so that the best match of the last moments counts.
Where they differ in height, and the throttle says what the poses say, it is the accelerometer that is wrong.
"""

import cmath
import math
from dataclasses import dataclass, replace

import numpy as np

from e2efly.deploy.attitude import Attitude
from e2efly.deploy.odometry import Odometry, yaw_of
from e2efly.deploy.pilot.accelerometer import level
from e2efly.deploy.pose.tracking import rotation_between
from e2efly.vehicles.vehicle import GRAVITY

MEMORY_S = 0.5
"""Time over which changes are compared, s."""
LATEST_S = 0.16
"""The largest delay of poses that is considered, s."""
STEADY_S, LARGEST_STEADY = 4.0, 0.8
"""What of the difference stays for longer is a tilted sensor, s; its bound, m/s^2."""
SPEED, SPEED_SHARE = 0.3, 0.6
"""Difference of velocity that is accepted in flight: m/s, and share of all that the accelerometer felt."""
TURN, TURN_SHARE = 0.35, 0.6
"""The same of the attitude: rad, and share of all that the gyroscope felt."""
TILT = 0.5
"""Accepted between the controller's tilt and the odometry's, rad."""
BY_HAND, BY_HAND_SHARE = 0.4, 1.2
"""The same of both while the vehicle is carried, where it may knock against something: only what is opposed is told."""
CARRIED = 0.25
"""What the sensors must have felt for that, m/s or rad: poses that jump while nothing moves are another matter."""
ALIKE, MOVED = 0.4, 0.6
"""Carried so far, m/s, with a difference of less than this share of it, poses and sensors agree."""
LASTING_S, BLAMED_S = 0.03, 0.15
"""A difference is believed after so long, s; the accelerometer is blamed for it after so long, s."""
TELLING, BETTER = 0.4, 0.2
"""How late poses are can be told while the felt velocity changes by so much within `LATEST_S`, m/s; too late they are
where that explains them better by so much, m/s."""
LONGEST_STEP = 0.1
"""Between two measurements; after a longer pause the comparison begins anew, s."""


@dataclass(frozen=True)
class Felt:
    """What the inertial sensors felt up to a moment, fading with `MEMORY_S`."""

    time: float
    """Time, s."""
    speed: np.ndarray
    """(3,) change of velocity, world, by the heading of the poses, m/s."""
    lift: float
    """Change of the vertical velocity by the throttle, m/s."""
    turn: np.ndarray
    """(3,) angle turned, body FLU, rad."""
    up: np.ndarray
    """(3,) where up is by the controller's attitude at this moment, body FLU."""


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
    """Tilt, rad."""


NOTHING = Differs(np.zeros(3))


@dataclass(frozen=True)
class MotionWatch:
    """What was compared so far. `MotionWatch()` before the first measurement."""

    felt: tuple[Felt, ...] = ()
    """What was felt within the last `LATEST_S`."""
    effort: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """All that was felt, whatever its direction, fading: along the ground and up, m/s, and turned, rad."""
    doubt: float = 0.0
    """How far `Felt.lift` may be off, fading, m/s."""
    pose: tuple[float, np.ndarray, np.ndarray] | None = None
    """Time, s, velocity (3,), m/s, and quaternion (4,) of the newest odometry."""
    speed: np.ndarray | None = None
    """(3,) change of velocity that the odometry told, fading, world, m/s."""
    turn: np.ndarray | None = None
    """(3,) angle turned that the odometry told, fading, body FLU, rad."""
    steady: np.ndarray | None = None
    """(3,) lasting part of the difference, world, m/s^2."""
    differs: Differs = NOTHING
    """The present differences."""
    lasting: float = 0.0
    """How long they have differed by too much, s."""
    late: float = 0.0
    """How late the poses were when that could be told last, s; at most `LATEST_S`."""
    late_for: float = 0.0
    """For how long they have been later than is accepted, of the time in which it could be told, s."""

    @property
    def problem(self) -> str | None:
        """How the poses contradict the sensors in flight. None: they do not."""
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
        """All change of velocity that was felt, fading, m/s."""
        return math.hypot(*self.effort[:2])

    @property
    def _accelerometer(self) -> bool:
        """Whether the throttle agrees with the poses."""
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
    """Take in a measurement of the inertial sensors.

    Args:
        before: the watch so far.
        attitude: the flight controller's; roll and pitch count.
        force: (3,) specific force, body FLU, m/s^2.
        gyro: (3,) body rate, FLU, rad/s.
        thrust: specific force by the throttle, and how far that may be off, m/s^2.
        now: s.
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
    """Compare with another odometry that passed the checks.

    Args:
        before: the watch so far.
        odometry: the newest.
        latest: so late poses may be, from the motion to their arrival, s.
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
    """(3,) world up, body FLU, of R = Rz(yaw) Ry(pitch) Rx(roll)."""
    cr, sr = math.cos(attitude.roll), math.sin(attitude.roll)
    cp, sp = math.cos(attitude.pitch), math.sin(attitude.pitch)
    return np.array([-sp, cp * sr, cp * cr])


def _angle(up: np.ndarray, quaternion: np.ndarray) -> float:
    """The angle between up and the up of a quaternion, both body FLU, rad."""
    w, x, y, z = (float(q) for q in quaternion)
    seen = (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y))
    cosine = sum(float(a) * b for a, b in zip(up, seen, strict=True))
    return math.acos(max(-1.0, min(1.0, cosine)))
