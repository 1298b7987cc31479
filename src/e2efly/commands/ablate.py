"""`e2efly ablate`."""

import dataclasses
import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tyro
from rich.console import Console

from e2efly.commands.terminal import Terminal, TerminalProgress, console_table, markdown
from e2efly.config import TrainConfig
from e2efly.config.run import criterion
from e2efly.config.storage import held, write_atomically, write_json
from e2efly.runs import presets
from e2efly.simulation.device import prepare


@dataclass(frozen=True)
class Ablate:
    """Train tasks with each reward term removed in turn, over several seeds in one compiled program; draw the curves.

    With `--by group`, all terms of a group are removed together, as in the paper's figures: prog, act, ori, v, anglev,
    sparse.
    """

    tasks: tyro.conf.Positional[Annotated[tuple[str, ...], tyro.conf.arg(metavar="[TASK ...]")]] = (
        "hover", "land", "track", "race",
    )  # fmt: skip
    """Tasks to ablate (default: hover land track race)."""
    algos: tuple[str, ...] = ("ppo", "bptt")
    """Learning algorithms. One figure is drawn per algorithm."""
    preset: str = "nominal"
    """Preset of the rewards and sizes; see `e2efly list presets`. Its curriculum is not used."""
    seeds: int = 3
    """Number of runs per variant."""
    by: Literal["term", "group"] = "term"
    """What is removed at a time: one term, or all terms of one of the paper's groups."""
    steps: int | None = None
    """Environment steps of each run. If omitted, those of the preset."""
    past_actions: int | None = None
    """How many past actions the policies see; 0 as in the paper. If omitted, as many as the latency spans."""
    out: Path = Path("runs/ablation")
    """Folder for the figures, the table and the curves. Curves that it already holds are not trained again."""
    device: Literal["cpu", "gpu"] | None = None
    """Device to compute on."""


def run(options: Ablate) -> int:
    """Train every variant of every task with every algorithm. Write JSON, a table, and one figure per algorithm.

    Curves that an earlier run with the same configuration wrote are reused. Training that it did not finish continues.

    Raises:
        ValueError: for unknown names, and for numbers that cannot be used.
        OSError: when the folder cannot be written.
    """
    if options.seeds < 1:
        raise ValueError(f"--seeds is {options.seeds}; accepted: 1 or more")
    prepare(options.device)
    console = Terminal()
    configs = {(algo, task): _config(options, task, algo) for algo in options.algos for task in options.tasks}
    with held(options.out):
        return _ablate(options, configs, console)


def _ablate(options: Ablate, configs: dict[tuple[str, str], TrainConfig], console: Console) -> int:
    """Run the ablation in a folder that no other process uses."""
    from e2efly.viewing.ablation_plots import CurvePanel, plot_ablation

    known = {pair: _known(options, config) for pair, config in configs.items()}
    lines: list[str] = []
    for algo in options.algos:
        panels = []
        for task in options.tasks:
            began = time.perf_counter()
            vehicles = _vehicles(configs[algo, task])
            curves = known[algo, task] or _curves(options, configs[algo, task], vehicles, console)
            rows = _rows(curves, 100 * criterion(None, vehicles))
            panels.append(CurvePanel(f"{task}, {vehicles}", curves, configs[algo, task].task.shows_error))
            took = "as found" if known[algo, task] else f"in {time.perf_counter() - began:.0f} s"
            console.print(
                f"\n{task} by {algo.upper()}: {len(curves.variants)} rewards, {options.seeds} seeds, {vehicles}, {took}"
            )
            console.print(console_table(rows))
            lines += [f"## {task} by {algo.upper()}, {vehicles}", "", *markdown(rows), ""]
        path = options.out / f"ablation_{algo}.png"
        plot_ablation(panels, path, f"What each reward term is good for: {algo.upper()}")
        console.print(f"Figure: {path}")
    write_atomically(options.out / "ablation.md", "\n".join(lines).encode())
    console.print(f"Table: {options.out / 'ablation.md'}")
    return 0


