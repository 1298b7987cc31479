"""What accelerometer, gyroscope, attitude and throttle tell in addition to the poses. Pure: state in, state out.

They give the accelerometer's scale, a check that the poses are those of this vehicle, the velocity without poses, and
the ground.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from e2efly.flight.attitude import Attitude
from e2efly.flight.pilot import motion_watch, reckoning, touch
from e2efly.flight.pilot.accelerometer import Scale, learn, standing_problem
from e2efly.flight.pilot.motion_watch import MotionWatch
from e2efly.flight.pilot.reckoning import ANCHOR_S, ANCHORS, Reckoning, Reckonings
from e2efly.flight.pilot.touch import Touch
from e2efly.policy.odometry import Odometry
from e2efly.vehicles.gravity import GRAVITY

FRESH_S = 0.1
"""How long a measured force is used, s."""
SHARE_RATE, SHARE_S, SHARE_RANGE = 0.05, 0.3, (0.7, 1.3)
"""How fast the share of the map's force is followed while poses are good, 1/s and s, and its bounds."""
SAG, SMOOTH_S, SAG_RATE, SAG_S = 0.02, 0.1, 0.1, 0.2
"""Without poses, the share follows as the battery sags. SAG: it follows only while force and thrust differ by less than
this share. SMOOTH_S: time over which the difference is smoothed, s. SAG_RATE: the fastest change, 1/s. SAG_S: the time
constant, s. A larger sudden difference is not the battery but the accelerometer."""
QUIET = 1.0
"""The accelerometer's scale is learned while the sensors measure less motion than this, m/s within
`motion_watch.MEMORY_S`. In a fast flight the poses come too late for a comparison."""
BELIEVED = 0.3
"""The share by which the force along the body's z axis may differ from the thrust. Beyond it, the accelerometer is
broken."""
FASTER, FASTER_SHARE = 0.5, 0.25
"""In a take-off the vehicle climbs faster than its poses say, if accelerometer and throttle both give a vertical speed
that is larger than theirs by more than the first value, m/s, and the second, a share of this speed."""
BURIED, BURIED_S = 1.5, 2.0
"""If the largest plausible height is this far under the ground, m, the vehicle surely stands. This counts only after
this time since the last pose, s, because the first estimates may be wrong."""
REST_SHARE = 0.05
"""Weight of a new measurement at rest."""


@dataclass(frozen=True)
class Measurement:
    """A reply of the controller, and the information that belongs to it."""

    counts: np.ndarray
    """(3,) counts of the accelerometer, body FLU."""
    gyro: np.ndarray
    """(3,) body rate, FLU, rad/s."""
    attitude: Attitude | None
    """The controller's attitude. None: not known."""
    thrust: tuple[float, float] | None
    """Specific force from the throttle that was sent, and its possible error, m/s^2. None: not known."""
    thrusts: tuple[float, ...]
    """The specific forces from the throttles that were sent each of `touch.LAGS` earlier, m/s^2. Empty: not known."""
    asked: float
    """When the measurement was requested, s. Everything sent before that had arrived when it was taken."""
    acts: bool = True
    """The commands that can have caused the force are known to have arrived. Nothing is learned from others."""
    delivered: bool = True
    """The commands since the previous measurement are known to have arrived."""
    standing: bool = False
    """The vehicle stands on the ground, disarmed."""
    flying: bool = False
    """The vehicle is in the air."""
    climb: float | None = None
    """Vertical velocity from good poses in flight, m/s. None: there are none, or the vehicle does not fly."""


