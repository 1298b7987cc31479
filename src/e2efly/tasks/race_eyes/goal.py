"""Racing by eye: the route of a flight. Imports no JAX."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from e2efly.config import number
from e2efly.config.storage import write_atomically
from e2efly.courses.gates import Tracks
from e2efly.courses.tracks import RaceTrack, track_text
from e2efly.policy.goal import Course, Shape
from e2efly.tasks.race.any_goal import AnyRaceGoal, AnyRaceMemory
from e2efly.tasks.race.goal import GatesRoute
from e2efly.tasks.race_eyes import RaceEyesConfig


@dataclass(frozen=True)
class RaceEyesRoute(GatesRoute):
    """The track to race on."""

    scale: float = number(2.0, above=0)
    """Factor by which the ground plan of the track is enlarged."""

    @classmethod
    def drawn(cls, course: Course, file: Path) -> "RaceEyesRoute":
        """The route with the gates that were drawn, written to a file."""
        memory: AnyRaceMemory = course.memory
        file.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(file, track_text(memory.tracks.track(0)).encode())
        return cls(track=str(file), scale=1.0, laps=int(course.goal.config.laps))

    def _track(self) -> RaceTrack:
        return super()._track().enlarged(self.scale)

    def course(self, shape: Shape, control_period: float) -> Course:
        """The course along the track, from its start and with its heading."""
        track = self._track()
        goal = AnyRaceGoal(dataclasses.replace(RaceEyesConfig(), laps=self.laps), shape)
        return self._placed(goal, AnyRaceMemory(Tracks.of(track), np.zeros(1, int)), track)
