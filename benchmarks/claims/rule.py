"""The rule of the verdicts: what a claim declares, what was measured of it, and the one function that finds the word.

A claim does not judge itself. It declares what the paper says, which numbers we had to invent where the paper is
silent, and how to read our runs as cases that agree with it or do not. `judge` alone says which word that comes to.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any

from claims.found import Found

CONFIRMED, REFUTED, DIFFERS = "confirmed", "refuted", "differs here"
UNMEASURED, UNTESTABLE = "not measured", "not testable here"
WORDS = {
    CONFIRMED: "our measurement, in our simulator, says the same, with at least one choice of the numbers that the "
    "paper does not give.",
    REFUTED: "our measurement contradicts the claim, and the rule below is met.",
    DIFFERS: "our measurement differs, but the rule is not met, or the claim is about a property of their simulator or "
    "machine. What is missing stands beside it.",
    UNMEASURED: "the runs are missing, or what is compared does not learn in them.",
    UNTESTABLE: "a test needs a vehicle, or the paper does not say what is to be measured.",
}
"""What each word of a verdict means."""
SEEDS = 3
"""Fewest seeds of each side of a comparison that can refute a claim."""
LEARNED = "0.99"
"""Success from which on a run that was stopped has answered whether it learns."""
NEARLY = 0.99
"""Share of the claimed steps that counts as all of them: a run ends with a whole chunk."""
RULE = f"""A claim is **refuted** only if all of this holds for a case that contradicts it:

