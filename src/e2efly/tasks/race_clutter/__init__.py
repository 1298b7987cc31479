"""Options and recipes: fly through gates in order, among obstacles seen only by a camera."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from e2efly.config import (
    AHEAD,
    AlgorithmConfig,
    BPTTConfig,
    CameraConfig,
    ClutterConfig,
    EnvConfig,
    ImageNoiseConfig,
    NetworkConfig,
    Paper,
    PPOConfig,
    RewardConfig,
    Robust,
    Sourced,
    StageConfig,
    TaskConfig,
    TrainConfig,
    number,
    shape,
)
from e2efly.config.domain import Domain, displaced, extent, track_domain, union
from e2efly.config.numbers import ANGLE, SPEED
from e2efly.config.run import CRL_RACING
from e2efly.courses.random_tracks import ANY, CLUTTERED
from e2efly.courses.tracks import load_track
from e2efly.tasks.race.tracks_used import by_track, used
from e2efly.tasks.registry import register

THREE = ("s_shaped", "circle_3d", "j_shaped")
"""The paper's tracks."""
AUTHORS_CAMERA = CameraConfig(
    "depth", 64, 64, fov=(math.pi / 2, math.pi / 2), position=(0.1, 0.0, 0.0), reach=(0.2, 10.0),
    noise=ImageNoiseConfig(inverse_depth=0.05),
)  # fmt: skip
"""The depth camera of the authors' public code."""


