"""A real vehicle in a virtual world: poses in, images of the world at those poses out, in real time."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from e2efly.control import Quat
from e2efly.courses.origin import Origin
from e2efly.deploy.odometry import Odometry
from e2efly.deploy.pose.checks import Checks
from e2efly.deploy.pose.source import PoseSource
from e2efly.deploy.pose.tracking import Track, track
from e2efly.deploy.sight.shared import SharedImages
from e2efly.validation.plant import RigidState
from e2efly.validation.scenery import Scenery

LOST_S = 0.1
"""A pose older than this shows nothing any more, s."""
RESTART_S = 1.0
"""After so long without a good pose tracking starts anew, s."""
STEPS = 4
"""From one image to the next the way of the vehicle is looked at in so many pieces."""
STRUCK_S = 1.0
"""For so long after a virtual collision there are no images, s: the policy's flight ends."""


@dataclass
class Node:
    """Renders what the vehicle's cameras would see, and publishes it."""

    scenery: Scenery
    source: PoseSource
    outputs: Sequence[SharedImages]
    """One for each camera."""
    origin: Origin
    """Of the scenery's world, in the room."""
    rate: float
    """Images per second."""
    radius: float
    """Of the vehicle, m."""
    checks: Checks = field(default_factory=lambda: Checks(max_age=LOST_S))
    """What a pose must satisfy."""
    tell: Callable[[str, dict[str, Any]], None] = lambda topic, message: None
    """Told each image's pose (`shown`), and by who runs it what else happens (`event`); it must not wait."""
    latencies: list[float] = field(default_factory=list, init=False)
    """Of each image: from the arrival of the newest pose to its publication, s."""
    times: list[float] = field(default_factory=list, init=False)
    """Of each image: when it was published, s."""
    collisions: int = field(default=0, init=False)
    """Virtual ones so far."""
    refused: str | None = field(default=None, init=False)
    """Why the newest pose was refused; None: it was not."""
    began: float | None = field(default=None, init=False)
    """When the world's time was 0, on the monotonic clock, s; None: it has not begun."""
    _track: Track = field(default=Track(), init=False)
    _odometry: Odometry | None = field(default=None, init=False)
    _received: float = field(default=-math.inf, init=False)
    _due: float = field(default=-math.inf, init=False)
    _blind_until: float = field(default=-math.inf, init=False)
    _count: int = field(default=0, init=False)
    _at: np.ndarray | None = field(default=None, init=False)
    """Where the vehicle was at the last image, in the scene, m; None: it was not seen then."""

    def warm(self) -> None:
        """Compile, so that the first image of a flight is not late."""
        state = RigidState(np.zeros(3), np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(3))
        self._images(state, 0.0)
        self._struck(np.zeros(3), np.zeros(3), 0.0)

    def step(self, now: float, clock: Callable[[], float]) -> str | None:
        """Take in poses, and publish where it is time to.

        Args:
            now: this machine's monotonic clock, s.
            clock: the same, to be read again once an image is out.

        Returns:
            What happened, for people; None: nothing new.
        """
        began = self.began = now if self.began is None else self.began
        if self._track.fault and now - self._received > RESTART_S:
            self._track = Track()  # it may have been carried elsewhere; the policy's flight has ended by now
        for sample in self.source.read(now):
            self._track, odometry, self.refused = track(self.checks, self._track, sample)
            if odometry is not None:
                self._odometry, self._received = odometry, sample.received
        if now < self._due:
            return None
        self._due = max(self._due + 1 / self.rate, now) if math.isfinite(self._due) else now + 1 / self.rate
        before, self._at = self._at, None
        if now < self._blind_until:
            return "no images: a virtual collision"
        if self._odometry is None or now - self._odometry.time > LOST_S:
            return f"no images: no good pose{f' ({self.refused})' if self.refused else ''}"
        shown = ahead(self._odometry, now)
        local = shown.seen_from(self.origin)
        self._at = local.position
        if self._struck(local.position if before is None else before, local.position, now - began):
            self.collisions, self._blind_until = self.collisions + 1, now + STRUCK_S
            return f"virtual collision at {local.position.round(2).tolist()} m of the scene"
        for output, image in zip(self.outputs, self._images(RigidState.of(local), now - began), strict=True):
            output.publish(now, image)
        self.times.append(clock())
        self.latencies.append(self.times[-1] - self._received)
        self.tell("shown", {
            "time": now, "position": shown.position.tolist(), "quaternion": shown.quaternion.tolist(),
            "scene_position": local.position.tolist(), "scene_quaternion": np.asarray(local.quaternion).tolist(),
            "scene_time": now - began, "pose_to_image": self.latencies[-1],
        })  # fmt: skip
        return "images"

    def _struck(self, before: np.ndarray, here: np.ndarray, time: float) -> bool:
        """Whether the vehicle comes too near to something on its way, scene, m."""
        way = list(np.linspace(before, here, STEPS + 1))
        return self.scenery.nearest(way, [time] * len(way), Origin(), self.radius) < self.radius

    def _images(self, state: RigidState, time: float) -> list[np.ndarray]:
        self._count += 1
        return self.scenery.images(state, time, self._count)


def ahead(odometry: Odometry, now: float) -> Odometry:
    """Where a vehicle is at `now`, s, by the last that is known: it goes on as it flew, and turns as it turned."""
    dt = min(max(now - odometry.time, 0.0), LOST_S)
    w, x, y, z = (1.0, *(0.5 * dt * odometry.body_rate).tolist())
    turned = Quat.of(odometry.quaternion).compose(Quat(w, x, y, z)).normalized()
    return replace(
        odometry,
        time=odometry.time + dt,
        position=odometry.position + dt * odometry.velocity,
        quaternion=np.array([float(part) for part in turned.stack()]),
    )