- The comparison learns. What would have to fail for the refutation has been learned here in some variant.
- Each run has taken the paper's steps, or was stopped after its success had stayed at 99 %.
- Each side has {SEEDS} seeds or more.
- Each number that we had to invent is listed beside the verdict and was varied, and no choice of it makes the case
  agree with the paper."""


@dataclass(frozen=True)
class Invented:
    """A number that the paper does not give, and that our runs nevertheless need."""

    what: str
    ours: str
    """Its value, and where that comes from."""
    variants: tuple[str, ...] = ()
    """Variants of runs in which it has another value."""
    by: str = ""
    """How it was varied in another way: by flights, or in the judgement itself."""
    tasks: tuple[str, ...] = ()
    """The tasks that need it. None named: all."""


@dataclass(frozen=True)
class Side:
    """The runs of one side of a comparison: one policy or one algorithm, all its seeds."""

    runs: Sequence[Mapping[str, Any]]
    claimed: float | None = None
    """Environment steps that the paper gives it. None: the claim is not about a training."""

    @property
    def seeds(self) -> int:
        """How many."""
        return max((one.get("seeds", 0) for one in self.runs), default=0) or len({one["seed"] for one in self.runs})

    @property
    def steps(self) -> list[float]:
        """Environment steps of each run that was a training."""
        return [steps for one in self.runs if (steps := taken(one)) is not None]

    @property
    def whole(self) -> bool:
        """Whether each run has taken the claimed steps, or was stopped because it had learned."""
        return self.claimed is None or all(enough(one, self.claimed) for one in self.runs)


@dataclass(frozen=True)
class Case:
    """One of the things that a claim speaks of, as it was measured: a task, a track, a part of a reward."""

    name: str
    agrees: bool
    learns: bool
    """Whether the comparison says anything: what would have to fail can be learned here."""
    ours: str
    """Our figure, in words."""
    sides: tuple[Side, ...] = ()
    under: str = ""
    """With which of the invented numbers."""


@dataclass(frozen=True)
class Claim:
    """A sentence or a figure of the paper, and what it needs to be judged."""

    says: str
    theirs: str
    cases: Callable[[Found], list[Case]] = lambda found: []
    """What was measured. Cases of one name, under different invented numbers, belong together."""
    about: int = 1
    """How many names it speaks of. It is confirmed when all of them agree."""
    invented: tuple[Invented, ...] | None = None
    """Every number that its runs need and the paper does not give. None: they have not been listed."""
    why: str = ""
    """What our figures are."""
    theirs_alone: str = ""
    """Why it speaks of their simulator or machine and not of ours, so that ours cannot refute it."""
    untestable: str = ""
    """Why nothing here can test it."""


@dataclass(frozen=True)
class Verdict:
    """What our measurements say of a claim."""

    word: str
    """One of `WORDS`."""
    why: str = ""
    cases: list[dict[str, str]] = field(default_factory=list)
    """A row per case: its figure, seeds, steps."""
    invented: list[dict[str, str]] = field(default_factory=list)
    """A row per invented number: its value, and how it was varied so far."""
    measured: dict[str, str] = field(default_factory=dict)
    """Seeds, and environment steps in millions, ours and theirs, of the strongest case of each name."""


def taken(one: Mapping[str, Any]) -> float | None:
    """Environment steps of a run; None: it was not a training."""
    if "steps" in one:
        return float(one["steps"])
    return float(one["curve"]["steps"].split()[-1]) if "curve" in one else None


def enough(one: Mapping[str, Any], claimed: float) -> bool:
    """Whether a run has taken the claimed steps, or has learned before."""
    return (taken(one) or 0.0) >= NEARLY * claimed or one.get("held", {}).get(LEARNED) is not None


def judge(claim: Claim, found: Found) -> Verdict:
    """The verdict on a claim, by the rule of this module."""
    if claim.untestable:
        return Verdict(UNTESTABLE, claim.untestable)
    cases = sorted(claim.cases(found), key=lambda case: case.name)
    groups = {name: list(of) for name, of in groupby(cases, key=lambda case: case.name)}
    agreeing = [name for name, of in groups.items() if any(case.agrees and case.learns for case in of)]
    against = {name: of for name, of in groups.items() if name not in agreeing and any(case.learns for case in of)}
    silent = [name for name in groups if name not in agreeing and name not in against]
    unlearned = f"the comparison does not learn: {', '.join(silent)}" if silent else ""
    strongest = {name: max(of, key=lambda case: (case.learns, *strength(case))) for name, of in groups.items()}
    table = {
        "cases": [row(case) for case in claim.cases(found)],
        "invented": [number_row(number, found) for number in claim.invented or ()],
        "measured": totals([side for case in strongest.values() for side in case.sides]),
    }
    if against:
        lacking = missing(claim, [strongest[name] for name in against], found)
        contradicted = f"contradicted by {', '.join(against)}"
        parts = (contradicted, f"but {'; '.join(lacking)}" if lacking else "", unlearned, claim.why)
        return Verdict(DIFFERS if lacking else REFUTED, "; ".join(filter(None, parts)), **table)
    if agreeing and len(agreeing) >= claim.about:
        return Verdict(CONFIRMED, claim.why, **table)
    so_far = f"so far {len(agreeing)} of {claim.about} cases, and all confirm it" if agreeing else ""
    return Verdict(UNMEASURED, "; ".join(filter(None, (so_far, unlearned, claim.why))), **table)


def totals(sides: Sequence[Side]) -> dict[str, str]:
    """The ranges of seeds and of steps, in millions, and of the steps that the paper gives."""
    counts, steps = [side.seeds for side in sides], [x for side in sides for x in side.steps]
    claimed = [side.claimed for side in sides if side.claimed is not None]
    seeds = " to ".join(map(str, sorted({min(counts), max(counts)}))) if counts else "-"
    return {
        "seeds": seeds,
        "M steps": span(steps) if steps else "-",
        "M steps, theirs": span(claimed) if claimed else "-",
    }


def strength(case: Case) -> tuple[int, bool]:
    """What orders the cases of one name: the seeds of the side with the fewest, and whether all took their steps."""
    return min((side.seeds for side in case.sides), default=0), all(side.whole for side in case.sides)


def missing(claim: Claim, against: Sequence[Case], found: Found) -> list[str]:
    """What the strongest of the cases of each name that contradict a claim lack to refute it."""
    if claim.theirs_alone:
        return [claim.theirs_alone]
    sides = [side for case in against for side in case.sides]
    fewest = min((side.seeds for side in sides), default=0)
    lacking = [f"only {fewest} {'seed' if fewest == 1 else 'seeds'} of {SEEDS}"] if fewest < SEEDS else []
    if short := [side for side in sides if not side.whole]:
        least = min(min(side.steps) / (side.claimed or 1.0) for side in short)
        lacking.append(f"only {100 * least:.2g} % of the paper's steps")
    if claim.invented is None:
        return [*lacking, "the numbers that the paper does not give are not listed"]
    tasks = {(one["task"], side.claimed) for side in sides for one in side.runs}
    fixed = [x.what for x in claim.invented if not all(is_varied(x, task, claimed, found) for task, claimed in tasks)]
    return [*lacking, f"not varied: {', '.join(fixed)}"] if fixed else lacking


def is_varied(number: Invented, task: str, claimed: float | None, found: Found) -> bool:
    """Whether an invented number was varied in a task, by a run with the claimed steps."""
    if number.by or (number.tasks and task not in number.tasks):
        return True
    runs = [one for one in found.of(task=task) if one["variant"] in number.variants]
    return any(claimed is None or enough(one, claimed) for one in runs)


def row(case: Case) -> dict[str, str]:
    """A case for the page."""
    claimed = [f"{side.claimed / 1e6:g}" for side in case.sides if side.claimed is not None]
    return {
        "case": case.name,
        "with": case.under,
        "ours": case.ours,
        "agrees": "does not learn" if not case.learns else "yes" if case.agrees else "no",
        "seeds": " / ".join(str(side.seeds) for side in case.sides) or "-",
        "M steps": " / ".join(span(side.steps) for side in case.sides if side.steps) or "-",
        "M steps, theirs": " / ".join(claimed) or "-",
    }


def span(values: Sequence[float]) -> str:
    """The range of numbers of steps, in millions."""
    least, most = (f"{x / 1e6:.3g}" for x in (min(values), max(values)))
    return least if least == most else f"{least} to {most}"


def number_row(number: Invented, found: Found) -> dict[str, str]:
    """An invented number for the page: its value, the variants that were measured, and those that were not."""
    known = {one["variant"] for one in found.runs}
    measured = [name for name in number.variants if name in known]
    missing = [name for name in number.variants if name not in known]
    told = (number.by, "; ".join(measured), f"not yet: {'; '.join(missing)}" if missing else "")
    return {"number": number.what, "ours": number.ours, "varied": "; ".join(filter(None, told)) or "no"}


def mean(values: Iterable[float]) -> float:
    """The mean; NaN of nothing."""
    known = list(values)
    return sum(known) / len(known) if known else float("nan")


def percents(values: Sequence[float]) -> str:
    """Success of each seed; - of none."""
    return " ".join(f"{100 * x:.1f}" for x in values) or "-"
