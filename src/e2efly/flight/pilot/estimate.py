"""The vehicle's motion from poses and from the controller's sensors, and whether each is fit to fly by. Pure."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from e2efly.flight.attitude import Attitude, attitude_of
from e2efly.flight.pilot import inertial
from e2efly.flight.pilot.delay_watch import DelayWatch, MeasuredDelay, delay_of, delay_problem, felt, turned
from e2efly.flight.pilot.flight_state import GROUNDED, Flight, Mode
from e2efly.flight.pilot.heading_watch import HeadingWatch, watched
from e2efly.flight.pilot.hover import LIFTED
from e2efly.flight.pilot.inertial import Inertial, Measurement
from e2efly.flight.pilot.lag_watch import LagWatch, MeasuredLag, lags_of, moved
from e2efly.flight.pose.conditions import Checks
from e2efly.flight.pose.pace import Pace, paced
from e2efly.flight.pose.tracking import PoseTrack, age, track
from e2efly.policy.odometry import Odometry, Sample

RESTART_S = 1.0
"""On the ground, tracking starts again after this time without a good pose, s."""
OUTLIERS_S = 0.03
"""How long poses may be refused before the odometry counts as lost, s. One or two outliers must not end a flight."""
CONTINUES = 0.3
"""In a landing without poses, a pose is not believed if its vertical speed differs by more than this and the doubt,
m/s."""
LATE_S = 0.05
"""How much later than the latency assumed by the gains poses may be, s."""
MEASURED = (Mode.INIT, Mode.TAKEOFF, Mode.HOVER, Mode.POLICY)
"""Modes in which the delay of the poses and the lags of the velocities are measured."""
FROZEN = "its numbers do not change"
"""Reported for an accelerometer that does not even measure the vibration of the rotors."""


@dataclass(frozen=True)
class StateEstimate:
    """The vehicle's motion as far as it is known, and the problems found with poses and sensors."""

    checks: Checks
    """The conditions that a pose must satisfy."""
    latest: float
    """The largest accepted delay of poses, from the motion to their arrival, s."""
    odometry: Odometry | None = None
    """The newest odometry that passed the checks."""
    good_at: float = -math.inf
    """When a pose last passed the checks, s."""
    refused: str | None = None
    """Why poses are refused now. None: they are not refused, or for less than `OUTLIERS_S`."""
    stale: str | None = None
    """Why the newest pose is too old. None: it is not."""
    track: PoseTrack = PoseTrack()
    """Memory of the checks of poses."""
    pace: Pace = Pace()
    """How often poses come."""
    heading: HeadingWatch = HeadingWatch()
    """Comparison of the poses' heading with the heading that the flight shows."""
    inertial: Inertial = Inertial()
    """Accelerometer, gyroscope, and the velocity without poses."""
    delays: DelayWatch = DelayWatch()
    """Rotations from poses and gyroscope, with which the delay of the poses is measured."""
    delay: MeasuredDelay | None = None
    """The delay of the poses. None: not measured."""
    given: tuple[bool, bool] = (False, False)
    """Whether velocity and body rate are the source's own."""
    lags: LagWatch = LagWatch()
    """Comparison of the source's velocity and body rate with its poses."""
    lag: tuple[MeasuredLag | None, MeasuredLag | None] = (None, None)
    """How late the source's velocity and body rate are. None: not measured."""
    opposed: str | None = None
    """How poses and sensors contradicted each other when the vehicle was carried. Kept until they agree."""

    @property
    def pose_problem(self) -> str | None:
        """Why there is no good pose now. None: there is one."""
        return self.refused or self.stale

    @property
    def heading_error(self) -> float | None:
        """The poses' heading minus the true heading, rad. None: unknown, or there is no good pose."""
        return None if self.pose_problem else self.heading.error

    def attitude_error(self, attitude: Attitude | None) -> float | None:
        """The larger of the differences in roll and in pitch between controller and poses, rad. None: one of them is
        unknown.
        """
        if attitude is None or self.odometry is None:
            return None
        posed = attitude_of(*self.odometry.quaternion.tolist())
        return max(abs(math.remainder(attitude.roll - posed.roll, math.tau)), abs(attitude.pitch - posed.pitch))

    def accelerometer_problem(self, mode: Mode) -> str | None:
        """Why the accelerometer must not be used for flight. None: it may. A problem found in flight lasts until the
        landing.
        """
        if mode in GROUNDED:
            return self.inertial.rest_problem
        if self.inertial.frozen:
            return FROZEN
        if mode is Mode.TAKEOFF:  # the throttle map is not known well enough to be another judge
            return None
        return self.inertial.watch.accelerometer_problem

    def motion_problem(self, mode: Mode) -> str | None:
        """How poses and sensors contradict each other, or how late the poses are. None: they agree."""
        if mode in GROUNDED:
            return self.opposed or delay_problem(self.delay, self.latest)
        if mode is Mode.TAKEOFF and (faster := self.inertial.climbs_faster):
            return faster
        velocity = self.refused if (self.refused or "").startswith("velocity") else None
        return self.inertial.watch.problem or velocity


def height_of(odometry: Odometry | None, flight: Flight) -> float:
    """Height over the place of take-off, m. 0 without odometry."""
    return 0.0 if odometry is None else float(odometry.position[2]) - flight.home


