"""Options and recipes: fly to a point and stay there."""

import dataclasses
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from e2efly.config import (
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
)
from e2efly.config.domain import Domain
from e2efly.config.drawing import INK, Line, Mark, Thing, circle
from e2efly.config.numbers import ANGLE, BODY_RATE, SPEED
from e2efly.config.run import VISFLY, check_aloft, check_counted
from e2efly.courses import defaults
from e2efly.tasks import public_code
from e2efly.tasks.registry import register


@register("hover")
@dataclass(frozen=True)
class HoverConfig(TaskConfig):
    """Fly to a point and stay there."""

    world: ClassVar[str] = "e2efly.tasks.hover.world:Hover"
    goal_class: ClassVar[str] = "e2efly.tasks.hover.goal:HoverGoal"
    route: ClassVar[str] = "e2efly.tasks.hover.goal:HoverRoute"
    shows_error: ClassVar = True
    variants: ClassVar = ("thrown", "rotors", "raptor", "lost_rotor")
    smooth: ClassVar = {"near": 1.0, "prog2": 0.2, "v1": 0.02, "anglev_sq": 0.002, "act2_sq": 0.02, "crash": 10.0}
    best: ClassVar = "bptt"
    robust: ClassVar = {
        "bptt": Robust(
            weights={"prog2": 1.0, "near": 1.5, "v1": 0.1, "anglev_sq": 0.025, "act2_sq": 0.05},
            algo={"horizon": 96, "learning_rate": 8e-3, "average": 0.99},
            steps=2_900_000,
        ),
        "ppo": Robust(steps=6_000_000, recurrent=96),
    }
    family: ClassVar = {
        "bptt": dataclasses.replace(
            robust["bptt"],
            weights={"prog2": 1.0, "near": 0.3, "v1": 0.1, "anglev_sq": 0.06, "act2_sq": 0.05},
            steps=14_000_000,
            chunk=60,
        )
    }
    rotors: ClassVar = Robust(
        weights={"prog2": 1.0, "near": 0.3, "v1": 0.1, "anglev_sq": 0.03, "act2_sq": 0.05},
        algo={"horizon": 160, "learning_rate": 6e-3, "average": 0.99},
        steps=30_000_000,
        chunk=150,
    )
    raptor: ClassVar = Robust(
        weights={"prog2": 1.0, "near": 0.3, "v1": 0.1, "anglev_sq": 0.03, "act2_sq": 0.05, "ori1": 0.2},
        algo={"horizon": 240, "learning_rate": 6e-3, "average": 0.99, "gamma": 0.995, "gradient_decay": 1.5},
        steps=60_000_000,
        chunk=150,
        recurrent=16,
        hidden=(16,),
    )
    lost_rotor: ClassVar = Robust(
        weights={"prog2": 1.0, "near": 1.0, "v1": 0.1, "upright": 0.1, "anglevxy_sq": 0.02, "act2_sq": 0.05},
        algo={"horizon": 96, "learning_rate": 8e-3, "average": 0.99},
        steps=4_000_000,
    )
    paper: ClassVar = Paper(
        weights={"prog2": 0.01, "ori2": 0.0001, "v1": 0.002, "anglev": 0.002},
        millions=(50, 10),
        silent=public_code.silent("envs/HoverEnv.py"),
        authors=(
            *public_code.authors("envs/HoverEnv.py"),
            Sourced("task.target", (0.0, 0.0, 1.5), f"{VISFLY}: envs/HoverEnv.py, target"),
            Sourced("task.position", 1.0, f"{VISFLY}: envs/HoverEnv.py, half of the starts; theirs is 0.5 m in z"),
            Sourced("task.tilt", 0.0, f"{VISFLY}: envs/HoverEnv.py, level starts"),
            Sourced("task.body_rate", 0.0, f"{VISFLY}: envs/HoverEnv.py, starts at rest"),
        ),
    )

    episode_s: float = 8.0
    """Length of an episode, s."""
    judged_s: float = 0.0
    """Length of the episodes by which the policy is judged, s. 0: the same as `episode_s`."""
    target: tuple[float, float, float] = number(defaults.TARGET, low=-math.inf)
    """Where to hover, world, m."""
    position: float = 2.0
    """Largest start distance from the target, m per axis."""
    velocity: float = number(1.0, high=SPEED)
    """Largest start velocity, m/s per axis, in either direction; drawn uniformly."""
    tilt: float = number(0.5235987755982988, high=ANGLE)
    """Largest start roll and pitch, rad, in either direction; drawn uniformly."""
    heading: float = number(math.pi, high=ANGLE, added=True)
    """Largest start yaw, rad, in either direction; drawn uniformly."""
    body_rate: float = number(1.0, high=BODY_RATE)
    """Largest start body rates, rad/s per axis, in either direction; drawn uniformly."""
    radius: float = number(0.1, above=0)
    """Success: largest distance from the target, m."""
    hold_s: float = 1.0
    """Success: the distance must hold during this last part of the episode, s."""
    fence: float = number(defaults.HOVER_FENCE, above=0, endless=True)
    """The episode fails farther than this from the target, m."""
    spin: float = number(35.0, above=0, endless=True)
    """The episode fails at a higher body rate than this, rad/s: gyroscopes measure up to 2000 degrees per second.
    Without a rate loop, nothing else ends a tumble."""

    def check(self, control_rate: float, feet_height: float) -> None:
        """The target is over the ground, and the success can be held within the longest episode."""
        super().check(control_rate, feet_height)
        check_counted("judged_s", self.judged_s, control_rate)
        check_aloft("target", self.target, feet_height)
        longest = max(self.episode_s, self.judged_s)
        if not 0 <= self.hold_s <= longest:
            raise ValueError(
                f"task.hold_s is {self.hold_s}; accepted: 0 to the {longest:g} s of task.episode_s, or of "
                "task.judged_s if longer"
            )

    def criteria(self) -> dict[str, TaskConfig]:
        """Episodes of length `judged_s`, if that is not 0."""
        return {self.name: dataclasses.replace(self, episode_s=self.judged_s or self.episode_s)}

    def domain(self) -> Domain:
        """Nothing stands in its world, and its goal is one place."""
        return ()

    def limits(self) -> dict[str, float]:
        """The largest distance from the target."""
        return {"final_error": float(self.radius)}

    def drawing(self) -> list[Thing]:
        """The target and the circle of the success radius."""
        target = np.asarray(self.target, float)
        return [Mark(target, marker="*", label="target"), Line(circle(target, float(self.radius)), INK, 1.0)]

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """PPO's reward pays for being near the target; BPTT's reward pays for coming nearer."""
        if algo == "ppo":
            weights = {"near": 1.0, "v1": 0.02, "anglev_sq": 0.002, "act2_sq": 0.02}
            return TrainConfig(cls(), PPOConfig(), RewardConfig(weights), steps=2_500_000)
        weights = {"prog2": 1.0, "v1": 0.1, "anglev_sq": 0.02, "act2_sq": 0.02}
        return TrainConfig(cls(), BPTTConfig(), RewardConfig(weights), steps=1_000_000, chunk=10)

    @classmethod
    def variant(cls, preset: str, config: TrainConfig) -> TrainConfig:
        """`thrown`: hover after being thrown: from any attitude, tumbling, and at high speed.

        The training episodes are short, because the behaviour to learn happens in the first seconds. The target is at
        a height of 5 m: at 3 m, some starts hit the ground whatever the policy does (docs/tasks.md).

        `rotors`: hover by rotor thrusts at 100 Hz, with a memory, and with delays of up to 34 ms.

        `raptor`: the same by rotor speeds, with exactly RAPTOR's network, which turns to the world's x axis.

        `lost_rotor`: a hexacopter stays at its place, although one of its rotors stops in nine of ten episodes. Its
        heading is free.
        """
        if preset in ("rotors", "raptor", "lost_rotor"):
            if not isinstance(config.algo, BPTTConfig):
                raise ValueError(f"preset {preset!r}: accepted for hover by bptt; not by {config.algo.name}")
            by_rotors = EnvConfig(command_mode="rotor_share", control_rate=100.0, action_latency=(0.0, 0.034))
            if preset == "raptor":
                env = dataclasses.replace(by_rotors, vehicle="any", command_mode="rotor_speed", past_actions=1)
                network = dataclasses.replace(config.network, form="raptor")
                config = dataclasses.replace(config, task=cls(heading=0.8), network=network)
                return cls.raptor.into(dataclasses.replace(config, env=env))
            loses = EnvConfig(vehicle="hexa", lost_rotor=0.9)
            recipe, env = (cls.rotors, by_rotors) if preset == "rotors" else (cls.lost_rotor, loses)
            return recipe.into(dataclasses.replace(config, env=env))
        thrown = cls(
            episode_s=3.0, judged_s=10.0, target=(0.0, 0.0, 5.0), velocity=3.0, tilt=math.pi, body_rate=6.0, fence=10.0
        )
        if isinstance(config.algo, BPTTConfig):
            config = dataclasses.replace(config, algo=dataclasses.replace(config.algo, envs=32, learning_rate=8e-3))
        return dataclasses.replace(config, task=thrown)
