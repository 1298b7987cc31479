"""What accelerometer, gyroscope, attitude and throttle tell beside the poses. Pure: state in, state out.

The scale of the accelerometer, whether poses are the vehicle's own, the velocity without them, and the ground.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from e2efly.deploy import motion_watch, reckoning, touch
from e2efly.deploy.accelerometer import Scale, learn, standing_problem
from e2efly.deploy.motion_watch import MotionWatch
from e2efly.deploy.msp.messages import Attitude
from e2efly.deploy.odometry import Odometry
from e2efly.deploy.reckoning import Reckoning
from e2efly.deploy.touch import Touch
from e2efly.vehicles.vehicle import GRAVITY

FRESH_S = 0.1
"""The force is taken for so long, s."""
ANCHOR_S, ANCHORS = 0.2, 6
"""Between two poses from which the velocity is reckoned on, s, and how many there are: those of the last moments may
have been wrong already when that is found out, and one alone is noisy."""
SHARE_RATE, SHARE_S, SHARE_RANGE = 0.05, 0.3, (0.7, 1.3)
"""How fast the share of the map's force is followed, 1/s and s, and its bounds."""
QUIET = 1.0
"""The accelerometer's scale is learned while less is felt than this, m/s within `motion_watch.MEMORY_S`: in a fast
flight the poses come too late to be compared with it."""
BELIEVED = 0.3
"""Share by which the force along the body's z axis may be unlike the thrust: beyond, the accelerometer is broken."""
REST_SHARE = 0.05
"""Weight of a new measurement at rest."""


@dataclass(frozen=True)
class Measurement:
    """An answer of the controller, and what goes with it."""

    counts: np.ndarray
    """(3,) of the accelerometer, body FLU."""
    gyro: np.ndarray
    """(3,) body rate, FLU, rad/s."""
    attitude: Attitude | None
    """The controller's; None: not known."""
    thrust: tuple[float, float] | None
    """Specific force by the throttle, and how far that may be off, m/s^2; None: not known."""
    standing: bool = False
    """It stands on the ground, disarmed."""
    flying: bool = False
    """It is in the air."""
    climb: float | None = None
    """Vertical velocity by good poses in flight, m/s; None: there are none, or it does not fly."""


@dataclass(frozen=True)
class Inertial:
    """What was told so far. `Inertial()` at first."""

    rest: np.ndarray | None = None
    """(3,) counts of the accelerometer at rest, smoothed."""
    scale: Scale = Scale()
    """Of the accelerometer, as poses in flight show it."""
    watch: MotionWatch = MotionWatch()
    """Poses against sensors."""
    reckoned: Reckoning | None = None
    """The velocity, from the newest pose on."""
    anchors: tuple[Reckoning, ...] = ()
    """The same from older poses on, oldest first."""
    touch: Touch = Touch()
    """The ground."""
    force: np.ndarray | None = None
    """(3,) newest specific force, body FLU, m/s^2."""
    gyro: np.ndarray | None = None
    """(3,) newest body rate, FLU, rad/s."""
    time: float = -math.inf
    """Of the newest measurement, s."""
    share: float = 1.0
    """Of the throttle map's force that is felt, while poses are good."""
    frozen: bool = False
    """In flight the accelerometer repeats itself."""

    @property
    def rest_problem(self) -> str | None:
        """Why the accelerometer cannot be flown by; None: it can."""
        return "it is not heard" if self.rest is None else standing_problem(self.rest)


