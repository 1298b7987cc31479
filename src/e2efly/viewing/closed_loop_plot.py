"""The plot of a policy's closed loop: the flight, and the simulator's flight by the same policy from the same start."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from e2efly.validation.closed_loop import ClosedLoop
from e2efly.viewing.alignment_plots import AFTER, BEFORE, MEASURED
from e2efly.viewing.style import figure, legend_of, say

SHOWN_S = 6.0
"""Longest time that is shown, s."""
COMMANDS = ("thrust\n(m/s²)", "roll rate\n(rad/s)", "pitch rate\n(rad/s)", "yaw rate\n(rad/s)")
FLIGHT: dict[str, Any] = MEASURED | {"label": "flight"}
STEPPED: dict[str, Any] = {"drawstyle": "steps-post"}


def plot_closed_loop(path: Path, loop: ClosedLoop) -> None:
    """Draw commands, body rates and position of the flight and of the simulator with each vehicle."""
    notes = [
        f"{loop.policy.name} ({loop.task}), from where it took over. Nothing of the flight is used after the start."
    ]
    with figure(path, "Response of the policy", 8.2, notes) as fig:
        axes = fig.subplots(3, 4, sharex=True)
        for i, ax in enumerate(axes[0]):
            ax.set_title(f"commanded {COMMANDS[i].partition(chr(10))[0]}", fontsize=10)
            ax.set_ylabel(COMMANDS[i].partition("\n")[2])
            _draw_commands(ax, loop, i)
        for i, ax in enumerate(axes[1, 1:]):
            ax.set_title(COMMANDS[1 + i].partition("\n")[0], fontsize=10)
            ax.set_ylabel("(rad/s)")
            _draw(ax, loop, "body_rate", i)
        axes[1, 0].set_title("speed", fontsize=10)
        axes[1, 0].set_ylabel("(m/s)")
        _draw(axes[1, 0], loop, "velocity", None)
        for i, ax in enumerate(axes[2, 1:]):
            ax.set_title("xyz"[i], fontsize=10)
            ax.set_ylabel("(m)")
            _draw(ax, loop, "position", i)
        axes[2, 0].set_title("distance from the flight", fontsize=10)
        axes[2, 0].set_ylabel("(m)")
        seen = loop.flown["position"]
        for (_, told), style in zip(loop.simulated.items(), (BEFORE, AFTER), strict=False):
            both = seen[:, 0] <= told.time[-1]
            place = [np.interp(seen[both, 0], told.time, column) for column in told.position.T]
            axes[2, 0].plot(seen[both, 0], np.linalg.norm(np.stack(place, 1) - seen[both, 1:], axis=1), **style)
        for ax in axes[2]:
            ax.set_xlabel("time (s)")
            ax.set_xlim(0, min(SHOWN_S, float(seen[-1, 0])))
        legend_of(axes[1, 1], fig)


def _draw_commands(ax: Axes, loop: ClosedLoop, channel: int) -> None:
    """Commands at the time at which they were sent."""
    if loop.command_mode != "ctbr":
        say(ax, f"the policy commands\n{loop.command_mode}")
        return
    time = loop.sent[:, 0]
    ax.plot(time, loop.sent[:, 1 + channel], **FLIGHT, **STEPPED)
    for (_, told), style in zip(loop.simulated.items(), (BEFORE, AFTER), strict=False):
        sent = told.time[:-1] + loop.shift
        ax.plot(sent, told.command[:, channel], **style, **STEPPED)


def _draw(ax: Axes, loop: ClosedLoop, stream: str, axis: int | None) -> None:
    """A signal of the motion. Axis None: its length."""

    def shown(values: np.ndarray) -> np.ndarray:
        return np.linalg.norm(values, axis=1) if axis is None else values[:, axis]

    seen = loop.flown[stream]
    ax.plot(seen[:, 0], shown(seen[:, 1:]), **FLIGHT)
    for (_, told), style in zip(loop.simulated.items(), (BEFORE, AFTER), strict=False):
        ax.plot(told.time, shown(getattr(told, stream)), **style)
