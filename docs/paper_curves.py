"""The curves of docs/paper.md, drawn as the paper draws its own: from benchmarks/results, by docs/paper_page.py."""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from PIL import Image

from e2efly.config.drawing import INK
from e2efly.viewing.style import CYCLE, figure, say

DOCS = Path(__file__).parent
RESULTS = DOCS.parent / "benchmarks" / "results"
TASKS = {"hover": "Hovering", "land": "Landing", "track": "Tracking", "race": "Racing"}
"""In the order of the paper, with its names."""
COLOURS = {"bptt": CYCLE[0], "ppo": CYCLE[1]}
BY_ERROR = ("hover", "track")
LINES = (("ppo", "identical", "-"), ("bptt", "identical", "-"), ("ppo", "its own", ":"))
"""Whose curves, with which rewards, in which style."""
Run = dict[str, Any]


def numbers(line: str) -> np.ndarray:
    """A column of a curve, which the file has in one line."""
    return np.array(line.split(), float)


def spread(ax: Axes, runs: Sequence[Run], column: str, scale: float = 1.0, **style: Any) -> None:
    """Draw the mean of several seeds against millions of steps, and the band from the lowest to the highest."""
    curves = [(numbers(one["curve"]["steps"]) / 1e6, scale * numbers(one["curve"][column])) for one in runs]
    if not curves:
        return
    grid = np.unique(np.concatenate([steps for steps, _ in curves]))
    each = np.array([np.interp(grid, *curve, left=np.nan, right=np.nan) for curve in curves])
    known = np.isfinite(each).any(axis=0)
    grid, each = grid[known], each[:, known]
    ax.plot(grid, np.nanmean(each, axis=0), **style)
    ax.fill_between(grid, np.nanmin(each, axis=0), np.nanmax(each, axis=0), color=style["color"], alpha=0.18, lw=0)


def share(ax: Axes) -> None:
    """An axis of success."""
    ax.set(ylim=(-4, 104), ylabel="success (%)")


