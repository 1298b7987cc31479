"""Options and recipes: hover, do not be struck by balls that are thrown at the vehicle, and come back."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from e2efly.config import (
    AHEAD,
    BPTTConfig,
    EnvConfig,
    NetworkConfig,
    PPOConfig,
    RewardConfig,
    Robust,
    TaskConfig,
    TrainConfig,
    number,
    shape,
)
from e2efly.config.domain import Domain, extent
from e2efly.config.numbers import ANGLE, LATEST, SPEED
from e2efly.config.run import check_aloft
from e2efly.tasks.registry import register
from e2efly.vehicles.gravity import GRAVITY


@register("dodge")
@dataclass(frozen=True)
class DodgeConfig(TaskConfig):
    """Hover, do not be struck by balls that are thrown at the vehicle, and come back."""

    world: ClassVar[str] = "e2efly.tasks.dodge.world:Dodge"
    goal_class: ClassVar[str] = "e2efly.tasks.dodge.goal:DodgeGoal"
    route: ClassVar[str] = "e2efly.tasks.dodge.goal:DodgeRoute"
    best: ClassVar = "bptt"
    robust: ClassVar = {"bptt": Robust(steps=4_400_000, chunk=60, recurrent=96, hidden=(128, 64))}
    cameras: ClassVar = (dataclasses.replace(AHEAD, width=48, height=32, encoding="log"),)
    variants: ClassVar = ("told",)

    episode_s: float = 7.5
    """Length of an episode, s."""
    target: tuple[float, float, float] = number((0.0, 0.0, 2.0), low=-math.inf)
    """The vehicle's place, world frame, m."""
    position: float = 0.2
    """Largest start distance from the place, m per axis."""
    velocity: float = number(0.2, high=SPEED)
    """Largest start velocity, m/s per axis, in either direction; drawn uniformly."""
    turned: float = number(0.1, high=ANGLE)
    """Largest angle at the start between the heading and the middle of the thrower's sector, rad."""
    throws: int = shape(2)
    """Number of throws in an episode (sets shapes)."""
    first: tuple[float, float] = number((1.5, 2.5), rising=True)
    """Time of the first throw, s, uniform."""
    pause: tuple[float, float] = number((2.0, 2.8), rising=True)
    """Time from one throw to the next, s, uniform."""
    speed: tuple[float, float] = number((8.0, 8.0), above=0, high=SPEED, rising=True)
    """Speed at which a ball is thrown, m/s, uniform."""
    distance: tuple[float, float] = number((3.5, 4.5), above=0, rising=True)
    """Horizontal distance from which it is thrown, m, uniform."""
    sector: float = number(0.5, high=ANGLE)
    """Largest angle of a throw to either side of the middle of the thrower's sector, rad. The sector itself may be on
    any side; the vehicle is told where."""
    rise: tuple[float, float] = number((-0.3, 0.8), low=-100.0, high=100.0, rising=True)
    """Height from which it is thrown, relative to the vehicle's place, m, uniform."""
    scatter: float = 0.25
    """Largest distance of the point that is aimed at from the vehicle's place, m. Uniform in a ball."""
    size: tuple[float, float] = number((0.10, 0.15), above=0, rising=True)
    """Radius of a ball, m, uniform."""
    ready: float = number(0.25, above=0)
    """Success: largest distance from the place when a ball is thrown, m."""
    radius: float = number(0.25, above=0)
    """Success: largest distance from the place at the end of the episode, m."""
    fence: float = number(3.0, above=0, endless=True)
    """The episode fails farther than this from the place, m."""
    collisions_end: bool = True
    """Whether an episode ends when the vehicle is struck or was not at its place. In training it does not."""
    shows_ball: bool = shape(False)
    """Whether the policy is told where a ball in the air is, and how fast it flies."""
    ball_age: float = number(0.04, high=LATEST)
    """How old this is, s."""

    def check(self, control_rate: float, feet_height: float) -> None:
        """The place is over the ground, every throw can reach it, and the episode lasts until the vehicle is back."""
        super().check(control_rate, feet_height)
        check_aloft("target", self.target, feet_height)
        if self.throws < 1:
            raise ValueError(f"task.throws is {self.throws}; accepted: at least 1")
        away = self.distance[1] + self.scatter
        climb = max(-self.rise[0], 0.0) + self.scatter
        slowest = math.sqrt(GRAVITY * (math.hypot(away, climb) + climb))
        if self.speed[0] < slowest:
            raise ValueError(
                f"task.speed is {self.speed}; accepted: at least {slowest:.3g} m/s, with which a ball comes "
                f"{self.distance[1]:g} m far (task.distance)"
            )
        last = self.first[1] + (self.throws - 1) * self.pause[1]
        if last > self.episode_s:
            raise ValueError(
                f"task.episode_s is {self.episode_s}; accepted: at least {last:g} s, the time of the last throw"
            )

    @classmethod
    def training(cls) -> "DodgeConfig":
        """Being struck ends no episode."""
        return cls(collisions_end=False)

    def criteria(self) -> dict[str, TaskConfig]:
        """Being struck ends the episode."""
        return {self.name: dataclasses.replace(self, collisions_end=True)}

    @property
    def own_worlds(self) -> bool:
        """Each episode has its own throws."""
        return True

    def shows(self, name: str) -> bool:
        """The ball by choice."""
        return super().shows(name) and (self.shows_ball or name not in ("ball", "ball_velocity"))

    def showing(self, names: Sequence[str]) -> "DodgeConfig":
        """For a policy that is told of the ball, or not."""
        return dataclasses.replace(self, shows_ball="ball" in names)

    def domain(self) -> Domain:
        """The throws."""
        return (
            extent("ball_speed", "m/s", self.speed),
            extent("throw_distance", "m", self.distance),
            extent("ball_radius", "m", self.size),
        )

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """With gradients: imitate an expert that knows each ball, and let the balls pass at a distance."""
        weights = {"imitate": 1.0, "prog2": 1.5, "fit": 40.0, "v1": 0.05, "anglev_sq": 0.01, "act2_sq": 0.02}
        parameters = {"fit_margin": 0.25, "fit_limit": 0.6}
        settings = BPTTConfig(horizon=48, learning_rate_end=2e-4, average=0.99) if algo != "ppo" else PPOConfig()
        if algo == "ppo":
            weights = {"near": 1.0, "ori1": 0.3, "v1": 0.02, "anglev_sq": 0.002, "act2_sq": 0.02, "crash": 20.0}
            parameters = {}
        return TrainConfig(
            cls.training(), settings, RewardConfig(weights, parameters), EnvConfig(cameras=cls.cameras),
            NetworkConfig((128, 64), pool=(16, 24), recurrent=96),
            steps=3_000_000, chunk=60, eval_episodes=250, fast_compile=False,
        )  # fmt: skip

    @classmethod
    def variant(cls, preset: str, config: TrainConfig) -> TrainConfig:
        """`told`: without a camera. The policy is told of the ball, 40 ms late."""
        task = dataclasses.replace(config.task, shows_ball=True)
        env, network = dataclasses.replace(config.env, cameras=()), NetworkConfig((64, 64))
        return dataclasses.replace(config, task=task, env=env, network=network, fast_compile=True)
