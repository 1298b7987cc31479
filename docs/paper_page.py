"""Make docs/paper.md, "The paper's claims", and its curves, from benchmarks/results/paper.json: `make docs`.

The pictures of flights are drawn by docs/paper_flights.py.
"""

import json
import statistics
import sys
from collections import Counter
from pathlib import Path
from typing import Any

from e2efly import tasks
from e2efly.commands.terminal import markdown
from e2efly.config import Sourced
from e2efly.config.registry import is_shipped
from e2efly.runs.paper import AUTHORS, SILENT

DOCS = Path(__file__).parent
BENCHMARKS = DOCS.parent / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))

from claims.learning import LEVEL, THEIRS, cost  # noqa: E402
from claims.rule import RULE, UNMEASURED, UNTESTABLE, WORDS  # noqa: E402

FILE = BENCHMARKS / "results" / "paper.json"
HEAD = """# The paper's claims

e2efly implements *E2E-Fly: An Integrated Training-to-Deployment System for End-to-End Quadrotor Autonomy* by Fangyu
Sun, Fanxing Li, Linzuo Zhang, Yu Hu, Renbiao Jin, Shuyu Wu, Wenxian Yu and Danping Zou (Shanghai Jiao Tong
University). This page takes every table and figure of its experiments, puts our figures beside theirs, and says of each
claim whether we find the same. It is written by `make docs` from what `benchmarks/paper.py` has measured. The rule of
the verdicts is code: `benchmarks/claims/rule.py`.
"""
AFTER = """The tables say how many seeds each row has. With few seeds, a row shows that something can happen, but not
how often. *Confirmed* needs no number of seeds. VisFly, the paper's simulator, may give another result than ours.
"""
COMMANDS = {
    "Training by PPO and BPTT: hovering, landing, tracking, racing": "`e2efly train race --preset paper --algo ppo`: "
    "its rewards, sizes, observations; `--preset authors`: with the starts, limits and delay of its authors' code",
    "Identical rewards for both": "`--reward.weights act3 0 goal 0 crash 0` removes the terms that only PPO has",
    "Reward ablation": "`e2efly ablate --by group`; with `--preset paper --past-actions 0` for the paper's rewards",
    "Visual landing by a segmentation mask, on three shapes of pad": "`e2efly train land_visual`",
    "Racing in clutter by depth: S-shaped, 3D circle, J-shaped": "`e2efly train race_clutter`",
    "Sim-to-sim in AirSim": "`e2efly validate hover --plant airsim:127.0.0.1:41451`",
    "Hardware in the loop: a real vehicle, virtual images": "`e2efly hil avoid`; `--rehearse` flies it without a "
    "vehicle ([hardware in the loop](hil.md))",
    "Alignment by step responses": "`e2efly align LOG`",
    "Flights of the real vehicle": "`e2efly fly`",
}
TAIL = """## Where it differs

- The paper trains on an RTX 4090 and 32 cores. Our figures are measured on CPU cores, from the start of the process,
  with compilation.
- Our starts are wider than those of the code around the paper. Our default preset, `robust`, trains for many vehicles
  and not for one. `--preset nominal` trains for the vehicle of the file alone. `--preset paper` trains with the
  paper's weights, steps and sizes; where the paper is silent, with numbers of its authors' public code.
- By default our policies see as many of their own past actions as fit into the latency. The paper's observations have
  no past actions: they have 13 numbers, in tracking 40, in racing 16. `--env.past-actions 0` gives the same. The
  experiments above that say *the paper's observations* use this option.
- Where the paper contradicts itself or is silent, the page of the subject says what we do: [physics](physics.md),
  [rewards](rewards.md), [vehicles](hardware-vis-r.md).

`VIS-R` and `VIS-H` are the paper's vehicles. VIS-R computes on board (0.75 kg, a Radxa X4 and a RealSense D435i,
3.5-inch propellers). VIS-H is lighter (0.47 kg); its policy runs on the ground, and its images come by radio or from a
virtual world.

## Citation

    @article{sun-e2efly,
      title  = {E2E-Fly: An Integrated Training-to-Deployment System for End-to-End Quadrotor Autonomy},
      author = {Sun, Fangyu and Li, Fanxing and Zhang, Linzuo and Hu, Yu and Jin, Renbiao and
                Wu, Shuyu and Yu, Wenxian and Zou, Danping}
    }
"""
GIVEN = """The preset `paper` has the paper's numbers, and where the paper gives none, the first ones below. The preset
`authors` has the others in their place. A weight of 0 leaves a term out.
"""
LONGEST = 70
"""Most characters of a value in the table of numbers."""
PICTURES = {
    "learning": (
        ("paper_learning_paper.png", "rewards and success of PPO and BPTT against steps, preset paper"),
        ("paper_learning_authors.png", "the same, preset authors"),
    ),
    "ablation": (
        ("paper_ablation_ppo.png", "different reward settings, training via PPO"),
        ("paper_ablation_bptt.png", "different reward settings, training via BPTT"),
    ),
    "landing": (
        ("paper_landing.png", "poses of one policy on its way to a triangle, a disc and a square, with what it saw"),
        ("paper_visual.png", "rewards and success of visual tasks against steps"),
    ),
    "racing": (("paper_racing.png", "laps on three tracks with obstacles, coloured by speed"),),
    "step_response": (("step_response.png", "steps through real Betaflight firmware, and the simulator"),),
    "real": (
        ("paper_response.png", "commands and body rates of a policy in the simulator and through the real firmware"),
        ("paper_scenarios.png", "flights of six tasks"),
    ),
}
"""The counterparts of the paper's figures, by experiment. One that is not drawn yet is left out."""
TASKS = ("hover", "land", "track", "race")
"""In the order of the paper's table."""


