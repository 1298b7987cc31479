"""Options and recipes: touch down gently on a point of the ground."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from e2efly.config import (
    AlgorithmConfig,
    BPTTConfig,
    EnvConfig,
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
from e2efly.config.domain import Domain
from e2efly.config.drawing import INK, ORANGE, Face, Line, Thing, circle
from e2efly.config.numbers import ANGLE, SPEED
from e2efly.config.run import OURS, VISFLY
from e2efly.courses import defaults
from e2efly.tasks.registry import register

PPO_WEIGHTS = {
    "prog1": 4.0, "descent": 0.2, "upright": 0.05, "anglev_sq": 0.002, "act2_sq": 0.02, "goal": 10.0, "crash": 10.0,
}  # fmt: skip
"""Weights of the reward with which PPO learns to land."""


PAPER_SILENT = (
    Sourced("reward.weights.act3", 1.0, OURS, "ppo"),
    Sourced("reward.weights.goal", 20.0, f"{VISFLY}: envs/LandingEnv.py, r_s", "ppo"),
    Sourced("reward.weights.crash", 0.1, f"{VISFLY}: envs/LandingEnv.py, r_l", "ppo"),
)
"""Values of both landings that the paper does not give."""
PAPER_AUTHORS = (
    Sourced("task.must_touch", False, f"{VISFLY}: envs/LandingEnv.py, get_success"),
    Sourced("task.radius", 0.3, f"{VISFLY}: envs/LandingEnv.py, landing_half; theirs is a square"),
    Sourced("task.height_error", 0.2, f"{VISFLY}: envs/LandingEnv.py, get_success"),
    Sourced("task.speed", 0.3, f"{VISFLY}: envs/LandingEnv.py, get_success"),
    Sourced("task.tilt", 3.14, f"{VISFLY}: envs/LandingEnv.py, get_success asks for no attitude"),
    Sourced("task.velocity", 0.0, f"{VISFLY}: envs/LandingEnv.py, starts at rest"),
    Sourced("task.episode_s", 3.84, f"{VISFLY}: envs/LandingEnv.py, max_episode_steps 128 of 0.03 s"),
)
"""Values of both landings in the authors' public code."""


@register("land")
@dataclass(frozen=True)
class LandConfig(TaskConfig):
    """Touch down gently on a point of the ground."""

    world: ClassVar[str] = "e2efly.tasks.land.world:Land"
    goal_class: ClassVar[str] = "e2efly.tasks.land.goal:LandGoal"
    route: ClassVar[str] = "e2efly.tasks.land.goal:LandRoute"
    variants: ClassVar = ("lost_rotor",)
    smooth: ClassVar = {
        "prog1": 4.0, "progxy": 0.1, "descent": 0.2, "upright": 0.05, "anglev_sq": 0.002, "act2_sq": 0.02,
        "goal": 10.0, "crash": 10.0,
    }  # fmt: skip
    best: ClassVar = "bptt"
    robust: ClassVar = {
        "bptt": Robust(
            weights={"progxy": 1.0, "descent": 1.0, "upright": 0.1, "anglev_sq": 0.05, "act2_sq": 0.05},
            algo={"horizon": 96, "average": 0.99},
            steps=2_900_000,
        )
    }
    family: ClassVar = {"bptt": replace(robust["bptt"], steps=6_000_000, chunk=60)}
    lost_rotor: ClassVar = Robust(
        weights={"progxy": 0.3, "descent": 1.0, "upright": 2.0, "anglevxy_sq": 0.02, "act2_sq": 0.02, "alive": 3.0},
        parameters={"descent_cone": 10.0, "vz_min": 1.0, "vz_max": 2.0},
        algo={"envs": 64, "horizon": 96, "learning_rate": 2e-3, "average": 0.99},
        steps=16_000_000,
        chunk=400,
        recurrent=96,
        hidden=(96, 96),
    )
    paper: ClassVar = Paper(
        weights={"progxy": 0.04, "vz": 0.1, "anglev": 0.001},
        millions=(100, 10),
        silent=PAPER_SILENT,
        authors=(
            *PAPER_AUTHORS,
            Sourced("task.height", (1.5, 3.5), f"{VISFLY}: envs/LandingEnv.py, starts 2.5 m over the ground, +-1 m"),
            Sourced("task.sideways", 1.0, f"{VISFLY}: envs/LandingEnv.py, half of the starts"),
        ),
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
    must_touch: bool = shape(True, added=True)
    """Success: whether the vehicle has to touch. Without it, being as near, as slow and as upright is enough."""
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

    @classmethod
    def variant(cls, preset: str, config: TrainConfig) -> TrainConfig:
        """`lost_rotor`: come down upright and below 2 m/s, anywhere within 5 m, although a rotor stops in nine of ten
        episodes.

        A quadrotor can then only hold its vertical axis, about which it spins faster and faster (M. W. Mueller and
        R. D'Andrea, 2014): the rate loop cannot do that, so the policy commands the rotors, at 100 Hz.
        """
        if not isinstance(config.algo, BPTTConfig):
            raise ValueError(f"preset {preset!r}: accepted for land by bptt; not by {config.algo.name}")
        task = cls(episode_s=6.0, sideways=0.5, height=(3.0, 5.0), radius=5.0, speed=2.0, tilt=0.5, fence=8.0)
        env = EnvConfig(
            command_mode="rotor_share",
            control_rate=100.0,
            action_latency=(0.0, 0.01),
            lost_rotor=0.9,
            lost_rotor_time=(0.3, 1.0),
        )
        return cls.lost_rotor.into(replace(config, task=task, env=env))
