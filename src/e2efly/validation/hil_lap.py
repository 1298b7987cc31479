"""One flight of a rehearsal of hardware in the loop, from the records of room, HIL node and bridge, and its verdict."""

import json
import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.flight.pilot.flight_state import Reason
from e2efly.logs.flight_log import FlightLog, read_log
from e2efly.policy.goal import Course
from e2efly.policy.odometry import Odometry
from e2efly.validation.processes import Victim
from e2efly.validation.room_process import RECORDED
from e2efly.validation.scenery import Scenery

GRACE_S = 0.15
"""Time after the end of the policy's flight on the bridge for which the true motion is still judged, s. The bridge's
poses are late."""
TOUCH = 2.5
"""Largest sink rate of a touch of the ground that counts as a landing, m/s."""


@dataclass(frozen=True)
class Spread:
    """Median, 99 % quantile and maximum of measured values, s. NaN if there are none."""

    median: float = math.nan
    p99: float = math.nan
    largest: float = math.nan

    @staticmethod
    def of(values: Any) -> "Spread":
        """The spread of any numbers. Those that are not finite are ignored."""
        known = np.asarray(values, np.float64).ravel()
        known = known[np.isfinite(known)]
        return Spread(*(float(x) for x in np.quantile(known, (0.5, 0.99, 1.0)))) if len(known) else Spread()


@dataclass(frozen=True)
class Truth:
    """The true motion of a flight in the room, t samples."""

    time: np.ndarray
    """(t,) this machine's monotonic clock, s."""
    position: np.ndarray
    """(t, 3) room, m."""
    velocity: np.ndarray
    """(t, 3) room, m/s."""
    quaternion: np.ndarray
    """(t, 4) wxyz, body to room."""
    behind: np.ndarray
    """(t,) lag of the room behind the clock, s."""

    @staticmethod
    def read(path: Path) -> "Truth":
        """Read it from the record of `room_process`."""
        rows = np.loadtxt(path, delimiter=",", ndmin=2).reshape(-1, len(RECORDED))
        at = {name: i for i, name in enumerate(RECORDED)}
        return Truth(
            rows[:, 0],
            rows[:, at["x"] : at["z"] + 1],
            rows[:, at["vx"] : at["vz"] + 1],
            rows[:, at["qw"] : at["qz"] + 1],
            rows[:, at["behind"]],
        )

    def between(self, begin: float, end: float) -> "Truth":
        """The part between two times, s."""
        rows = (self.time >= begin) & (self.time <= end)
        return Truth(*(x[rows] for x in vars(self).values()))

    def every(self, period: float) -> "Truth":
        """The samples nearest to times `period` s apart, from the first sample on."""
        if not len(self.time):
            return self
        moments = np.arange(self.time[0], self.time[-1] + 1e-9, period)
        rows = np.unique(np.clip(np.searchsorted(self.time, moments), 0, len(self.time) - 1))
        return Truth(*(x[rows] for x in vars(self).values()))


@dataclass(frozen=True)
class SceneChange:
    """A change of the bridge's mode."""

    time: float
    """This machine's monotonic clock, s."""
    mode: str
    reasons: tuple[str, ...]


