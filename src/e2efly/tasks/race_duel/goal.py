"""Racing against others: the goal, and the route of a flight. Imports no JAX."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.control.vectors import Array
from e2efly.courses.gates import Gates
from e2efly.policy.goal import Course, Observed, Outcome, Shape
from e2efly.policy.observation import Company
from e2efly.policy.others import Others, company_of, nobody, others_fields
from e2efly.tasks.race.goal import GatesRoute, RaceGoal
from e2efly.tasks.race.racing import Racing
from e2efly.tasks.race_duel import RaceDuelConfig

RACING = 20.0
"""Speed that no racer exceeds, m/s."""


@dataclass(frozen=True)
class RaceDuelMemory:
    """How far each racer is, and the others."""

    passed: Array
    """(n,) number of gates passed."""
    others: Others
    """The others that the policy observes, the nearest first."""


@dataclass(frozen=True)
class RaceDuelGoal(Racing):
    """Fly through the gates of a race among others."""

    config: RaceDuelConfig
    shape: Shape
    track: Gates
    closed: bool
    """Whether the first gate follows the last."""
    control_period: float
    checks: int
    """Number of collision checks per control step."""

    @property
    def race(self) -> RaceGoal:
        """The same race without the others."""
        return RaceGoal(self.config, self.shape, self.track, self.closed)

    @property
    def neighbours(self) -> int:
        """See `RaceDuelConfig.neighbours`."""
        return self.config.neighbours

    @property
    def company(self) -> Company:
        """The others may be anywhere on the track."""
        gates = np.asarray(self.track.position)
        return company_of(self.neighbours, float(np.linalg.norm(np.ptp(gates, axis=0))), RACING)

    def among(self, memory: RaceDuelMemory, others: Others) -> RaceDuelMemory:
        """The state with these others."""
        return dataclasses.replace(memory, others=others)

    def place(self, memory: RaceDuelMemory) -> tuple[int, int]:
        """See `Racing.place`."""
        return self.race.place(memory.passed)

    def goal(self, memory: RaceDuelMemory, time: Array) -> Array:
        """The next gate's centre."""
        return self.race.goal(memory.passed, time)

    def gates(self, memory: RaceDuelMemory, time: Array, body: Any) -> Array:
        """See `RaceGoal.target_offsets`."""
        return self.race.target_offsets(memory.passed, time, body)

    def others(self, memory: RaceDuelMemory, time: Array, body: Any) -> Array:
        """See `Others.offsets`."""
        return memory.others.offsets(body)

    def others_velocity(self, memory: RaceDuelMemory, time: Array, body: Any) -> Array:
        """See `Others.motion`."""
        return memory.others.motion(body)

    @property
    def observable(self) -> tuple[Observed, ...]:
        """What a racer alone observes, and the nearest others."""
        (gates, _), cls = RaceGoal.observation[0], RaceDuelGoal
        where, motion = others_fields(self.config.neighbours)
        return ((gates, cls.gates), (where, cls.others), (motion, cls.others_velocity))

    def advance(
        self, memory: RaceDuelMemory, before: Any, after: Any, time: Array, timed_out: Array
    ) -> tuple[RaceDuelMemory, Outcome]:
        """The verdict on a racer alone, of the same race."""
        passed, outcome = self.race.advance(memory.passed, before, after, time, timed_out)
        return dataclasses.replace(memory, passed=passed), outcome

    def told(self, arrivals: Sequence[float], mean_error: float, final_error: float, speed: float) -> str:
        """See `RaceGoal.told`."""
        return self.race.told(arrivals, mean_error, final_error, speed)


@dataclass(frozen=True)
class RaceDuelRoute(GatesRoute):
    """The track to race on, among others."""

    def course(self, shape: Shape, control_period: float) -> Course:
        """The course along the track, from its start and with its heading."""
        track = self._track()
        config = dataclasses.replace(RaceDuelConfig(), laps=self.laps)
        goal = RaceDuelGoal(config, shape, Gates.of(track), track.closed, control_period, 1)
        memory = RaceDuelMemory(np.zeros(1, int), nobody(track.start[None], goal.neighbours))
        return self._placed(goal, memory, track)