def see(
    before: StateEstimate,
    samples: Iterable[Sample],
    flight: Flight,
    attitude: Attitude | None,
    now: float,
    said: str = "",
) -> StateEstimate:
    """The estimate after the poses of a control step. The poses come oldest first; there may be none. `now` is in s.
    `said` is the problem that the pose source reports. Empty: none.
    """
    after = before
    waited = before.refused and now - before.good_at > RESTART_S
    if flight.mode in GROUNDED and (before.track.fault or waited):
        after = replace(after, track=PoseTrack(), good_at=now)  # it may have been carried away, or its clock set
    for sample in samples:
        tracked, odometry, refused = track(after.checks, after.track, sample)
        after = replace(after, track=tracked, refused=refused)
        if odometry is not None:
            after = _accept(after, odometry, sample, flight, attitude, now)
    frozen = (after.refused or "").startswith("frozen")  # this has lasted for some time already
    if not after.track.fault and now - after.good_at < OUTLIERS_S and not frozen:
        after = replace(after, refused=None)
    old = age(after.track, now)
    if after.refused is not None or old <= after.checks.max_age:
        return replace(after, stale=None)
    late = f"the newest is {old:.2f} s old" if math.isfinite(old) else "none has come"
    return replace(after, stale=late + (f" ({said})" if said else ""))


def _accept(
    before: StateEstimate, odometry: Odometry, sample: Sample, flight: Flight, attitude: Attitude | None, now: float
) -> StateEstimate:
    """The estimate after a pose that passed the checks."""
    heading, new = before.heading, before.track.same_since == odometry.time
    given = sample.velocity is not None, sample.body_rate is not None
    if attitude is not None:
        lifted = height_of(odometry, flight) > LIFTED
        heading = watched(heading, odometry, attitude) if lifted else HeadingWatch()
    told = inertial.see(
        before.inertial, odometry, now,
        moved=new,  # otherwise it may be frozen while the motion goes on
        trusted=(not flight.misled or flight.turned is not None) and _continues(before, odometry, flight),
        turned=flight.turned or 0.0, latest=before.latest,
    )  # fmt: skip
    return replace(
        before, odometry=odometry, good_at=now, heading=heading, inertial=told, given=given,
        pace=paced(before.pace, odometry.time, sample.received, new=new or flight.mode in GROUNDED),
        delays=turned(before.delays, odometry) if flight.mode in MEASURED else before.delays,
        lags=moved(before.lags, odometry, before.track.angle) if any(given) else before.lags,
    )  # fmt: skip


def _continues(before: StateEstimate, odometry: Odometry, flight: Flight) -> bool:
    """Whether an odometry may correct the velocity. In a landing without poses, only one that continues it may: what
    comes back after a loss may be wrong.
    """
    reckoned = before.inertial.reckoned
    if not flight.blind or flight.turned is not None or reckoned is None:
        return True
    return abs(float(odometry.velocity[2]) - reckoned.climb) <= CONTINUES + reckoned.doubt


def compare(before: StateEstimate, mode: Mode, *, measure: bool) -> StateEstimate:
    """On the ground: a contradiction that was found while the vehicle was carried stays until it is carried again and
    agrees. With `measure`, the delay of the poses and the lags of the velocities are measured, which takes a fraction
    of a millisecond.
    """
    if measure and mode in MEASURED:
        velocity, body_rate = (new or old for new, old in zip(lags_of(before.lags), before.lag, strict=True))
        before = replace(before, delay=delay_of(before.delays) or before.delay, lag=(velocity, body_rate))
    if mode not in GROUNDED:
        return before
    watch, opposed = before.inertial.watch, before.opposed
    if watch.opposed is not None:
        opposed = f"{watch.opposed}, when it was carried; carry it again, once frames and axes are right"
    elif watch.agrees:
        opposed = None
    return replace(before, opposed=opposed)


def feel(before: StateEstimate, m: Measurement, turned_at: float, mode: Mode, now: float) -> StateEstimate:
    """The estimate after a reply of the inertial sensors. Its body rate was true at `turned_at`, s. `now` is in s."""
    x, y, z = m.gyro.tolist()
    delays = felt(before.delays, turned_at, (x, y, z)) if mode in MEASURED else before.delays
    return replace(before, delays=delays, inertial=inertial.measure(before.inertial, m, now))


def enter(before: StateEstimate, flight_before: Flight, flight: Flight) -> StateEstimate:
    """The estimate after a step of the state machine, which resets what a new mode or a landing without poses starts
    again.
    """
    told, delays = before.inertial, before.delays
    if flight.blind and not flight_before.blind and flight.turned is None:
        top = flight.home + flight.lost[1] if flight.adrift and flight.lost is not None else None
        told = inertial.alone(told, wrong=flight.misled is not None and not flight.adrift, height=top)
    if flight.mode is not flight_before.mode:
        flown = replace(told, touch=told.touch.afresh(), reckonings=replace(told.reckonings, grounded=None))
        told = told.at_rest() if flight.mode is Mode.TAKEOFF else flown
        delays = DelayWatch()
    return replace(before, inertial=told, delays=delays)
