"""A real vehicle in a virtual world: poses come in, and images of the world at those poses go out, in real time."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from e2efly.control import Quat
from e2efly.courses.origin import Origin
from e2efly.flight.pose.conditions import Checks
from e2efly.flight.pose.pose_source import PoseSource
from e2efly.flight.pose.tracking import PoseTrack, track
from e2efly.flight.sight.shared import SharedImages
from e2efly.policy.odometry import Odometry
from e2efly.validation.plant import RigidState
from e2efly.validation.scenery import Scenery

LOST_S = 0.1
"""Age above which a pose is not used for images, s."""
RESTART_S = 1.0
"""Time without a valid pose after which tracking restarts, s."""
STEPS = 4
"""Number of parts into which the vehicle's path between two images is divided for the collision check."""
STRUCK_S = 1.0
"""Time after a virtual collision without images, s. The policy's flight ends because of it."""


@dataclass
class Node:
    """Renders the images of the vehicle's cameras and publishes them."""

    scenery: Scenery
    source: PoseSource
    outputs: Sequence[SharedImages]
    """One output for each camera."""
    origin: Origin
    """Origin of the scenery's world in the room."""
    rate: float
    """Images per second."""
    radius: float
    """Radius of the vehicle, m."""
    checks: Checks = field(default_factory=lambda: Checks(max_age=LOST_S))
    """Conditions that a pose must satisfy."""
    tell: Callable[[str, dict[str, Any]], None] = lambda topic, message: None
    """Function that is called with each image's pose (`shown`), and by the node's runner with other events (`event`).
    It must not wait."""
    latencies: list[float] = field(default_factory=list, init=False)
    """For each image: time from the arrival of the newest pose to publication, s."""
    times: list[float] = field(default_factory=list, init=False)
    """For each image: time of publication, s."""
    collisions: int = field(default=0, init=False)
    """Number of virtual collisions so far."""
    refused: str | None = field(default=None, init=False)
    """Why the newest pose was refused. None: it was not refused."""
    began: float | None = field(default=None, init=False)
    """Time at which the world's time was 0, on the monotonic clock, s. None: it has not begun."""
    _track: PoseTrack = field(default=PoseTrack(), init=False)
    _odometry: Odometry | None = field(default=None, init=False)
    _received: float = field(default=-math.inf, init=False)
    _due: float = field(default=-math.inf, init=False)
    _blind_until: float = field(default=-math.inf, init=False)
    _count: int = field(default=0, init=False)
    _at: np.ndarray | None = field(default=None, init=False)
    """Position of the vehicle at the last image, in the scene, m. None: there was no valid pose then."""

    def warm(self) -> None:
        """Compile the programs, so that the first image of a flight is not late."""
        state = RigidState(np.zeros(3), np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(3))
        self._images(state, 0.0)
        self._struck(np.zeros(3), np.zeros(3), 0.0)

    def step(self, now: float, clock: Callable[[], float]) -> str | None:
        """Read poses, and publish images if they are due. The clock is read again after an image is published.

        Returns:
            What happened, as text. None: nothing new.
        """
        began = self.began = now if self.began is None else self.began
        if self._track.fault and now - self._received > RESTART_S:
            self._track = (
                PoseTrack()
            )  # the vehicle may have been carried elsewhere; the policy's flight has ended by now
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
        """Whether the vehicle comes too near to an obstacle on its way, scene, m."""
        way = list(np.linspace(before, here, STEPS + 1))
        return self.scenery.nearest(way, [time] * len(way), Origin(), self.radius) < self.radius

    def _images(self, state: RigidState, time: float) -> list[np.ndarray]:
        self._count += 1
        return self.scenery.images(state, time, self._count)


def ahead(odometry: Odometry, now: float) -> Odometry:
    """The predicted motion of a vehicle at `now`, s, from its last known motion. Velocity and body rates are kept."""
    dt = min(max(now - odometry.time, 0.0), LOST_S)
    w, x, y, z = (1.0, *(0.5 * dt * odometry.body_rate).tolist())
    turned = Quat.of(odometry.quaternion).compose(Quat(w, x, y, z)).normalized()
    return replace(
        odometry,
        time=odometry.time + dt,
        position=odometry.position + dt * odometry.velocity,
        quaternion=np.array([float(part) for part in turned.stack()]),
    )
