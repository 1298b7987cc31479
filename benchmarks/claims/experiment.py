"""What an experiment of the paper is: the runs that it needs, the rows made of them, and the verdict's rules."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

CONFIRMED, REFUTED, UNTESTABLE, UNMEASURED = "confirmed", "refuted", "not testable here", "not measured yet"
"""The words of a verdict."""


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
class Verdict:
    """What our measurements say of a claim."""

    word: str
    """One of the four words of this module."""
    ours: str = "-"
    """Our figure, beside the paper's."""
    why: str = ""
    """Why the word is what it is."""


NOTHING = Verdict(UNMEASURED)


@dataclass(frozen=True)
class Claim:
    """A sentence or a figure of the paper, and how it is judged."""

    says: str
    theirs: str
    judge: Callable[["Found"], Verdict]


@dataclass(frozen=True)
class Experiment:
    """A table or a figure of the paper."""

    name: str
    """On the command line and in the file of results."""
    title: str
    where: str
    """The paper's tables and figures."""
    claims: tuple[Claim, ...]
    runs: tuple[Run, ...] = ()
    rows: Callable[["Found"], list[dict[str, str]]] = lambda found: []
    """The table under the claims."""
    about: str = ""
    """How it was done, in words."""
    made_of: tuple[str, ...] = ()
    """The results of other benchmarks that it is made of, by the names of their files."""
    seeds: int = 5
    """Of the whole experiment."""
    short: int = 1
    """How many of its runs the short version makes."""


@dataclass(frozen=True)
class Found:
    """What was measured of an experiment."""

    runs: Sequence[Mapping[str, Any]]
    """As `e2efly`'s processes left them, see `benchmarks/claims/running.py`."""
    results: Callable[[str], dict[str, Any] | None]
    """The results of another benchmark by the name of its file; None: there are none."""

    def of(self, **wanted: Any) -> list[Mapping[str, Any]]:
        """The runs with these values, by seed."""
        fits = (one for one in self.runs if all(one[name] == value for name, value in wanted.items()))
        return sorted(fits, key=lambda one: one["seed"])

    def whole(self, **wanted: Any) -> list[Mapping[str, Any]]:
        """The same, of those that took all their steps."""
        return [one for one in self.of(**wanted) if one["finished"]]

    def flown(self, flight: str, figure: str = "success", **wanted: Any) -> list[float]:
        """A figure of a flight of each run: of its worst criterion."""
        least = min if figure == "success" else max
        runs = (one["flights"][flight] for one in self.of(**wanted) if flight in one["flights"])
        return [least(criterion[figure] for criterion in of.values()) for of in runs]


def mean(values: Sequence[float]) -> float:
    """The mean; NaN of nothing."""
    return sum(values) / len(values) if values else math.nan


def percents(values: Sequence[float]) -> str:
    """Success of each seed; - of none."""
    return " ".join(f"{100 * x:.1f}" for x in values) or "-"


def verdict(right: Sequence[bool], told: Sequence[str], why: str, cases: float) -> Verdict:
    """The verdict on a claim about several cases: confirmed where all agree, refuted where one does not.

    Args:
        right: of each case that was measured, whether it says what the paper says.
        told: our figures, in words.
        why: what they are.
        cases: that the claim is about.
    """
    if not right:
        return NOTHING
    ours = "; ".join(told) or "-"
    if not all(right):
        return Verdict(REFUTED, ours, f"{right.count(False)} of {len(right)} cases contradict it; {why}".rstrip("; "))
    if len(right) < cases:
        of = "" if math.isinf(cases) else f" of {cases:g}"
        return Verdict(UNMEASURED, ours, f"so far {len(right)}{of} cases, and all confirm it; {why}".rstrip("; "))
    return Verdict(CONFIRMED, ours, why)
