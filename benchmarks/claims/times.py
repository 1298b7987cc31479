"""The paper's table of training times: frames per second, and seconds to convergence beside ours to the criterion."""

from claims.experiment import Experiment, Run
from claims.found import Found
from claims.learning import LONG, PAPER, SEEN, TASKS, THEIRS, each
from claims.rule import Case, Claim, Side, mean


def alike(found: Found) -> list[Case]:
    """Whether both algorithms step about as fast: within a factor of two in each task."""
    out = []
    for task in TASKS:
        sides = tuple(Side(found.of(task=task, algo=algo)) for algo in ("ppo", "bptt"))
        if all(side.runs for side in sides):
            ppo, bptt = (mean(one["rate"] for one in side.runs) for side in sides)
            told = f"{ppo / 1e3:.0f} k and {bptt / 1e3:.0f} k"
            out.append(Case(task, 0.5 <= bptt / ppo <= 2.0, True, told, sides))
    return out


def above(found: Found) -> list[Case]:
    """Whether ours steps as fast as theirs in each task by each algorithm."""
    out = []
    for one in found.runs:
        times = one["rate"] / THEIRS["rate"][one["algo"]][TASKS.index(one["task"])]
        name = f"{one['task']} by {one['algo'].upper()}"
        out.append(Case(name, times >= 1, True, f"{times:.1f} times theirs", (Side([one]),)))
    return out


def speed_rows(found: Found) -> list[dict[str, str]]:
    """One row per task and algorithm."""
    return [
        {
            "task": task,
            "algorithm": algo.upper(),
            "frames/s, theirs": f"{THEIRS['rate'][algo][TASKS.index(task)]:,}",
            "frames/s, ours": each(found.of(task=task, algo=algo), lambda one: f"{one['rate']:,.0f}"),
        }
        for task in TASKS
        for algo in ("ppo", "bptt")
    ]


SPEED = Experiment(
    "speed",
    "Training FPS, time steps and training time",
    "table of this content",
    (
        Claim(
            "The difference in FPS between PPO and BPTT is minimal",
            "13 to 24 k",
            alike,
            len(TASKS),
            (),
            "steps/s of training by PPO and BPTT; the same: within a factor of 2",
            theirs_alone="a property of their simulator",
        ),
        Claim(
            "Frames per second of training, 100 environments",
            "13 to 24 k on an RTX 4090",
            above,
            2 * len(TASKS),
            (),
            "two CPU cores against an RTX 4090",
            theirs_alone="a property of the machine",
        ),
    ),
    tuple(
        Run(task, algo, "speed", ("--preset", PAPER, *SEEN, *(LONG if algo == "ppo" else ()), "--steps", "2000000"))
        for task in TASKS
        for algo in ("bptt", "ppo")
    ),
    speed_rows,
    "FPS are the median over the chunks of a run of 2 M steps, without the evaluations, while nothing else ran. Steps "
    "and CPU seconds are those of the trainings above, until 90 % of 250 starts succeed, as medians of the seeds.",
    seeds=1,
)

COMPARABLE = {"land": "land, 99%", "race": "race, 95%"}


def hours(found: Found) -> list[Case]:
    """Our seconds to the criterion beside theirs."""
    return [
        Case(f"{row['task']} by {row['algorithm']}", float(row["ours, s"]) < float(row["theirs, s"]), True,
             f"{row['ours, s']} s, {row['M steps, ours']} M steps")
        for row in hour_rows(found)
    ]  # fmt: skip


def hour_rows(found: Found) -> list[dict[str, str]]:
    """One row per task and algorithm with the same criterion."""
    known = found.results("time_to_criterion")
    by = {(row["algorithm"], row["task"]): row for row in known["table"]} if known else {}
    return [
        {
            "task": task,
            "algorithm": algo.upper(),
            "theirs, s": str(THEIRS["seconds"][algo][TASKS.index(task)]),
            "ours, s": by[algo, name]["cold, s (median)"],
            "M steps, theirs": f"{THEIRS['steps'][algo][TASKS.index(task)] / 1e6:.0f}",
            "M steps, ours": by[algo, name]["million steps"],
        }
        for task, name in COMPARABLE.items()
        for algo in ("ppo", "bptt")
        if (algo, name) in by
    ]  # fmt: skip


HOURS = Experiment(
    "hours",
    "Their hours, our seconds",
    "table of training FPS, time steps and training time",
    (
        Claim(
            "Training time to convergence: landing and racing",
            "750 to 6600 s",
            hours,
            4,
            why="every policy that counts as converged here accomplishes the task as the paper defines it",
        ),
        Claim(
            "Training time to convergence: hovering and tracking",
            "750 to 2500 s",
            untestable="the paper does not say how small the error has to be",
        ),
    ),
    (),
    hour_rows,
    made_of=("time_to_criterion",),
    about="""
The paper counts seconds on an RTX 4090 until the reward has converged. The policy then lands within 5 cm of height and
10 cm of the pad, or flies a lap through all gates in order. We count seconds on two CPU cores, from the start of the
process and with an empty cache, until 99 % of 1000 unseen starts (race: 95 %) meet the same conditions. In landing we
also require that the vehicle is slow (0.5 m/s) and upright. So the conditions of one flight are the same or stricter.
The paper does not say how many of its flights meet them. The presets are ours (`nominal`), not the paper's.""",
)
