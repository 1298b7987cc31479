"""Whether the images of a camera can be flown by: a pure state that every new frame goes through.

A policy must never act on an image that is stale or that shows nothing. What is wrong is a text: POLICY ends with it.
"""

import dataclasses
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from e2efly.control import Quat, Vec3
from e2efly.deploy.odometry import Odometry, tilt_of
from e2efly.deploy.policy.images import Image
from e2efly.deploy.sight.source import Frame

SLACK_S = 0.05
"""An image may be older than in training by this, s: 50 ms are a control step and a half."""
AHEAD_S = 0.005
"""A frame that was exposed so long after now, s, has a clock of its own."""
FROZEN = 3
"""So many equal images in a row that show something are no camera's: its noise alone would change them."""
DARK = 0.02
"""Colours below this, of 1, are black."""
BEYOND = 1.3
"""Nothing can be farther away than the ground: measured by this factor farther, and `BEYOND_M`, it contradicts it."""
BEYOND_M = 0.2
"""m."""
MOST = 0.7
"""Share of the lowest row that has to be so for an image to contradict the ground."""
WRONG = 10
"""So many images in a row that contradict the ground are of a camera that sits otherwise, upside down for example."""
LEVEL, TURNING = 0.35, 1.0
"""Tilt, rad, and body rate, rad/s, up to which a pose tells where the ground is in an image that is a little older."""


@dataclass(frozen=True)
class Seen:
    """What is known of one camera of a policy."""

    camera: Image
    """What the contract says of it."""
    frame: Frame | None = None
    """The newest that passed the checks."""
    fault: str | None = None
    """Why the newest frame did not pass; None: it did."""
    same: int = 1
    """Equal images in a row."""
    empty: bool = False
    """Whether the newest shows nothing."""
    wrong: int = 0
    """Images in a row that contradict where the ground is."""
    trouble: str | None = None
    """What the source says was wrong last: why none come, if it knows."""

    def problem(self, now: float) -> str | None:
        """Why no policy may act on the newest image; None: it may."""
        name, frame = f"image {self.camera.name!r}", self.frame
        why = f" ({self.trouble})" if self.trouble else ""
        if self.fault is not None:
            return f"{name}: {self.fault}"
        if frame is None:
            return f"{name}: none came yet{why}"
        if (age := now - frame.time) > self.oldest:
            return f"{name}: is {1e3 * age:.0f} ms old; accepted: at most {1e3 * self.oldest:.0f} ms{why}"
        if self.same >= FROZEN:
            return f"{name}: frozen: {self.same} equal images in a row"
        if self.empty:
            return f"{name}: shows nothing: {_EMPTY[self.camera.sees]}"
        if self.wrong >= WRONG:
            return f"{name}: sees farther than the ground (upside down?); accepted: mounted as the contract says"
        return None

    @property
    def oldest(self) -> float:
        """Largest age of an image that may be acted on, s: that of the training, an image's time, and `SLACK_S`."""
        return self.camera.latency_range_s[1] + 1 / self.camera.rate_hz + SLACK_S


_EMPTY = {
    "depth": "holes everywhere", "range": "holes everywhere", "rgb": "black", "normal": "no surface", "mask": "",
}  # fmt: skip


def see(
    seen: Seen,
    frames: Iterable[Frame],
    now: float,
    odometry: Odometry | None = None,
    ground: float = 0.0,
    trouble: str | None = None,
) -> Seen:
    """Take in new frames, oldest first.

    Args:
        seen: what was known.
        frames: as the source gave them.
        now: this machine's monotonic clock, s.
        odometry: the vehicle's motion in the air: it tells where the ground is in an image; None: it is not known.
        ground: height of the ground, world, m.
        trouble: what the source says was wrong last.
    """
    if trouble != seen.trouble:
        seen = dataclasses.replace(seen, trouble=trouble)
    for frame in frames:
        fault = _fault(seen, frame, now)
        if fault is not None:
            seen = dataclasses.replace(seen, fault=fault)
            continue
        shows, old, contradicts = _shows(seen.camera, frame.image), seen.frame, None
        same = shows and seen.camera.sees != "mask" and old is not None and np.array_equal(old.image, frame.image)
        if odometry is not None:
            contradicts = _contradicts(seen.camera, frame.image, odometry, ground)
        seen = dataclasses.replace(
            seen,
            frame=frame,
            fault=None,
            same=seen.same + 1 if same and np.ptp(frame.image) > 0 else 1,
            empty=not shows,
            wrong=seen.wrong if contradicts is None else seen.wrong + 1 if contradicts else 0,
        )
    return seen


def _fault(seen: Seen, frame: Frame, now: float) -> str | None:
    if frame.time > now + AHEAD_S:
        return f"was exposed {1e3 * (frame.time - now):.0f} ms from now; accepted: times by this machine's clock"
    if seen.frame is not None and frame.time <= seen.frame.time:
        return (
            f"was exposed {1e3 * (seen.frame.time - frame.time):.0f} ms before the one before; accepted: rising times"
        )
    try:
        seen.camera.check(frame.image, ())
    except ValueError as error:
        return str(error).removeprefix(f"image {seen.camera.name!r} ")
    return None


def _shows(camera: Image, image: np.ndarray) -> bool:
    """Whether there is anything in an image; a mask without its object is an image, too."""
    if camera.sees == "mask":
        return True
    return bool(np.any(image > DARK)) if camera.sees == "rgb" else bool(np.any(image != 0))


def _contradicts(camera: Image, image: np.ndarray, odometry: Odometry, ground: float) -> bool | None:
    """Whether the lowest row of a depth image is farther away than the ground there; None: it does not tell."""
    turning = float(np.linalg.norm(odometry.body_rate)) > TURNING
    if camera.sees != "depth" or camera.projection != "pinhole" or turning or tilt_of(odometry.quaternion) > LEVEL:
        return None
    across, down = (math.tan(angle / 2) for angle in camera.fov_rad)
    left = across * (1 - 2 * (np.arange(camera.width) + 0.5) / camera.width)
    low = -down * (1 - 1 / camera.height)
    sin, cos = math.sin(camera.pitch_rad), math.cos(camera.pitch_rad)
    ones = np.ones(camera.width)
    rays = Quat.of(odometry.quaternion).rotate(Vec3(ones * (cos + low * sin), left, ones * (low * cos - sin)))
    place = Quat.of(odometry.quaternion).rotate(Vec3(*camera.position_m))
    height = float(odometry.position[2]) + float(place.z) - ground
    depth = height / np.maximum(-np.asarray(rays.z), 1e-6)
    told = (depth > camera.reach_m[0]) & (depth * BEYOND + BEYOND_M < camera.reach_m[1]) & (image[-1] > 0)
    if told.mean() < MOST:
        return None
    return bool((image[-1] > BEYOND * depth + BEYOND_M)[told].mean() > MOST)
