"""The paper's two figures of rewards without one of their parts."""

import math
from collections.abc import Mapping
from typing import Any

from claims.experiment import NOTHING, Claim, Experiment, Found, Run, Verdict, mean, verdict
from claims.learning import TASKS

PRESETS = {
    "nominal": ("--past-actions", "0"),
    "paper": ("--preset", "paper", "--past-actions", "0", "--steps", "4000000"),
}
"""Whose rewards; of the paper's, fewer steps."""
THEIRS = "paper"
"""Whose rewards the claims are about."""
STABLE = ("hover", "land", "track")
BY_ERROR = ("hover", "track")
SUCCESS, ERROR = 0.02, 0.01
"""A part is missed where success is lower by more than this without it, or the error higher by more than this, m."""
FULL = "full"


def missed(one: Mapping[str, Any], part: str) -> bool:
    """Whether the task is flown worse without a part of the reward: by the figure that the paper shows of it."""
    full, without = (one["variants"].index(name) for name in (FULL, part))
    if one["task"] in BY_ERROR:
        return mean(one["error"][without]) > mean(one["error"][full]) + ERROR
    return mean(one["success"][without]) < mean(one["success"][full]) - SUCCESS


def all_needed(found: Found) -> Verdict:
    """Whether hover, land and track get worse without any of prog, act, v and anglev."""
    told, right = [], []
    for one in found.of(variant=THEIRS):
        parts = [part for part in one["variants"] if part in ("prog", "act", "v", "anglev")]
        if one["task"] in STABLE:
            spared = [part for part in parts if not missed(one, part)]
            right += [part not in spared for part in parts]
            if spared:
                told.append(f"{one['task']} by {one['algo'].upper()} ({one['variant']}) without {', '.join(spared)}")
    whole = sum(one["task"] in STABLE for one in found.of(variant=THEIRS)) == 2 * len(STABLE)
    why = f"not worse: {'; '.join(told)}" if told else ""
    return verdict(right, [f"{sum(right)} of {len(right)} parts are missed"], why, 0 if whole else math.inf)


def without(part: str, tasks: tuple[str, ...], algos: tuple[str, ...], cases: int) -> Any:
    """A judge: whether tasks get worse without a part; cases: rewards that have it."""

    def judge(found: Found) -> Verdict:
        told, right = [], []
        for one in found.of(variant=THEIRS):
            if one["task"] in tasks and one["algo"] in algos and part in one["variants"]:
                right.append(missed(one, part))
                case = f"{one['task']} by {one['algo'].upper()} ({one['variant']})"
                told.append(f"{case}: {shown(one, FULL)} with, {shown(one, part)} without")
        return verdict(right, told, "", cases)

    return judge


def shown(one: Mapping[str, Any], variant: str) -> str:
    """The figure that the paper's curves show of the task, mean over the seeds."""
    i = one["variants"].index(variant)
    return (
        f"{100 * mean(one['error'][i]):.2f} cm" if one["task"] in BY_ERROR else f"{100 * mean(one['success'][i]):.1f} %"
    )


def rows(found: Found) -> list[dict[str, str]]:
    """A row a task, algorithm and preset: the full reward, and without each part."""
    parts = ("prog", "act", "ori", "v", "anglev", "sparse")
    out = []
    for run in ABLATION.runs:
        row = {"task": run.task, "algorithm": run.algo.upper(), "rewards": run.variant}
        known = found.of(task=run.task, algo=run.algo, variant=run.variant)
        if not known:
            out.append(row | {"seeds": "0", FULL: NOTHING.word} | {f"without {part}": "-" for part in parts})
            continue
        (one,) = known
        row |= {"seeds": str(one["seeds"]), FULL: shown(one, FULL)}
        out.append(row | {f"without {p}": shown(one, p) if p in one["variants"] else "-" for p in parts})
    return out


ABLATION = Experiment(
    "ablation",
    "Rewards without one of their parts",
    "figures of success and error under different rewards, PPO and BPTT",
    (
        Claim("Hovering, landing and tracking degrade without any of progress, action, velocity, body rate",
              "by both algorithms", all_needed),
        Claim("Progress plays the dominant role in racing", "by both algorithms",
              without("prog", ("race",), ("ppo", "bptt"), 2)),
        Claim("Sparse rewards are critical for PPO", "in all four tasks", without("sparse", TASKS, ("ppo",), 4)),
    ),
    tuple(
        Run(task, algo, preset, options, kind="ablate")
        for preset, options in PRESETS.items()
        for algo in ("ppo", "bptt")
        for task in TASKS
    ),
    rows,
    f"""
`e2efly ablate --by group`: error (hover, track) or success (land, race) at the end, mean of the seeds. A part counts as
missed where success is lower by more than {100 * SUCCESS:.0f} points, or the error higher by more than
{100 * ERROR:.0f} cm. Rewards of the preset `paper` are the paper's, for 4 M steps: the verdicts are of
those. Those of `nominal` are ours, whose terms stand with what they reward: `near` is progress, `descent` velocity,
`upright` orientation.""",
    seeds=3,
)  # fmt: skip
