"""What accelerometer, gyroscope, attitude and throttle tell beside the poses. Pure: state in, state out.

The scale of the accelerometer, whether poses are the vehicle's own, the velocity without them, and the ground.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from e2efly.deploy.attitude import Attitude
from e2efly.deploy.odometry import Odometry
from e2efly.deploy.pilot import motion_watch, reckoning, touch
from e2efly.deploy.pilot.accelerometer import Scale, learn, standing_problem
from e2efly.deploy.pilot.motion_watch import MotionWatch
from e2efly.deploy.pilot.reckoning import ANCHOR_S, ANCHORS, Reckoning, Reckonings
from e2efly.deploy.pilot.touch import Touch
from e2efly.vehicles.vehicle import GRAVITY

FRESH_S = 0.1
"""The force is taken for so long, s."""
DELIVERED = 0.3
"""After a silence: by so much nearer must the force be to what was sent than to what was held, m/s^2, to show that the
commands came all the same."""
SHARE_RATE, SHARE_S, SHARE_RANGE = 0.05, 0.3, (0.7, 1.3)
"""How fast the share of the map's force is followed, 1/s and s, and its bounds."""
QUIET = 1.0
"""The accelerometer's scale is learned while less is felt than this, m/s within `motion_watch.MEMORY_S`: in a fast
flight the poses come too late to be compared with it."""
BELIEVED = 0.3
"""Share by which the force along the body's z axis may be unlike the thrust: beyond, the accelerometer is broken."""
BURIED, BURIED_S = 1.5, 2.0
"""So far under the ground by the largest height that is plausible, m, the vehicle surely stands; not sooner after the
last pose than this, s, as what was reckoned at first may be wrong."""
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
    asked: float
    """When it was asked for, s: what had been sent until then had arrived as it was taken."""
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
    reckonings: Reckonings = Reckonings()
    """The velocity, carried on from the poses by what was sent."""
    held: Reckonings | None = None
    """The same since the newest measurement, if the controller has held the command of that time ever since ..."""
    held_thrust: float | None = None
    """... and the specific force of it, m/s^2."""
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
    learned: tuple[tuple[float, Scale, float], ...] = ()
    """What scale and share were at some moments, s, oldest first: wrong poses teach wrong ones before they are told."""
    frozen: bool = False
    """The accelerometer repeats itself: the thrust stands for it."""

    @property
    def reckoned(self) -> Reckoning | None:
        """The velocity, from the newest pose on."""
        return self.reckonings.newest

    def at_rest(self) -> "Inertial":
        """As a flight begins: of earlier ones, which may have ended in a fall, nothing counts but gravity at rest."""
        return Inertial(rest=self.rest, reckonings=self.reckonings, force=self.force, gyro=self.gyro, time=self.time)

    def buried(self, ground: float, now: float) -> bool:
        """Whether it must be under the ground, whose height is given, m, and cannot feel that it stands on it."""
        r = self.reckoned
        deep = r is not None and ground - r.height > BURIED and now - r.since > BURIED_S
        return deep and not self.touch.able(now)

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
    before = replace(before, reckonings=_after_silence(before, m, scale.value * plain, now), held=None)
    felt = touch.seen(felt, tuple(m.counts.tolist()), None if m.thrust is None else m.thrust[0], now)
    if felt.frozen and not m.standing:
        watch = watch if before.frozen else MotionWatch(pose=watch.pose)  # the poses were compared with wrong numbers
        if m.attitude is not None and m.thrust is not None:
            watch = motion_watch.feel(watch, m.attitude, np.array([0.0, 0.0, m.thrust[0]]), m.gyro, m.thrust, now)
        return replace(before, rest=rest, watch=watch, touch=felt, force=None, gyro=m.gyro, time=now, frozen=True)
    if m.climb is not None and m.attitude is not None and watch.moved < QUIET:
        scale = learn(scale, m.attitude, plain, m.climb, dt)
    force = scale.value * plain
    thrust = m.thrust or (GRAVITY, GRAVITY)
    if m.attitude is not None:
        watch = motion_watch.feel(watch, m.attitude, force, m.gyro, thrust, now)
    if m.thrust is not None:
        felt = touch.feel(felt, float(force[2]), m.thrust[0], m.asked, dt)
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
    learned = before.learned
    if not learned or now - learned[-1][0] >= ANCHOR_S:
        learned = (*learned[-ANCHORS + 1 :], (now, before.scale, before.share))
    held = None if before.held is None else before.held.seen(newest)
    return replace(before, watch=watch, reckonings=before.reckonings.seen(newest), held=held, learned=learned)


def carry(
    before: Inertial,
    attitude: Attitude | None,
    thrust: tuple[float, float] | None,
    now: float,
    *,
    held: tuple[float, float] | None = None,
) -> Inertial:
    """Reckon on to `now`, s: see `reckoning.reckon`.

    A controller that is not heard may get the commands, or hold the last one: both are reckoned, and the first
    measurement afterwards tells which.

    Args:
        before: so far.
        attitude: the controller's; None: not known.
        thrust: specific force of the throttle that was sent, and how far it may be off, m/s^2; None: not known.
        now: s.
        held: the same of the throttle that was sent as the controller was heard last.
    """
    force = None if before.force is None or now - before.time > FRESH_S else tuple(before.force.tolist())

    def on(thrust: tuple[float, float] | None) -> Callable[[Reckoning], Reckoning | None]:
        unlike = force is not None and thrust is not None and abs(force[2] - thrust[0]) > BELIEVED * GRAVITY + thrust[1]
        believed = None if unlike else force
        return lambda r: reckoning.reckon(r, attitude, believed, thrust, now)

    after = replace(before, reckonings=before.reckonings.on(on(thrust)))
    if now <= before.time:
        return after
    begun = before.reckonings if before.held is None else before.held
    return replace(after, held=begun.on(on(held)), held_thrust=None if held is None else held[0])


def _after_silence(before: Inertial, m: Measurement, force: np.ndarray, now: float) -> Reckonings:
    """The velocity by what has come of the commands while nothing was heard."""
    if before.held is None or before.held_thrust is None or m.thrust is None or now - before.time <= FRESH_S:
        return before.reckonings
    z = float(force[2])
    came = abs(z - m.thrust[0]) < abs(z - before.held_thrust) - DELIVERED
    return before.reckonings if came else before.held


def alone(before: Inertial, *, wrong: bool) -> Inertial:
    """From here on without poses: see `Reckonings.alone`."""
    if wrong and before.learned:
        _, scale, share = before.learned[0]
        before = replace(before, scale=scale, share=share)
    held = None if before.held is None else before.held.alone(before.share, wrong=wrong)
    return replace(before, reckonings=before.reckonings.alone(before.share, wrong=wrong), held=held)


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
