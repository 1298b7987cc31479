"""From samples of a pose source to odometry that is good enough to fly with, or to the reason for a refusal. Pure.

One sample goes in; one `Odometry` or one reason comes out. A refused sample does not change the motion. After a
refusal, the last good odometry stays valid as the last good one and grows older. The flight is judged by its `age`.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from e2efly.flight.pose.clock_map import ClockMap, follow_clock, start_clock
from e2efly.flight.pose.conditions import Checks
from e2efly.flight.pose.slope import Slope, follow_slope, settled, slope, start_slope
from e2efly.policy.odometry import Odometry, Sample

LARGEST = 1e6
"""Numbers beyond this are invalid, and their squares may overflow."""
TRAVEL_S = 0.5
"""Time over which the path that a source's velocities add up to is compared with the path of its positions, s."""
LARGEST_STAMP = 1e11
"""Stamps beyond this are too coarse, s. There, a float is only accurate to 15 microseconds."""


@dataclass(frozen=True)
class PoseTrack:
    """What is remembered of the samples so far. Use `Track()` before the first sample, and to start again after a
    lasting fault.
    """

    clock: ClockMap | None = None
    """Map of the source's clock. None before the first stamp."""
    odometry: Odometry | None = None
    """The last odometry that was returned. `age` is counted from it."""
    pose: tuple[float, np.ndarray, np.ndarray] | None = None
    """Time, s, position (3,), m, and quaternion (4,) of the last good sample."""
    velocity: Slope | None = None
    """Fit of the position, m."""
    body_rate: Slope | None = None
    """Fit of `angle`."""
    strayed: np.ndarray = field(default_factory=lambda: np.zeros(3))
    """(3,) path from the source's velocities minus path of its positions, m. It fades with the time constant
    `TRAVEL_S`."""
    travelled: float = 0.0
    """Length of that path, m. It fades in the same way."""
    angle: np.ndarray = field(default_factory=lambda: np.zeros(3))
    """(3,) sum of the small rotations about the body's axes so far, rad."""
    same_since: float = 0.0
    """Time since which the pose has repeated bit for bit, s."""
    same_pose: bytes = b""
    """Bits of the last pose as it arrived."""
    suspect: tuple[float, np.ndarray, np.ndarray] | None = None
    """Time, s, position (3,), m, and quaternion (4,) after the last jump."""
    suspect_count: int = 0
    """Number of successive samples there."""
    fault: str | None = None
    """Reason for a fault that only a new `Track()` ends."""


def age(track: PoseTrack, now: float) -> float:
    """Age of the last odometry, s. Infinite before the first one. `now` is on the local monotonic clock, s."""
    return now - track.odometry.time if track.odometry is not None else math.inf


def track(checks: Checks, track: PoseTrack, sample: Sample) -> tuple[PoseTrack, Odometry | None, str | None]:
    """Check one sample and estimate what it does not contain. Samples must come in the order in which they were
    received.

    Returns:
        The new track; the odometry, or None; the reason why there is none, or None. A reason starts with a key of
            `REASONS` and a colon, and names the value and what is accepted. If both are None, the sample was out of
            order and is ignored.
    """
    if (reason := _content(checks, sample)) is not None:
        return track, None, reason
    clock, time, reason = _time(checks, track, sample)
    track = replace(track, clock=clock)
    if reason is not None:
        ignored = reason.startswith("order") and checks.out_of_order == "ignore"
        return track, None, None if ignored else reason
    track, reason = _frozen(checks, track, sample, time)
    if reason is not None or track.fault is not None:
        return track, None, reason or track.fault
    quaternion = np.asarray(sample.quaternion, np.float64)
    quaternion = quaternion / math.sqrt(float(quaternion @ quaternion))
    if track.pose is not None and float(quaternion @ track.pose[2]) < 0:
        quaternion = -quaternion  # q and -q are the same attitude: keep the sign of the last one
    position = np.array(sample.position, np.float64)
    track, reason = _jump(checks, track, time, position, quaternion)
    if reason is not None:
        return track, None, reason
    return _motion(checks, track, sample, time, position, quaternion)


