"""Options and recipes: hover at a point and keep a slowly moving target in the middle of the camera's image."""

import math
from dataclasses import dataclass
from typing import ClassVar

from e2efly.config import BPTTConfig, PPOConfig, RewardConfig, Robust, TaskConfig, TrainConfig, number
from e2efly.courses import defaults
from e2efly.tasks.registry import register


@register("hover_aware")
@dataclass(frozen=True)
class HoverAwareConfig(TaskConfig):
    """Hover at a point and keep a slowly moving target in the middle of the camera's image."""

    world: ClassVar[str] = "e2efly.tasks.hover_aware.world:HoverAware"
    goal_class: ClassVar[str] = "e2efly.tasks.hover_aware.goal:HoverAwareGoal"
    route: ClassVar[str] = "e2efly.tasks.hover_aware.goal:HoverAwareRoute"
    best: ClassVar = "bptt"
    robust: ClassVar = {
        "bptt": Robust(
            weights={"prog2": 1.0, "ori1": 1.0, "ori3": 1.0, "v1": 0.1, "anglev_sq": 0.06, "act2_sq": 0.05},
            algo={"horizon": 96, "learning_rate": 8e-3},
            steps=3_000_000,
        ),
    }

    episode_s: float = 8.0
    """Length of an episode, s."""
    target: tuple[float, float, float] = number(defaults.TARGET, low=-math.inf)
    """Where to hover, world, m."""
    position: float = 1.5
    """Start within this of the target, m per axis."""
    velocity: float = 0.5
    """Start velocity, m/s per axis, uniform in +-."""
    tilt: float = 0.2617993877991494
    """Start roll and pitch, rad, uniform in +-; any heading."""
    distance: tuple[float, float] = number((4.0, 6.0), rising=True)
    """From where to hover to what to look at, m, uniform."""
    elevation: float = 0.2
    """What to look at is within this of the height of where to hover, m."""
    turn_rate: float = 0.2
    """It circles around where to hover at up to this, rad/s, either way."""
    size: float = 0.2
    """Radius of what to look at, m."""
    fov: tuple[float, float] = number((1.518436449235301, 1.0122909661567112), above=0)
    """Of the camera: horizontal and vertical, rad."""
    camera_position: tuple[float, float, float] = number((0.0, 0.0, 0.0), low=-math.inf)
    """Where the camera sits, body frame (forward, left, up), m."""
    camera_pitch: float = number(0.0, low=-math.inf)
    """Of the camera, downwards from straight ahead, rad."""
    radius: float = number(0.1, above=0)
    """Success: within this of the target, m, ..."""
    centred: float = 0.25
    """... what to look at within this share of half the image from its middle, across and down, ..."""
    hold_s: float = 1.0
    """... for this last part of the episode, s."""
    fence: float = number(defaults.HOVER_FENCE, above=0, endless=True)
    """Farther than this from the target the episode fails, m."""

    @property
    def own_worlds(self) -> bool:
        """What it looks at."""
        return True

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """As hover's, with rewards for looking at the target."""
        if algo == "ppo":
            weights = {"near": 1.0, "ori1": 1.0, "ori3": 1.0, "v1": 0.02, "anglev_sq": 0.002, "act2_sq": 0.02}
            return TrainConfig(cls(), PPOConfig(), RewardConfig(weights), steps=3_000_000)
        weights = {"prog2": 1.0, "ori1": 1.0, "ori3": 1.0, "v1": 0.1, "anglev_sq": 0.02, "act2_sq": 0.02}
        return TrainConfig(cls(), BPTTConfig(), RewardConfig(weights), steps=1_000_000, chunk=10)
