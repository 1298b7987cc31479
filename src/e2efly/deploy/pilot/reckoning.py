"""Flight without odometry: the last known velocity, propagated with the accelerometer and with the throttle.

Neither is good for long: an accelerometer that is wrong by 1 % of gravity is off by half a metre a second after five,
and so is a throttle map. But the map was learned while poses were good, and knows how well. The vertical speed is the
accelerometer's, no farther from the throttle's than the map may be wrong: an accelerometer that is calibrated badly, or
broken, then makes the vehicle sink a little slower or faster, and never climb.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from e2efly.control import Ctbr, Vec3
from e2efly.deploy.attitude import Attitude
from e2efly.deploy.odometry import Odometry, yaw_of
from e2efly.deploy.pilot.accelerometer import level
from e2efly.deploy.pilot.hover import LEVEL_GAIN, LEVEL_RATE, SINK_ACCELERATION, SINK_FASTER, SINK_SPEED
from e2efly.vehicles.vehicle import GRAVITY

LONGEST_STEP = 0.1
"""Between two measurements; after a longer pause the velocity is not known any more, s."""
BRAKE_GAIN, BRAKE_ACCELERATION = 1.5, 3.0
"""Deceleration over horizontal speed, 1/s, and the largest, m/s^2."""
BRAKE_S = 2.0
"""Horizontal motion is braked for so long, s: then its reckoning is too old, and the vehicle is held level."""
SINK_GAIN = 3.0
"""Acceleration divided by the error of the vertical speed, 1/s."""
FASTEST_SINK, LOW_SINK, LOW = 2.0, 1.3, 3.0
"""The speed of sinking grows up to the first, m/s, and below the height in the last, m, up to the second."""
SAG, SMOOTH_S, SAG_RATE, SAG_S = 0.02, 0.1, 0.05, 0.3
"""The thrust follows the force that is felt, as a battery sags: while they are no farther apart than this share,
smoothed over so long, s; by so much in a second, within so long, s. What is farther off at once is no battery: it is
the accelerometer."""
SLOWER = 0.3
"""The height is reckoned with a speed that is so much higher, m/s, at most."""
DOUBT = 0.05
"""Error of the vertical speed from the poses, m/s."""
ANCHOR_S, ANCHORS = 0.2, 6
"""Between two poses from which the velocity is reckoned on, s, and how many there are: those of the last moments may
have been wrong already when that is found out, and one alone is noisy."""
TRIM_GAIN, TRIM_ERROR, LARGEST_TRIM = 3.0, 0.6, 4.0
"""Growth of the trim over the error of the vertical speed, 1/s^2; the largest error that counts, m/s, as a motion that
is being ended is none of the map's; and its bound, m/s^2: a map that is wrong by 30 %."""


@dataclass(frozen=True)
class Reckoning:
    """The velocity without odometry."""

    velocity: tuple[float, float, float]
    """Forward, left and up along the heading, by the accelerometer, m/s."""
    lifted: float
    """Vertical speed from the throttle, m/s."""
    doubt: float
    """Possible error of that speed, m/s."""
    share: float
    """Of the throttle's thrust that comes, as a battery sags."""
    time: float
    """Time up to which it is propagated, s."""
    since: float
    """When the odometry was last seen, s."""
    height: float
    """Reckoned from the odometry's last, world, m: the largest that is plausible."""
    unlike: float | None = None
    """By how much more of the thrust is felt than `share`, smoothed; None: nothing was felt yet."""

    @property
    def climb(self) -> float:
        """Vertical speed, m/s: the accelerometer's, as far as the throttle's allows; to sink faster, half as far."""
        return max(self.lifted - self.doubt, min(self.lifted + self.doubt / 2, self.velocity[2]))