def _content(checks: Checks, sample: Sample) -> str | None:
    """The reason to refuse a sample because of its own content. None: the content is good."""
    arrays = (
        ("position", sample.position, 3),
        ("quaternion", sample.quaternion, 4),
        ("velocity", sample.velocity, 3),
        ("body_rate", sample.body_rate, 3),
    )
    for name, value, size in arrays:
        if value is None:
            continue
        if not isinstance(value, np.ndarray) or value.shape != (size,) or value.dtype.kind not in "fiu":
            return f"malformed: {name} is {value!r}; accepted: an array of {size} numbers"
        if not (np.abs(value) <= LARGEST).all():  # false for NaN, too
            return f"not_finite: {name} is {value.tolist()}; accepted: finite numbers up to {LARGEST:g}"
    if sample.stamp is not None and not abs(sample.stamp) <= LARGEST_STAMP:
        return f"not_finite: stamp is {sample.stamp!r}; accepted: a finite number of seconds up to {LARGEST_STAMP:g}"
    if checks.frame and sample.frame != checks.frame:
        return f"frame: frame is {sample.frame[:80]!r}; accepted: {checks.frame!r}"
    length = math.sqrt(float(np.square(sample.quaternion, dtype=np.float64).sum()))
    if not abs(length - 1) <= checks.quaternion_tolerance:
        tolerance = checks.quaternion_tolerance
        return f"quaternion: its length is {length:.4g}; accepted: 1 within {tolerance:g}, wxyz, body to world"
    for name, value, limit in (
        ("velocity", sample.velocity, checks.jump_speed),
        ("body_rate", sample.body_rate, checks.jump_rate),
    ):
        if value is not None and float(np.abs(value).max()) > limit:
            return f"speed: {name} is {value.tolist()}; accepted: at most {limit:g} per axis"
    return None


def _time(checks: Checks, track: PoseTrack, sample: Sample) -> tuple[ClockMap | None, float, str | None]:
    """The map of the clock, the time of the sample on the local clock, s, and the reason for a refusal."""
    clock, last = track.clock, track.pose[0] if track.pose is not None else -math.inf
    time = sample.received - checks.latency
    if sample.stamp is None:
        return (
            clock,
            time,
            None if time > last else f"order: received {last - time:.4g} s before the last; accepted: later",
        )
    if clock is None:
        return start_clock(sample.received, sample.stamp), time, None
    step = sample.stamp - clock.stamp
    if -checks.clock_jump <= step <= 0:
        return clock, time, f"order: its stamp is {abs(step):.4g} s before the last; accepted: later"
    followed, mapped = follow_clock(clock, sample.received, sample.stamp)
    ahead = clock.offset - (sample.received - sample.stamp)  # according to the old map, it comes from the future
    if step < 0 or ahead > checks.clock_jump:
        jump = step if step < 0 else ahead
        text = f"clock: the source's clock jumped by {jump:+.4g} s; accepted: steps below {checks.clock_jump:g} s"
        return start_clock(sample.received, sample.stamp), time, text
    time, delay = mapped - checks.latency, sample.received - mapped
    if delay > checks.max_age:
        return followed, time, f"late: {delay:.4g} s later than the quickest; accepted: at most {checks.max_age:g} s"
    if time <= last:  # the map has just moved back by more than the interval
        return followed, time, f"order: true {last - time:.4g} s before the last; accepted: later"
    return followed, time, None


def _frozen(checks: Checks, track: PoseTrack, sample: Sample, time: float) -> tuple[PoseTrack, str | None]:
    bits = sample.position.tobytes() + sample.quaternion.tobytes()
    if bits != track.same_pose:
        return replace(track, same_pose=bits, same_since=time), None
    still = time - track.same_since
    if still <= checks.frozen_after:
        return track, None
    return track, f"frozen: the same pose for {still:.4g} s; accepted: at most {checks.frozen_after:g} s"