@register("race_clutter")
@dataclass(frozen=True)
class RaceClutterConfig(TaskConfig):
    """Fly through gates in order, among obstacles seen only by a camera."""

    world: ClassVar[str] = "e2efly.tasks.race_clutter.world:RaceClutter"
    goal_class: ClassVar[str] = "e2efly.tasks.race_clutter.goal:RaceClutterGoal"
    route: ClassVar[str] = "e2efly.tasks.race_clutter.goal:RaceClutterRoute"
    best: ClassVar = "bptt"
    precision: ClassVar = "duration"
    robust: ClassVar = {
        "bptt": Robust(steps=15_000_000, chunk=200, recurrent=96, hidden=(128, 64), eased=(0.4, 4_000_000))
    }
    cameras: ClassVar = (dataclasses.replace(AHEAD, width=48, height=24, noise_share=0.5),)
    curriculum: ClassVar = (
        StageConfig({"clutter.obstacles": 0.0}, success=0.8, steps=2_000_000),
        StageConfig({"clutter.obstacles": 5.0}, success=0.7, steps=2_000_000),
    )
    paper: ClassVar = Paper(
        weights={"prog1": 0.9, "act3": 1.0, "ori1": 0.04, "avoid1": 0.01, "goal": 5.0, "crash": 4.0},
        millions=(100, 50),
        silent=(
            Sourced("task.track", THREE, "the paper's tracks"),
            Sourced("task.shows_axes", False, "the paper's observation has 17 numbers"),
            Sourced("task.collisions_end", True, f"{CRL_RACING}: envs/droneGymEnv.py, is_collision", "ppo"),
        ),
        authors=(
            Sourced("task.scale", 1.0, f"{CRL_RACING}: envs/demo2_3Dcircle_onboard.py, a circle of 6x6 m"),
            Sourced("task.speed", (2.0, 4.0), "ours: what such tracks allow; v_d of their code is 0.5 to 1 m/s"),
            Sourced(
                "task.clutter",
                ClutterConfig(sideways=2.0, size=(0.15, 0.15)),
                f"{CRL_RACING}: examples/ete_racing_sim/random_obstacle.py, 18 trees of 0.15 m",
            ),
            Sourced("task.position", 0.3, f"{CRL_RACING}: envs/demo3_U.py, half of the starts"),
            Sourced("task.episode_s", 20.0, "ours: a whole lap must fit into an episode"),
            Sourced("env.cameras", (AUTHORS_CAMERA,), f"{CRL_RACING}: envs/demo3_U.py, sensor_kwargs and noisy_depth"),
        ),
    )

    episode_s: float = 20.0
    """Length of an episode, s."""
    track: tuple[str, ...] = shape((*THREE, ANY))
    """One or more of four_gates, s_shaped, circle_3d, j_shaped, or paths of .toml files. any: random tracks. Every
    episode uses one of them (their number and their gates set shapes)."""
    only: float = number(-1.0, low=-1)
    """Number of the track that every episode uses, counted from 0. -1: any of them."""
    scale: float = number(2.0, above=0)
    """Factor on the track's ground plan. The default makes it wide enough for 10 m/s."""
    clutter: ClutterConfig = ClutterConfig()
    """The obstacles."""
    gate_position: float = 0.3
    """Half-width of each gate's random offset from its place on the track, m per axis."""
    gate_yaw: float = number(0.2, high=ANGLE)
    """Half-width of each gate's random rotation, rad."""
    speed: tuple[float, float] = number((4.0, 12.0), high=SPEED, rising=True)
    """Commanded speed, m/s, uniform per episode."""
    position: float = 0.5
    """Radius of the ball around the track's start in which episodes start, m."""
    laps: int = 1
    """Number of laps that end the episode with success. 0: fly on until the time is over."""
    fence: float = number(20.0, above=0, endless=True)
    """The episode fails farther than this from the next gate, m."""
    collisions_end: bool = True
    """Whether a collision ends the episode. In training it does not, so that the policy learns from what follows."""
    shows_axes: bool = shape(True, added=True)
    """Whether the policy sees in which direction the next two gates are flown through. Without it, its observation is
    the paper's: 17 numbers, with env.past_actions 0."""

    @classmethod
    def training(cls) -> "RaceClutterConfig":
        """Lap after lap. Collisions do not end the episode."""
        return cls(laps=0, collisions_end=False)

    def criteria(self) -> dict[str, TaskConfig]:
        """Each track that is used, with one lap or the requested number of laps. Collisions end the episode."""
        judged = dataclasses.replace(self, laps=max(self.laps, 1), collisions_end=True)
        return by_track(judged)

    def domain(self) -> Domain:
        """The tracks with their displaced gates, the commanded speed, and up to so many obstacles."""
        tracks = union(
            CLUTTERED.domain if name == ANY else track_domain(load_track(name).enlarged(self.scale))
            for name in used(self)
        )
        return (
            *displaced(tracks, self.gate_position, self.gate_yaw),
            extent("speed", "m/s", self.speed),
            extent("obstacles", "1", (0.0, self.clutter.obstacles)),
            extent("obstacle_size", "m", self.clutter.size),
            extent("obstacles_moving", "1", (0.0, self.clutter.moving)),
        )

    def shows(self, name: str) -> bool:
        """The gates' axes by choice."""
        return super().shows(name) and (self.shows_axes or name != "gate_axes")

    def showing(self, names: Sequence[str]) -> "RaceClutterConfig":
        """For a policy with or without the gates' axes."""
        return dataclasses.replace(self, shows_axes="gate_axes" in names)

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """Rewards for the velocity that leads through the gates, and for keeping away from the obstacles."""
        weights = {
            "vel": 1.5, "near": 1.0, "avoid": 12.0, "fit": 20.0, "ori2": 0.3, "anglev_sq": 0.01, "act2_sq": 0.02,
        }  # fmt: skip
        parameters = {"fit_margin": 0.25, "fit_limit": 2.0}
        settings: AlgorithmConfig = BPTTConfig(horizon=48, gradient_decay=1.5, average=0.99)
        task, network = cls.training(), NetworkConfig((128, 64), pool=(12, 48), recurrent=64)
        steps, curriculum = 12_000_000, ()
        if algo == "ppo":
            weights = {
                "prog1": 1.0, "overspeed": 0.01, "avoid": 0.05, "ori2": 0.1, "anglev_sq": 0.0005, "act2_sq": 0.005,
                "goal": 1.0, "crash": 2.0,
            }  # fmt: skip
            settings, parameters, steps = PPOConfig(gamma=0.97), {}, 8_000_000
            task, curriculum = cls(laps=0), cls.curriculum
            network = dataclasses.replace(network, recurrent=0)
        return TrainConfig(
            task, settings, RewardConfig(weights, parameters), EnvConfig(cameras=cls.cameras), network,
            steps=steps, chunk=200, eval_episodes=500, curriculum=curriculum, fast_compile=False,
        )  # fmt: skip


@register("race_clutter_room")
@dataclass(frozen=True)
class RaceClutterRoomConfig(RaceClutterConfig):
    """Fly through gates in order, in a room of 6x6 m, among obstacles seen only by a camera."""

    route: ClassVar[str] = "e2efly.tasks.race_clutter.goal:RaceClutterRoomRoute"
    # gates are near everywhere: `fit` costs less, so that a low speed is obeyed
    robust: ClassVar = {
        "bptt": Robust(
            weights={
                "vel": 4.0, "near": 0.3, "avoid": 12.0, "fit": 6.0, "ori2": 0.3, "anglev_sq": 0.01, "act2_sq": 0.02,
            },
            algo={"learning_rate": 3e-3}, start_from="race_clutter",
            steps=1_200_000, chunk=100, recurrent=96, hidden=(128, 64),
        )
    }  # fmt: skip
    paper: ClassVar = None

    episode_s: float = 15.0
    track: tuple[str, ...] = shape(("room_6",))
    scale: float = number(1.0, above=0)
    clutter: ClutterConfig = ClutterConfig(sideways=1.5, size=(0.1, 0.3), clear=0.4)
    gate_position: float = 0.1
    gate_yaw: float = number(0.1, high=ANGLE)
    speed: tuple[float, float] = number((1.5, 2.5), high=SPEED, rising=True)
