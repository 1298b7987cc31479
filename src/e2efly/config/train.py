"""Options of a run: all of the others, and how to learn."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Literal

from e2efly.config.algorithms import ALGORITHMS, AlgorithmConfig
from e2efly.config.vehicle import CameraConfig, EnvConfig
from e2efly.drawing import Thing


@dataclass(frozen=True)
class RewardConfig:
    """The reward: a weighted sum of the manual's terms."""

    weights: dict[str, float] = field(default_factory=dict)
    """Weight of each term by name; see `e2efly list`. On the command line: changes to the preset's, 0 drops a term."""
    parameters: dict[str, float] = field(default_factory=dict)
    """Constants of the terms that differ from their defaults."""


@dataclass(frozen=True)
class NetworkConfig:
    """The policy network (and the critic's, where there is one)."""

    hidden: tuple[int, ...] = (64, 64)
    """Units of the hidden layers (sets shapes)."""
    activation: Literal["relu", "tanh", "elu"] = "relu"
    """Activation of the hidden layers (sets the program)."""
    pool: tuple[int, int] = (16, 16)
    """Rows and columns that an image is brought to: the mean of each cell, of depth the nearest; divide the camera's
    (sets shapes)."""
    convolution: tuple[int, ...] = ()
    """Channels of the convolutions that take an image in place of its averages; their stride is their size, 4 (2 where
    4 does not divide the image), so that they are products of matrices (sets shapes)."""
    encoder: tuple[int, ...] = (64,)
    """Units of the layers that each image passes before it joins the rest (sets shapes)."""
    recurrent: int = 0
    """Units of a gated recurrent unit (GRU) before the hidden layers; 0: none (sets shapes)."""


@dataclass(frozen=True)
class StageConfig:
    """A stage of a curriculum: the task with a few numbers changed, until it is mastered or its time is over."""

    changes: dict[str, float | tuple[float, ...]]
    """Values of the task's fields by dotted path: {"forest.density": 0.0}; none that sets shapes or the program."""
    success: float | None = None
    """Promotion: success of an evaluation in this stage."""
    steps: int | None = None
    """Promotion at the latest after so many environment steps."""


@dataclass(frozen=True)
class Paper:
    """What the paper gives of a task's training (its tables)."""

    weights: Mapping[str, float]
    """Of the reward."""
    ppo: Mapping[str, float]
    """Those that PPO has in addition."""
    millions: tuple[int, int]
    """Environment steps by PPO and by BPTT, millions."""


@dataclass(frozen=True, kw_only=True)
class Robust:
    """How a task's recipe changes where every episode has another vehicle, which the policy has to feel."""

    weights: Mapping[str, float] | None = None
    """Of the reward, in place of the recipe's; None: those."""
    parameters: Mapping[str, float] = field(default_factory=dict)
    """Constants of its terms, beside the recipe's."""
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

    def into(self, config: "TrainConfig") -> "TrainConfig":
        """A configuration that learns so."""
        given = config.reward.parameters
        return replace(
            config,
            network=replace(config.network, recurrent=self.recurrent, hidden=self.hidden),
            algo=replace(config.algo, **self.algo),
            reward=config.reward
            if self.weights is None
            else RewardConfig(dict(self.weights), {**given, **self.parameters}),
            steps=self.steps,
            chunk=self.chunk,
        )


TIMED = ("duration", "pace")
"""Values of `TaskConfig.precision` of tasks flown against time: a distance from the goal says nothing of them."""


