"""The pose source `gates:` of a whole flight on a bench: rendered images, and the IMU of the autopilot. Imports JAX."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.flight.pose.gates.gate_setup import GateSetup
from e2efly.flight.pose.gates.gate_source import GateSource
from e2efly.flight.pose.gates.lens import Corners
from e2efly.policy.goal import Course
from e2efly.policy.odometry import Sample
from e2efly.validation.bridge_session import FlightBench
from e2efly.validation.gate_pose import GateCamera, GateEyes, track_of
from e2efly.validation.plant import RigidState


@dataclass
class RigLooks:
    """The camera of a flight on a bench, whose true state is `state()`, in a room in which the course has its place."""

    eyes: GateEyes
    state: Callable[[], Any]
    problem: None = None

    def read(self, now: float) -> list[tuple[float, Corners]]:
        """See `gate_source.Looks`."""
        return self.eyes.see(now, RigidState.of(self.state()))

    def close(self) -> None:
        """Nothing to release."""

    def describe(self) -> str:
        """The camera."""
        camera = self.eyes.setup.camera
        return f"a rendered mask, {camera.width} x {camera.height} pixels, {camera.rate:g} Hz"


class LatePoses(GateSource):
    """Poses that are told a latency after they were true, as the policy was trained for."""

    def __init__(self, setup: GateSetup, looks: RigLooks, latency: float) -> None:
        """See `GateSource`. The latency is in s."""
        super().__init__(setup, looks)
        self._latency, self._waiting = latency, list[Sample]()

    def read(self, now: float) -> list[Sample]:
        """The poses of a latency ago, and older ones that have not been told."""
        self._waiting.extend(super().read(now))
        ready = [sample for sample in self._waiting if (sample.stamp or 0.0) + self._latency <= now]
        self._waiting = self._waiting[len(ready) :]
        return [dataclasses.replace(sample, received=now) for sample in ready]


def gate_poses(rig: FlightBench, setup: GateCamera, course: Course, seed: int) -> GateSource:
    """The pose source of a whole flight on a bench, put down at the start of its course.

    Raises:
        ValueError: as for `track_of`.
    """
    known, origin = track_of(course), course.origin
    track = dataclasses.replace(known, position=origin.points(known.position), yaw=known.yaw + origin.yaw)
    x, y = origin.points(course.start)[:2]
    heading = known.start_yaw if course.heading is None else course.heading
    start = np.array([x, y, rig.world.vehicle.feet_height, heading + origin.yaw])
    c = setup.camera
    told = GateSetup(track, start, setup.lens, c.rate or 30.0, 0.0, setup.noise)  # stamps are of the exposure
    return LatePoses(told, RigLooks(GateEyes.of(setup, track, seed), lambda: rig.state), rig.latency)
