"""Flight without odometry: the last known velocity, propagated with the accelerometer and with the throttle.

Neither is accurate for long. After five seconds, an accelerometer with an error of 1 % of gravity gives a velocity
error of half a metre per second, and a throttle map is no better. But the map was learned while poses were good, and
its possible error is known. So the vertical speed is that of the accelerometer, but it is limited to the range around
the throttle's vertical speed that the error of the map allows. With a broken or badly calibrated accelerometer, the
vehicle then sinks a little slower or faster, but never climbs.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from e2efly.control import Ctbr, Vec3
from e2efly.flight.attitude import Attitude, level, turned
from e2efly.flight.pilot.hover import LEVEL_GAIN, LEVEL_RATE, SINK_ACCELERATION, SINK_FASTER, SINK_SPEED
from e2efly.policy.odometry import Odometry, yaw_of
from e2efly.vehicles.gravity import GRAVITY

LONGEST_STEP = 2.5
"""The longest step, s: a bridge that was stopped goes on with what the controller has held meanwhile. After a longer
pause the velocity is not known any more."""
BRAKE_GAIN, BRAKE_ACCELERATION = 1.5, 3.0
"""Deceleration divided by horizontal speed, 1/s, and the largest deceleration, m/s^2."""
BRAKE_S = 2.0
"""How long horizontal motion is braked, s. After this time the estimate of the horizontal velocity is too old, and the
vehicle is held level."""
SINK_GAIN = 3.0
"""Acceleration divided by the error of the vertical speed, 1/s."""
FASTEST_SINK, LOW_SINK, LOW = 2.0, 1.3, 3.0
"""The sink speed grows up to the first value, m/s. Below the height of the last value, m, it grows only up to the
second, m/s."""
SLOWER = 0.3
"""How much faster than `climb` the height may be assumed to rise, m/s."""
DOUBT = 0.05
"""Possible error of the vertical speed from the poses, m/s."""
ANCHOR_S, ANCHORS = 0.2, 6
"""Time between two poses from which the velocity is propagated, s, and the number of these poses. When poses are found
to be wrong, the latest ones may already have been wrong for a while, and a single pose is noisy."""
TRIM_GAIN, TRIM_ERROR, LARGEST_TRIM = 3.0, 0.6, 4.0
"""TRIM_GAIN: rate of change of the trim divided by the error of the vertical speed, 1/s^2. TRIM_ERROR: the largest
error that counts, m/s, because a motion that is just being stopped is not an error of the map. LARGEST_TRIM: the bound
of the trim, m/s^2, for a map that is wrong by 30 %."""


@dataclass(frozen=True)
class Reckoning:
    """The velocity without odometry."""

    velocity: tuple[float, float, float]
    """Forward, left and up along the heading, from the accelerometer, m/s."""
    lifted: float
    """Vertical speed from the throttle, m/s."""
    doubt: float
    """Possible error of `lifted`, m/s."""
    time: float
    """Time up to which it is propagated, s."""
    begun: float
    """When the odometry was last seen, s."""
    since: float
    """The same, but it moves on while the controller is not heard, s."""
    height: float
    """The largest plausible height, propagated from the last odometry, world, m."""
    attitude: Attitude | None = None
    """The attitude up to which it is propagated. None: not known; a level attitude is assumed."""

    @property
    def climb(self) -> float:
        """Vertical speed, m/s: that of the accelerometer, limited to a range around that of the throttle.

        It may be lower than the throttle's by the whole `doubt`, but higher only by half of it, because an estimate
        that is too high makes the vehicle sink faster.
        """
        return max(self.lifted - self.doubt, min(self.lifted + self.doubt / 2, self.velocity[2]))


@dataclass(frozen=True)
class Reckonings:
    """The velocity, propagated from several poses. `Reckonings()` before the first pose."""

    newest: Reckoning | None = None
    """Propagated from the newest pose."""
    anchors: tuple[Reckoning, ...] = ()
    """Propagated from older poses, oldest first."""
    grounded: Reckoning | None = None
    """In a take-off: propagated from the ground, where the velocity is zero, however the poses are scaled."""

    def seen(self, newest: Reckoning) -> "Reckonings":
        """These reckonings with another pose."""
        if self.anchors and newest.begun - self.anchors[-1].begun < ANCHOR_S:
            return replace(self, newest=newest)
        return Reckonings(newest, (*self.anchors[-ANCHORS + 1 :], newest), self.grounded)

    def from_ground(self) -> "Reckonings":
        """Begin a take-off: nothing moves yet."""
        grounded = self.newest and replace(self.newest, velocity=(0.0, 0.0, 0.0), lifted=0.0)
        return Reckonings(self.newest, grounded=grounded)

    def on(self, step: Callable[[Reckoning], Reckoning | None]) -> "Reckonings":
        """All reckonings after a step. Those that cannot be propagated are left out."""
        anchors = tuple(after for anchor in self.anchors if (after := step(anchor)) is not None)
        newest, grounded = (None if r is None else step(r) for r in (self.newest, self.grounded))
        return Reckonings(newest, anchors, grounded)

    def alone(self, *, wrong: bool, height: float | None = None) -> "Reckonings":
        """Start a flight without poses, from the median of all reckonings. If the poses were `wrong`, perhaps for a
        while, only the older half is used, or in a take-off what was propagated from the ground. If their height says
        nothing, `height` is the largest plausible one, world, m.
        """
        if wrong and self.grounded is not None:
            return Reckonings(self.grounded)
        every = (*self.anchors, *([self.newest] if self.newest else []))
        if not every:
            return self
        believed = every[: (len(every) + 1) // 2] if wrong else every
        ahead, left, up, lifted, seen = (
            float(np.median(values))
            for values in zip(*((*r.velocity, r.lifted, r.height) for r in believed), strict=True)
        )  # fmt: skip
        begun = replace(every[-1], velocity=(ahead, left, up), lifted=lifted, doubt=DOUBT)
        begun = replace(begun, height=seen if height is None else height)
        return Reckonings(begun)


def seen(odometry: Odometry, now: float, error: float = 0.0) -> Reckoning:
    """The reckoning that begins with an odometry at `now`, s. `error` is that of its heading, rad."""
    x, y, z = (float(v) for v in odometry.velocity)
    yaw = yaw_of(odometry.quaternion) - error
    c, s = math.cos(yaw), math.sin(yaw)
    height = float(odometry.position[2])
    return Reckoning((c * x + s * y, c * y - s * x, z), z, DOUBT, now, now, now, height)


def reckon(
    before: Reckoning,
    attitude: Attitude | None,
    force: tuple[float, ...] | None,
    thrust: tuple[float, float] | None,
    rate: tuple[float, float, float],
    now: float,
) -> Reckoning | None:
    """Propagate the velocity by one control step.

    Args:
        before: the reckoning so far.
        attitude: the flight controller's attitude. None: not known; the last one turns on with `rate`.
        force: specific force from its accelerometer, body FLU, m/s^2. None: not known; the thrust is used instead.
        thrust: specific force according to the throttle, and its possible error, m/s^2. None: not known; the force is
            used instead.
        rate: the commanded body rate, FLU, rad/s.
        now: s.

    Returns:
        The reckoning now. None: it is not known, because force and thrust are both missing or the pause was too long.
    """
    dt = now - before.time
    if not 0 <= dt <= LONGEST_STEP or (force is None and thrust is None):
        return None
    since = before.since if attitude is not None or force is not None else before.since + dt
    attitude = attitude or turned(before.attitude or Attitude(0.0, 0.0, 0.0), rate, dt)
    upright = math.cos(attitude.roll) * math.cos(attitude.pitch)
    ahead, aside, above = level(attitude, force or (0.0, 0.0, thrust[0] if thrust else GRAVITY))
    lift, doubt = (above, 0.0) if thrust is None else (thrust[0] * upright, thrust[1])
    forward, left, up = before.velocity
    if before.attitude is not None:
        about = attitude.yaw - before.attitude.yaw
        c, s = math.cos(about), math.sin(about)
        forward, left = c * forward + s * left, c * left - s * forward
    after = replace(
        before, velocity=(forward + ahead * dt, left + aside * dt, up + (above - GRAVITY) * dt),
        lifted=before.lifted + (lift - GRAVITY) * dt, doubt=before.doubt + doubt * dt,
        time=now, since=since, attitude=attitude,
    )  # fmt: skip
    height = before.height + min(after.lifted + after.doubt, after.climb + SLOWER) * dt
    return replace(after, height=height)


def trimmed(trim: float, reckoned: Reckoning, ground: float, dt: float) -> float:
    """The trim that compensates for a wrong throttle map, m/s^2, after another `dt` s. `reckoned` is the velocity now,
    and `ground` the height of the ground, world, m.
    """
    behind = max(-TRIM_ERROR, min(TRIM_ERROR, _climb(reckoned, ground) - reckoned.climb))
    return max(-LARGEST_TRIM, min(LARGEST_TRIM, trim + TRIM_GAIN * behind * dt))


def settle(attitude: Attitude | None, reckoned: Reckoning, ground: float, trim: float = 0.0) -> Ctbr:
    """Stop the horizontal motion, level the vehicle, and sink. Without an attitude, the body rates are zero. `reckoned`
    is the velocity now, and `ground` the height of the ground, world, m. `trim` is added to the thrust, m/s^2; see
    `trimmed`.
    """
    elapsed = reckoned.time - reckoned.since
    wanted = SINK_GAIN * (_climb(reckoned, ground) - reckoned.climb)
    thrust = GRAVITY + trim + max(-SINK_ACCELERATION, min(SINK_ACCELERATION, wanted))
    if attitude is None:
        return Ctbr(thrust, Vec3(0.0, 0.0, 0.0))
    forward, left, _ = reckoned.velocity
    speed = math.hypot(forward, left)
    share = min(BRAKE_GAIN, BRAKE_ACCELERATION / speed) if speed > 0 and elapsed < BRAKE_S else 0.0
    roll, pitch = math.atan(share * left / GRAVITY), -math.atan(share * forward / GRAVITY)
    tilt = max(math.cos(attitude.roll) * math.cos(attitude.pitch), 0.5)
    return Ctbr(thrust / tilt, Vec3(_turn(roll - attitude.roll), _turn(pitch - attitude.pitch), 0.0))


def _climb(reckoned: Reckoning, ground: float) -> float:
    fastest = LOW_SINK if reckoned.height - ground < LOW else FASTEST_SINK
    return max(-SINK_SPEED - SINK_FASTER * (reckoned.time - reckoned.since), -fastest)


def _turn(angle: float) -> float:
    return max(-LEVEL_RATE, min(LEVEL_RATE, LEVEL_GAIN * angle))