@dataclass(frozen=True)
class TaskConfig:
    """Options of a task, and all that commands ask of a task.

    A task extends this and registers itself by `e2efly.tasks.register`. Its numbers are leaves of the compiled
    programs; texts and fields made by `shape` decide which program is compiled.
    """

    name: ClassVar[str] = ""
    """By which it is registered."""
    world: ClassVar[Any] = ""
    """The class of `e2efly.tasks.task.Task` that flies it, or its reference: `package.module:Name`."""
    goal_class: ClassVar[Any] = None
    """The class of `e2efly.goal.Goal` that flight uses, without JAX, or its reference; None: `world`."""
    route: ClassVar[Any] = None
    """The class of `e2efly.tasks.route.Route` that says where to fly, or its reference; None: `fly` refuses it."""
    reward: ClassVar[Mapping[str, float]] = {}
    """Weights of the reward's terms, where there is no `recipe`."""
    best: ClassVar[str] = "ppo"
    """The algorithm that learns it best."""
    precision: ClassVar[Literal["final_error", "mean_error", "duration", "pace"]] = "final_error"
    """What is to be small among policies that succeed as often; `pace`: a success counts by one over its duration."""
    smooth: ClassVar[Mapping[str, float] | None] = None
    """Rewards for methods that have both a gradient and a critic; None: PPO's. To a critic nothing follows a crash:
    where every step costs, as in BPTT's rewards, an early crash would be the best end; these pay for living on, and
    charge for a crash."""
    robust: ClassVar[Mapping[str, Robust]] = {}
    """How it is learned for vehicles that are not the file's, by algorithm: those have the preset `robust`."""
    family: ClassVar[Mapping[str, Robust]] = {}
    """How it is learned for all vehicles of a family together, by algorithm."""
    cameras: ClassVar[tuple[CameraConfig, ...]] = ()
    """What its policies see."""
    curriculum: ClassVar[tuple["StageConfig", ...]] = ()
    """No obstacles, few, and then the task itself."""
    paper: ClassVar[Paper | None] = None
    """What the paper gives."""
    goal: ClassVar[str] = "goal"
    """What plots call where it is to be."""
    shows_error: ClassVar[bool] = False
    """Whether the curves of an ablation show its error, as in the paper; else they show success."""
    variants: ClassVar[tuple[str, ...]] = ()
    """Presets of its own, beside `robust`, `nominal` and `paper`."""
    asked: ClassVar[Mapping[tuple[str, str], str]] = {}
    """Of its own presets, those that the value of an option asks for where none is named."""

    episode_s: float = 10.0
    """Length of an episode, s."""

    @classmethod
    def training(cls) -> "TaskConfig":
        """The options that it is trained with."""
        return cls()

    def criteria(self) -> "dict[str, TaskConfig]":
        """What a policy is judged by, by name. It counts by its worst."""
        return {self.name: self}

    def course(self) -> dict[str, Any]:
        """What all its episodes share of what is to be flown, for reports; `Goal.drawn` says what each has besides."""
        return {}

    def limits(self) -> dict[str, float]:
        """The largest values, by field of `Episodes`, with which an episode still succeeds, for plots."""
        return {}

    @property
    def own_worlds(self) -> bool:
        """Whether each episode has a world of its own, for plots."""
        return False

    def showing(self, names: Sequence[str]) -> "TaskConfig":
        """These options for a policy whose observation has fields of these names, where a task has several."""
        del names
        return self

    def drawing(self) -> list[Thing] | None:
        """What it has in space, for plots; None: nothing but its goal."""
        return None

    @classmethod
    def recipe(cls, algo: str) -> "TrainConfig":
        """How it is learned by an algorithm of `ALGORITHMS`; others build on that by ppo or bptt."""
        return TrainConfig(cls.training(), ALGORITHMS[algo](), RewardConfig(dict(cls.reward)))

    @classmethod
    def with_critic(cls, algo: str) -> dict[str, Any]:
        """Options of an algorithm that has both a gradient and a critic, where they are not BPTT's."""
        del algo
        return {}

    @classmethod
    def variant(cls, preset: str, config: "TrainConfig") -> "TrainConfig":
        """Its configuration by one of `variants`, made from `recipe`'s."""
        raise NotImplementedError(preset)


@dataclass(frozen=True)
class TrainConfig:
    """Everything that decides the outcome of a run."""

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
    """The policy whose weights it begins with, as a name of the zoo or a file; left out: fresh ones."""
    seed: int = 0
    """Seed of everything random."""
    steps: int = 2_000_000
    """Environment steps of the whole run, rounded up to whole chunks."""
    chunk: int = 20
    """Updates between two evaluations (sets shapes)."""
    eval_episodes: int = 250
    """Starts of an evaluation while training (sets shapes)."""
    devices: int | None = None
    """Devices (CPU: cores) that share the environments; left out: all there are, 32 environments or more on each."""
    fast_compile: bool = True
    """On a CPU: compile faster, run slower: right for runs of seconds; half the rate or less with cameras."""
    curriculum: tuple[StageConfig, ...] = ()
    """Stages before the task itself."""
    stop_at: float | None = None
    """Stop once the success on 1000 starts is at least this; left out: use all steps."""
