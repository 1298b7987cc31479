"""The figure of the analysis of a rate loop: step response, spectra of the gyroscope, and the loop's terms, by axis."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from e2efly.config.drawing import INK
from e2efly.viewing.flight_axes import XYZ, liveliest
from e2efly.viewing.flight_data import AXES
from e2efly.viewing.flight_report import draw_response
from e2efly.viewing.pid_analysis import THROTTLES, PidAnalysis
from e2efly.viewing.style import BLUE, GREEN, GREY, PURPLE, VERMILLION, figure, say

TERM_COLOR = {"P": BLUE, "I": GREEN, "D": VERMILLION, "F": PURPLE}
SHOWN_S = 2.0
"""Length of the part whose terms are shown, s: that in which the axis' setpoint changes most."""


def plot_pid(found: PidAnalysis, path: str | Path, of: str) -> None:
    """Draw the analysis of one session. `of` names its log under the title."""
    notes = [
        f"{of}, {np.ptp(found.time):.1f} s at {found.rate:.0f} Hz, {found.firmware}. Step responses are estimated from "
        "the flight."
    ]
    with figure(path, "PID analysis", 11.0, notes) as fig:
        axes = fig.subplots(4, 3, sharey="row", height_ratios=[1.1, 1, 1, 1])
        for i, axis in enumerate(AXES):
            draw_response(axes[0, i], {"blackbox": found.responses[axis]}, axis, i)
            _draw_spectrum(axes[1, i], found, i)
            _draw_throttle(fig, axes[2, i], found, i, last=i == len(AXES) - 1)
            _draw_terms(axes[3, i], found, i)
        axes[0, 0].set_ylim(-0.2, 1.8)
        labels = ("rate / rate commanded", "gyro (rad/s/√Hz)", "mean motor output", "term (share of full range)")
        for ax, label in zip(axes[:, 0], labels, strict=True):
            ax.set_ylabel(label)
        told = [ax.get_legend_handles_labels() for ax in (axes[1, 0], axes[3, 0])]
        handles = {label: line for each in told for line, label in zip(*each, strict=True)}
        fig.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=max(len(handles), 1))


def _draw_spectrum(ax: Axes, found: PidAnalysis, axis: int) -> None:
    spectra = found.spectra
    if spectra.unfiltered is not None:
        ax.semilogy(spectra.frequency[1:], spectra.unfiltered[axis, 1:], color=GREY, linewidth=1.0, label="unfiltered")
    ax.semilogy(spectra.frequency[1:], spectra.filtered[axis, 1:], color=INK, linewidth=1.2, label="filtered")
    ax.set_xlabel("frequency (Hz)")


def _draw_throttle(fig: Figure, ax: Axes, found: PidAnalysis, axis: int, last: bool) -> None:
    spectra = found.spectra
    density = spectra.by_throttle[axis]
    known = np.isfinite(density) & (density > 0)
    ax.set_xlabel("frequency (Hz)")
    if not known.any():
        say(ax, "motor outputs not recorded")
        return
    shown = 20 * np.log10(np.where(known, density, np.nan))
    every = spectra.by_throttle[np.isfinite(spectra.by_throttle) & (spectra.by_throttle > 0)]
    low, high = 20 * np.log10(np.quantile(every, [0.02, 0.998]))
    edges = np.concatenate([spectra.frequency, [2 * spectra.frequency[-1] - spectra.frequency[-2]]])
    mesh = ax.pcolormesh(edges, THROTTLES, shown, vmin=low, vmax=high, cmap="viridis", rasterized=True)
    ax.grid(visible=False)
    if last:
        fig.colorbar(mesh, ax=ax, label="gyro (dB, 1 rad/s/√Hz)")


def _draw_terms(ax: Axes, found: PidAnalysis, axis: int) -> None:
    ax.set_xlabel("time in the log (s)")
    if not found.terms:
        say(ax, "not recorded")
        return
    moved = found.setpoint if np.isfinite(found.setpoint).any() else found.gyro
    start = liveliest(found.time, moved[:, axis : axis + 1], SHOWN_S)
    inside = (found.time >= start) & (found.time <= start + SHOWN_S)
    for name, values in found.terms.items():
        ax.plot(found.time[inside], values[inside, axis], color=TERM_COLOR[name], linewidth=1.0, label=name)
    ax.axhline(0, color=XYZ[axis], linewidth=0.8, zorder=0)
    ax.set_xlim(start, start + SHOWN_S)
