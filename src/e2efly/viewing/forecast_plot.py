"""The plot of how well a vehicle foretells flights."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from e2efly.alignment.open_loop import HOLD, HOVER, OWN_VEHICLE, STREAMS, VEHICLE
from e2efly.viewing.style import BLUE, GREEN, GREY, VERMILLION, figure, legend_of, say

COLOURS = {HOLD: GREY, HOVER: VERMILLION, VEHICLE: BLUE, OWN_VEHICLE: GREEN}


def plot_forecasts(
    path: Path, ahead: Sequence[float], errors: Mapping[str, Mapping[str, np.ndarray]], title: str
) -> None:
    """Draw the mean errors by stream and prediction, each (times,), over how far ahead they are, s."""
    rows = -(-max(len(errors), 1) // 2)
    notes = ["Mean error of open-loop predictions that start as measured"]
    with figure(path, f"Prediction of flights: {title}", 1.0 + 2.6 * rows, notes) as fig:
        for place, (stream, sizes) in enumerate(errors.items(), 1):
            ax = fig.add_subplot(rows, 2, place)
            for name, size in sizes.items():
                ax.plot(ahead, size, "o-", color=COLOURS[name], markersize=4, label=name)
            ax.set_title({"quaternion": "attitude"}.get(stream, stream.replace("_", " ")))
            ax.set_ylabel(STREAMS[stream])
            ax.set_xlabel("time ahead (s)")
            ax.set_ylim(bottom=0)
        if errors:
            legend_of(max(fig.axes, key=lambda ax: len(ax.get_legend_handles_labels()[1])), fig)
        else:
            say(fig.add_subplot(), "nothing that is predicted was measured")
