"""Shows a vehicle at the poses of a pose source: a real vehicle, or one that another process flies."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from e2efly.flight.pose.conditions import Checks
from e2efly.flight.pose.pose_source import PoseSource
from e2efly.flight.pose.tracking import PoseTrack, track
from e2efly.policy.odometry import Odometry
from e2efly.simulation.scenes.faces import FacesBody
from e2efly.vehicles.vehicle import Vehicle
from e2efly.viewing.watch.stage import Stage, StageFrame

LOST_S, RESTART_S = 0.3, 1.0
"""`LOST_S`: a pose older than this is reported as lost, s. `RESTART_S`: after this time without a good pose, tracking
starts anew, s."""
TURNING = 400.0
"""Rotor speed that is drawn while the vehicle moves, if the real speed is not known, rad/s."""


@dataclass
class Poses:
    """A source of frames: always the newest pose."""

    source: PoseSource
    """An open pose source. The caller that opened it closes it."""
    vehicle: Vehicle
    """The vehicle that is drawn."""
    bodies: Sequence[FacesBody] = ()
    """Solids in the world of the poses."""
    period: float = field(default=1 / 30, init=False)
    origin: np.ndarray = field(default_factory=lambda: np.zeros(3), init=False)

    def __post_init__(self) -> None:
        self._stage = Stage(self.vehicle, self.bodies)
        self._track, self._odometry, self._received = PoseTrack(), None, -np.inf
        self._checks = Checks(max_age=LOST_S, frozen_after=np.inf, out_of_order="ignore")
        self._began = time.monotonic()
        self._refused: str | None = None
        self._odometry: Odometry | None

    def stage_of(self, followed: int) -> Stage:
        """The world of the poses."""
        del followed
        return self._stage

    def step(self, followed: int) -> StageFrame:
        """The vehicle at its last pose. Before the first pose, far below the ground."""
        del followed
        now = time.monotonic()
        if self._track.fault and now - self._received > RESTART_S:
            self._track = PoseTrack()
        for sample in self.source.read(now):
            self._track, odometry, self._refused = track(self._checks, self._track, sample)
            if odometry is not None:
                self._odometry, self._received = odometry, now
        o, nowhere = self._odometry, np.array([[0.0, 0.0, -100.0]])
        lost = now - self._received > LOST_S
        told = f"no good pose from {self.source.describe()}{f' ({self._refused})' if self._refused else ''}"
        if o is None:
            level, still = np.array([[1.0, 0, 0, 0]]), np.zeros((1, 3))
            return StageFrame(now - self._began, nowhere, level, still, np.zeros((1, 1)), note=told)
        speed = float(np.linalg.norm(o.velocity))
        turning = np.full((1, 1), 0.0 if lost else TURNING)
        place = ", ".join(f"{x:.2f}" for x in o.position)
        note = f"{place} m, {speed:.1f} m/s" + (f"\n{told}" if lost else "")
        return StageFrame(
            now - self._began, o.position[None], o.quaternion[None], o.velocity[None], turning,
            series={"speed (m/s)": (speed,)}, note=note,
        )  # fmt: skip
