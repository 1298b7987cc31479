"""Options and recipes: fly through gates in order."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from e2efly.config import (
    AlgorithmConfig,
    BPTTConfig,
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
from e2efly.config.domain import Domain, displaced, track_domain
from e2efly.config.drawing import ORANGE, Face, Mark, Thing
from e2efly.config.run import OURS, VISFLY
from e2efly.courses import defaults
from e2efly.courses.gates import FRAME, Gates
from e2efly.courses.random_tracks import ANY, RACING
from e2efly.courses.tracks import load_track
from e2efly.tasks.registry import register

ANY_TRACK = "any_track"
"""The preset for such tracks."""
LONGEST = 30.0
"""Length of episodes on such tracks, s."""


@register("race")
@dataclass(frozen=True)
class RaceConfig(TaskConfig):
    """Fly through gates in order."""

    world: ClassVar[str] = "e2efly.tasks.race.world:Race"
    goal_class: ClassVar[str] = "e2efly.tasks.race.goal:RaceGoal"
    route: ClassVar[str] = "e2efly.tasks.race.goal:RaceRoute"
    smooth: ClassVar = {"prog1": 1.0, "anglev_sq": 0.0005, "act2_sq": 0.005, "goal": 1.0, "crash": 1.0}
    best: ClassVar = "bptt"
    robust: ClassVar = {
        "bptt": Robust(
            weights={"progway": 1.0, "fitlog": 2.0, "anglev_sq": 0.001, "act2_sq": 0.01},
            parameters={"fitlog_margin": 0.1},
            algo={"learning_rate": 4e-3, "learning_rate_end": 1e-4, "gradient_decay": 0.3, "average": 0.99},
            steps=10_000_000,
            chunk=50,
            recurrent=96,
            hidden=(96, 96),
            eased=(0.4, 4_000_000),
        )
    }
    identified: ClassVar = {
        "bptt": dataclasses.replace(
            robust["bptt"], weights={"progway": 1.0, "fitlog": 4.0, "anglev_sq": 0.001, "act2_sq": 0.01}
        )
    }
    family: ClassVar = {
        "bptt": Robust(
            weights={"progway": 1.0, "fitlog": 40.0, "anglev_sq": 0.001, "act2_sq": 0.01},
            parameters={"fitlog_margin": 0.12},
            algo={"learning_rate": 4e-3, "learning_rate_end": 1e-4, "gradient_decay": 0.3, "average": 0.99},
            steps=16_000_000,
            chunk=60,
            recurrent=96,
            hidden=(96, 96),
        )
    }
    variants: ClassVar = (ANY_TRACK,)
    asked: ClassVar = {("track", ANY): ANY_TRACK}
    paper: ClassVar = Paper(
        weights={"prog1": 0.9, "ori2": 0.001, "v1": 0.002, "anglev": 0.002},
        millions=(100, 50),
        silent=(
            Sourced("reward.weights.act3", 1.0, OURS, "ppo"),
            Sourced("reward.weights.goal", 5.0, "the paper's weight in clutter", "ppo"),
            Sourced("reward.weights.crash", 4.0, "the paper's weight in clutter", "ppo"),
        ),
        authors=(
            Sourced("reward.weights.alive", 0.1, f"{VISFLY}: envs/RacingEnv.py, base_r"),
            Sourced("reward.weights.goal", 20.0, f"{VISFLY}: envs/RacingEnv.py, success_r", "ppo"),
            Sourced("reward.weights.crash", 0.0, f"{VISFLY}: envs/RacingEnv.py has no such term", "ppo"),
            Sourced("task.position", 0.2, f"{VISFLY}: envs/RacingEnv.py, half of the starts"),
            Sourced("task.episode_s", 12.0, "ours: a whole lap must fit into an episode"),
        ),
    )

    episode_s: float = 12.0
    """Length of an episode, s."""
    track: str = shape(defaults.TRACK)
    """four_gates, s_shaped, circle_3d, j_shaped, or the path of a .toml file (the number of gates sets shapes). any: a
    random track in every episode."""
    position: float = 1.0
    """Radius of the ball around the track's start in which episodes start, m."""
    laps: int = 1
    """Number of laps that end the episode with success. 0: fly on until the time is over."""
    fence: float = number(defaults.RACE_FENCE, above=0, endless=True)
    """The episode fails farther than this from the next gate, m. With shows_more, the distance between the previous
    gate (or the start) and the next gate is added."""
    shows_more: bool = shape(False)
    """Whether the policy sees what it needs for any track: the next three gates with their axes and openings, and the
    height above the ground. With track any, it always does."""

    swing: float = number(0.0, high=5.0, added=True, sets_shapes=True)
    """Largest amplitude with which a gate swings sideways, in its own plane, m. Each gate has its own, and its own
    period and phase, in every episode. 0: the gates stand still (sets shapes)."""
    swing_period: tuple[float, float] = number((3.0, 8.0), low=0.5, rising=True, added=True)
    """Shortest and longest period of that, s."""

    @property
    def precision(self) -> str:  # type: ignore[override]
        """The time of a lap. On random tracks, which none flies without failures, success and time count together."""
        return "pace" if self.track == ANY else "duration"

    @property
    def any_track(self) -> bool:
        """Whether the policy sees what it needs for any track."""
        return self.shows_more or self.track == ANY

    @classmethod
    def training(cls) -> "RaceConfig":
        """Lap after lap in training. The policy is judged on one lap."""
        return cls(laps=0)

    def criteria(self) -> dict[str, TaskConfig]:
        """One lap, or the requested number of laps."""
        return {self.name: dataclasses.replace(self, laps=max(self.laps, 1))}

    def domain(self) -> Domain:
        """The track with its gates wherever they swing, or random tracks."""
        if self.track == ANY:
            return RACING.domain
        tracks = track_domain(load_track(self.track))
        return displaced(tracks, self.swing, 0.0) if self.swing else tracks

    def check(self, control_rate: float, feet_height: float) -> None:
        """Gates swing on tracks that the policy knows."""
        super().check(control_rate, feet_height)
        if self.swing and self.any_track:
            raise ValueError(
                f"task.swing is {self.swing:g}; accepted: 0 with task.track {ANY} or task.shows_more, whose gates "
                "stand still"
            )

    @property
    def own_worlds(self) -> bool:
        """With track any, and with gates that swing, each episode has its own world."""
        return self.track == ANY or self.swing > 0

    def showing(self, names: Sequence[str]) -> "RaceConfig":
        """For a policy whose observation has the gates' axes: track any, if no other track is named."""
        if "gate_axes" not in names:
            return self
        other = {} if self.any_track else {"track": ANY, "episode_s": LONGEST}
        return dataclasses.replace(self, shows_more=True, **other)

    def drawing(self) -> list[Thing] | None:
        """The gates with their numbers."""
        return None if self.own_worlds else _frames(Gates.of(load_track(self.track)))

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """Rewards for coming nearer to the next gate."""
        if algo == "ppo":
            weights = {"prog1": 1.0, "anglev_sq": 0.0005, "act2_sq": 0.005, "goal": 1.0, "crash": 1.0}
            settings: AlgorithmConfig = PPOConfig(gamma=0.97, learning_rate=5e-3, learning_rate_end=5e-4)
            return TrainConfig(cls.training(), settings, RewardConfig(weights), steps=3_000_000)
        weights = {"prog1": 1.0, "near": 0.2, "anglev_sq": 0.0005, "act2_sq": 0.005}
        settings = BPTTConfig(learning_rate=8e-3, max_grad_norm=1.0, gradient_decay=1.0)
        return TrainConfig(cls.training(), settings, RewardConfig(weights), steps=2_500_000, chunk=15)

    @classmethod
    def variant(cls, preset: str, config: TrainConfig) -> TrainConfig:
        """`any_track`: a different track in every episode. From behind a gate, the way leads around it."""
        weights = {"progway" if name == "prog1" else name: weight for name, weight in config.reward.weights.items()}
        weights = {name: weight for name, weight in weights.items() if name != "near"} | {"fitlog": 1.0}
        algo: Any = config.algo
        if isinstance(algo, BPTTConfig):
            weights["fitlog"] = 40.0  # to its gradient, nothing else speaks against missing a gate
            algo = dataclasses.replace(
                algo, learning_rate=4e-3, learning_rate_end=1e-4, gradient_decay=0.3, average=0.99
            )
        return dataclasses.replace(
            config,
            task=cls(track=ANY, shows_more=True, episode_s=LONGEST, laps=0),
            algo=algo,
            reward=RewardConfig(weights, {"fitlog_margin": 0.12}),
            network=NetworkConfig((192, 192)),
            steps=60_000_000,
            chunk=200,
        )

    @classmethod
    def with_critic(cls, algo: str) -> dict[str, Any]:
        """Longer windows than for other tasks. SHAC needs a smaller learning rate and more noise."""
        longer = {} if algo == "abpt" else {"horizon": 64}
        return longer | ({"learning_rate": 4e-3, "noise": 0.1} if algo == "shac" else {})


def _frames(gates: Gates) -> list[Thing]:
    things: list[Thing] = []
    rows = zip(*(np.asarray(x, float) for x in (gates.position[:-1], gates.cos, gates.sin, gates.half)), strict=True)
    for i, (centre, cos, sin, half) in enumerate(rows):
        left, up = np.array([-sin, cos, 0.0]), np.array([0.0, 0.0, 1.0])
        inner, outer = (
            [centre + a * w * left + b * h * up for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
            for w, h in (half, half + FRAME)
        )
        for k in range(4):
            bar = np.stack([inner[k], inner[k - 1], outer[k - 1], outer[k]])
            things.append(Face(bar, ORANGE, label="gate, numbered in order" if i == k == 0 else ""))
        beyond = centre + (half[1] + FRAME + 0.3) * up + (half[0] + FRAME + 0.3) * left
        things.append(Mark(beyond, text=str(i + 1)))
    return things
