"""Make docs/paper.md, "The paper's claims", and its pictures, from benchmarks/results/paper.json: `make docs`."""

import json
from collections import Counter
from pathlib import Path
from typing import Any

from e2efly.commands.terminal import markdown

DOCS = Path(__file__).parent
FILE = DOCS.parent / "benchmarks" / "results" / "paper.json"
WORDS = ("confirmed", "refuted", "not testable here", "not measured yet")
HEAD = """# The paper's claims

e2efly implements *E2E-Fly: An Integrated Training-to-Deployment System for End-to-End Quadrotor Autonomy* by Fangyu
Sun, Fanxing Li, Linzuo Zhang, Yu Hu, Renbiao Jin, Shuyu Wu, Wenxian Yu and Danping Zou (Shanghai Jiao Tong
University). This page takes every table and figure of its experiments, puts our figures beside theirs, and says of each
claim whether we find the same. It is written by `make docs` from what `benchmarks/paper.py` has measured. The rules of
the verdicts are code, in `benchmarks/claims`.

- **confirmed**: our measurement, in our simulator, says the same.
- **refuted**: our measurement contradicts the claim, under the conditions given beside it. The paper's simulator,
  VisFly, may give another result.
- **not testable here**: a test needs a vehicle, or the paper does not say what is to be measured.
- **not measured yet**: the experiment is defined, but its runs are missing.

The tables say how many seeds each row has. With few seeds, a row shows that something can happen, but not how often.
"""
COMMANDS = {
    "Training by PPO and BPTT: hovering, landing, tracking, racing": "`e2efly train race --preset paper --algo ppo "
    "--env.past-actions 0`: its rewards, sizes and observations",
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
  paper's weights, steps and sizes.
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
PICTURES = {
    "learning": ("paper_learning.png", "rewards and success of PPO and BPTT against steps"),
    "ablation": ("paper_ablation.png", "rewards without one of their parts against steps"),
}
"""The curves of an experiment, once there are any."""
TASKS = ("hover", "land", "track", "race")
"""In the order of the paper."""
LINES = {"identical rewards": "-", "its own rewards": "--"}


def page() -> str:
    """The page."""
    parts = json.loads(FILE.read_text(encoding="utf-8"))
    counts, total = [], Counter()
    for part in parts.values():
        of = Counter(claim["verdict"] for claim in part["claims"])
        total += of
        anchor = part["title"].lower().replace(" ", "-").replace(",", "")
        counts.append(
            {
                "experiment": f"[{part['title']}](#{anchor})",
                **{word: str(of[word]) if of[word] else "" for word in WORDS},
            }
        )
    counts.append({"experiment": "all", **{word: str(total[word]) for word in WORDS}})
    lines = [HEAD, *markdown(counts), ""]
    for name, part in parts.items():
        lines += [*section(name, part), ""]
    commands = [{"the paper's experiment": what, "ours": how} for what, how in COMMANDS.items()]
    return "\n".join([*lines, "## Which command repeats it", "", *markdown(commands), "", TAIL])


def section(name: str, part: dict[str, Any]) -> list[str]:
    """An experiment: what it is, its claims, its curves and its table."""
    lines = [f"## {part['title']}", "", f"The paper: {part['where']}. {measured(name, part)}".strip(), ""]
    lines += [part["about"], ""] if part["about"] else []
    lines += [*markdown(part["claims"]), ""]
    if part["runs"] and name in PICTURES:
        file, told = PICTURES[name]
        lines += [f"![{told}]({file})", ""]
    return [*lines, *(markdown(part["table"]) if part["table"] else [])]


def measured(name: str, part: dict[str, Any]) -> str:
    """Where the figures come from."""
    if part["made_of"]:
        return f"From {', '.join(f'`{file}.json` of {day}' for file, day in part['made_of'].items())}."
    if all(claim["verdict"] == WORDS[2] for claim in part["claims"]):
        return ""
    if not part["runs"]:
        return f"`benchmarks/paper.py {name}`."
    m = part["machine"]
    cores = sorted({one["cores"] for one in part["runs"] if "cores" in one})
    of = f"{' or '.join(map(str, cores))} of {m['cores']}" if cores else m["cores"]
    return f"`benchmarks/paper.py {name}`, {part['date']}, {of} cores of {m['cpu']}, JAX {m['jax']}."


def numbers(line: str) -> list[float]:
    """A column of a curve, which the file has in one line."""
    return [float(x) for x in line.split()]


def curve(one: dict[str, Any], name: str) -> list[float]:
    """A column of a run's curve."""
    return numbers(one["curve"][name])


def learning(runs: list[dict[str, Any]]) -> None:
    """docs/paper_learning.png: reward and success of every run against steps, one column per task."""
    from e2efly.viewing.style import CYCLE, figure

    tasks = [task for task in TASKS if any(one["task"] == task for one in runs)]
    notes = ["one line per run; the preset paper; dashed: PPO with the action and sparse terms of its own table"]
    with figure(DOCS / PICTURES["learning"][0], "PPO against BPTT", 5.6, notes) as fig:
        axes = fig.subplots(2, len(tasks), squeeze=False, sharex=True)
        for column, task in zip(axes.T, tasks, strict=True):
            for one in (one for one in runs if one["task"] == task):
                kind = {"color": CYCLE[one["algo"] == "ppo"], "linestyle": LINES[one["variant"]], "linewidth": 1.2}
                steps = [x / 1e6 for x in curve(one, "steps")]
                if one["variant"] != "its own rewards":  # another sum, which cannot be compared
                    column[0].plot(steps, curve(one, "reward"), **kind)
                label = f"{one['algo'].upper()}, {one['variant']}" if one["seed"] == 0 else None
                column[1].plot(steps, [100 * x for x in curve(one, "success")], label=label, **kind)
            column[0].set_title(task)
            column[1].set_xscale("log")
            column[1].set_ylim(-4, 104)
            column[1].set_xlabel("steps (million)")
        axes[0, 0].set_ylabel("reward of a step (1)")
        axes[1, 0].set_ylabel("success (%)")
        known = {label: line for ax in axes[1] for line, label in zip(*ax.get_legend_handles_labels(), strict=True)}
        fig.legend(list(known.values()), list(known), loc="outside lower center", ncols=3)


def ablation(runs: list[dict[str, Any]]) -> None:
    """docs/paper_ablation.png: the full reward and each without one part, one panel per task, algorithm and preset."""
    from e2efly.config.drawing import INK
    from e2efly.viewing.style import CYCLE, figure

    tasks = [task for task in TASKS if any(one["task"] == task for one in runs)]
    kinds = sorted({(one["variant"], one["algo"]) for one in runs})
    notes = ["mean of the seeds; error of hover and track, success of land and race; black: the full reward"]
    title, height = "Rewards without one of their parts", 1.0 + 2.6 * len(kinds)
    with figure(DOCS / PICTURES["ablation"][0], title, height, notes) as fig:
        axes = fig.subplots(len(kinds), len(tasks), squeeze=False)
        parts = list(dict.fromkeys(name for one in runs for name in one["variants"][1:]))
        for ax in axes.ravel():
            ax.set_axis_off()
        for one in runs:
            ax = axes[kinds.index((one["variant"], one["algo"])), tasks.index(one["task"])]
            ax.set_axis_on()
            by_error = one["task"] in ("hover", "track")
            steps = [x / 1e6 for x in numbers(one["curve"]["steps"])]
            for variant, told in zip(one["variants"], one["curve"]["error" if by_error else "success"], strict=True):
                full = variant == "full"
                ax.plot(
                    steps,
                    [x * (1 if by_error else 100) for x in numbers(told)],
                    color=INK if full else CYCLE[parts.index(variant) % len(CYCLE)],
                    linewidth=2.2 if full else 1.4,
                    label=variant if full else f"w/o {variant}",
                )
            ax.set_title(f"{one['task']} by {one['algo'].upper()}, {one['variant']}", fontsize=9)
            ax.set_ylabel("error (m)" if by_error else "success (%)")
            if by_error:
                ax.set_yscale("log")
            else:
                ax.set_ylim(-4, 104)
        known = {
            label: line for ax in axes.ravel() for line, label in zip(*ax.get_legend_handles_labels(), strict=True)
        }
        fig.legend(list(known.values()), list(known), loc="outside lower center", ncols=7)
        for ax in axes[-1]:
            ax.set_xlabel("steps (million)")


def main() -> None:
    """Write the page, and draw what there is to draw."""
    from PIL import Image

    (DOCS / "paper.md").write_text(page(), encoding="utf-8")
    parts = json.loads(FILE.read_text(encoding="utf-8"))
    for name, draw in (("learning", learning), ("ablation", ablation)):
        if parts[name]["runs"]:
            draw(parts[name]["runs"])
            path = DOCS / PICTURES[name][0]
            with Image.open(path) as picture:
                small = picture.convert("RGB").quantize(256, dither=Image.Dither.NONE)
            small.save(path, optimize=True)


if __name__ == "__main__":
    main()
