"""Options and recipes: fly through a cluttered hall, seen only by a LiDAR."""

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
    ForestConfig,
    ImageNoiseConfig,
    NetworkConfig,
    PPOConfig,
    RewardConfig,
    Robust,
    TaskConfig,
    TrainConfig,
    number,
)
from e2efly.config.algorithms import EXPERT
from e2efly.config.numbers import SPEED
from e2efly.tasks.avoid import AvoidConfig
from e2efly.tasks.registry import register

LIDAR = CameraConfig(
    "range", width=64, height=4, projection="spherical", fov=(2 * math.pi, math.radians(30)), reach=(0.1, 12.0),
    noise=ImageNoiseConfig(gaussian=0.0015),
)  # fmt: skip
"""A small LiDAR: four rings of 64 rays all around, with an error of 2 cm."""


@register("hall")
@dataclass(frozen=True)
class HallConfig(AvoidConfig):
    """Fly through a cluttered hall, seen only by a LiDAR."""

    world: ClassVar[str] = "e2efly.tasks.hall.world:Hall"
    goal_class: ClassVar[str] = "e2efly.tasks.avoid.goal:AvoidGoal"
    route: ClassVar[str] = "e2efly.tasks.hall.goal:HallRoute"
    best: ClassVar = "bptt"
    robust: ClassVar = {
        "bptt": Robust(steps=10_000_000, chunk=60, recurrent=96, hidden=(128, 64)),
        "dagger": Robust(steps=8_000_000, chunk=200, recurrent=96, hidden=(128, 64)),
    }
    cameras: ClassVar = (LIDAR,)
    curriculum: ClassVar = ()
    paper: ClassVar = None

    forest: ForestConfig = ForestConfig(
        density=0.15, length=30.0, width=8.0, radius=(0.15, 0.4), height=(3.0, 3.0), clear=1.5, room=48
    )
    """The pillars and crates, from the floor to the ceiling, and the hall's length and width."""
    crates: float = number(0.5, high=1.0)
    """Share of the obstacles that are crates: square, turned by any angle. The others are round pillars. The radius is
    that of the circle around it."""
    speed: tuple[float, float] = number((2.0, 4.5), high=SPEED, rising=True)
    sideways: float = 2.0

    def criteria(self) -> dict[str, TaskConfig]:
        """Two speeds. Collisions end the episode."""
        return {
            f"{self.name}_{speed:g}": dataclasses.replace(self, speed=(speed, speed), collisions_end=True)
            for speed in (2.5, 4.0)
        }

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """Imitate an expert that knows the hall. By a gradient, then keep away from what stands in it, too."""
        config = super().recipe(algo)
        network, reward = NetworkConfig((128, 64), pool=(4, 64), recurrent=64), config.reward
        settings: AlgorithmConfig = BPTTConfig(
            horizon=96, learning_rate=1e-4, learning_rate_end=3e-5, gradient_decay=1.5, average=0.99, imitated=0.85
        )
        steps, chunk = 7_000_000, 60
        if algo == "bptt":
            reward = RewardConfig({"imitate": 1.0, "avoid": 20.0}, {"avoid_reach": 0.4})
        elif algo == "dagger":
            settings, steps, chunk = DAggerConfig(teacher=EXPERT), 5_000_000, 200
        elif algo == "ppo":
            network, settings = dataclasses.replace(network, recurrent=0), PPOConfig(learning_rate=2e-3, gamma=0.98)
            steps = 2_000_000
        return dataclasses.replace(
            config, task=cls() if algo == "ppo" else cls.training(), algo=settings, network=network, reward=reward,
            env=EnvConfig(cameras=cls.cameras), curriculum=(), steps=steps, chunk=chunk,
        )  # fmt: skip
