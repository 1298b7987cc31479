"""Options and recipes: fly through gates in order, by one camera and an IMU, without being told where one is."""

import dataclasses
import math
from dataclasses import dataclass
from typing import ClassVar

from e2efly.config import (
    AHEAD,
    AlgorithmConfig,
    BPTTConfig,
    DAggerConfig,
    DisturbanceConfig,
    EnvConfig,
    ImageNoiseConfig,
    LinkConfig,
    NetworkConfig,
    PPOConfig,
    RewardConfig,
    TaskConfig,
    TrainConfig,
    number,
    shape,
)
from e2efly.config.domain import Domain, displaced, track_domain, union
from e2efly.config.numbers import ANGLE
from e2efly.courses import defaults
from e2efly.courses.tracks import load_track
from e2efly.tasks.race.tracks_used import by_track, used
from e2efly.tasks.registry import register

SENSED = ("attitude", "gyroscope", "accelerometer", "past_actions")
"""What a vehicle knows without a pose. Of the attitude, the network takes where up is."""
EYE = dataclasses.replace(
    AHEAD, sees="mask", of="gate", width=64, height=36, noise=ImageNoiseConfig(), rate=30.0, latency=(0.02, 0.06),
    angle_spread=math.radians(2),
)  # fmt: skip
"""The camera, which sees gates: tilted up, mounted a little askew, and late."""
ABOUT = EnvConfig(
    cameras=(EYE,),
    action_latency=(0.01, 0.03),
    observation_latency=(0.0, 0.02),
    randomize={
        "mass": 0.1, "inertia": 0.2, "motor_time_constant": 0.4, "rate_gain": 0.4, "drag_linear": 0.5,
        "drag_quadratic": 0.5, "torque_ratio": 0.2,
    },
    wind=2.0,
    disturbance=DisturbanceConfig(gust=0.5, thrust=0.1, rotor=0.05, sag=0.1),
    link=LinkConfig(dropped=0.05),
)  # fmt: skip
"""Vehicles and air about those of the file. Its latency is mostly the age of poses that come by radio. Here all is
measured on board: what is late are the images, by their own ages, and a little the commands and the attitude."""
TOLD = "told"
"""The preset for a policy that is told everything: the teacher."""


@register("race_eyes")
@dataclass(frozen=True)
class RaceEyesConfig(TaskConfig):
    """Fly through gates in order, by one camera and an IMU, without being told where one is."""

    world: ClassVar[str] = "e2efly.tasks.race_eyes.world:RaceEyes"
    goal_class: ClassVar[str] = "e2efly.tasks.race.any_goal:AnyRaceGoal"
    route: ClassVar[str] = "e2efly.tasks.race_eyes.goal:RaceEyesRoute"
    best: ClassVar = "dagger"
    precision: ClassVar = "duration"
    cameras: ClassVar = (EYE,)
    variants: ClassVar = (TOLD,)

    episode_s: float = 20.0
    """Length of an episode, s."""
    observes: tuple[str, ...] | None = shape(SENSED, added=True)
    """Names of the fields that the policy observes. None: all, as if it had a pose."""
    track: tuple[str, ...] = shape(("four_gates", "circle_3d", "s_shaped", "j_shaped"))
    """One or more shipped tracks, or paths of .toml files. Every episode uses one of them (their number and their gates
    set shapes)."""
    only: float = number(-1.0, low=-1)
    """Number of the track that every episode uses, counted from 0. -1: any of them."""
    scale: float = number(2.0, above=0)
    """Factor on the track's ground plan. The default makes it wide enough for 10 m/s."""
    gate_position: float = 0.1
    """Half-width of each gate's random offset from its place on the track, m per axis."""
    gate_yaw: float = number(0.05, high=ANGLE)
    """Half-width of each gate's random rotation, rad."""
    position: float = 1.0
    """Radius of the ball around the track's start in which episodes start, m."""
    heading: float = number(0.3, high=ANGLE)
    """Largest start heading relative to the track's, rad, in either direction; drawn uniformly."""
    laps: int = 1
    """Number of laps that end the episode with success. 0: fly on until the time is over."""
    fence: float = number(defaults.RACE_FENCE, above=0, endless=True)
    """The episode fails farther than this from the next gate, in addition to the distance between the previous gate (or
    the start) and the next gate, m."""

    @classmethod
    def training(cls) -> "RaceEyesConfig":
        """Lap after lap in training. The policy is judged on one lap."""
        return cls(laps=0)

    def criteria(self) -> dict[str, TaskConfig]:
        """Each track that is used, with one lap or the requested number of laps."""
        judged = dataclasses.replace(self, laps=max(self.laps, 1))
        return by_track(judged)

    def domain(self) -> Domain:
        """The tracks with their displaced gates."""
        tracks = union(track_domain(load_track(name).enlarged(self.scale)) for name in used(self))
        return displaced(tracks, self.gate_position, self.gate_yaw)

    @property
    def own_worlds(self) -> bool:
        """Each episode has its own track."""
        return True

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """The zoo's policy of the preset `told` is imitated. The other algorithms have rewards."""
        settings: AlgorithmConfig = DAggerConfig(teacher="race_told")
        weights = {"progway": 2.0, "fitlog": 40.0, "overspeed": 0.03, "anglev_sq": 0.0005, "act2_sq": 0.005}
        if algo == "bptt":
            settings = BPTTConfig(
                learning_rate=4e-3, learning_rate_end=1e-4, gradient_decay=0.3, average=0.99, max_grad_norm=1.0
            )
        elif algo == "ppo":
            settings = PPOConfig(gamma=0.97)
            weights = {"progway": 1.0, "fitlog": 1.0, "anglev_sq": 0.0005, "act2_sq": 0.005, "goal": 1.0, "crash": 1.0}
        return TrainConfig(
            cls.training(), settings, RewardConfig(weights, {"fitlog_margin": 0.2, "desired_speed": 9.0}),
            ABOUT,
            NetworkConfig((96, 96), pool=(18, 32), encoder=(96,), recurrent=128),
            steps=25_000_000, chunk=300, eval_episodes=250, fast_compile=False,
        )  # fmt: skip

    @classmethod
    def variant(cls, preset: str, config: TrainConfig) -> TrainConfig:
        """`told`: without a camera. The policy knows where it is, where the gates are, and how fast it flies. Progress
        does not weigh more than it has to: a teacher that turns fast has a learner that sees nothing.
        """
        return dataclasses.replace(
            config,
            task=dataclasses.replace(config.task, observes=None),
            env=dataclasses.replace(ABOUT, cameras=(), observation_latency=(0.0, 0.0)),
            network=NetworkConfig((192, 192)),
            steps=12_000_000,
            chunk=100,
            fast_compile=True,
        )
