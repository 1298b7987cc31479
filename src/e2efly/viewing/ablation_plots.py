"""Learning curves of the variants of a reward: the paper's two figures, one per algorithm."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from e2efly.config.drawing import INK
from e2efly.learning.ablation import FULL, Curves
from e2efly.viewing.style import CYCLE, GREY, figure

_DASHES = ("-", (0, (4, 2)), (0, (1, 1.2)))


@dataclass(frozen=True)
class CurvePanel:
    """The curves of one task, and which of them to draw."""

    title: str
    curves: Curves
    by_error: bool
    """Draw the error instead of the success rate."""


def plot_ablation(panels: Sequence[CurvePanel], path: str | Path, title: str) -> None:
    """Draw one panel per task: for every variant, the mean over the seeds against steps, and a band from the worst to
    the best seed.

    Args:
        panels: the panels of the tasks.
        path: the PNG file.
        title: title of the figure.
    """
    columns = min(2, len(panels))
    rows = -(-len(panels) // columns)
    seeds = next(iter(panels[0].curves.success.values())).shape[1]
    notes = [
        f"mean of {seeds} seeds; bands: from the worst to the best seed of the full reward; w/o: without that term"
    ]
    with figure(path, title, 0.8 + 3.3 * rows, notes) as fig:
        axes = fig.subplots(rows, columns, squeeze=False).ravel()
        for ax, panel in zip(axes, panels, strict=False):
            _draw(ax, panel)
        for ax in axes[len(panels) :]:
            ax.set_axis_off()


def _draw(ax: Axes, panel: CurvePanel) -> None:
    curves = panel.curves
    lines = worst(curves, panel.by_error)
    steps = curves.steps / 1e6
    for i, (variant, values) in enumerate(zip(curves.variants, lines, strict=True)):
        mean = values.mean(axis=0)
        if variant == FULL:
            ax.fill_between(steps, values.min(axis=0), values.max(axis=0), color=INK, alpha=0.12, linewidth=0)
            ax.plot(steps, mean, color=INK, linewidth=2.2, label=FULL, zorder=3)
            continue
        color, dashes = CYCLE[(i - 1) % len(CYCLE)], _DASHES[(i - 1) // len(CYCLE) % len(_DASHES)]
        ax.plot(steps, mean, color=color, linestyle=dashes, label=f"w/o {variant}")
    ax.set_title(panel.title)
    ax.set_xlabel("environment steps (million)")
    ax.set_xlim(left=0.0)
    if panel.by_error:
        ax.set_ylabel("error (m)")
        ax.set_yscale("log")
    else:
        ax.set_ylabel("success (%)")
        ax.set_ylim(-4, 104)
        ax.axhline(100, color=GREY, linewidth=0.6)
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), borderpad=0.1)


def worst(curves: Curves, by_error: bool) -> np.ndarray:
    """Success rate (%), or error (m), of the worst criterion: (variants, seeds, evaluations)."""
    if by_error:
        return np.max(list(curves.error.values()), axis=0)
    return 100 * np.min(list(curves.success.values()), axis=0)
