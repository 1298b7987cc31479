"""Options and recipes: hold a load, which hangs on a cable and is not seen, at a place."""

import math
from dataclasses import dataclass
from typing import ClassVar

from e2efly.config import (
    BPTTConfig,
    EnvConfig,
    NetworkConfig,
    PayloadConfig,
    PPOConfig,
    RewardConfig,
    TrainConfig,
    number,
)
from e2efly.config.numbers import ANGLE, BODY_RATE, SPEED
from e2efly.courses import defaults
from e2efly.tasks.hover import HoverConfig
from e2efly.tasks.registry import register

LOADS = PayloadConfig(mass=(0.1, 0.5), length=(0.3, 1.0), swing=math.radians(20))
"""The loads with which a policy is trained and judged."""


@register("hover_payload")
@dataclass(frozen=True)
class HoverPayloadConfig(HoverConfig):
    """Hold a load, which hangs on a cable and is not seen, at a place."""

    world: ClassVar[str] = "e2efly.tasks.hover_payload.world:HoverPayload"
    goal_class: ClassVar[str] = "e2efly.tasks.hover_payload.goal:HoverPayloadGoal"
    route: ClassVar[str] = "e2efly.tasks.hover_payload.goal:HoverPayloadRoute"
    shows_error: ClassVar = False
    variants: ClassVar = ()
    smooth: ClassVar = None
    robust: ClassVar = {}
    family: ClassVar = {}
    paper: ClassVar = None

    episode_s: float = 10.0
    """Length of an episode, s."""
    target: tuple[float, float, float] = number(defaults.TARGET, low=-math.inf)
    """The vehicle's place, world, m. The load's place is a cable's length below the hook of a level vehicle there."""
    position: float = 1.0
    """Largest start distance from the place, m per axis."""
    velocity: float = number(0.3, high=SPEED)
    """Largest start velocity, m/s per axis, in either direction; drawn uniformly."""
    tilt: float = number(0.1, high=ANGLE)
    """Largest start roll and pitch, rad, in either direction; drawn uniformly."""
    body_rate: float = number(0.2, high=BODY_RATE)
    """Largest start body rates, rad/s per axis, in either direction; drawn uniformly."""
    radius: float = number(0.1, above=0)
    """Success: largest distance of the load from its place, m."""

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """The rewards of hovering, for the load in place of the vehicle: its distance, and its speed for its swing.

        A memory, as nothing shows the load but how the vehicle answers.
        """
        env, network = EnvConfig(payload=LOADS), NetworkConfig((64, 64), recurrent=64)
        if algo == "ppo":
            weights = {"near": 1.0, "v1": 0.02, "anglev_sq": 0.002, "act2_sq": 0.02, "crash": 10.0}
            return TrainConfig(cls(), PPOConfig(), RewardConfig(weights), env, network, steps=10_000_000)
        weights = {"prog2": 1.0, "near": 0.5, "v1": 0.1, "anglev_sq": 0.02, "act2_sq": 0.05}
        settings = BPTTConfig(horizon=96, learning_rate=8e-3, average=0.99)
        return TrainConfig(cls(), settings, RewardConfig(weights), env, network, steps=2_000_000, chunk=30)
