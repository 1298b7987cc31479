"""A vehicle where a pose source sees it: a real one, or one that another process flies."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from e2efly.deploy.odometry import Odometry
from e2efly.deploy.pose.checks import Checks
from e2efly.deploy.pose.source import PoseSource
from e2efly.deploy.pose.tracking import Track, track
from e2efly.scenes.faces import Body
from e2efly.vehicles import Vehicle
from e2efly.watch.frames import Frame, Stage

LOST_S, RESTART_S = 0.3, 1.0
"""A pose older than this is told to be lost; after so long without a good one tracking starts anew, s."""
TURNING = 400.0
"""Of rotors whose speed nobody tells, while the vehicle moves, rad/s."""


@dataclass
class Poses:
    """A source of frames: the newest pose, as it comes."""

    source: PoseSource
    """Opened; it is closed by who opened it."""
    vehicle: Vehicle
    """As it is drawn."""
    bodies: Sequence[Body] = ()
    """What stands in the poses' world."""
    period: float = field(default=1 / 30, init=False)
    origin: np.ndarray = field(default_factory=lambda: np.zeros(3), init=False)

    def __post_init__(self) -> None:
        self._stage = Stage(self.vehicle, self.bodies)
        self._track, self._odometry, self._received = Track(), None, -np.inf
        self._checks = Checks(max_age=LOST_S, frozen_after=np.inf, out_of_order="ignore")
        self._began = time.monotonic()
        self._refused: str | None = None
        self._odometry: Odometry | None

    def stage_of(self, followed: int) -> Stage:
        """The world of the poses."""
        del followed
        return self._stage

    def step(self, followed: int) -> Frame:
        """Where it was seen last; far below the ground before the first pose."""
        del followed
        now = time.monotonic()
        if self._track.fault and now - self._received > RESTART_S:
            self._track = Track()
        for sample in self.source.read(now):
            self._track, odometry, self._refused = track(self._checks, self._track, sample)
            if odometry is not None:
                self._odometry, self._received = odometry, now
        o, nowhere = self._odometry, np.array([[0.0, 0.0, -100.0]])
        lost = now - self._received > LOST_S
        told = f"no good pose from {self.source.describe()}{f' ({self._refused})' if self._refused else ''}"
        if o is None:
            level, still = np.array([[1.0, 0, 0, 0]]), np.zeros((1, 3))
            return Frame(now - self._began, nowhere, level, still, np.zeros((1, 4)), note=told)
        speed = float(np.linalg.norm(o.velocity))
        turning = np.full((1, 4), 0.0 if lost else TURNING)
        place = ", ".join(f"{x:.2f}" for x in o.position)
        note = f"**{place} m**, {speed:.1f} m/s" + (f"  \n{told}" if lost else "")
        return Frame(
            now - self._began, o.position[None], o.quaternion[None], o.velocity[None], turning,
            series={"speed (m/s)": (speed,)}, note=note,
        )  # fmt: skip
