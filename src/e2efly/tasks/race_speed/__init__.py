"""Options and recipes: fly through gates in order, at a commanded speed."""

import dataclasses
from dataclasses import dataclass
from typing import ClassVar

from e2efly.config import (
    AlgorithmConfig,
    BPTTConfig,
    NetworkConfig,
    PPOConfig,
    RewardConfig,
    Robust,
    TaskConfig,
    TrainConfig,
    number,
    shape,
)
from e2efly.config.domain import Domain, displaced, extent, track_domain, union
from e2efly.config.numbers import ANGLE, SPEED
from e2efly.courses import defaults
from e2efly.courses.tracks import load_track
from e2efly.tasks.registry import register


@register("race_speed")
@dataclass(frozen=True)
class RaceSpeedConfig(TaskConfig):
    """Fly through gates in order, at a commanded speed."""

    world: ClassVar[str] = "e2efly.tasks.race_speed.world:RaceSpeed"
    goal_class: ClassVar[str] = "e2efly.tasks.race_speed.goal:RaceSpeedGoal"
    route: ClassVar[str] = "e2efly.tasks.race_speed.goal:RaceSpeedRoute"
    best: ClassVar = "bptt"
    robust: ClassVar = {
        "bptt": Robust(
            algo={"average": 0.99}, steps=6_500_000, chunk=100, recurrent=96, hidden=(96, 96), eased=(0.4, 2_500_000)
        )
    }
    family: ClassVar = {
        "bptt": Robust(
            weights={"vel": 1.0, "progway": 2.5, "fitlog": 40.0, "anglev_sq": 0.001, "act2_sq": 0.01},
            algo={"learning_rate": 4e-3, "learning_rate_end": 1e-4, "gradient_decay": 0.3},
            steps=14_000_000,
            chunk=100,
            recurrent=96,
            hidden=(96, 96),
        )
    }

    episode_s: float = 30.0
    """Length of an episode, s."""
    track: tuple[str, ...] = shape(defaults.TRACKS)
    """One or more shipped tracks, or paths of .toml files. Every episode uses one of them (their number and their gates
    set shapes)."""
    gate_position: float = 0.15
    """Half-width of each gate's random offset from its place on the track, m per axis."""
    gate_yaw: float = number(0.15, high=ANGLE)
    """Half-width of each gate's random rotation, rad."""
    speed: tuple[float, float] = number((2.0, 12.0), above=0, high=SPEED, rising=True)
    """Commanded speed, m/s, log-uniform per episode."""
    position: float = 0.4
    """Radius of the ball around the track's start in which episodes start, m."""
    laps: int = 1
    """Number of laps that end the episode with success. 0: fly on until the time is over."""
    fence: float = number(defaults.RACE_FENCE, above=0, endless=True)
    """The episode fails farther than this from the next gate, in addition to the distance between the previous gate (or
    the start) and the next gate, m."""

    @classmethod
    def training(cls) -> "RaceSpeedConfig":
        """Lap after lap in training. The policy is judged on one lap."""
        return cls(laps=0)

    def criteria(self) -> dict[str, TaskConfig]:
        """One lap, or the requested number of laps."""
        return {self.name: dataclasses.replace(self, laps=max(self.laps, 1))}

    def domain(self) -> Domain:
        """The tracks with their displaced gates, and the commanded speed."""
        tracks = union(track_domain(load_track(name)) for name in self.track)
        return *displaced(tracks, self.gate_position, self.gate_yaw), extent("speed", "m/s", self.speed)

    @property
    def own_worlds(self) -> bool:
        """Each episode has its own track."""
        return True

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """Rewards for the commanded velocity, for progress along the way, and for the middle of the gates."""
        settings: AlgorithmConfig = BPTTConfig(
            learning_rate=5e-3, learning_rate_end=2e-4, gradient_decay=0.6, average=0.99
        )
        weights = {"vel": 1.0, "progway": 2.5, "fitlog": 20.0, "anglev_sq": 0.001, "act2_sq": 0.01}
        if algo == "ppo":
            settings = PPOConfig(gamma=0.97, learning_rate=5e-3, learning_rate_end=5e-4)
            weights = {
                "progway": 1.0, "overspeed": 0.02, "fitlog": 1.0, "anglev_sq": 0.0005, "act2_sq": 0.005, "goal": 1.0,
                "crash": 1.0,
            }  # fmt: skip
        return TrainConfig(
            cls.training(), settings, RewardConfig(weights, {"fitlog_margin": 0.12}),
            network=NetworkConfig((96, 96)), steps=5_000_000, chunk=100,
        )  # fmt: skip