def legend(fig: Any, axes: Iterable[Axes], columns: int) -> None:
    """One legend for all axes."""
    known = {label: line for ax in axes for line, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    fig.legend(list(known.values()), list(known), loc="outside lower center", ncols=columns)


def learning(runs: Sequence[Run], preset: str) -> Path | None:
    """Rewards of PPO and BPTT against steps, a panel per task, and the success under them."""
    drawn = [one for one in runs if one["variant"] in (f"{preset}, identical rewards", f"{preset}, its own rewards")]
    if not drawn:
        return None
    path = DOCS / f"paper_learning_{preset}.png"
    notes = ["mean of the seeds, and the band from the lowest to the highest; PPO and BPTT with identical rewards"]
    with figure(path, f"Training rewards of PPO and BPTT, preset {preset}", 5.6, notes) as fig:
        axes = fig.subplots(2, len(TASKS), squeeze=False, sharex="col")
        for (reward, success), task in zip(axes.T, TASKS, strict=True):
            reward.set_title(TASKS[task])
            for algo, rewards, style in (
                ("ppo", "identical", "-"),
                ("bptt", "identical", "-"),
                ("ppo", "its own", ":"),
            ):
                own = [x for x in drawn if (x["task"], x["algo"]) == (task, algo) and f", {rewards} " in x["variant"]]
                told = f"{algo.upper()}{', with the rewards of its own table' if style == ':' else ''}"
                look: Any = {"color": COLOURS[algo], "linestyle": style, "label": told}
                if style == "-":
                    spread(reward, own, "return", **look)
                spread(success, own, "success", 100, **look)
            for ax in (ax for ax in (reward, success) if not ax.lines):
                say(ax, "not measured yet")
            share(success)
            success.set(xlabel="steps (million)", xscale="log", ylabel="success (%)" if task == "hover" else "")
        axes[0, 0].set_ylabel("reward of an episode (1)")
        legend(fig, axes.ravel(), 3)
    return path


def ablation(runs: Sequence[Run], algo: str) -> Path | None:
    """Success or error under rewards without one of their parts, a panel per task and a row per set of rewards."""
    drawn = [one for one in runs if one["algo"] == algo]
    kinds = list(dict.fromkeys(one["variant"] for one in sorted(drawn, key=lambda one: "our" in one["variant"])))
    if not drawn:
        return None
    parts = list(dict.fromkeys(name for one in drawn for name in one["variants"][1:]))
    path = DOCS / f"paper_ablation_{algo}.png"
    notes = ["error of hovering and tracking, success of landing and racing; mean of the seeds"]
    title, height = f"Different reward settings, training via {algo.upper()}", 1.3 + 2.5 * len(kinds)
    with figure(path, title, height, notes) as fig:
        axes = fig.subplots(len(kinds), len(TASKS), squeeze=False)
        for ax in axes.ravel():
            ax.set_axis_off()
        for one in drawn:
            ax = axes[kinds.index(one["variant"]), list(TASKS).index(one["task"])]
            ax.set_axis_on()
            by_error = one["task"] in BY_ERROR
            steps = numbers(one["curve"]["steps"]) / 1e6
            for name, told in zip(one["variants"], one["curve"]["error" if by_error else "success"], strict=True):
                full = name == "full"
                turn, place = (0, 0) if full else divmod(parts.index(name), len(CYCLE))
                look: Any = {"color": INK if full else CYCLE[place], "linestyle": ("-", "--", ":")[turn]}
                label = "r full" if full else f"w/o r {name}"
                values = numbers(told) * (1 if by_error else 100)
                ax.plot(steps, values, **look, linewidth=2.2 if full else 1.4, label=label)
            ax.set_title(f"{TASKS[one['task']]}, {one['variant']}", fontsize=9)
            if by_error:
                ax.set(yscale="log", ylabel="error (m)")
            else:
                share(ax)
            ax.set_xlabel("steps (million)")
        legend(fig, axes.ravel(), 7)
    return path


def visual(racing: Sequence[Run], landing: Sequence[Run]) -> Path | None:
    """Rewards and success of the two tasks by sight, from left to right as in the paper."""
    tasks = (("Racing with obstacles", racing), ("Visual landing", landing))
    tasks = tuple((title, [one for one in runs if "curve" in one]) for title, runs in tasks)
    if not any(runs for _, runs in tasks):
        return None
    path = DOCS / "paper_visual.png"
    colours = {variant: CYCLE[i % len(CYCLE)] for i, variant in enumerate(
        dict.fromkeys(one["variant"] for _, runs in tasks for one in runs))}  # fmt: skip
    notes = ["mean of the seeds; racing begins with the stages of its curriculum: no obstacles, then few"]
    with figure(path, "Rewards and success of visual tasks", 3.9 + 0.2 * len(colours) // 3, notes) as fig:
        axes = fig.subplots(1, 4)
        for (reward, success), (title, runs) in zip(axes.reshape(2, 2), tasks, strict=True):
            whole = all("return" in one["curve"] for one in runs)
            for variant in dict.fromkeys(one["variant"] for one in runs):
                own = [one for one in runs if one["variant"] == variant]
                look: Any = {"color": colours[variant], "label": variant}
                spread(reward, own, "return" if whole else "reward", **look)
                spread(success, own, "success", 100, **look)
            reward.set(title=title, ylabel=f"reward of {'an episode' if whole else 'a step'} (1)")
            share(success)
            for ax in (reward, success):
                ax.set_xlabel("steps (million)")
        legend(fig, axes, 3)
    return path


def response() -> Path | None:
    """Commands and body rates of the same policy from the same start, in the simulator and through the firmware."""
    file = RESULTS / "policy_response.json"
    if not file.exists():
        return None
    flown = json.loads(file.read_text(encoding="utf-8"))["flown"]
    path = DOCS / "paper_response.png"
    notes = ["the same policy from the same start; thin: the command, thick: the body rate that follows"]
    with figure(path, "Policy response, simulator and real firmware", 8.4, notes) as fig:
        axes = fig.subplots(4, len(flown), squeeze=False, sharex="col")
        for column, (task, places) in zip(axes.T, flown.items(), strict=True):
            column[0].set_title(task)
            for (place, curve), colour in zip(places.items(), CYCLE, strict=False):
                time, told = numbers(curve["time"]), "training simulator" if place == "simulator" else "real Betaflight"
                column[0].plot(time, numbers(curve["command thrust"]), color=colour, label=told)
                for ax, name in zip(column[1:], ("roll", "pitch", "yaw"), strict=True):
                    ax.plot(time, numbers(curve[f"command {name}"]), color=colour, linewidth=0.7, alpha=0.8)
                    ax.plot(time, numbers(curve[name]), color=colour)
            column[-1].set_xlabel("time (s)")
        for ax, label in zip(axes[:, 0], ("thrust (m/s²)", "roll rate (rad/s)", "pitch rate", "yaw rate"), strict=True):
            ax.set_ylabel(label)
        legend(fig, axes[0], 2)
    return path


def draw(parts: dict[str, Any]) -> None:
    """Draw what there is to draw, small. Pictures of what is no longer there go."""
    runs = {name: part["runs"] for name, part in parts.items()}
    for old in DOCS.glob("paper_learning*.png"):
        old.unlink()
    for path in (
        *(learning(runs["learning"], preset) for preset in ("paper", "authors")),
        *(ablation(runs["ablation"], algo) for algo in ("ppo", "bptt")),
        visual(runs["racing"], runs["landing"]), response(),
    ):  # fmt: skip
        if path:
            smaller(path)


def smaller(path: Path, colours: int = 256) -> None:
    """Fewer colours, which a page loads sooner."""
    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(colours, dither=Image.Dither.NONE)
    small.save(path, optimize=True)
