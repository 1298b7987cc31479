"""Options and recipes: touch down gently on a point of the ground."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from e2efly.config import (
    AlgorithmConfig,
    BPTTConfig,
    Paper,
    PPOConfig,
    RewardConfig,
    Robust,
    TaskConfig,
    TrainConfig,
    number,
)
from e2efly.config.domain import Domain
from e2efly.config.drawing import INK, ORANGE, Face, Line, Thing, circle
from e2efly.config.numbers import ANGLE, SPEED
from e2efly.courses import defaults
from e2efly.tasks.registry import register

PPO_WEIGHTS = {
    "prog1": 4.0, "descent": 0.2, "upright": 0.05, "anglev_sq": 0.002, "act2_sq": 0.02, "goal": 10.0, "crash": 10.0,
}  # fmt: skip
"""Weights of the reward with which PPO learns to land."""


@register("land")
@dataclass(frozen=True)
class LandConfig(TaskConfig):
    """Touch down gently on a point of the ground."""

    world: ClassVar[str] = "e2efly.tasks.land.world:Land"
    goal_class: ClassVar[str] = "e2efly.tasks.land.goal:LandGoal"
    route: ClassVar[str] = "e2efly.tasks.land.goal:LandRoute"
    smooth: ClassVar = {
        "prog1": 4.0, "progxy": 0.1, "descent": 0.2, "upright": 0.05, "anglev_sq": 0.002, "act2_sq": 0.02,
        "goal": 10.0, "crash": 10.0,
    }  # fmt: skip
    best: ClassVar = "bptt"
    robust: ClassVar = {
        "bptt": Robust(
            weights={"progxy": 1.0, "descent": 1.0, "upright": 0.1, "anglev_sq": 0.05, "act2_sq": 0.05},
            algo={"horizon": 96},
            steps=2_200_000,
        )
    }
    family: ClassVar = {
        "bptt": replace(robust["bptt"], algo={"horizon": 96, "average": 0.99}, steps=6_000_000, chunk=60)
    }
    paper: ClassVar = Paper(
        weights={"progxy": 0.04, "vz": 0.1, "anglev": 0.001},
        ppo={"act3": 1.0, "goal": 1.0, "crash": 1.0},
        millions=(100, 10),
    )

    episode_s: float = 10.0
    """Length of an episode, s."""
    sideways: float = 2.0
    """Largest start distance from the pad's centre, m per axis."""
    height: tuple[float, float] = number((1.0, 3.0), rising=True)
    """Height of the feet at the start, m."""
    velocity: float = number(0.5, high=SPEED)
    """Largest start velocity, m/s per axis, in either direction; drawn uniformly."""
    radius: float = number(0.10, above=0)
    """Success: largest horizontal error at touchdown, m."""
    height_error: float = 0.05
    """Success: largest height error at touchdown, m."""
    speed: float = number(0.5, high=SPEED)
    """Success: largest speed at touchdown, m/s."""
    tilt: float = number(0.2617993877991494, high=ANGLE)
    """Success: largest tilt at touchdown, rad."""
    fence: float = number(defaults.LAND_FENCE, above=0, endless=True)
    """The episode fails farther than this from the pad, sideways or upwards, m."""

    def domain(self) -> Domain:
        """Nothing stands in its world, and its goal is one place."""
        return ()

    def limits(self) -> dict[str, float]:
        """The pad's radius."""
        return {"final_error": float(self.radius)}

    def drawing(self) -> list[Thing]:
        """The pad."""
        pad = circle(np.zeros(3), float(self.radius))
        return [Face(pad, ORANGE, label="pad: touch down within"), Line(pad, INK, 1.0)]

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """Rewards for coming nearer, descending and staying upright."""
        if algo == "ppo":
            settings: AlgorithmConfig = PPOConfig(learning_rate=5e-3, learning_rate_end=5e-4)
            return TrainConfig(cls(), settings, RewardConfig(dict(PPO_WEIGHTS)), steps=2_000_000)
        weights = {"progxy": 1.0, "descent": 1.0, "upright": 0.1, "anglev_sq": 0.02, "act2_sq": 0.02}
        return TrainConfig(cls(), BPTTConfig(learning_rate=8e-3), RewardConfig(weights), steps=1_000_000, chunk=10)
