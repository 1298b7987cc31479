"""Options and recipes: hover at a point and keep a slowly moving target in the middle of the camera's image."""

import math
from dataclasses import dataclass
from typing import ClassVar

from e2efly.config import BPTTConfig, PPOConfig, RewardConfig, Robust, TaskConfig, TrainConfig, number
from e2efly.config.domain import Domain, extent
from e2efly.config.numbers import ANGLE, BODY_RATE, SPEED
from e2efly.config.run import check_aloft
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
            algo={"horizon": 96, "learning_rate": 8e-3, "average": 0.99},
            steps=3_900_000,
        )
    }

    episode_s: float = 8.0
    """Length of an episode, s."""
    target: tuple[float, float, float] = number(defaults.TARGET, low=-math.inf)
    """The hover point, world frame, m."""
    position: float = 1.5
    """Largest start distance from the hover point, m per axis."""
    velocity: float = number(0.5, high=SPEED)
    """Largest start velocity, m/s per axis, in either direction; drawn uniformly."""
    tilt: float = number(0.2617993877991494, high=ANGLE)
    """Largest start roll and pitch, rad, in either direction; drawn uniformly. The heading is arbitrary."""
    distance: tuple[float, float] = number((4.0, 6.0), rising=True)
    """Distance from the hover point to the object to look at, m, uniform."""
    elevation: float = number(0.2, high=ANGLE)
    """Largest height difference between the object and the hover point, m."""
    turn_rate: float = number(0.2, high=BODY_RATE)
    """Largest rate at which the object circles around the hover point, in either direction, rad/s."""
    size: float = 0.2
    """Radius of the object to look at, m."""
    fov: tuple[float, float] = number((1.518436449235301, 1.0122909661567112), above=0, high=ANGLE)
    """Horizontal and vertical field of view of the camera, rad."""
    camera_position: tuple[float, float, float] = number((0.0, 0.0, 0.0), low=-math.inf)
    """Position of the camera in the body frame (forward, left, up), m."""
    camera_pitch: float = number(0.0, low=-ANGLE, high=ANGLE)
    """Downward pitch of the camera from straight ahead, rad."""
    radius: float = number(0.1, above=0)
    """Success: largest distance from the hover point, m."""
    centred: float = number(0.25, high=ANGLE)
    """Success: largest offset of the object from the image centre, horizontally and vertically, as a share of half the
    image."""
    hold_s: float = 1.0
    """Success: both must hold during this last part of the episode, s."""
    fence: float = number(defaults.HOVER_FENCE, above=0, endless=True)
    """The episode fails farther than this from the hover point, m."""

    def check(self, control_rate: float, feet_height: float) -> None:
        """The hover point is over the ground, and the success can be held within an episode."""
        super().check(control_rate, feet_height)
        check_aloft("target", self.target, feet_height)
        if not 0 <= self.hold_s <= self.episode_s:
            raise ValueError(f"task.hold_s is {self.hold_s}; accepted: 0 to the {self.episode_s:g} s of task.episode_s")

    @property
    def own_worlds(self) -> bool:
        """Each episode has its own object to look at."""
        return True

    def domain(self) -> Domain:
        """The object to look at. It circles in either direction."""
        rate = abs(self.turn_rate)
        return extent("object_distance", "m", self.distance), extent("object_rate", "rad/s", (-rate, rate))

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """As for hover, with rewards for looking at the object."""
        if algo == "ppo":
            weights = {"near": 1.0, "ori1": 1.0, "ori3": 1.0, "v1": 0.02, "anglev_sq": 0.002, "act2_sq": 0.02}
            return TrainConfig(cls(), PPOConfig(), RewardConfig(weights), steps=3_000_000)
        weights = {"prog2": 1.0, "ori1": 1.0, "ori3": 1.0, "v1": 0.1, "anglev_sq": 0.02, "act2_sq": 0.02}
        return TrainConfig(cls(), BPTTConfig(), RewardConfig(weights), steps=1_000_000, chunk=10)
