"""What racing on a fixed track and on any track share: the verdict. Imports no JAX."""

from typing import Any

from e2efly.control.vectors import Array
from e2efly.courses.gates import Gates
from e2efly.policy.goal import Goal, Outcome, Shape
from e2efly.tasks.verdicts import distance, touches_ground


class Racing(Goal):
    """Fly through gates in order."""

    config: Any
    """The options of the task, `laps` and `fence` among them."""
    shape: Shape

    def place(self, memory: Any) -> tuple[int, int]:
        """For a single flight (n = 1): the next gate and the lap, both counted from 1."""
        raise NotImplementedError

    def verdict(
        self, memory: Any, before: Any, after: Any, time: Array, gates: Gates, index: Array, end: Array, fence: Array
    ) -> tuple[Array, Outcome]:
        """The outcome of a step that ended at `time`, s, and which vehicles have passed a gate in it.

        `index` is the next gate, counted from 0 within a lap. `end` marks the vehicles that have finished if they pass
        it. `fence` is the largest allowed distance from it, m.
        """
        passed, missed, struck = gates.judge(index, before.position, after.position, self.shape.radius)
        error = distance(after.position, self.goal(memory, time))
        crashed = missed | struck | (error > fence) | touches_ground(self.shape, after)
        passed = passed & ~crashed
        finished = passed & end
        return passed, Outcome(
            terminated=crashed | finished, success=finished, arrived=passed, crashed=crashed, error=error,
            signals={"missed": missed, "struck": struck},
        )  # fmt: skip

    def failure(self, memory: Any, outcome: Outcome) -> str:
        """The gate that was missed or touched, if this is the reason."""
        where = "gate {} of lap {}".format(*self.place(memory))
        if outcome.signals["missed"][0]:
            return f"{where} missed"
        if outcome.signals["struck"][0]:
            return f"frame struck on the way to {where}"
        return f"{super().failure(memory, outcome)}, {where}"
