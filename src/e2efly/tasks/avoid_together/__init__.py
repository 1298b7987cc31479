"""Options and recipes: several vehicles fly through the same random forest, seen only by their cameras."""

import dataclasses
from dataclasses import dataclass
from typing import ClassVar

from e2efly.config import Paper, TrainConfig, number
from e2efly.tasks.avoid import AvoidConfig
from e2efly.tasks.registry import register


@register("avoid_together")
@dataclass(frozen=True)
class AvoidTogetherConfig(AvoidConfig):
    """Fly through a random forest together with others, seen only by a camera."""

    world: ClassVar[str] = "e2efly.tasks.avoid_together.world:AvoidTogether"
    goal_class: ClassVar[str] = "e2efly.tasks.avoid_together.goal:AvoidTogetherGoal"
    route: ClassVar[str] = "e2efly.tasks.avoid.goal:AvoidRoute"
    paper: ClassVar[Paper | None] = None

    robust: ClassVar = {"bptt": dataclasses.replace(AvoidConfig.robust["bptt"], steps=2_000_000, start_from="avoid")}

    agents: int = number(4, low=2, high=16, sets_shapes=True)
    """Number of vehicles in a forest (sets shapes)."""

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """That of avoid, in whole worlds, from which the others are kept away, too."""
        config = super().recipe(algo)
        reward = dataclasses.replace(config.reward, weights={**config.reward.weights, "apart": 5.0})
        return dataclasses.replace(config, reward=reward)

    def check(self, control_rate: float, feet_height: float) -> None:
        """The starts have space beside each other."""
        super().check(control_rate, feet_height)
        if 2 * self.sideways < self.agents - 1:
            raise ValueError(
                f"task.sideways is {self.sideways}; accepted: {(self.agents - 1) / 2:g} m or more, so that "
                f"{self.agents} vehicles start 1 m apart"
            )
