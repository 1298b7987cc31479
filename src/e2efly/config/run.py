"""Options of a run: all other options, and how to learn."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Literal

from e2efly.config.algorithms import ALGORITHMS, AlgorithmConfig
from e2efly.config.domain import Domain
from e2efly.config.drawing import Thing
from e2efly.config.env import FILE, CameraConfig, EnvConfig
from e2efly.config.numbers import check_fields, number, shape
from e2efly.config.registry import absolute


@dataclass(frozen=True)
class RewardConfig:
    """The reward: a weighted sum of the terms of the reward manual."""

    weights: dict[str, float] = field(default_factory=dict)
    """Weight of each term: a name of `e2efly list rewards`, or your own term, path/to/file.py:Name. On the command
    line, these are changes to the preset's weights, and 0 removes a term."""
    parameters: dict[str, float] = field(default_factory=dict)
    """Constants of the terms that differ from their defaults."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "weights", {absolute(name): weight for name, weight in self.weights.items()})


@dataclass(frozen=True)
class NetworkConfig:
    """The policy network, and the critic's network if there is one."""

    hidden: tuple[int, ...] = number((64, 64), low=1, high=10**6)
    """Units of the hidden layers (sets shapes)."""
    activation: Literal["relu", "tanh", "elu"] = "relu"
    """Activation of the hidden layers (sets the program)."""
    pool: tuple[int, int] = number((16, 16), low=1, high=8192)
    """Rows and columns to which an image is reduced. Each cell becomes its mean value, or for depth its nearest value.
    They must divide the camera's rows and columns (sets shapes)."""
    convolution: tuple[int, ...] = number((), low=1, high=10**6)
    """Channels of the convolutions that process an image in place of the reduction by `pool`. Their kernel size
    equals their stride: 4, or 2 where 4 does not divide the image. They can then be computed as matrix products
    (sets shapes)."""
    encoder: tuple[int, ...] = number((64,), low=1, high=10**6)
    """Units of the layers that process each image before it joins the other inputs (sets shapes)."""
    recurrent: int = number(0, high=10**6)
    """Units of a gated recurrent unit (GRU) before the hidden layers. 0: no GRU (sets shapes)."""
    form: Literal["features", "raptor"] = shape("features", added=True)
    """raptor: exactly the network of RAPTOR, which PX4's mc_raptor flies: 22 inputs, 16 hidden units, a GRU of 16 after
    them, 4 outputs (sets the program)."""


@dataclass(frozen=True)
class StageConfig:
    """A stage of a curriculum: the task with a few numbers changed, or with a share of what is drawn, until it is
    mastered or its time is over.
    """

    changes: dict[str, float | tuple[float, ...]]
    """New values of the task's fields, by dotted path: {"forest.density": 0.0}. Fields that set shapes or the program
    are not allowed."""
    success: float | None = number(None, above=0, high=1.0)
    """Promotion: the success rate in an evaluation at which this stage ends."""
    steps: int | None = number(None, low=1, high=10**15)
    """Promotion at the latest after so many environment steps."""
    strength: float = number(1.0, high=1.0, added=True)
    """Share of everything that the environment draws: vehicles, delays, air, poses and links."""


VISFLY = "SJTU-ViSYS-team/VisFly at 6ff29bf"
CRL_RACING = "SJTU-ViSYS-team/CRL-Drone-Racing at 11924fa"
"""The repositories of the paper's authors, as they were read on 2026-11-27."""
OURS = "ours: the paper names the term, but no weight"


@dataclass(frozen=True)
class Sourced:
    """A value of a preset that is not in the paper, and where it is from."""

    field: str
    """Dotted name of the field of `TrainConfig`. Of a reward: `reward.weights.NAME`."""
    value: Any
    """The value."""
    source: str
    """The public page or file that has it, or why it was chosen."""
    algo: str = ""
    """The algorithm that it is for. Empty: all."""


@dataclass(frozen=True)
class Paper:
    """The values for the training of a task as in the paper: the presets `paper` and `authors`."""

    weights: Mapping[str, float]
    """Weights of the reward (from the paper's tables)."""
    millions: tuple[int, int]
    """Environment steps for PPO and for BPTT, in millions (from the paper)."""
    silent: tuple[Sourced, ...] = ()
    """Values that a training needs and the paper does not give."""
    authors: tuple[Sourced, ...] = ()
    """Values of its authors' public code, which the preset `authors` has in addition."""


