"""Options and recipes: several vehicles exchange their places."""

import dataclasses
import math
from dataclasses import dataclass
from typing import ClassVar

from e2efly.config import (
    AlgorithmConfig,
    BPTTConfig,
    CameraConfig,
    DAggerConfig,
    EnvConfig,
    ImageNoiseConfig,
    NetworkConfig,
    PPOConfig,
    RewardConfig,
    TaskConfig,
    TrainConfig,
    number,
)
from e2efly.config.algorithms import EXPERT
from e2efly.config.domain import Domain, extent
from e2efly.config.numbers import SPEED
from e2efly.tasks.registry import register

RING = CameraConfig(
    "range", width=64, height=16, projection="spherical", fov=(2 * math.pi, math.pi / 2), reach=(0.1, 6.0),
    encoding="log", noise=ImageNoiseConfig(gaussian=0.003),
)  # fmt: skip
"""A ring of small range sensors that see all around and 45 degrees up and down, with an error of 2 cm."""
SENSED = ("position_error", "attitude", "velocity", "body_rate", "past_actions")
"""What a vehicle knows that is not told of the others."""


@register("swap")
@dataclass(frozen=True)
class SwapConfig(TaskConfig):
    """Several vehicles exchange their places, and none touches another."""

    world: ClassVar[str] = "e2efly.tasks.swap.world:Swap"
    goal_class: ClassVar[str] = "e2efly.tasks.swap.goal:SwapGoal"
    route: ClassVar[str] = "e2efly.tasks.swap.goal:SwapRoute"
    best: ClassVar = "bptt"
    shows_error: ClassVar = True
    variants: ClassVar = ("depth",)

    agents: int = number(8, low=2, high=64, sets_shapes=True)
    """Number of vehicles in a world (sets shapes)."""
    neighbours: int = number(2, low=1, high=63, sets_shapes=True)
    """Number of nearest others that a vehicle observes (sets shapes)."""
    episode_s: float = 10.0
    """Length of an episode, s."""
    centre: tuple[float, float, float] = number((0.0, 0.0, 2.0), low=-math.inf)
    """Middle of the places, world, m."""
    side: float = number(5.0, above=0)
    """Side of the square in which the places are, m."""
    height: float = 0.5
    """Largest distance of a place above or below the middle, m."""
    apart: float = 0.9
    """Smallest horizontal distance between two places, m."""
    speed: float = number(2.0, above=0, high=SPEED)
    """Speed from which on the reward term `overspeed` counts, m/s."""
    radius: float = number(0.2, above=0)
    """Success: largest distance from the goal, m."""
    hold_s: float = 1.0
    """Success: every vehicle of the world must stay there for this last part of the episode, s."""
    fence: float = number(10.0, above=0, endless=True)
    """The episode fails farther than this from the middle, m."""
    collisions_end: bool = True
    """Whether a collision ends the episode of the whole world. In training it does not, so that the policy learns from
    what follows."""

    @classmethod
    def training(cls) -> "SwapConfig":
        """Collisions end no episode."""
        return cls(collisions_end=False)

    def criteria(self) -> dict[str, TaskConfig]:
        """Collisions end the episode."""
        return {self.name: dataclasses.replace(self, collisions_end=True)}

    @property
    def cells(self) -> int:
        """Number of cells along a side of the square. Each place is in a cell of its own; half of them stay empty."""
        return math.ceil(math.sqrt(2 * self.agents))

    def check(self, control_rate: float, feet_height: float) -> None:
        """The places have space, and the success can be held within the episode."""
        super().check(control_rate, feet_height)
        if self.apart * self.cells > self.side:
            raise ValueError(
                f"task.apart is {self.apart}; accepted: at most {self.side / self.cells:g} m, so that the places of "
                f"{self.agents} vehicles have space in task.side, {self.side:g} m"
            )
        if self.centre[2] - self.height <= feet_height:
            raise ValueError(
                f"task.height is {self.height}; accepted: less than {self.centre[2] - feet_height:g} m, so that every "
                "place is over the ground"
            )
        if not 0 <= self.hold_s <= self.episode_s:
            raise ValueError(f"task.hold_s is {self.hold_s}; accepted: 0 to task.episode_s, {self.episode_s:g} s")

    def domain(self) -> Domain:
        """Up to so many vehicles in a square of at least this side."""
        return (extent("vehicles", "1", (1.0, float(self.agents))),)

    def limits(self) -> dict[str, float]:
        """The largest distance from the goal."""
        return {"final_error": float(self.radius)}

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """The way to the goal, and a distance to the others. Many small steps of learning."""
        network = NetworkConfig((256, 128))
        if algo == "ppo":
            weights = {
                "near": 1.0, "prog1": 1.0, "avoid": 0.3, "v1": 0.02, "anglev_sq": 0.002, "act2_sq": 0.02, "crash": 10.0,
            }  # fmt: skip
            return TrainConfig(
                cls.training(), PPOConfig(), RewardConfig(weights, {"avoid_reach": 0.6}), network=network,
                steps=20_000_000,
            )  # fmt: skip
        settings: AlgorithmConfig = BPTTConfig(envs=64, horizon=32, learning_rate=2e-3, average=0.99)
        if algo == "dagger":
            settings = DAggerConfig(teacher=EXPERT)
        weights = {"prog2": 1.0, "v1": 0.1, "anglev_sq": 0.02, "act2_sq": 0.02, "overspeed": 1.0, "avoid": 10.0}
        return TrainConfig(
            cls.training(), settings, RewardConfig(weights, {"avoid_reach": 0.8}), network=network,
            steps=24_000_000, chunk=400, eval_episodes=800,
        )  # fmt: skip

    @classmethod
    def variant(cls, preset: str, config: TrainConfig) -> TrainConfig:
        """`depth`: the others are not told. A ring of range sensors sees them. An expert that is told of them is
        imitated; by bptt, gradients then keep vehicles apart.
        """
        config = dataclasses.replace(
            config, task=dataclasses.replace(config.task, observes=SENSED), env=EnvConfig(cameras=(RING,)),
            network=dataclasses.replace(config.network, pool=(16, 64), recurrent=96), steps=8_000_000, chunk=200,
            eval_episodes=400, fast_compile=False,
        )  # fmt: skip
        if not isinstance(config.algo, BPTTConfig):
            return config
        algo = dataclasses.replace(config.algo, horizon=96, learning_rate=1e-4, learning_rate_end=3e-5, imitated=0.87)
        weights = {**config.reward.weights, "avoid": 30.0}
        return dataclasses.replace(
            config, algo=algo, reward=RewardConfig(weights, {"avoid_reach": 0.5}), steps=9_500_000, chunk=60
        )
