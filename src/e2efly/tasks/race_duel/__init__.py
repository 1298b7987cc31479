"""Options and recipes: several vehicles race on the same track."""

import dataclasses
from dataclasses import dataclass
from typing import ClassVar

from e2efly.config import BPTTConfig, NetworkConfig, Paper, RewardConfig, TaskConfig, TrainConfig, number
from e2efly.tasks.race import RaceConfig
from e2efly.tasks.registry import register


@register("race_duel")
@dataclass(frozen=True)
class RaceDuelConfig(RaceConfig):
    """Fly through gates in order, faster than others, and touch none of them."""

    world: ClassVar[str] = "e2efly.tasks.race_duel.world:RaceDuel"
    goal_class: ClassVar[str] = "e2efly.tasks.race_duel.goal:RaceDuelGoal"
    route: ClassVar[str] = "e2efly.tasks.race_duel.goal:RaceDuelRoute"
    paper: ClassVar[Paper | None] = None
    variants: ClassVar = ()
    asked: ClassVar = {}
    robust: ClassVar = {}
    identified: ClassVar = {}
    family: ClassVar = {}

    agents: int = number(2, low=2, high=8, sets_shapes=True)
    """Number of racers in a world (sets shapes)."""
    neighbours: int = number(1, low=1, high=7, sets_shapes=True)
    """Number of nearest others that a racer observes (sets shapes)."""
    position: float = 0.3
    """Radius of the ball around a racer's place of start in which it starts, m."""
    spacing: float = number(1.0, above=0)
    """Distance of each place of start in front of the one after it, m. The last one is the track's. They are in turn to
    the left and to the right of the line by half of it."""
    scattered: float = number(0.0, low=0, high=1)
    """Share of the worlds in which each racer starts in front of a gate of its own, anywhere on the track. A policy
    that has only met itself, one place behind, knows no racer that is far away, or slower."""
    blind: float = number(0.0, low=0, high=1)
    """Share of the racers that are shown nobody, for an episode: the others learn to keep away from one that does not
    keep away from them."""
    collisions_end: bool = True
    """Whether a touch of two racers ends the episode of the whole world. In training it does not, so that the policy
    learns from what follows."""

    @classmethod
    def training(cls) -> "RaceDuelConfig":
        """Lap after lap, in half of the worlds from anywhere, a quarter of the racers blind, and no touch of two racers
        ends the episode.
        """
        return cls(laps=0, collisions_end=False, scattered=0.5, blind=0.25)

    def criteria(self) -> dict[str, TaskConfig]:
        """One lap, or the requested number of laps, for all racers of a world, from the places of start."""
        judged = dataclasses.replace(self, laps=max(self.laps, 1), collisions_end=True, scattered=0.0, blind=0.0)
        return {self.name: judged}

    def check(self, control_rate: float, feet_height: float) -> None:
        """The track is one for all, and the starts have space."""
        super().check(control_rate, feet_height)
        if self.any_track:
            raise ValueError(f"task.track is {self.track!r}; accepted: one track, which all racers of a world share")
        if self.swing:
            raise ValueError(f"task.swing is {self.swing:g}; accepted: 0, as the gates of a duel stand still")
        if 2 * self.position >= self.spacing:
            raise ValueError(
                f"task.position is {self.position}; accepted: less than half of task.spacing, {self.spacing:g} m, so "
                "that racers do not touch at the start"
            )

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """The way through the gates, and a distance to the others."""
        config = super().recipe(algo)
        if algo == "ppo":
            reward = dataclasses.replace(config.reward, weights={**config.reward.weights, "apart": 1.0})
            return dataclasses.replace(config, reward=reward)
        weights = {"progway": 1.0, "fitlog": 4.0, "anglev_sq": 0.001, "act2_sq": 0.01, "apart": 2.0}
        return dataclasses.replace(
            config,
            algo=BPTTConfig(learning_rate=4e-3, learning_rate_end=1e-4, gradient_decay=0.3, average=0.99, league=8),
            reward=RewardConfig(weights, {"fitlog_margin": 0.1, "apart_reach": 0.4}),
            network=NetworkConfig((96, 96)),
            steps=10_000_000,
            chunk=50,
        )