@dataclass(frozen=True, kw_only=True)
class Robust:
    """Changes to the recipe of a task for training in which every episode has a different vehicle, which the policy
    must sense.
    """

    weights: Mapping[str, float] | None = None
    """Weights of the reward, in place of the recipe's. None: the recipe's weights."""
    parameters: Mapping[str, float] = field(default_factory=dict)
    """Constants of the reward terms, in addition to the recipe's."""
    algo: Mapping[str, Any] = field(default_factory=dict)
    """Options of the algorithm."""
    steps: int
    """Environment steps."""
    chunk: int = 30
    """Updates between two evaluations."""
    recurrent: int = 64
    """Units of the GRU, which remembers how the vehicle has answered."""
    hidden: tuple[int, ...] = (64, 64)
    """Units of the hidden layers."""
    start_from: str | None = None
    """The policy of the zoo whose weights the training starts from. None: fresh weights, or as the recipe says."""
    eased: tuple[float, int] | None = None
    """A first stage: its `StageConfig.strength` and its environment steps. Its changes are those of the recipe's own
    first stage. None: there is none."""

    def into(self, config: "TrainConfig") -> "TrainConfig":
        """A configuration that learns in this way."""
        given, curriculum = config.reward.parameters, config.curriculum
        if self.eased is not None:
            changes = curriculum[0].changes if curriculum else {}
            curriculum = (StageConfig(changes, strength=self.eased[0], steps=self.eased[1]), *curriculum)
        return replace(
            config,
            network=replace(config.network, recurrent=self.recurrent, hidden=self.hidden),
            algo=replace(config.algo, **self.algo),
            reward=config.reward
            if self.weights is None
            else RewardConfig(dict(self.weights), {**given, **self.parameters}),
            start_from=self.start_from or config.start_from,
            curriculum=curriculum,
            steps=self.steps,
            chunk=self.chunk,
        )


LEARNED, LEARNED_RANDOM = 0.95, 0.9
"""Success rates of the worst criterion at which a task counts as learned: with the vehicle of the file, and with random
vehicles, some of which are hardly able to fly it."""


def criterion(stop_at: float | None, vehicles: str) -> float:
    """The success rate at which a task counts as learned: the one that the user asked for, or that of what flies.

    Args:
        stop_at: what the user asked for, if anything.
        vehicles: name of what flies (`Env.vehicles`).
    """
    return stop_at or (LEARNED if vehicles == FILE else LEARNED_RANDOM)


TIMED = ("duration", "pace")
"""Values of `TaskConfig.precision` for tasks flown against time. For them the distance from the goal has no meaning."""


COUNTED = 2**24
"""Largest number of control steps in an episode: float32 does not count further."""


def check_counted(name: str, seconds: float, control_rate: float) -> None:
    """Refuse an episode of a task with more control steps than `COUNTED`."""
    if seconds * control_rate > COUNTED:
        raise ValueError(
            f"task.{name} is {seconds}; accepted: at most {COUNTED / control_rate:g} s, as far as float32 counts the "
            f"control steps, 2^24 at {control_rate:g} Hz"
        )


def check_aloft(name: str, place: tuple[float, float, float], feet_height: float) -> None:
    """Refuse a place of a task, world, m, at which a vehicle would touch the ground."""
    if place[2] <= feet_height:
        raise ValueError(
            f"task.{name} is {place}; accepted: a place more than {feet_height:g} m over the ground, the "
            "height of the centre of mass over the feet"
        )