def page() -> str:
    """The page."""
    parts = json.loads(FILE.read_text(encoding="utf-8"))
    total = Counter(claim["verdict"] for part in parts.values() for claim in part["claims"])
    words = [f"- **{word}** ({total[word]}): {told}" for word, told in WORDS.items()]
    lines = [HEAD, *words, "", RULE, "", AFTER, *markdown(overview(parts)), ""]
    for name, part in parts.items():
        lines += [*section(name, part, parts), ""]
    commands = [{"the paper's experiment": what, "ours": how} for what, how in COMMANDS.items()]
    lines += ["## Numbers that the paper does not give", "", GIVEN, *markdown(numbers()), ""]
    return "\n".join([*lines, "## Which command repeats it", "", *markdown(commands), "", TAIL])


def numbers() -> list[dict[str, str]]:
    """Every number of the presets `paper` and `authors` that is not in the paper, with its source."""

    def rows(task: str, preset: str, given: tuple[Sourced, ...]) -> list[dict[str, str]]:
        return [
            {"task": task, "preset": preset, "by": one.algo.upper() or "all", "number": f"`{one.field}`",
             "value": str(one.value) if len(str(one.value)) < LONGEST else "a whole part of the options",
             "source": one.source}
            for one in given
        ]  # fmt: skip

    found = rows("all", "paper, authors", SILENT) + rows("all", "authors", AUTHORS)
    for name, task in ((name, task) for name, task in tasks.TASKS.items() if is_shipped(task)):
        if task.paper is not None:
            found += rows(name, "paper, authors", task.paper.silent) + rows(name, "authors", task.paper.authors)
    return found


def overview(parts: dict[str, Any]) -> list[dict[str, str]]:
    """All claims with their verdicts."""
    return [
        {
            "claim": f"[{claim['the paper']}](#{anchor(part['title'])})",
            "verdict": claim["verdict"],
            **{name: claim.get(name, "-") for name in ("seeds", "M steps", "M steps, theirs")},
            "numbers varied": varied(claim["invented"]),
        }
        for part in parts.values()
        for claim in part["claims"]
    ]


def varied(invented: list[dict[str, str]]) -> str:
    """How many of the numbers that the paper does not give have been varied."""
    done = sum(number["varied"] != "no" and not number["varied"].startswith("not yet") for number in invented)
    return f"{done} of {len(invented)}" if invented else "-"


def anchor(title: str) -> str:
    """The address of a heading on the page."""
    return title.lower().replace(" ", "-").replace(",", "")


def section(name: str, part: dict[str, Any], parts: dict[str, Any]) -> list[str]:
    """An experiment: its claims, the counterparts of the paper's figures, its table, its cases, what was invented."""
    lines = [f"## {part['title']}", "", f"The paper: {part['where']}. {measured(name, part)}".strip(), ""]
    lines += [part["about"], ""] if part["about"] else []
    words = ("the paper", "theirs", "verdict", "why")
    claims = [{"": str(i), **{of: claim[of] for of in words}} for i, claim in enumerate(part["claims"], 1)]
    lines += [*markdown(claims), ""]
    for file, told in PICTURES.get(name, ()):
        lines += [f"![{told}]({file})", ""] if (DOCS / file).exists() else []
    lines += [*markdown(training(parts)), ""] if name == "speed" else []
    if part["table"] and name != "speed":
        lines += [*rows_measured(part["table"]), ""]
    cases = [{"claim": str(i), **case} for i, c in enumerate(part["claims"], 1) for case in c["cases"]]
    lines += folded("What each claim was judged by", without_empty(cases)) if cases else []
    numbers = list({tuple(x.items()): x for claim in part["claims"] for x in claim["invented"]}.values())
    lines += ["Numbers that the paper does not give:", "", *markdown(numbers), ""] if numbers else []
    return lines[:-1]