@dataclass(frozen=True)
class Inertial:
    """What is known so far. `Inertial()` at first."""

    rest: np.ndarray | None = None
    """(3,) counts of the accelerometer at rest, smoothed."""
    scale: Scale = Scale()
    """Scale of the accelerometer, learned from poses in flight."""
    watch: MotionWatch = MotionWatch()
    """Comparison of poses and sensors."""
    reckonings: Reckonings = Reckonings()
    """The velocity, propagated from the poses with what was sent."""
    held: Reckonings | None = None
    """The same since the newest measurement, if the controller has held the command of that time ever since."""
    touch: Touch = Touch()
    """Detection of the ground."""
    force: np.ndarray | None = None
    """(3,) newest specific force, body FLU, m/s^2."""
    gyro: np.ndarray | None = None
    """(3,) newest body rate, FLU, rad/s."""
    time: float = -math.inf
    """Time of the newest measurement, s."""
    share: float = 1.0
    """The share of the throttle map's force that the rotors really give."""
    unlike: float = 0.0
    """The measured share minus `share`, smoothed, in a flight without poses."""
    stepped: bool = False
    """This has once been larger than `SAG`, and the share is not followed any more in this flight without poses."""
    learned: tuple[tuple[float, Scale], ...] = ()
    """The scale at some moments, s, oldest first. Wrong poses can corrupt it before they are detected, so older values
    are kept. The share changes too slowly for that, and it has to follow the battery."""
    frozen: bool = False
    """The accelerometer repeats its numbers. The thrust is used in its place."""

    @property
    def reckoned(self) -> Reckoning | None:
        """The velocity, propagated from the newest pose."""
        return self.reckonings.newest

    def at_rest(self) -> "Inertial":
        """The state at the beginning of a flight. Of earlier flights, which may have ended in a fall, only gravity at
        rest is kept.
        """
        return Inertial(
            rest=self.rest, reckonings=self.reckonings.from_ground(), force=self.force, gyro=self.gyro, time=self.time
        )

    def buried(self, ground: float, now: float) -> bool:
        """Whether it must be under the ground, whose height is given, m."""
        r = self.reckoned
        return r is not None and ground - r.height > BURIED and now - r.since > BURIED_S

    @property
    def climbs_faster(self) -> str | None:
        """How much faster than its poses the vehicle has climbed since the ground, by accelerometer and throttle: the
        poses may be scaled. None: it has not.
        """
        grounded, newest = self.reckonings.grounded, self.reckonings.newest
        if grounded is None or newest is None:
            return None
        told, climb = newest.velocity[2], min(grounded.velocity[2], grounded.lifted)
        if climb - told < FASTER + FASTER_SHARE * abs(climb):
            return None
        return f"they climb at {told:.1f} m/s, by accelerometer and throttle it is {climb:.1f} m/s"

    @property
    def rest_problem(self) -> str | None:
        """Why the accelerometer must not be used for flight. None: it may."""
        return "it is not heard" if self.rest is None else standing_problem(self.rest)


def measure(before: Inertial, m: Measurement, now: float) -> Inertial:
    """Process a measurement that arrived at `now`, s."""
    rest = before.rest
    if m.standing:
        rest = m.counts if rest is None else rest + REST_SHARE * (m.counts - rest)
    gravity = 0.0 if rest is None else float(np.linalg.norm(rest))
    if not gravity > 0:
        return replace(before, rest=rest)
    dt = min(max(now - before.time, 0.0), FRESH_S)
    plain = m.counts * (GRAVITY / gravity)
    scale, watch, felt = before.scale, before.watch, before.touch
    if now - before.time > FRESH_S:
        scale = replace(scale, climb=None)
    held = before.held if now - before.time > FRESH_S and not m.delivered else None
    before = replace(before, reckonings=held or before.reckonings, held=None)
    m = m if m.acts else replace(m, thrust=None, thrusts=())
    felt = touch.seen(felt, tuple(m.counts.tolist()), None if m.thrust is None else m.thrust[0], now)
    if felt.frozen and not m.standing:
        watch = watch if before.frozen else MotionWatch(pose=watch.pose)  # the poses were compared with wrong numbers
        if m.attitude is not None and m.thrust is not None:
            watch = motion_watch.feel(watch, m.attitude, np.array([0.0, 0.0, m.thrust[0]]), m.gyro, m.thrust, now)
        return replace(before, rest=rest, watch=watch, touch=felt, force=None, gyro=m.gyro, time=now, frozen=True)
    if m.climb is not None and m.attitude is not None and watch.moved < QUIET:
        scale = learn(scale, m.attitude, plain, m.climb, dt)
    else:
        scale = replace(scale, climb=None)  # what happens in the meantime is not compared
    force = scale.value * plain
    thrust = m.thrust or (GRAVITY, GRAVITY)
    if m.attitude is not None:
        watch = motion_watch.feel(watch, m.attitude, force, m.gyro, thrust, now)
    if m.thrusts:
        felt = touch.feel(felt, float(force[2]), m.thrusts, float(np.linalg.norm(m.gyro)), m.asked, dt)
    share, unlike, stepped = before.share, before.unlike, before.stepped
    if m.climb is not None and m.thrust is not None and m.thrust[0] > 0 and watch.moved < QUIET:
        off = (float(force[2]) / m.thrust[0] - share) * dt / SHARE_S
        share += min(max(off, -SHARE_RATE * dt), SHARE_RATE * dt)
        share, unlike, stepped = min(max(share, SHARE_RANGE[0]), SHARE_RANGE[1]), 0.0, False
    elif m.flying and m.climb is None and m.thrust is not None and m.thrust[0] > 0:
        unlike += (float(force[2]) / m.thrust[0] - share - unlike) * -math.expm1(-dt / SMOOTH_S)
        stepped = stepped or abs(unlike) >= SAG
        if not stepped:
            share += min(max(unlike * dt / SAG_S, -SAG_RATE * dt), SAG_RATE * dt)
    return replace(
        before, rest=rest, scale=scale, watch=watch, touch=felt, force=force, gyro=m.gyro, time=now, share=share,
        unlike=unlike, stepped=stepped, frozen=False,
    )  # fmt: skip