@dataclass(frozen=True)
class TaskConfig:
    """Options of a task, and everything that the commands need to know about it.

    A task extends this and registers itself by `e2efly.tasks.register`. Its numbers are leaves of the compiled
    programs. Texts, and fields made by `shape`, decide which program is compiled.
    """

    name: ClassVar[str] = ""
    """The name under which it is registered."""
    world: ClassVar[Any] = ""
    """The class of `e2efly.tasks.task.Task` that simulates it, or a reference to that class: `package.module:Name`."""
    goal_class: ClassVar[Any] = None
    """The class of `e2efly.policy.goal.Goal` that flight uses, without JAX, or a reference to it. None: `world`."""
    route: ClassVar[Any] = None
    """The class of `e2efly.tasks.route.Route` that says where to fly, or a reference to it. None: `fly` refuses the
    task."""
    reward: ClassVar[Mapping[str, float]] = {}
    """Weights of the reward terms, if there is no `recipe`."""
    best: ClassVar[str] = "ppo"
    """The algorithm that learns the task best."""
    precision: ClassVar[str] = "final_error"
    """The measure that ranks policies with equal success, smaller is better: final_error, mean_error, duration or pace.
    With `pace`, a success counts as one divided by its duration."""
    smooth: ClassVar[Mapping[str, float] | None] = None
    """Rewards for methods that have both a gradient and a critic. None: PPO's rewards. For a critic, nothing follows a
    crash. If every step costs, as in BPTT's rewards, an early crash would be the best outcome. These rewards therefore
    pay for staying alive and charge for a crash."""
    robust: ClassVar[Mapping[str, Robust]] = {}
    """Recipe for training with vehicles that differ from the vehicle file, by algorithm. These algorithms have the
    preset `robust`."""
    identified: ClassVar[Mapping[str, Robust]] = {}
    """The same for the preset `identified`, where it differs from `robust`."""
    family: ClassVar[Mapping[str, Robust]] = {}
    """Recipe for training with all vehicles of a family together, by algorithm."""
    cameras: ClassVar[tuple[CameraConfig, ...]] = ()
    """The cameras of its policies."""
    curriculum: ClassVar[tuple["StageConfig", ...]] = ()
    """Stages of the training: no obstacles, few obstacles, then the task itself."""
    paper: ClassVar[Paper | None] = None
    """The paper's values."""
    goal: ClassVar[str] = "goal"
    """Label in the plots for the place that the vehicle must reach."""
    shows_error: ClassVar[bool] = False
    """Whether the curves of an ablation show the error, as in the paper. Otherwise they show the success rate."""
    variants: ClassVar[tuple[str, ...]] = ()
    """Presets of its own, in addition to `robust`, `nominal` and `paper`."""
    asked: ClassVar[Mapping[tuple[str, str], str]] = {}
    """Presets of its own that an option value selects when no preset is named."""

    episode_s: float = number(10.0, above=0)
    """Length of an episode, s."""
    observes: tuple[str, ...] | None = shape(None, added=True)
    """Names of the fields that the policy observes, of the task's own and of the vehicle's. None: all that there are.
    Rewards, critics and experts know the others all the same (sets shapes)."""

    @classmethod
    def training(cls) -> "TaskConfig":
        """The options with which it is trained."""
        return cls()

    def criteria(self) -> "dict[str, TaskConfig]":
        """The criteria by which a policy is judged, by name. The worst result counts."""
        return {self.name: self}

    def check(self, control_rate: float, feet_height: float) -> None:
        """Check the numbers, individually and in combination. A task that has further rules adds them.

        Args:
            control_rate: Hz.
            feet_height: height of the vehicle's centre of mass over its feet, m.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        del feet_height
        check_fields("task", self)
        check_counted("episode_s", self.episode_s, control_rate)
        for name, part in vars(self).items():
            if hasattr(part, "check"):
                part.check(f"task.{name}")

    def course(self) -> dict[str, Any]:
        """The part of the course that all episodes share, for reports. `Goal.drawn` gives what each episode adds."""
        return {}

    def domain(self) -> Domain | None:
        """The ranges of the courses and worlds that its episodes draw. A policy is trained for them. None: unknown."""
        return None

    def limits(self) -> dict[str, float]:
        """The largest values, by field of `Episodes`, with which an episode still succeeds, for plots."""
        return {}

    @property
    def settling_s(self) -> float:
        """Time from which on the mean error counts, s: the option `settle_s`, if the task has it."""
        return float(getattr(self, "settle_s", 0.0))

    @property
    def own_worlds(self) -> bool:
        """Whether each episode has its own world, for plots."""
        return False

    def shows(self, name: str) -> bool:
        """Whether the policy observes the task's own field of this name."""
        return self.observes is None or name in self.observes

    def showing(self, names: Sequence[str]) -> "TaskConfig":
        """These options, adapted to a policy whose observation has fields with these names, if the task has several
        observations.
        """
        del names
        return self

    def drawing(self) -> list[Thing] | None:
        """The task's objects in space, for plots. None: only its goal."""
        return None

    @classmethod
    def recipe(cls, algo: str) -> "TrainConfig":
        """How it is learned by an algorithm of `ALGORITHMS`. Other algorithms build on the recipe for ppo or bptt."""
        return TrainConfig(cls.training(), ALGORITHMS[algo](), RewardConfig(dict(cls.reward)))

    @classmethod
    def with_critic(cls, algo: str) -> dict[str, Any]:
        """Options of an algorithm that has both a gradient and a critic, where they differ from BPTT's."""
        del algo
        return {}

    @classmethod
    def variant(cls, preset: str, config: "TrainConfig") -> "TrainConfig":
        """The configuration of one of `variants`, made from that of `recipe`."""
        raise NotImplementedError(preset)


@dataclass(frozen=True)
class TrainConfig:
    """Everything that determines the result of a run."""

    task: TaskConfig
    """The task."""
    algo: AlgorithmConfig
    """The algorithm."""
    reward: RewardConfig
    """The reward."""
    env: EnvConfig = EnvConfig()
    """Vehicle, latency, randomisation, noise."""
    network: NetworkConfig = NetworkConfig()
    """The networks."""
    start_from: str | None = None
    """The policy whose weights the training starts from: a name of the zoo or a file. If omitted, fresh weights."""
    seed: int = number(0, high=2**32 - 1)
    """Seed of everything random."""
    steps: int = number(2_000_000, low=1, high=10**15)
    """Environment steps of the whole run, rounded up to whole chunks."""
    chunk: int = number(20, low=1)
    """Updates between two evaluations (sets shapes)."""
    eval_episodes: int = number(250, low=1)
    """Starts of an evaluation while training (sets shapes)."""
    devices: int | None = number(None, low=1)
    """Devices (on a CPU: cores) that share the environments. If omitted, all devices, with at least 32 environments on
    each."""
    fast_compile: bool = True
    """Compile faster but run slower. Good for runs of a few seconds. With cameras, a CPU then runs at half the rate or
    less. On a GPU it leaves out the search for the fastest kernel of each matrix product."""
    curriculum: tuple[StageConfig, ...] = ()
    """Stages before the task itself."""
    stop_at: float | None = number(None, above=0, high=1.0)
    """Stop when the success rate on 1000 starts is at least this. If omitted, use all steps."""
