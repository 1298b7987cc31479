"""Whether the images of a camera are good enough to fly with: a pure state that processes every new frame.

A policy must never act on an image that is stale or that shows nothing. A problem is given as a text, and ends POLICY.
"""

import dataclasses
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from e2efly.control import Quat, Vec3
from e2efly.flight.sight.image_source import Frame
from e2efly.policy.images import Image
from e2efly.policy.odometry import Odometry, tilt_of

SLACK_S = 0.05
"""How much older than in training an image may be, s. 50 ms is one and a half control steps."""
AHEAD_S = 0.005
"""A frame that was exposed this long after now, s, has times of another clock."""
FROZEN = 3
"""This many equal images in a row that show something do not come from a real camera. Its noise alone would change
them."""
DARK = 0.02
"""Colours below this value, with 1 as the maximum, are black."""
BEYOND = 1.3
"""Nothing can be farther away than the ground. An image contradicts the ground if it measures more than this factor
times the ground's distance, plus `BEYOND_M`."""
BEYOND_M = 0.2
"""The distance that is added, m."""
MOST = 0.7
"""Share of the lowest row that has to be too far away for an image to contradict the ground."""
WRONG = 5
"""After this many images in a row that contradict the ground, the camera is mounted differently, upside down for
example."""
MOUNTED, FIELD = 0.06, 0.04
"""How far a camera may be off its mount, rad, and by which share its field of view may be smaller: as in the training
of the preset `robust`."""
STANDING = 0.2
"""Height of a camera over the ground below which the vehicle may stand on something, m."""
LEVEL, TURNING = 0.35, 1.0
"""The largest tilt, rad, and body rate, rad/s, at which a pose still tells where the ground is in a slightly older
image."""


@dataclass(frozen=True)
class SeenImages:
    """What is known about one camera of a policy."""

    camera: Image
    """The camera of the contract."""
    frame: Frame | None = None
    """The newest frame that passed the checks."""
    fault: str | None = None
    """Why the newest frame did not pass. None: it passed."""
    same: int = 1
    """Number of equal images in a row."""
    empty: bool = False
    """Whether the newest image shows nothing."""
    wrong: int = 0
    """Number of images in a row that contradict the position of the ground."""
    trouble: str | None = None
    """The last problem that the source reported. It says why no images come, if the source knows."""

    def problem(self, now: float) -> str | None:
        """Why no policy may act on the newest image. None: it may."""
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
        """The largest age of an image on which a policy may act, s. It is the largest latency of the training plus one
        image period plus `SLACK_S`.
        """
        return self.camera.latency_range_s[1] + 1 / self.camera.rate_hz + SLACK_S


_EMPTY = {
    "depth": "holes everywhere", "range": "holes everywhere", "rgb": "black", "normal": "no surface", "mask": "",
}  # fmt: skip


def see(
    seen: SeenImages,
    frames: Iterable[Frame],
    now: float,
    odometry: Odometry | None = None,
    ground: float = 0.0,
    trouble: str | None = None,
) -> SeenImages:
    """Process new frames, oldest first. `now` is on this machine's monotonic clock, s. The vehicle's motion in the air
    tells where the ground is in an image. `ground` is its height, world, m. `trouble` is the last problem that the
    source reported.
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
            contradicts = _contradicts(seen.camera, frame.image, odometry, ground, now - frame.time)
        seen = dataclasses.replace(
            seen,
            frame=frame,
            fault=None,
            same=seen.same + 1 if same and np.ptp(frame.image) > 0 else 1,
            empty=not shows,
            wrong=seen.wrong if contradicts is None else seen.wrong + 1 if contradicts else 0,
        )
    return seen


def _fault(seen: SeenImages, frame: Frame, now: float) -> str | None:
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
    """Whether an image shows anything. A mask without its object is also a valid image."""
    if camera.sees == "mask":
        return True
    return bool(np.any(image > DARK)) if camera.sees == "rgb" else bool(np.any(image != 0))


def _contradicts(camera: Image, image: np.ndarray, odometry: Odometry, ground: float, age: float) -> bool | None:
    """Whether the lowest row of a depth image is farther away than the ground there, also if the camera is off by
    `MOUNTED` and `FIELD`, and if the vehicle has turned down in the `age` s since the exposure. None: the image cannot
    tell.
    """
    turning = float(np.linalg.norm(odometry.body_rate))
    usable = camera.sees == "depth" and camera.projection == "pinhole" and turning <= TURNING
    if not usable or tilt_of(odometry.quaternion) > LEVEL:
        return None
    across, down = (math.tan(angle / 2) for angle in camera.fov_rad)
    left = across * (1 - 2 * (np.arange(camera.width) + 0.5) / camera.width)
    low = -down * (1 - 1 / camera.height)
    sin, cos = math.sin(camera.pitch_rad), math.cos(camera.pitch_rad)
    ones = np.ones(camera.width)
    rays = Quat.of(odometry.quaternion).rotate(Vec3(ones * (cos + low * sin), left, ones * (low * cos - sin)))
    place = Quat.of(odometry.quaternion).rotate(Vec3(*camera.position_m))
    height = float(odometry.position[2]) + float(place.z) - ground
    if height < STANDING:
        return None
    higher = MOUNTED - FIELD * low + turning * max(age, 0.0)
    depth = height / np.maximum(-np.asarray(rays.z) - higher, 1e-6)
    told = (depth > camera.reach_m[0]) & (depth * BEYOND + BEYOND_M < camera.reach_m[1]) & (image[-1] > 0)
    if told.mean() < MOST:
        return None
    return bool((image[-1] > BEYOND * depth + BEYOND_M)[told].mean() > MOST)