def _config(options: Ablate, task: str, algo: str) -> TrainConfig:
    config = dataclasses.replace(presets.preset(task, algo, options.preset), curriculum=(), start_from=None)
    if options.steps is not None:
        config = dataclasses.replace(config, steps=options.steps)
    if options.past_actions is not None:
        config = dataclasses.replace(config, env=dataclasses.replace(config.env, past_actions=options.past_actions))
    presets.check(config)
    return config


def _vehicles(config: TrainConfig) -> str:
    """The name of what flies."""
    from e2efly.environment import Env

    return Env.of(config.task, config.reward, config.env).vehicles


def _path(options: Ablate, config: TrainConfig) -> Path:
    return options.out / f"{config.task.name}_{config.algo.name}.json"


def _about(options: Ablate, config: TrainConfig) -> dict[str, Any]:
    """The settings that determine the curves."""
    from e2efly.learning.checkpoint import FORMAT
    from e2efly.runs.inputs import to_json

    groups = {"by": options.by} if options.by != "term" else {}  # curves by terms that are there already stay
    return {"format": FORMAT, "seeds": options.seeds, "config": to_json(config), **groups}


def _known(options: Ablate, config: TrainConfig) -> Any:
    """The curves that an earlier run wrote, or None."""
    from e2efly.learning.ablation import Curves
    from e2efly.runs.inputs import different_values

    path = _path(options, config)
    if not path.exists():
        return None
    found, about = json.loads(path.read_text(encoding="utf-8")), json.loads(json.dumps(_about(options, config)))
    if different := list(different_values(found["about"], about)):
        raise ValueError(f"{path} is of another ablation: {'; '.join(different)}; accepted: another --out")
    parts = {part: {k: np.array(v, np.float64) for k, v in found[part].items()} for part in ("success", "error")}
    return Curves(tuple(found["variants"]), np.array(found["steps"]), **parts)


def _curves(options: Ablate, config: TrainConfig, vehicles: str, console: Console) -> Any:
    """Train all variants of a configuration and keep their curves."""
    from e2efly.learning.ablation import KeptRun, ablate
    from e2efly.simulation.rewards import grouped

    task, algo = config.task.name, config.algo.name
    parts = grouped(config.reward.weights) if options.by == "group" else config.reward.weights
    steps = config.steps * options.seeds * (len(parts) + 1)
    with TerminalProgress(console, f"{task} by {algo}") as progress:
        progress.compiling()
        began, best = time.perf_counter(), 0.0

        def told(share: float, success: float) -> None:
            nonlocal best
            best = max(best, success)
            done = share * steps
            progress.progress(int(done), steps, done / (time.perf_counter() - began), success, best, vehicles)

        kept = KeptRun(_path(options, config).with_suffix(".safetensors"), _about(options, config))
        curves = ablate(config, options.seeds, told, kept, options.by)
    content = {
        "about": _about(options, config),
        "variants": list(curves.variants),
        "steps": curves.steps.tolist(),
        "success": {name: x.tolist() for name, x in curves.success.items()},
        "error": {name: x.tolist() for name, x in curves.error.items()},
    }
    write_json(_path(options, config), content, indent=None)
    kept.path.unlink(missing_ok=True)
    return curves


def _rows(curves: Any, learned: float) -> list[dict[str, str]]:
    """One row per variant: its last evaluation, over all seeds, and when it was learned, at this success, %."""
    from e2efly.viewing.ablation_plots import worst

    success, error = worst(curves, False), worst(curves, True)
    reached = [np.flatnonzero(s.mean(axis=0) >= learned) for s in success]
    return [
        {
            "reward": variant if i == 0 else f"without {variant}",
            "success": f"{success[i, :, -1].mean():.1f} %",
            "worst seed": f"{success[i, :, -1].min():.1f} %",
            "error": f"{100 * error[i, :, -1].mean():.1f} cm",
            f"{learned:g} % at": f"{curves.steps[reached[i][0]] / 1e6:.2f} M" if len(reached[i]) else "-",
        }
        for i, variant in enumerate(curves.variants)
    ]
