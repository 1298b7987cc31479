"""Options of a run: all of the others, and how to learn."""

from dataclasses import dataclass, field
from typing import Literal

from e2efly.config.algorithms import AlgorithmConfig
from e2efly.config.tasks import TaskConfig
from e2efly.config.vehicle import EnvConfig


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
