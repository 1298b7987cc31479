"""Options and recipes: several vehicles fly through the same random forest, seen only by their cameras."""

import dataclasses
from dataclasses import dataclass
from typing import Any, ClassVar

from e2efly.config import ALGORITHMS, Paper, TrainConfig, number
from e2efly.tasks.avoid import AvoidConfig
from e2efly.tasks.registry import register


@register("avoid_together")
@dataclass(frozen=True)
class AvoidTogetherConfig(AvoidConfig):
    """Fly through a random forest together with others, seen only by a camera."""

    world: ClassVar[str] = "e2efly.tasks.avoid_together.world:AvoidTogether"
    paper: ClassVar[Paper | None] = None

    robust: ClassVar = {
        "bptt": dataclasses.replace(AvoidConfig.robust["bptt"], steps=2_000_000, start_from="avoid"),
    }

    agents: int = number(3, low=2, high=16, sets_shapes=True)
    """Number of vehicles in a forest (sets shapes)."""

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """That of avoid, in whole worlds, from which the others are kept away, too."""
        config = super().recipe(algo)
        reward = dataclasses.replace(config.reward, weights={**config.reward.weights, "apart": 5.0})
        settings = dataclasses.replace(config.algo, envs=96)
        return dataclasses.replace(config, reward=reward, algo=settings, eval_episodes=252)

    @classmethod
    def with_critic(cls, algo: str) -> dict[str, Any]:
        """ABPT's buffers fit its own number of environments. It refuses worlds of several vehicles."""
        return {**super().with_critic(algo), **({"envs": ALGORITHMS[algo]().envs} if algo == "abpt" else {})}

    def check(self, control_rate: float, feet_height: float) -> None:
        """The starts have space beside each other."""
        super().check(control_rate, feet_height)
        if 2 * self.sideways < self.agents - 1:
            raise ValueError(
                f"task.sideways is {self.sideways}; accepted: {(self.agents - 1) / 2:g} m or more, so that "
                f"{self.agents} vehicles start 1 m apart"
            )
