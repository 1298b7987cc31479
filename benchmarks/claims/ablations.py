"""The paper's two figures of success and error under different reward settings."""

from collections.abc import Mapping
from typing import Any

from claims.experiment import Experiment, Run
from claims.found import Found
from claims.learning import TASKS
from claims.learning import steps as claimed
from claims.rule import LEARNED as LEVEL
from claims.rule import UNMEASURED, Case, Claim, Invented, Side, mean
from claims.running import HELD

THEIRS, AUTHORS, OURS = "the paper's rewards", "its authors' rewards", "our rewards"
"""Whose rewards. The claims are about the first two."""
PRESETS = {OURS: "nominal", THEIRS: "paper", AUTHORS: "authors"}
MILLIONS = {
    "bptt": {"hover": 10, "land": 10, "track": 20, "race": 20},
    "ppo": {"hover": 10, "land": 20, "track": 20, "race": 20},
}
"""Steps with the paper's and its authors' rewards: the paper's own for BPTT but for race (50), fewer for PPO (50 and
100), as many as PPO needs to learn the task."""
STABLE = ("hover", "land", "track")
BY_ERROR = ("hover", "track")
WORSE = ((0.02, 0.01), (0.005, 0.002))
"""A part is needed if success is lower by more than this without it, or the error higher by more than this, m. The
paper does not say how much is worse, so a case contradicts it only if it does by both."""
FULL = "full"
LEARNED = 0.9
"""A case says something where the full reward has learned the task: so many starts succeed."""
NEEDED = ("prog", "act", "v", "anglev")


def missed(one: Mapping[str, Any], part: str, worse: tuple[float, float] = WORSE[0]) -> bool:
    """Whether the task is flown worse without a part of the reward: by success, in hover and track by the error too."""
    full, without = (one["variants"].index(name) for name in (FULL, part))
    if mean(one["success"][without]) < mean(one["success"][full]) - worse[0]:
        return True
    return one["task"] in BY_ERROR and mean(one["error"][without]) > mean(one["error"][full]) + worse[1]


def without(parts: tuple[str, ...], tasks: tuple[str, ...], algos: tuple[str, ...]) -> Any:
    """Whether tasks get worse without each of these parts."""

    def cases(found: Found) -> list[Case]:
        out = []
        for one in found.runs:
            if one["variant"] == OURS or one["task"] not in tasks or one["algo"] not in algos:
                continue
            learns = mean(one["success"][one["variants"].index(FULL)]) >= LEARNED
            for part in (part for part in parts if part in one["variants"]):
                told = f"{shown(one, FULL)} with, {shown(one, part)} without"
                name = f"{one['task']} by {one['algo'].upper()} without {part}"
                worse = any(missed(one, part, by) for by in WORSE)
                side = Side([{**one, "held": {LEVEL: stays(one, part)}}], claimed(one["task"], one["algo"]))
                out.append(Case(name, worse, learns, told, (side,), one["variant"]))
        return out

    return cases


def stays(one: Mapping[str, Any], part: str) -> bool | None:
    """True where both with the part and without it the success has stayed at the rule's level to the end."""
    both = (one["curve"]["success"][one["variants"].index(name)].split()[-HELD:] for name in (FULL, part))
    return all(float(x) >= float(LEVEL) for curve in both for x in curve) or None


def shown(one: Mapping[str, Any], variant: str) -> str:
    """The figure of the paper's curves of the task, mean over the seeds; beside an error the success, if any fail."""
    i = one["variants"].index(variant)
    success = mean(one["success"][i])
    if one["task"] not in BY_ERROR:
        return f"{100 * success:.1f} %"
    return f"{100 * mean(one['error'][i]):.2f} cm" + (f" ({100 * success:.1f} %)" if success < 1 else "")


def rows(found: Found) -> list[dict[str, str]]:
    """One row per task, algorithm and preset: the full reward, and without each part."""
    parts = ("prog", "act", "ori", "v", "anglev", "sparse")
    out = []
    for run in ABLATION.runs:
        row = {"task": run.task, "algorithm": run.algo.upper(), "rewards": run.variant}
        known = found.of(task=run.task, algo=run.algo, variant=run.variant)
        if not known:
            out.append(row | {"seeds": "0", FULL: UNMEASURED} | {f"without {part}": "-" for part in parts})
            continue
        (one,) = known
        row |= {"seeds": str(one["seeds"]), FULL: shown(one, FULL)}
        out.append(row | {f"without {p}": shown(one, p) if p in one["variants"] else "-" for p in parts})
    return out


def steps(whose: str, task: str, algo: str) -> tuple[str, ...]:
    """The option of how many."""
    return ("--steps", f"{MILLIONS[algo][task]}000000") if whose != OURS else ()


NUMBERS = (
    Invented("reward of every step, of success, cost of a crash, decay", "the preset's, as in the authors' public code",
             (AUTHORS,)),
    Invented("starts, limits of the body rates, delay, what counts as success", "ours", (AUTHORS,)),
    Invented("how much counts as worse", "2 points of success or 1 cm", by="judged by 0.5 points or 2 mm, too"),
)  # fmt: skip
"""What the paper does not give."""

ABLATION = Experiment(
    "ablation",
    "Success rate and task error under different reward settings",
    "figures *training via PPO* and *training via BPTT*",
    (
        Claim("Hovering, landing and tracking get worse without progress, action, velocity or body rate",
              "by both algorithms", without(NEEDED, STABLE, ("ppo", "bptt")), 21, NUMBERS),
        Claim("Progress plays the dominant role in racing", "by both algorithms",
              without(("prog",), ("race",), ("ppo", "bptt")), 2, NUMBERS),
        Claim("Sparse rewards are critical for PPO", "in all four tasks", without(("sparse",), TASKS, ("ppo",)), 4,
              NUMBERS),
    ),
    tuple(
        Run(task, algo, whose, ("--preset", preset, "--past-actions", "0", *steps(whose, task, algo)), kind="ablate")
        for whose, preset in PRESETS.items()
        for algo in ("ppo", "bptt")
        for task in TASKS
    ),
    rows,
    """
The command is `e2efly ablate --by group`. The table has the error (hover, track) or the success (land, race) at the end
of the training, as the mean of the seeds. If some starts fail, the success stands in brackets after the error. An error
of 0 means that all starts end before the error counts. A case says something only where the full reward learns the task
(90 % of the starts). *Our rewards* are those of the preset `nominal`; no claim is judged by them. Each of our terms
belongs to the part that it rewards: `near` to progress, `descent` to velocity, `upright` to orientation.""",
    seeds=3,
)  # fmt: skip