def _jump(
    checks: Checks, track: PoseTrack, time: float, position: np.ndarray, quaternion: np.ndarray
) -> tuple[PoseTrack, str | None]:
    """Refuse a pose that the vehicle cannot have reached by flight. A jump that lasts becomes a fault.

    The allowance grows with time, so a lasting jump would be accepted by itself after some samples. Both the pose
    before the jump and the pose after it are therefore extrapolated with the last velocity and body rate. A sample that
    is nearer to the extrapolated jump than to the extrapolated track is refused too. The extrapolation is needed
    because a vehicle that turns fast is soon far from its last pose.
    """
    if track.pose is None:
        return track, None
    interval = min(time - track.pose[0], checks.gap)
    reach = checks.jump_position + checks.jump_speed * interval
    turn = checks.jump_attitude + checks.jump_rate * interval
    step, angle = _apart(track.pose, position, quaternion)
    reason = None
    if not (step <= reach and angle <= turn):
        reason = (
            f"jump: by {step:.4g} m and {angle:.4g} rad within {interval:.4g} s; accepted: at most {reach:.4g} m and "
            f"{turn:.4g} rad"
        )
    count = 1
    if track.suspect is not None:
        near, on = (_apart(_led_on(track, pose, time), position, quaternion) for pose in (track.suspect, track.pose))
        if max(near[0] / reach, near[1] / turn) < max(on[0] / reach, on[1] / turn):
            count = track.suspect_count + 1
            reason = reason or (
                f"jump: {near[0]:.4g} m and {near[1]:.4g} rad from where an earlier jump led; accepted: nearer to "
                f"where the motion before it leads, now {on[0]:.4g} m and {on[1]:.4g} rad away"
            )
    if reason is None:
        return replace(track, suspect=None, suspect_count=0), None
    lasting = f"{reason}; seen {count} times, a fault until the track starts anew"
    fault = lasting if count >= checks.jump_count else None
    return replace(track, suspect=(time, position, quaternion), suspect_count=count, fault=fault), fault or reason


def _apart(pose: tuple[float, np.ndarray, np.ndarray], position: np.ndarray, quaternion: np.ndarray) -> tuple:
    """The distance to a pose, m and rad."""
    return (
        float(np.linalg.norm(position - pose[1])), float(np.linalg.norm(rotation_between(pose[2], quaternion))),
    )  # fmt: skip


def _led_on(
    track: PoseTrack, pose: tuple[float, np.ndarray, np.ndarray], time: float
) -> tuple[float, np.ndarray, np.ndarray]:
    """The pose extrapolated to `time` s, if the motion goes on as in the last odometry."""
    if track.odometry is None:
        return pose
    since = time - pose[0]
    half = 0.5 * since * track.odometry.body_rate
    angle = float(np.linalg.norm(half))
    vector = half * float(np.sinc(angle / math.pi))
    w, (bx, by, bz) = math.cos(angle), vector.tolist()
    aw, ax, ay, az = pose[2].tolist()
    quaternion = np.array(
        [
            aw * w - ax * bx - ay * by - az * bz,
            aw * bx + ax * w + ay * bz - az * by,
            aw * by - ax * bz + ay * w + az * bx,
            aw * bz + ax * by - ay * bx + az * w,
        ]
    )
    return time, pose[1] + since * track.odometry.velocity, quaternion


