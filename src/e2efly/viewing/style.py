"""The style of all plots. They use Matplotlib's objects without pyplot, so there is no global state and no window."""

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, LogFormatter, LogFormatterMathtext, MaxNLocator

from e2efly.config.drawing import INK, ORANGE
from e2efly.config.storage import write_atomically

BLUE, VERMILLION, GREEN, PURPLE, SKY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9"
CYCLE = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY)
"""Okabe and Ito's palette, which can be distinguished with every kind of colour vision."""
GREY, PALE, HALO = "#767676", "#D0D0D0", "#F5CE85"

WIDTH, DPI = 10.0, 120
"""Width in inches and dots per inch: 1200 pixels."""

SPEED = LinearSegmentedColormap.from_list("speed", [colormaps["viridis"](0.92 * i / 255) for i in range(256)])
"""Viridis without its pale end, which is hard to see on white paper."""
MARK: dict[str, Any] = {
    "color": INK, "markersize": 12, "markeredgecolor": "white", "markeredgewidth": 0.8, "linestyle": "",
}  # fmt: skip
"""Style of the mark of a place."""
START: dict[str, Any] = {
    "marker": "o", "markersize": 5, "markerfacecolor": "white", "markeredgecolor": INK, "markeredgewidth": 1.2,
    "linestyle": "",
}  # fmt: skip
"""Style of the mark where a flight begins."""
FAILURE: dict[str, Any] = {
    "marker": "X", "markersize": 8, "markerfacecolor": VERMILLION, "markeredgecolor": "white", "linestyle": "",
}  # fmt: skip
"""Style of the mark where a failed flight ends."""

_STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans", "font.size": 10, "axes.titlesize": 11, "axes.labelsize": 10,
    "legend.fontsize": 9, "xtick.labelsize": 9, "ytick.labelsize": 9,
    "text.color": INK, "axes.labelcolor": INK, "axes.edgecolor": GREY, "xtick.color": GREY, "ytick.color": GREY,
    "xtick.labelcolor": INK, "ytick.labelcolor": INK,
    "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "axes.axisbelow": True,
    "axes.titlelocation": "left", "axes.facecolor": "white", "figure.facecolor": "white", "savefig.facecolor": "white",
    "grid.color": "#E6E6E6", "grid.linewidth": 0.8, "lines.linewidth": 1.6, "lines.solid_capstyle": "round",
    "legend.frameon": False, "axes.formatter.useoffset": False, "axes.unicode_minus": True, "text.parse_math": False,
}  # fmt: skip


@contextmanager
def figure(
    path: str | Path, title: str, height: float, notes: Sequence[str] = (), free: bool = False
) -> Iterator[Figure]:
    """A figure that is written to `path` as PNG when the block ends without an error.

    Args:
        path: the PNG file.
        title: title, in bold.
        height: height, inches.
        notes: lines under the title.
        free: whether the block places its axes itself.
    """
    with rc_context(_STYLE):
        fig = Figure(figsize=(WIDTH, height), dpi=DPI)
        FigureCanvasAgg(fig)
        lines = 0.42 + 0.21 * len(notes)  # inches above the axes
        fig.text(0.012, 1 - 0.12 / height, title, va="top", weight="bold", size=13)
        fig.text(0.012, 1 - 0.40 / height, "\n".join(notes), va="top", linespacing=1.45)
        if not free:
            rect = (0.004, 0.0, 0.988, 1 - lines / height)
            fig.set_layout_engine("constrained", rect=rect, w_pad=0.06, h_pad=0.06)
        yield fig
        for axis in (axis for ax in fig.axes for axis in (ax.xaxis, ax.yaxis)):
            if isinstance(axis.get_major_formatter(), LogFormatterMathtext):
                _label_decades(axis)
        picture = io.BytesIO()
        fig.savefig(picture, format="png")
        write_atomically(Path(path), picture.getvalue())


def in_space(ax: Any, ticks: tuple[int, int, int]) -> None:
    """Give three-dimensional axes labels in metres, so many ticks at most, and clear walls."""
    for axis, name, most in zip((ax.xaxis, ax.yaxis, ax.zaxis), "xyz", ticks, strict=True):
        axis.set_label_text(f"{name} (m)")
        axis.set_major_locator(MaxNLocator(most, steps=[1, 2, 5, 10]))
        axis.set_pane_color((1, 1, 1, 0))
        axis.line.set_color(GREY)
        axis.labelpad = 0
    ax.tick_params(pad=1)


def legend_of(ax: Axes, fig: Figure) -> None:
    """Explain, below all plots of a figure, what one of them shows."""
    handles, labels = ax.get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside lower center", ncols=len(labels))


def _label_decades(axis: Axis) -> None:
    """Label a logarithmic axis with plain numbers. Matplotlib's own labels are formulas, but every text of a figure is
    shown as it is, since it may hold the dollar signs of a name.
    """
    axis.set_major_formatter(FormatStrFormatter("%g"))
    axis.set_minor_formatter(LogFormatter())


def say(ax: Axes, text: str) -> None:
    """Write a text in the middle of axes that have nothing to show."""
    ax.text(0.5, 0.5, text, transform=ax.transAxes, ha="center", va="center", color=GREY)