def measure(before: Inertial, m: Measurement, now: float) -> Inertial:
    """Take in a measurement that came at `now`, s."""
    rest = before.rest
    if m.standing:
        rest = m.counts if rest is None else rest + REST_SHARE * (m.counts - rest)
    gravity = 0.0 if rest is None else float(np.linalg.norm(rest))
    if not gravity > 0:
        return replace(before, rest=rest)
    dt = min(max(now - before.time, 0.0), FRESH_S)
    plain = m.counts * (GRAVITY / gravity)
    scale, watch, felt = before.scale, before.watch, before.touch
    if m.thrust is not None:
        felt = touch.seen(felt, tuple(m.counts.tolist()), m.thrust[0], now)
    if m.flying and felt.frozen(now):
        return replace(before, rest=rest, touch=felt, force=None, gyro=m.gyro, time=now, frozen=True)
    if m.climb is not None and m.attitude is not None and watch.moved < QUIET:
        scale = learn(scale, m.attitude, plain, m.climb, dt)
    force = scale.value * plain
    thrust = m.thrust or (GRAVITY, GRAVITY)
    if m.attitude is not None:
        watch = motion_watch.feel(watch, m.attitude, force, m.gyro, thrust, now)
    if m.thrust is not None:
        felt = touch.feel(felt, float(force[2]), m.thrust[0], now, dt)
    share = before.share
    if m.climb is not None and m.thrust is not None and m.thrust[0] > 0 and watch.moved < QUIET:
        off = (float(force[2]) / m.thrust[0] - share) * dt / SHARE_S
        share += min(max(off, -SHARE_RATE * dt), SHARE_RATE * dt)
        share = min(max(share, SHARE_RANGE[0]), SHARE_RANGE[1])
    return replace(
        before, rest=rest, scale=scale, watch=watch, touch=felt, force=force, gyro=m.gyro, time=now, share=share,
        frozen=False,
    )  # fmt: skip


def see(
    before: Inertial, odometry: Odometry, now: float, *, moved: bool, trusted: bool, turned: float, latest: float
) -> Inertial:
    """Take in an odometry that passed the checks.

    Args:
        before: so far.
        odometry: the newest.
        now: s.
        moved: it is no repetition of the one before.
        trusted: the velocity is reckoned on from it.
        turned: error of its heading, rad.
        latest: so late poses may be, s.
    """
    watch = motion_watch.see(before.watch, odometry, latest)
    if not (moved and trusted):
        return replace(before, watch=watch)
    newest = reckoning.seen(odometry, now, turned, before.share)
    anchors = before.anchors
    if not anchors or now - anchors[-1].since >= ANCHOR_S:
        anchors = (*anchors[-ANCHORS + 1 :], newest)
    return replace(before, watch=watch, reckoned=newest, anchors=anchors)


def carry(before: Inertial, attitude: Attitude | None, thrust: tuple[float, float] | None, now: float) -> Inertial:
    """Reckon on to `now`, s: see `reckoning.reckon`."""
    force = None if before.force is None or now - before.time > FRESH_S else tuple(before.force.tolist())
    if force is not None and thrust is not None and abs(force[2] - thrust[0]) > BELIEVED * GRAVITY + thrust[1]:
        force = None

    def on(r: Reckoning | None) -> Reckoning | None:
        return None if r is None else reckoning.reckon(r, attitude, force, thrust, now)

    anchors = tuple(after for anchor in before.anchors if (after := on(anchor)) is not None)
    return replace(before, reckoned=on(before.reckoned), anchors=anchors)


def alone(before: Inertial, *, wrong: bool) -> Inertial:
    """From here on without poses: the velocity is the median of what was reckoned on from the last ones.

    Args:
        before: so far.
        wrong: the poses were wrong, perhaps for a while: only the older half counts.
    """
    every = (*before.anchors, *([before.reckoned] if before.reckoned else []))
    if not every:
        return before
    believed = every[: (len(every) + 1) // 2] if wrong else every
    ahead, left, up, lifted, height = (
        float(np.median(values))
        for values in zip(*((*r.velocity, r.lifted, r.height) for r in believed), strict=True)
    )  # fmt: skip
    begun = replace(
        every[-1], velocity=(ahead, left, up), lifted=lifted, height=height, doubt=reckoning.DOUBT, share=before.share
    )
    return replace(before, reckoned=begun, anchors=())


def feel_for_ground(before: Inertial, thrust: float, now: float, *, overdue: bool) -> Inertial:
    """In a landing without poses: begin to feel for the ground, where there is a reason.

    Args:
        before: so far.
        thrust: by the throttle now, m/s^2.
        now: s.
        overdue: by its height the vehicle ought to stand.
    """
    if before.force is None or now - before.time > FRESH_S:
        return before
    beyond = float(before.force[2]) - thrust
    return replace(before, touch=touch.dip(before.touch, now, overdue=overdue, beyond=beyond))
