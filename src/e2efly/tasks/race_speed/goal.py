"""Racing at a commanded speed: the goal, and the route of a flight. Imports no JAX."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.config import number
from e2efly.config.domain import Domain, extent
from e2efly.config.numbers import SPEED
from e2efly.config.storage import write_atomically
from e2efly.control.vectors import Array, namespace
from e2efly.courses.gates import Tracks
from e2efly.courses.tracks import track_text
from e2efly.policy.goal import Course, Shape
from e2efly.policy.observation import Field
from e2efly.tasks.race.any_goal import Ahead, AnyRaceGoal, AnyRaceMemory, towards
from e2efly.tasks.race.goal import GatesRoute
from e2efly.tasks.race_speed import RaceSpeedConfig
from e2efly.tasks.verdicts import distance

SLOW = 3.0
"""Speed of a flight for which none is given, m/s."""

QUICKEST = 1.6
"""Largest speed that is commanded, per metre from the next gate to the one after it, 1/s. Where gates stand close, a
vehicle has no time to turn from one to the other at any speed."""


@dataclass(frozen=True)
class RaceSpeedGoal(AnyRaceGoal):
    """Fly through gates in order, at a commanded speed."""

    config: RaceSpeedConfig
    shape: Shape

    def desired_velocity(self, memory: AnyRaceMemory, time: Array, body: Any) -> Array:
        """The commanded velocity: at the commanded speed, or at `QUICKEST` where this is slower."""
        here, there = (Ahead.of(memory).centre[:, i] for i in range(2))
        return towards(memory, body, namespace(here).minimum(memory.speed, QUICKEST * distance(here, there)))

    observation = (
        *AnyRaceGoal.observation,
        (
            Field("desired_velocity", 3, "world", "m/s", 4.0, "velocity to fly at, towards the next gate"),
            desired_velocity,
        ),
    )


@dataclass(frozen=True)
class RaceSpeedRoute(GatesRoute):
    """The track to race on, and the speed."""

    speed: float = number(SLOW, above=0, high=SPEED)
    """Commanded speed, m/s."""

    @property
    def notes(self) -> list[str]:
        """The speed."""
        return [f"It is told to fly at {self.speed:g} m/s (goal.speed)."]

    @classmethod
    def drawn(cls, course: Course, file: Path) -> "RaceSpeedRoute":
        """The route with the gates that were drawn, written to a file, and with the speed that was drawn."""
        memory: AnyRaceMemory = course.memory
        file.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(file, track_text(memory.tracks.track(0)).encode())
        return cls(track=str(file), laps=int(course.goal.config.laps), speed=float(memory.speed[0]))

    def domain(self) -> Domain:
        """The track, and the commanded speed."""
        return *super().domain(), extent("speed", "m/s", self.speed)

    def course(self, shape: Shape, control_period: float) -> Course:
        """The course along the track, from its start and with its heading."""
        track = self._track()
        goal = RaceSpeedGoal(dataclasses.replace(RaceSpeedConfig(), laps=self.laps), shape)
        return self._placed(goal, AnyRaceMemory(Tracks.of(track), np.zeros(1, int), np.array([self.speed])), track)
