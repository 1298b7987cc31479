"""Options and recipes: fly fast through a random forest, seen only by a camera."""

import dataclasses
import math
from dataclasses import dataclass
from typing import ClassVar

from e2efly.config import (
    AHEAD,
    AlgorithmConfig,
    BPTTConfig,
    EnvConfig,
    ForestConfig,
    NetworkConfig,
    Paper,
    PPOConfig,
    RewardConfig,
    Robust,
    Sourced,
    StageConfig,
    TaskConfig,
    TrainConfig,
    number,
)
from e2efly.config.domain import Domain, extent
from e2efly.config.numbers import SPEED
from e2efly.config.run import CRL_RACING
from e2efly.tasks.registry import register


@register("avoid")
@dataclass(frozen=True)
class AvoidConfig(TaskConfig):
    """Fly fast through a random forest, seen only by a camera."""

    world: ClassVar[str] = "e2efly.tasks.avoid.world:Avoid"
    goal_class: ClassVar[str] = "e2efly.tasks.avoid.goal:AvoidGoal"
    route: ClassVar[str] = "e2efly.tasks.avoid.goal:AvoidRoute"
    best: ClassVar = "bptt"
    precision: ClassVar = "pace"
    robust: ClassVar = {"bptt": Robust(steps=4_500_000, chunk=150, recurrent=96, hidden=(128, 64))}
    cameras: ClassVar = (dataclasses.replace(AHEAD, width=32, height=12),)
    curriculum: ClassVar = (
        StageConfig({"forest.density": 0.0, "speed": (2.0, 4.0)}, success=0.9, steps=1_000_000),
        StageConfig({"forest.density": 0.03, "speed": (2.0, 5.0)}, success=0.8, steps=2_000_000),
    )
    paper: ClassVar = Paper(
        weights={"prog1": 0.9, "ori1": 0.04, "v3": 0.002, "anglev": 0.002, "avoid2": 0.01},
        millions=(100, 50),
        silent=(
            Sourced("reward.weights.goal", 5.0, "the paper's weight in clutter", "ppo"),
            Sourced("reward.weights.crash", 4.0, "the paper's weight in clutter", "ppo"),
            Sourced("task.collisions_end", True, f"{CRL_RACING}: envs/droneGymEnv.py, is_collision", "ppo"),
        ),
        authors=(Sourced("task.episode_s", 20.0, "ours: the whole forest must fit into an episode"),),
    )

    episode_s: float = 20.0
    """Length of an episode, s."""
    forest: ForestConfig = ForestConfig()
    """The forest. Its lane is also the fence."""
    speed: tuple[float, float] = number((3.0, 10.0), high=SPEED, rising=True)
    """Commanded speed, m/s, uniform per episode."""
    sideways: float = 3.0
    """Largest start distance from the middle of the lane, m."""
    altitude: float = 1.5
    """Height to fly at above the ground, m."""
    ceiling: float = number(3.0, endless=True)
    """The episode fails above this height, m."""
    swing: float = number(0.0, high=5.0, added=True, sets_shapes=True)
    """Largest amplitude with which a trunk swings to and fro, upright, m. Each has its own, and its own level direction
    and phase. 0: they stand still (sets shapes)."""
    swing_period: tuple[float, float] = number((3.0, 8.0), low=0.5, rising=True, added=True)
    """Period of a trunk that swings, s."""
    collisions_end: bool = True
    """Whether a collision ends the episode. In training it does not, so that the policy learns from what follows."""

    @classmethod
    def training(cls) -> "AvoidConfig":
        """Collisions end no episode."""
        return cls(collisions_end=False)

    def criteria(self) -> dict[str, TaskConfig]:
        """Three speeds. Collisions end the episode."""
        return {
            f"{self.name}_{speed:g}": dataclasses.replace(self, speed=(speed, speed), collisions_end=True)
            for speed in (5.0, 8.0, 10.0)
        }

    def domain(self) -> Domain:
        """The commanded speed, and a forest up to a density: parts of every forest are thinner. If trunks move: how
        fast.
        """
        fastest = 2 * math.pi * self.swing / self.swing_period[0]
        return (
            *((extent("trunk_speed", "m/s", (0.0, fastest)),) if self.swing else ()),
            extent("speed", "m/s", self.speed),
            extent("tree_density", "1/m^2", (0.0, self.forest.density)),
            extent("trunk_radius", "m", self.forest.radius),
        )

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """With gradients: imitate an expert that knows every tree, and keep away from the trees."""
        weights = {"imitate": 1.0, "avoid": 10.0}
        parameters = {"avoid_reach": 0.5}
        settings: AlgorithmConfig = BPTTConfig(horizon=48, learning_rate_end=3e-4, gradient_decay=1.5, average=0.99)
        task, network = cls(), NetworkConfig((128, 64), pool=(12, 32), recurrent=64)
        curriculum: tuple[StageConfig, ...] = ()
        if algo == "ppo":
            weights = {"vel": 0.3, "avoid": 0.1, "anglev_sq": 0.002, "act2_sq": 0.02, "goal": 5.0, "crash": 5.0}
            settings, parameters = PPOConfig(learning_rate=2e-3, gamma=0.98), {}
            network, curriculum = dataclasses.replace(network, recurrent=0), cls.curriculum
        return TrainConfig(
            task, settings, RewardConfig(weights, parameters), EnvConfig(cameras=cls.cameras), network,
            steps=4_000_000, chunk=100, eval_episodes=250, curriculum=curriculum, fast_compile=False,
        )  # fmt: skip