@dataclass(frozen=True)
class Reckonings:
    """The velocity, reckoned on from several poses. `Reckonings()` before the first."""

    newest: Reckoning | None = None
    """Propagated from the newest pose."""
    anchors: tuple[Reckoning, ...] = ()
    """Propagated from older poses, oldest first."""

    def seen(self, newest: Reckoning) -> "Reckonings":
        """With another pose."""
        if self.anchors and newest.since - self.anchors[-1].since < ANCHOR_S:
            return replace(self, newest=newest)
        return Reckonings(newest, (*self.anchors[-ANCHORS + 1 :], newest))

    def on(self, step: Callable[[Reckoning], Reckoning | None]) -> "Reckonings":
        """All of them carried on; those that cannot be are left out."""
        anchors = tuple(after for anchor in self.anchors if (after := step(anchor)) is not None)
        return Reckonings(None if self.newest is None else step(self.newest), anchors)

    def alone(self, share: float, *, wrong: bool) -> "Reckonings":
        """From here on without poses: the median of all.

        Args:
            share: of the throttle's thrust that comes.
            wrong: the poses were wrong, perhaps for a while: only the older half counts.
        """
        every = (*self.anchors, *([self.newest] if self.newest else []))
        if not every:
            return self
        believed = every[: (len(every) + 1) // 2] if wrong else every
        ahead, left, up, lifted, height = (
            float(np.median(values))
            for values in zip(*((*r.velocity, r.lifted, r.height) for r in believed), strict=True)
        )  # fmt: skip
        begun = replace(every[-1], velocity=(ahead, left, up), lifted=lifted, height=height, doubt=DOUBT, share=share)
        return Reckonings(begun)


def seen(odometry: Odometry, now: float, error: float = 0.0, share: float = 1.0) -> Reckoning:
    """Begin from an odometry at `now`, s, whose heading is wrong by `error`, rad, with a share of the thrust."""
    x, y, z = (float(v) for v in odometry.velocity)
    yaw = yaw_of(odometry.quaternion) - error
    c, s = math.cos(yaw), math.sin(yaw)
    height = float(odometry.position[2])
    return Reckoning((c * x + s * y, c * y - s * x, z), z, DOUBT, share, now, now, height)


def reckon(
    before: Reckoning,
    attitude: Attitude | None,
    force: tuple[float, ...] | None,
    thrust: tuple[float, float] | None,
    now: float,
) -> Reckoning | None:
    """Carry the velocity on by one control step; the heading is taken to stay.

    Args:
        before: what was reckoned so far.
        attitude: the flight controller's; None: it is not known, and taken to be level.
        force: specific force by its accelerometer, body FLU, m/s^2; None: it is not known, and taken to be the thrust.
        thrust: specific force by the throttle, and how far that may be off, m/s^2; None: it is not known, and taken to
            be the force.
        now: s.

    Returns:
        The velocity now; None where it cannot be known: neither force nor thrust, or too long a pause.
    """
    dt = now - before.time
    if not 0 <= dt <= LONGEST_STEP or (force is None and thrust is None):
        return None
    attitude = attitude or Attitude(0.0, 0.0, 0.0)
    upright = math.cos(attitude.roll) * math.cos(attitude.pitch)
    ahead, aside, above = (float(a) for a in level(attitude, force or (0.0, 0.0, thrust[0] if thrust else GRAVITY)))
    share, unlike = before.share, before.unlike
    if thrust is not None and force is not None and thrust[0] > 0:
        off = force[2] / thrust[0] - share
        unlike = off if unlike is None else unlike + (off - unlike) * dt / SMOOTH_S
        follow = max(-SAG_RATE * dt, min(SAG_RATE * dt, unlike * dt / SAG_S))
        share += follow if abs(unlike) < SAG else 0.0
    lift, doubt = (above, 0.0) if thrust is None else (share * thrust[0] * upright, thrust[1])
    forward, left, up = before.velocity
    after = replace(
        before, velocity=(forward + ahead * dt, left + aside * dt, up + (above - GRAVITY) * dt),
        lifted=before.lifted + (lift - GRAVITY) * dt, doubt=before.doubt + doubt * dt, share=share, unlike=unlike,
        time=now,
    )  # fmt: skip
    height = before.height + min(after.lifted + after.doubt, after.climb + SLOWER) * dt
    return replace(after, height=height)


def trimmed(trim: float, reckoned: Reckoning, ground: float, dt: float) -> float:
    """The trim that makes up for a wrong throttle map, m/s^2, carried on by `dt` s.

    Args:
        trim: so far, m/s^2.
        reckoned: the velocity now.
        ground: its height, world, m.
        dt: s.
    """
    behind = max(-TRIM_ERROR, min(TRIM_ERROR, _climb(reckoned, ground) - reckoned.climb))
    return max(-LARGEST_TRIM, min(LARGEST_TRIM, trim + TRIM_GAIN * behind * dt))


def settle(attitude: Attitude | None, reckoned: Reckoning, ground: float, trim: float = 0.0) -> Ctbr:
    """End the motion, level, and sink; without an attitude the body rates are held at zero.

    Args:
        attitude: the flight controller's.
        reckoned: the velocity now.
        ground: its height, world, m.
        trim: added to the thrust, m/s^2; see `trimmed`.
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
