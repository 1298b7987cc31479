"""Options and recipes: touch down gently on a pad, seen only by a camera."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from e2efly.config import (
    AlgorithmConfig,
    BPTTConfig,
    CameraConfig,
    EnvConfig,
    NetworkConfig,
    Paper,
    PPOConfig,
    RewardConfig,
    Robust,
    Sourced,
    TaskConfig,
    TrainConfig,
    number,
    shape,
)
from e2efly.config.domain import Domain, extent
from e2efly.config.numbers import ANGLE, SPEED
from e2efly.config.run import VISFLY
from e2efly.courses import defaults
from e2efly.tasks.land import PAPER_AUTHORS, PAPER_SILENT, PPO_WEIGHTS
from e2efly.tasks.registry import register


@register("land_visual")
@dataclass(frozen=True)
class LandVisualConfig(TaskConfig):
    """Touch down gently on a pad, seen only by a camera."""

    world: ClassVar[str] = "e2efly.tasks.land_visual.world:LandVisual"
    goal_class: ClassVar[str] = "e2efly.tasks.land_visual.goal:LandVisualGoal"
    route: ClassVar[str] = "e2efly.tasks.land_visual.goal:LandVisualRoute"
    best: ClassVar = "bptt"
    robust: ClassVar = {"bptt": Robust(steps=2_000_000, hidden=(128, 64))}
    family: ClassVar = {
        "bptt": Robust(algo={"horizon": 96, "average": 0.99}, steps=6_000_000, chunk=60, hidden=(128, 64))
    }
    cameras: ClassVar = (CameraConfig("mask", 16, 16, fov=(math.pi / 2, math.pi / 2), pitch=math.pi / 2),)
    paper: ClassVar = Paper(
        weights={"progxy": 0.04, "ori2": 0.003, "vz": 0.1, "anglev": 0.001},
        millions=(100, 1),
        silent=(
            *PAPER_SILENT,
            Sourced("task.shows_position", True, "the paper's table; its text says that no target is observed"),
        ),
        authors=(
            *PAPER_AUTHORS,
            Sourced("task.height", (1.5, 3.5), f"{VISFLY}: envs/LandingEnv.py, starts 2.5 m over the ground, +-1 m"),
        ),
    )

    episode_s: float = 10.0
    """Length of an episode, s."""
    sideways: float = 1.0
    """Largest start distance from the pad's centre, m per axis."""
    height: tuple[float, float] = number((1.0, 3.0), rising=True)
    """Height of the feet above the pad at the start, m."""
    velocity: float = number(0.5, high=SPEED)
    """Largest start velocity, m/s per axis, in either direction; drawn uniformly."""
    pad_size: tuple[float, float] = number((0.4, 0.6), rising=True)
    """Width of the pad, m, uniform. Its shape is a disc, a square or a triangle."""
    pad_height: float = 0.2
    """Height of the pad above the ground, m."""
    radius: float = number(0.10, above=0)
    """Success: largest horizontal error at touchdown, m."""
    height_error: float = 0.05
    """Success: largest height error at touchdown, m."""
    speed: float = number(0.5, high=SPEED)
    """Success: largest speed at touchdown, m/s."""
    tilt: float = number(0.2617993877991494, high=ANGLE)
    """Success: largest tilt at touchdown, rad."""
    must_touch: bool = shape(True, added=True)
    """Success: whether the vehicle has to touch. Without it, being as near, as slow and as upright is enough."""
    fence: float = number(defaults.LAND_FENCE, above=0, endless=True)
    """The episode fails farther than this from the pad, sideways or upwards, m."""
    shows_position: bool = shape(False, added=True)
    """Whether the policy sees where the pad is, and not only the height. With it, its observation beside the image is
    that of the paper's table: 13 numbers, with env.past_actions 0."""

    def shows(self, name: str) -> bool:
        """The position of the pad by choice."""
        return super().shows(name) and name == ("position_error" if self.shows_position else "height")

    def showing(self, names: Sequence[str]) -> "LandVisualConfig":
        """For a policy with or without the position of the pad."""
        return replace(self, shows_position="position_error" in names)

    def domain(self) -> Domain:
        """The pad."""
        return extent("pad_size", "m", self.pad_size), extent("pad_height", "m", self.pad_height)

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """As for landing, with small images."""
        weights = {"progxy": 1.0, "descent": 1.0, "upright": 0.1, "anglev_sq": 0.02, "act2_sq": 0.02}
        settings: AlgorithmConfig = BPTTConfig(envs=32, horizon=48, learning_rate_end=1.2e-4)
        steps = 650_000
        if algo == "ppo":
            weights, settings, steps = dict(PPO_WEIGHTS), PPOConfig(learning_rate=2e-3), 2_000_000
        network, seen = NetworkConfig((128, 64)), EnvConfig(cameras=cls.cameras)
        return TrainConfig(
            cls(), settings, RewardConfig(weights), seen, network, steps=steps, chunk=30, eval_episodes=100
        )