def rows_measured(table: list[dict[str, str]]) -> list[str]:
    """A table without the rows that nobody has measured, and how many those are."""
    rows = [row for row in table if UNMEASURED not in row.values()]
    missing = f"Not measured yet: {len(table) - len(rows)} rows of {len(table)}." if len(rows) < len(table) else ""
    return [*(markdown(rows) if rows else []), *(["", missing] if rows and missing else [missing] if missing else [])]


def without_empty(rows: list[dict[str, str]]) -> list[dict[str, str]]:
    """Rows without the columns in which none has anything."""
    return [{name: x for name, x in row.items() if any(other[name] not in ("", "-") for other in rows)} for row in rows]


def folded(title: str, rows: list[dict[str, str]]) -> list[str]:
    """A table that opens when it is asked for."""
    return [f'<details markdown="1"><summary>{title}</summary>', "", *markdown(rows), "", "</details>", ""]


def training(parts: dict[str, Any]) -> list[dict[str, str]]:
    """The paper's table of training: FPS, steps and seconds of PPO and BPTT in the four tasks, theirs and ours.

    Ours are medians over the seeds: steps and CPU seconds until 90 % of the starts succeed, by the preset `paper` or,
    where it does not get there, by `authors`.
    """
    out = []
    for algo in ("ppo", "bptt"):
        theirs = {("FPS", t): f"{x / 1e3:.0f} k" for t, x in zip(TASKS, THEIRS["rate"][algo], strict=True)}
        theirs |= {("M steps", t): f"{x / 1e6:.0f}" for t, x in zip(TASKS, THEIRS["steps"][algo], strict=True)}
        theirs |= {("s", t): f"{x}" for t, x in zip(TASKS, THEIRS["seconds"][algo], strict=True)}
        ours = {}
        for task in TASKS:
            rates = [one["rate"] for one in parts["speed"]["runs"] if (one["task"], one["algo"]) == (task, algo)]
            ours["FPS", task] = f"{statistics.median(rates) / 1e3:.0f} k" if rates else "-"
            reached = first_reached(parts["learning"]["runs"], task, algo)
            for kind, figure, scale in (("M steps", "steps", 1e6), ("s", "seconds", 1.0)):
                values = [cost(one, figure) / scale for one in reached]
                ours[kind, task] = f"{statistics.median(values):.2g}" if values else "-"
        for whose, row in (("theirs", theirs), ("ours", ours)):
            columns = {f"{kind}, {task}": row[kind, task] for kind in ("FPS", "M steps", "s") for task in TASKS}
            out.append({"": f"{algo.upper()}, {whose}", **columns})
    return out


def first_reached(runs: list[dict[str, Any]], task: str, algo: str) -> list[dict[str, Any]]:
    """The seeds of the first kind of run of which all get to 90 %."""
    rewards = "identical rewards" if algo == "bptt" else "its own rewards"
    for preset in ("paper", "authors"):
        own = [x for x in runs if (x["task"], x["algo"], x["variant"]) == (task, algo, f"{preset}, {rewards}")]
        if own and all(one["reached"][LEVEL] for one in own):
            return own
    return []


def measured(name: str, part: dict[str, Any]) -> str:
    """Where the figures come from."""
    if part["made_of"]:
        return f"From {', '.join(f'`{file}.json` of {day}' for file, day in part['made_of'].items())}."
    if all(claim["verdict"] == UNTESTABLE or not claim["cases"] for claim in part["claims"]) and not part["runs"]:
        return ""
    if not part["runs"]:
        return f"`benchmarks/paper.py {name}`."
    m = part["machine"]
    cores = sorted({one["cores"] for one in part["runs"] if "cores" in one})
    of = f"{' or '.join(map(str, cores))} of {m['cores']}" if cores else m["cores"]
    days: dict[str, set[str]] = {}
    for one in part["runs"]:
        days.setdefault(one["cpu"], set()).add(one["date"])
    where = "; ".join(f"{' and '.join(sorted(own))} on {cpu}" for cpu, own in sorted(days.items()))
    return f"`benchmarks/paper.py {name}`, {of} cores, {where}; JAX {m['jax']}."


def main() -> None:
    """Draw what there is to draw, and write the page."""
    from paper_curves import draw

    draw(json.loads(FILE.read_text(encoding="utf-8")))
    (DOCS / "paper.md").write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