@dataclass(frozen=True)
class Lap:
    """The results of a flight."""

    seed: int
    """Seed of its world."""
    kill: Victim | None = None
    """The process that was killed during the flight."""
    success: bool = False
    """The task's verdict on the true motion, with the condition that nothing in the world was hit."""
    told: str = "none"
    """How the policy did, as text."""
    nearest: float = math.nan
    """Smallest distance of the policy's flight to a solid, m. NaN: the world has none."""
    policy_s: float = 0.0
    """Duration of the policy's flight, s."""
    top_speed: float = 0.0
    """Largest speed of the policy, m/s."""
    changes: tuple[SceneChange, ...] = ()
    """The bridge's changes of mode."""
    pose_to_image: Spread = Spread()
    """Time from the arrival of the newest pose at the HIL node to the image, s."""
    image_age: Spread = Spread()
    """Age of the images when the policy uses them, s."""
    to_stick: Spread = Spread()
    """Time from the due time of a control step with images to its sticks, s. It adds to the age of the image."""
    pose_age: Spread = Spread()
    """Age of the poses at the bridge's control steps during the policy's flight, s."""
    lateness: Spread = Spread()
    """Lateness of the bridge's control steps during the policy's flight, s."""
    behind: Spread = Spread()
    """Lag of the room behind real time, s."""
    reaction: float = math.nan
    """Time from the kill to the bridge's next change of mode, s. NaN without either."""
    touch_speed: float = math.nan
    """Speed of the hardest touch of the ground, m/s."""
    touch_sink: float = math.nan
    """Downward part of this speed, m/s."""
    problems: tuple[str, ...] = ()
    """Everything that was not as required. Empty: everything was as required."""
    truth: Truth | None = None
    """The true motion, if it was recorded."""
    window: tuple[float, float] = (math.nan, math.nan)
    """Begin and end of the policy's flight, on this machine's monotonic clock, s."""
    begun: bool = True
    """Whether all processes were ready in their time. If not, nothing has flown: the flight does not count."""

    @property
    def good(self) -> bool:
        """Whether everything was as required, and the policy, if nothing was killed, did its task."""
        return not self.problems and (self.success or self.kill is not None)

    def as_json(self) -> dict[str, Any]:
        """All results except the true motion."""
        spreads = ("pose_to_image", "image_age", "to_stick", "pose_age", "lateness", "behind")
        return {
            **{name: getattr(self, name) for name in (
                "seed", "kill", "begun", "success", "told", "nearest", "policy_s", "top_speed", "reaction",
                "touch_speed", "touch_sink",
            )},
            **{f"{name}_s": vars(getattr(self, name)) for name in spreads},
            "modes": [[change.time, change.mode, list(change.reasons)] for change in self.changes],
            "problems": list(self.problems),
        }  # fmt: skip


@dataclass(frozen=True)
class Verdict:
    """The task's verdict on a true motion."""

    success: bool
    told: str
    nearest: float
    """Smallest distance to a solid, m. Infinite: there are no solids."""
    top_speed: float
    """Largest speed, m/s."""


