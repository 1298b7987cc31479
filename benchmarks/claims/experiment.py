"""What an experiment of the paper is: its claims, the runs that they need, and the rows made of them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from claims.found import Found
from claims.rule import Claim


@dataclass(frozen=True)
class Flight:
    """What a policy is flown in: what differs from its training."""

    env: Mapping[str, Any] = field(default_factory=dict)
    """Options of the environment by dotted name."""
    task: Mapping[str, Any] = field(default_factory=dict)
    """Options of the task by name."""
    by: str = ""
    """What each episode draws and its verdicts are sorted by: a column of `Goal.drawn`; empty: nothing."""


@dataclass(frozen=True)
class Run:
    """A training of one seed and the flights of its policy; or the flights of a policy of the zoo; or an ablation."""

    task: str
    algo: str
    variant: str
    """What is special about it; with task, algorithm and seed it names the run."""
    options: tuple[str, ...] = ()
    """Of `e2efly train` beside task, algorithm and seed, or of `e2efly ablate`."""
    flights: Mapping[str, Flight] = field(default_factory=dict)
    """By name."""
    kind: Literal["train", "zoo", "ablate"] = "train"
    """train: each seed; zoo: the policy that comes with the package, once; ablate: all seeds in one process."""
    seeds: int | None = None
    """Most seeds of a training. None: as many as the experiment has."""


@dataclass(frozen=True)
class Experiment:
    """A table or a figure of the paper."""

    name: str
    """On the command line and in the file of results."""
    title: str
    where: str
    """The paper's tables and figures, by their captions."""
    claims: tuple[Claim, ...]
    runs: tuple[Run, ...] = ()
    rows: Callable[[Found], list[dict[str, str]]] = lambda found: []
    """The table under the claims."""
    about: str = ""
    """How it was done, in words."""
    made_of: tuple[str, ...] = ()
    """The results of other benchmarks that it is made of, by the names of their files."""
    seeds: int = 5
    """Of the whole experiment."""
    short: int = 1
    """How many of its runs the short version makes."""
