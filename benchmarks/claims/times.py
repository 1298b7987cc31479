"""The paper's table of training times: frames per second, and seconds to convergence beside ours to the criterion."""

from claims.experiment import (
    CONFIRMED,
    NOTHING,
    REFUTED,
    UNTESTABLE,
    Claim,
    Experiment,
    Found,
    Run,
    Verdict,
    mean,
    verdict,
)
from claims.learning import LONG, PAPER, SEEN, TASKS, THEIRS, each


def faster(found: Found) -> Verdict:
    """Whether both algorithms step about as fast: within a factor of two in each task."""
    told, right = [], []
    for task in TASKS:
        rates = {algo: [one["rate"] for one in found.of(task=task, algo=algo)] for algo in ("ppo", "bptt")}
        if all(rates.values()):
            ppo, bptt = mean(rates["ppo"]), mean(rates["bptt"])
            right.append(0.5 <= bptt / ppo <= 2.0)
            told.append(f"{task}: {ppo / 1e3:.0f} k and {bptt / 1e3:.0f} k")
    return verdict(right, told, "steps/s of training by PPO and BPTT; confirmed if within a factor of 2", len(TASKS))


def above(found: Found) -> Verdict:
    """Whether ours step as fast as theirs."""
    least = [one["rate"] / THEIRS["rate"][one["algo"]][TASKS.index(one["task"])] for one in found.runs]
    if not least:
        return NOTHING
    return Verdict(CONFIRMED if min(least) >= 1 else REFUTED, f"{min(least):.1f} to {max(least):.1f} times theirs",
                   "two CPU cores against an RTX 4090")  # fmt: skip


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
    "Frames per second",
    "table of training times",
    (
        Claim("The difference in FPS between PPO and BPTT is minimal", "13 to 24 k", faster),
        Claim("Frames per second of training, 100 environments", "13 to 24 k on an RTX 4090", above),
    ),
    tuple(
        Run(task, algo, "speed", ("--preset", PAPER, *SEEN, *(LONG if algo == "ppo" else ()), "--steps", "2000000"))
        for task in TASKS
        for algo in ("bptt", "ppo")
    ),
    speed_rows,
    "Median over the chunks of a run of 2 M steps, without the evaluations. Measure it while nothing else runs.",
    seeds=1,
)

COMPARABLE = {"land": "land, 99%", "race": "race, 95%"}


def hours(found: Found) -> Verdict:
    """Our seconds to the criterion beside theirs."""
    table = hour_rows(found)
    if not table:
        return NOTHING
    faster = all(float(row["ours, s"]) < float(row["theirs, s"]) for row in table)
    return Verdict(
        CONFIRMED if faster else REFUTED, "; ".join(f"{r['task']} {r['algorithm']}: {r['ours, s']} s" for r in table),
        "every policy that counts as converged here accomplishes the task as the paper defines it",
    )  # fmt: skip


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


def no_threshold(found: Found) -> Verdict:
    """Hovering and tracking have no criterion in the paper."""
    del found
    return Verdict(
        UNTESTABLE,
        why="the paper defines an error for these tasks, but not how small it has to be; so our criteria, 10 cm for "
        "the last second and 8 cm on average, are our own, and the times cannot be compared",
    )


HOURS = Experiment(
    "hours",
    "Their hours, our seconds",
    "table of training times",
    (
        Claim("Training time to convergence: landing and racing", "750 to 6600 s", hours),
        Claim("Training time to convergence: hovering and tracking", "750 to 2500 s", no_threshold),
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