def verdict(course: Course, scenery: Scenery, motion: Truth, began: float, period: float, radius: float) -> Verdict:
    """Let the task judge the true motion in the policy's flight.

    `began` is the time at which the world's time was 0, monotonic clock, s; `period` that of the control steps, s;
    `radius` that of the vehicle, m.
    """
    steps = motion.every(period)
    count, goal, memory = len(steps.time), course.goal, course.memory
    bodies = [
        Odometry(float(steps.time[i]), steps.position[i], steps.velocity[i], steps.quaternion[i], np.zeros(3))
        .seen_from(course.origin)
        .batch
        for i in range(count)
    ]
    arrivals, errors, outcome = list[float](), list[float](), None
    end = count
    for k in range(1, count):
        elapsed = float(steps.time[k] - steps.time[0])
        timed_out = np.array([k == count - 1])
        memory, outcome = goal.advance(memory, bodies[k - 1], bodies[k], np.array([elapsed]), timed_out)
        errors.append(float(outcome.error[0]))
        if outcome.arrived[0]:
            arrivals.append(elapsed)
        if outcome.terminated[0]:
            end = k + 1
            break
    if outcome is None:
        return Verdict(False, "none", math.nan, 0.0)
    last = float(steps.time[end - 1])
    flown = motion.between(float(steps.time[0]), last)
    near = scenery.nearest(list(flown.position), list(flown.time - began), course.origin)
    speed = np.linalg.norm(flown.velocity, axis=1)
    half = errors[len(errors) // 2 :]
    told = goal.told(arrivals, float(np.mean(half)), errors[-1], float(speed[-1]))
    hit = near <= radius
    good = bool(outcome.success[0]) and not hit
    return Verdict(good, f"{told}, hit something" if hit else told, near, float(speed.max()))


def clock_of(log: FlightLog) -> float:
    """Difference between the stamps of a log and the monotonic clock of its machine, s. NaN without odometry."""
    poses = log["odometry"]
    return (
        float(np.median(1e-9 * poses.stamp - poses.numbers("time") - poses.numbers("age"))) if len(poses) else math.nan
    )


def changes_of(log: FlightLog) -> tuple[SceneChange, ...]:
    """The bridge's changes of mode, from its log."""
    shift, modes = clock_of(log), log["mode"]
    return tuple(
        SceneChange(1e-9 * float(stamp) - shift, str(message["mode"]), tuple(map(str, message.get("reasons") or ())))
        for stamp, message in zip(modes.stamp, modes.values, strict=True)
    )


@dataclass
class Heard:
    """Notes taken during a flight, with times of the monotonic clock, s."""

    began: float = math.nan
    """When the policy took over."""
    ended: float = math.nan
    """When the bridge left the policy, or when it was killed."""
    struck: float = math.nan
    """When a process was killed."""
    touches: list[list[float]] = field(default_factory=list)
    """Touches in the form of `room_process.State`."""
    problems: list[str] = field(default_factory=list)


def lap_of(
    heard: Heard, course: Course, scenery: Scenery, period: float, radius: float, folder: Path, seed: int,
    kill: Victim | None,
) -> Lap:  # fmt: skip
    """The results of a flight, from the notes taken and the files in its folder, as far as they exist.

    `period` is that of the control steps, s; `radius` that of the vehicle, m.
    """
    truth, node = folder / "truth.csv", folder / "node.json"
    motion = Truth.read(truth) if truth.is_file() else None
    told: dict[str, Any] = json.loads(node.read_text(encoding="utf-8")) if node.is_file() else {}
    try:
        log = read_log(folder / "flight.mcap")
    except ValueError as error:
        return Lap(seed, kill, problems=(*heard.problems, str(error)), truth=motion)
    changes = changes_of(log)
    begin, end = _window(changes, heard)
    after = [change.time for change in changes if change.time > heard.struck]
    judged = Verdict(False, "none", math.nan, 0.0)
    if motion is not None and math.isfinite(begin):
        flown = motion.between(begin, end + GRACE_S)
        judged = verdict(course, scenery, flown, told.get("began") or begin, period, radius)
    broke_off = next((c for c in changes if c.time == end and str(Reason.POLICY_DONE) not in c.reasons), None)
    if broke_off is not None:
        hit = "hit something" if told.get("collisions") else "ended"
        judged = replace(judged, success=False, told=f"{hit} after {end - begin:.1f} s")
        if kill is None:
            heard.problems.append(f"the policy was ended by {broke_off.mode}: {'; '.join(broke_off.reasons)}")
    shift = clock_of(log)
    poses, steps, timing = log["odometry"], log["policy"], log["timing"]
    flying = 1e-9 * poses.stamp - shift
    ages = poses.numbers("age")[(flying >= begin) & (flying <= end)] if len(poses) else []
    up = next((c.time for c in changes if c.mode == "takeoff"), math.nan)
    on = motion.between(up, math.inf).behind if motion is not None and math.isfinite(up) else []
    width = steps.width("image_age")
    touch = max(heard.touches, key=lambda x: x[2]) if heard.touches else [math.nan] * 3
    return Lap(
        seed, kill, judged.success, judged.told,
        judged.nearest if math.isfinite(judged.nearest) else math.nan,
        max(end - begin, 0.0) if math.isfinite(begin) else 0.0, judged.top_speed, changes,
        pose_to_image=Spread.of(told.get("pose_to_image_s", [])),
        image_age=Spread.of(steps.numbers("image_age", width)) if width else Spread(),
        to_stick=Spread.of(_to_stick(log)) if width else Spread(),
        pose_age=Spread.of(ages),
        lateness=Spread.of(timing.numbers("lateness_s")[1e-9 * timing.stamp - shift >= up] if len(timing) else []),
        behind=Spread.of(on),
        reaction=after[0] - heard.struck if after else math.nan,
        touch_speed=touch[0], touch_sink=touch[2],
        problems=tuple(heard.problems), truth=motion, window=(begin, end),
    )  # fmt: skip


def _to_stick(log: FlightLog) -> np.ndarray:
    """Lateness and computing time of the rounds in which the policy was called, s."""
    steps, timing = log["policy"], log["timing"]
    if not len(timing):
        return np.zeros(0)
    asked = np.isin(timing.stamp, steps.stamp)
    return (timing.numbers("lateness_s") + timing.numbers("work_s"))[asked]


def _window(changes: tuple[SceneChange, ...], heard: Heard) -> tuple[float, float]:
    """Begin and end of the policy's flight from the log, or from the notes if the log ends too early."""
    begin = next((c.time for c in changes if c.mode == "policy"), heard.began)
    end = next((c.time for c in changes if c.time > begin), heard.ended)
    return begin, end
