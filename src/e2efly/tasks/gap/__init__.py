"""Options and recipes: fly through a narrow slit in a wall. The slit is tilted, so only a banked vehicle fits."""

import dataclasses
from dataclasses import dataclass
from typing import ClassVar

from e2efly.config import AlgorithmConfig, BPTTConfig, PPOConfig, RewardConfig, Robust, TaskConfig, TrainConfig, number
from e2efly.config.domain import Domain, extent
from e2efly.config.numbers import ANGLE, SPEED
from e2efly.tasks.registry import register


@register("gap")
@dataclass(frozen=True)
class GapConfig(TaskConfig):
    """Fly through a narrow slit in a wall. The slit is tilted, so only a banked vehicle fits."""

    world: ClassVar[str] = "e2efly.tasks.gap.world:Gap"
    goal_class: ClassVar[str] = "e2efly.tasks.gap.goal:GapGoal"
    route: ClassVar[str] = "e2efly.tasks.gap.goal:GapRoute"
    best: ClassVar = "bptt"
    robust: ClassVar = {
        "bptt": Robust(
            algo={"average": 0.99}, steps=10_000_000, chunk=60, recurrent=96, hidden=(96, 96), eased=(0.4, 4_000_000)
        )
    }

    episode_s: float = 6.0
    """Length of an episode, s."""
    distance: tuple[float, float] = number((2.5, 4.0), rising=True)
    """Distance from the start to the slit, m, uniform."""
    sideways: float = 0.5
    """Half-width of the slit's random offset from straight ahead, m per axis."""
    altitude: float = 2.0
    """Height of the start, m."""
    yaw: float = number(0.3, high=ANGLE)
    """Half-width of the wall's random rotation about the up axis, rad."""
    roll: tuple[float, float] = number((0.4, 0.8), high=ANGLE, rising=True)
    """Tilt of the slit to either side, rad, uniform."""
    opening: tuple[float, float] = number((0.7, 0.18), above=0)
    """Long and short side of the slit, m."""
    thickness: float = 0.1
    """Thickness of the wall, m."""
    approach: float = number(1.5, high=SPEED)
    """The vehicle counts as approaching when it is nearer to the wall than this, m."""
    beyond: float = 2.0
    """Success: distance behind the slit of the point that must be reached, m."""
    radius: float = number(0.5, above=0)
    """Success: largest distance from that point, m."""
    fence: float = number(6.0, above=0, endless=True)
    """The episode fails farther than this from the next target, m."""
    collisions_end: bool = True
    """Whether a collision ends the episode. In training it does not, so that the policy learns from what follows."""

    @property
    def own_worlds(self) -> bool:
        """Each episode has its own wall."""
        return True

    @classmethod
    def training(cls) -> "GapConfig":
        """Collisions end no episode."""
        return cls(collisions_end=False)

    def criteria(self) -> dict[str, TaskConfig]:
        """Collisions end the episode."""
        return {self.name: dataclasses.replace(self, collisions_end=True)}

    def domain(self) -> Domain:
        """The slit. It is tilted to either side."""
        return (
            extent("slit_distance", "m", self.distance),
            extent("slit_tilt", "rad", self.roll),
            extent("slit_length", "m", self.opening[0]),
            extent("slit_width", "m", self.opening[1]),
            extent("wall_thickness", "m", self.thickness),
        )

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """Rewards for coming nearer, and for an attitude and a position with which the vehicle fits."""
        constants = {"desired_speed": 2.0, "fit_margin": 0.02, "fit_limit": 0.1}
        if algo == "ppo":
            weights = {
                "prog1": 1.0, "ori4": 0.1, "fit": 1.0, "overspeed": 0.02, "anglev_sq": 0.0005, "act2_sq": 0.005,
                "goal": 1.0, "crash": 1.0,
            }  # fmt: skip
            settings: AlgorithmConfig = PPOConfig(gamma=0.97, learning_rate=5e-3, learning_rate_end=5e-4)
            return TrainConfig(cls.training(), settings, RewardConfig(weights, constants), steps=3_000_000)
        weights = {
            "prog1": 1.0, "near": 0.1, "ori4": 0.1, "fit": 1.0, "overspeed": 0.02, "anglev_sq": 0.0005,
            "act2_sq": 0.005,
        }  # fmt: skip
        settings = BPTTConfig(learning_rate=6e-3, max_grad_norm=1.0, gradient_decay=1.0)
        return TrainConfig(cls.training(), settings, RewardConfig(weights, constants), steps=6_000_000, chunk=60)