def see(
    before: Inertial, odometry: Odometry, now: float, *, moved: bool, trusted: bool, turned: float, latest: float
) -> Inertial:
    """Process an odometry that passed the checks. `now` is in s. An odometry that has `moved` is not a repetition of
    the previous one. The velocity is propagated from one that is `trusted`. `turned` is the error of its heading, rad,
    and `latest` the largest accepted delay of poses, s.
    """
    watch = motion_watch.see(before.watch, odometry, latest)
    if not (moved and trusted):
        return replace(before, watch=watch)
    newest = reckoning.seen(odometry, now, turned)
    learned = before.learned
    if not learned or now - learned[-1][0] >= ANCHOR_S:
        learned = (*learned[-ANCHORS + 1 :], (now, before.scale))
    held = None if before.held is None else before.held.seen(newest)
    return replace(before, watch=watch, reckonings=before.reckonings.seen(newest), held=held, learned=learned)


def carry(
    before: Inertial,
    attitude: Attitude | None,
    thrust: tuple[float, float] | None,
    now: float,
    *,
    rate: tuple[float, float, float] = (0.0, 0.0, 0.0),
    held: tuple[float, float] | None = None,
    held_rate: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Inertial:
    """Propagate the velocity to `now`, s; see `reckoning.reckon`.

    A controller that is not heard may receive the commands, or may hold the last one. Both cases are computed. The
    first measurement afterwards chooses: the commands arrived only if that is known.

    Args:
        before: the state so far.
        attitude: the controller's attitude. None: not known.
        thrust: specific force of the throttle that was sent, and its possible error, m/s^2. None: not known.
        now: s.
        rate: the body rate that was sent, FLU, rad/s.
        held: the thrust of the throttle that was sent when the controller was last heard ...
        held_rate: ... and the body rate.
    """
    force = None if before.force is None or now - before.time > FRESH_S else tuple(before.force.tolist())

    def on(
        thrust: tuple[float, float] | None, rate: tuple[float, float, float]
    ) -> Callable[[Reckoning], Reckoning | None]:
        thrust = None if thrust is None else (before.share * thrust[0], thrust[1])
        unlike = force is not None and thrust is not None and abs(force[2] - thrust[0]) > BELIEVED * GRAVITY + thrust[1]
        believed = None if unlike else force
        return lambda r: reckoning.reckon(r, attitude, believed, thrust, rate, now)

    after = replace(before, reckonings=before.reckonings.on(on(thrust, rate)))
    if now <= before.time:
        return after
    begun = before.reckonings if before.held is None else before.held
    return replace(after, held=begun.on(on(held, held_rate)))


def alone(before: Inertial, *, wrong: bool, height: float | None = None) -> Inertial:
    """Continue without poses; see `Reckonings.alone`."""
    if wrong and before.learned:
        before = replace(before, scale=before.learned[0][1])
    held = None if before.held is None else before.held.alone(wrong=wrong, height=height)
    return replace(before, reckonings=before.reckonings.alone(wrong=wrong, height=height), held=held)
