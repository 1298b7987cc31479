"""Comparison of runs: the course of their success rates."""

from collections.abc import Sequence
from pathlib import Path

from e2efly.learn.comparison import Compared
from e2efly.view.style import CYCLE, figure

LINES = ("-", "--", ":", "-.")
"""Line styles. If there are more runs than colours, the next line style is used."""


def plot_runs(runs: Sequence[Compared], path: str | Path) -> None:
    """Draw the success rate of each evaluation over environment steps and over seconds, as a PNG file."""
    notes = ["Success of the worst criterion at each evaluation in training; a dot: the run's own criterion is reached"]
    with figure(path, f"{len(runs)} runs", 4.6 + 0.16 * len(runs), notes) as fig:
        axes = fig.subplots(1, 2, sharey=True)
        for i, run in enumerate(runs):
            colour, line = CYCLE[i % len(CYCLE)], LINES[i // len(CYCLE) % len(LINES)]
            style = {"color": colour, "linestyle": line}
            for ax, x, at in ((axes[0], run.steps / 1e6, 0), (axes[1], run.seconds, 1)):
                ax.plot(x, 100 * run.success, **style, label=f"{run.path}, {run.vehicles}" if at else None)
                if (there := run.there) is not None:
                    ax.plot(there[at] / (1 if at else 1e6), 100 * run.criterion, "o", color=colour, markersize=5)
        axes[0].set(xlabel="environment steps (millions)", ylabel="success (%)", ylim=(-2, 102))
        axes[1].set(xlabel="time since the start of the process (s)")
        for ax in axes:
            ax.set_xlim(left=0)
        fig.legend(loc="outside lower left", ncols=2)
