"""Options and recipes: follow a reference trajectory that is known one second ahead."""

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, ClassVar

from e2efly.config import (
    AlgorithmConfig,
    BPTTConfig,
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
from e2efly.config.numbers import BODY_RATE, SPEED
from e2efly.config.run import VISFLY, check_aloft
from e2efly.courses import defaults
from e2efly.courses.references import KNOT_PERIOD, Lissajous, motion_domain, read_csv, through_points
from e2efly.tasks import public_code
from e2efly.tasks.registry import register


@register("track")
@dataclass(frozen=True)
class TrackConfig(TaskConfig):
    """Follow a reference trajectory that is known one second ahead."""

    world: ClassVar[str] = "e2efly.tasks.track.world:Track"
    goal_class: ClassVar[str] = "e2efly.tasks.track.goal:TrackGoal"
    route: ClassVar[str] = "e2efly.tasks.track.goal:TrackRoute"
    goal: ClassVar = "reference"
    shows_error: ClassVar = True
    precision: ClassVar = "mean_error"
    smooth: ClassVar = {"near": 1.0, "prog2": 0.2, "anglev_sq": 0.002, "act2_sq": 0.02, "crash": 10.0}
    best: ClassVar = "bptt"
    robust: ClassVar = {
        "bptt": Robust(
            weights={"prog2": 1.0, "anglev_sq": 0.02, "act2_sq": 0.03},
            algo={"horizon": 96, "average": 0.99},
            steps=3_600_000,
        ),
        "ppo": Robust(algo={"horizon": 64, "learning_rate": 2e-3, "gamma": 0.96}, steps=6_000_000, recurrent=96),
    }
    family: ClassVar = {
        "bptt": Robust(
            weights={"prog2": 1.0, "anglev_sq": 0.02, "act2_sq": 0.03},
            algo={"horizon": 96, "learning_rate": 6e-3, "average": 0.99},
            steps=4_000_000,
            chunk=60,
        )
    }
    paper: ClassVar = Paper(
        weights={"prog2": 0.02, "ori2": 0.001, "v1": 0.002, "anglev": 0.002},
        millions=(50, 20),
        silent=public_code.silent("envs/TrackingEnv.py"),
        authors=(
            *public_code.authors("envs/TrackingEnv.py"),
            Sourced("task.reference", "circle", f"{VISFLY}: envs/TrackingEnv.py, radius 2 m, 0.2 pi rad/s"),
            Sourced("task.centre", (0.0, 0.0, 1.0), f"{VISFLY}: envs/TrackingEnv.py, centre"),
            Sourced("task.position", 0.2, f"{VISFLY}: envs/TrackingEnv.py; theirs is around the circle's centre"),
        ),
    )

    episode_s: float = 10.0
    """Length of an episode, s (sets shapes)."""
    reference: str = shape("polynomial")
    """Reference: polynomial (random, smooth), circle, lemniscate, or the path of a .csv file with columns t, x, y,
    z."""
    centre: tuple[float, float, float] = number(defaults.CENTRE, low=-math.inf)
    """Centre of the reference, world, m."""
    position: float = 1.0
    """Radius of the ball around the reference in which episodes start, m."""
    velocity: float = number(0.5, high=SPEED)
    """Largest start velocity, m/s per axis, in either direction; drawn uniformly."""
    settle_s: float = 2.0
    """Time after which the error counts, s."""
    mean_error: float = 0.08
    """Success: largest mean distance to the reference, m."""
    fence: float = number(defaults.TRACK_FENCE, above=0, endless=True)
    """The episode fails farther than this from the reference, m."""
    radius: float = number(defaults.RADIUS, above=0)
    """Circle: its radius, m. Lemniscate: half its length, m."""
    circle_rate: float = number(defaults.CIRCLE_RATE, low=-BODY_RATE, high=BODY_RATE)
    """Circle: angular rate, rad/s."""
    lemniscate_speed: float = number(defaults.LEMNISCATE_SPEED, high=SPEED)
    """Lemniscate: highest speed, m/s."""
    polynomial_reach: float = 2.0
    """Random polynomial: largest distance of its knots from the centre, m per axis."""
    polynomial_speed: float = number(2.5, high=SPEED)
    """Random polynomial: largest speed at a knot, m/s."""

    def check(self, control_rate: float, feet_height: float) -> None:
        """The centre of the reference is over the ground."""
        super().check(control_rate, feet_height)
        check_aloft("centre", self.centre, feet_height)

    def criteria(self) -> dict[str, TaskConfig]:
        """A policy trained on random references is judged on a circle and a lemniscate, which it has never seen."""
        if self.reference != "polynomial":
            return {self.name: self}
        return {
            "circle": dataclasses.replace(self, reference="circle", mean_error=0.08),
            "lemniscate": dataclasses.replace(self, reference="lemniscate", mean_error=0.15),
        }

    def course(self) -> dict[str, Any]:
        """The reference. For a random reference, without the phase that an episode draws or the knots of its
        polynomial.
        """
        shared: dict[str, Any] = {"reference": self.reference, "duration_s": float(self.episode_s)}
        centre = {"centre_m": [float(x) for x in self.centre]}
        if self.reference == "circle":
            return shared | centre | {"radius_m": float(self.radius), "rate_rad_s": float(self.circle_rate)}
        if self.reference == "lemniscate":
            size = {"half_length_m": float(self.radius), "top_speed_m_s": float(self.lemniscate_speed)}
            return shared | centre | size
        return shared

    def domain(self) -> Domain:
        """Top speed and acceleration of the reference.

        A piece of a random polynomial lasts four knot periods. It is no faster than a piece of least jerk that begins
        and ends at rest: 15/8 of its mean speed, and 10/sqrt(3) of that over its duration.
        """
        if self.reference == "polynomial":
            top = self.polynomial_speed
            return motion_domain(15 / 8 * top, 10 / math.sqrt(3) * top / (4 * KNOT_PERIOD))
        if self.reference == "circle":
            return Lissajous.circle(self.radius, self.circle_rate).domain
        if self.reference == "lemniscate":
            return Lissajous.lemniscate(self.radius, self.lemniscate_speed).domain
        return through_points(read_csv(self.reference)).domain

    def limits(self) -> dict[str, float]:
        """The mean error."""
        return {"mean_error": float(self.mean_error)}

    @classmethod
    def recipe(cls, algo: str) -> TrainConfig:
        """PPO's reward pays for being near the reference; BPTT's reward pays for coming nearer."""
        if algo == "ppo":
            weights = {"near": 1.0, "anglev_sq": 0.002, "act2_sq": 0.02}
            settings: AlgorithmConfig = PPOConfig(horizon=48, gamma=0.95, learning_rate=5e-3)
            return TrainConfig(cls(), settings, RewardConfig(weights), steps=2_000_000)
        weights = {"prog2": 1.0, "anglev_sq": 0.01, "act2_sq": 0.02}
        settings = BPTTConfig(horizon=32, learning_rate=8e-3)
        return TrainConfig(cls(), settings, RewardConfig(weights), steps=1_000_000)