def _motion(
    checks: Checks, track: PoseTrack, sample: Sample, time: float, position: np.ndarray, quaternion: np.ndarray
) -> tuple[PoseTrack, Odometry | None, str | None]:
    """The odometry of a good sample. Velocities are the source's, if it gives them, or otherwise estimated."""
    velocity_rate, body_rate_rate = (2 * math.pi * f for f in (checks.velocity_cutoff, checks.rate_cutoff))
    shift, turn, before = track.velocity, track.body_rate, track.pose
    if track.pose is None or shift is None or turn is None or time - track.pose[0] > checks.gap:
        shift, turn = start_slope(time, position), start_slope(time, np.zeros(3))
        angle = np.zeros(3)
    else:
        # The derivative of the sum of these angles is the body rate, and noise does not accumulate in the sum.
        angle = track.angle + rotation_between(track.pose[2], quaternion)
        shift = follow_slope(shift, velocity_rate, time, position)
        turn = follow_slope(turn, body_rate_rate, time, angle)
    track = replace(track, pose=(time, position, quaternion), velocity=shift, body_rate=turn, angle=angle)
    for name, given, fit, rate in (
        ("velocity", sample.velocity, shift, velocity_rate),
        ("body_rate", sample.body_rate, turn, body_rate_rate),
    ):
        if given is None and not settled(fit, rate):
            return track, None, f"starting: {fit.count} samples in {fit.last - fit.first:.3g} s are too few for {name}"
    velocity = slope(shift) if sample.velocity is None else np.array(sample.velocity, np.float64)
    if sample.velocity is not None and settled(shift, velocity_rate):
        seen = slope(shift)
        off = float(np.linalg.norm(velocity - seen))
        limit = checks.velocity_mismatch + 0.3 * float(max(np.linalg.norm(velocity), np.linalg.norm(seen)))
        if off > limit:
            text = f"velocity: {velocity.tolist()} m/s is {off:.3g} from how the position changes"
            return track, None, f"{text}, {seen.round(3).tolist()}; accepted: at most {limit:.3g}, in the world's axes"
    if sample.velocity is not None and before is not None:
        seen = slope(shift) if settled(shift, velocity_rate) else velocity
        track, reason = _strayed(checks, track, before, velocity, seen)
        if reason is not None:
            return track, None, reason
    body_rate = slope(turn) if sample.body_rate is None else np.array(sample.body_rate, np.float64)
    odometry = Odometry(time, position, velocity, quaternion, body_rate)
    return replace(track, odometry=odometry), odometry, None


def _strayed(
    checks: Checks,
    track: PoseTrack,
    before: tuple[float, np.ndarray, np.ndarray],
    velocity: np.ndarray,
    seen: np.ndarray,
) -> tuple[PoseTrack, str | None]:
    """Refuse a velocity that is too slow, zero, negated or in other axes: its path differs from the positions' path."""
    assert track.pose is not None
    dt = track.pose[0] - before[0]
    if not 0 < dt <= checks.gap:
        return replace(track, strayed=np.zeros(3), travelled=0.0), None
    kept = math.exp(-dt / TRAVEL_S)
    strayed = kept * track.strayed + velocity * dt - (track.pose[1] - before[1])
    speed = max(float(np.linalg.norm(velocity)), float(np.linalg.norm(seen)))
    travelled = kept * track.travelled + speed * dt
    off, limit = float(np.linalg.norm(strayed)), checks.velocity_drift + checks.velocity_share * travelled
    after = replace(track, strayed=strayed, travelled=travelled)
    if off <= limit:
        return after, None
    text = f"velocity: {velocity.round(3).tolist()} m/s and the last ones lead {off:.2g} m away from the positions"
    return after, f"{text}; accepted: {limit:.2g} m, in the world's axes"


def rotation_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(3,) the rotation vector from attitude `a` to `b`, both (4,) unit wxyz, in the axes of the body, rad.

    It is the logarithm of conj(a) b, for the shorter rotation.
    """
    w = float(a @ b)
    (aw, ax, ay, az), (bw, bx, by, bz) = a.tolist(), b.tolist()  # floats: many times faster than arrays of three
    vector = np.array(
        [
            aw * bx - bw * ax - ay * bz + az * by,
            aw * by - bw * ay - az * bx + ax * bz,
            aw * bz - bw * az - ax * by + ay * bx,
        ]
    )
    sine = math.sqrt(float(vector @ vector))
    if w < 0:
        w, vector = -w, -vector
    return vector * (2.0 if sine < 1e-12 else 2 * math.atan2(sine, w) / sine)
