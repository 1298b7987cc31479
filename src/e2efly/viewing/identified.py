"""Plots of an identification: the fit and the data, predictions and residuals, and the identified values."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from e2efly.alignment.estimates import Estimate
from e2efly.alignment.found import Found
from e2efly.alignment.prediction import Prediction
from e2efly.logs.recording import KINDS
from e2efly.vehicles.vehicle import Vehicle
from e2efly.viewing.style import BLUE, GREY, INK, VERMILLION, figure

UNITS = {name: kind.unit for name, kind in KINDS.items()} | {"quaternion": "rad"}
"""Units of the errors. The error of an attitude is an angle."""
_NAMES = {
    "body_rate": "body rate", "specific_force": "specific force", "rotor_speed": "rotor speed", "velocity": "velocity",
    "quaternion": "attitude", "position": "position",
}  # fmt: skip


def plot_identified(
    folder: Path,
    base: Vehicle,
    fused: Mapping[str, Estimate],
    found: Mapping[str, Found],
    outside: Mapping[str, Prediction],
) -> list[Path]:
    """Draw all figures and return their files."""
    paths = [folder / "parameters.png"]
    _plot_parameters(paths[0], base, fused)
    for kind, each in found.items():
        for name, draw in (("prediction", _plot_prediction), ("fit", _plot_fit), ("residuals", _plot_residuals)):
            paths.append(folder / f"{kind}_{name}.png")
            draw(paths[-1], each, outside[kind])
    return paths


def _plot_parameters(path: Path, base: Vehicle, fused: Mapping[str, Estimate]) -> None:
    rows = []
    for name, e in fused.items():
        own, value, sigma = (
            np.atleast_1d(np.asarray(x, float)).ravel() for x in (getattr(base, name), e.value, e.sigma)
        )
        for i in range(own.size):
            if np.isfinite(value[i] / own[i] if own[i] else np.nan):
                label = name if own.size == 1 else f"{name}[{i}]"
                rows.append((label.replace("_", " "), value[i] / own[i], 1.645 * sigma[i] / abs(own[i])))
    notes = ["over the value of the file that it began from, with the interval that holds 90 %"]
    with figure(path, "What was identified", 1.4 + 0.3 * max(len(rows), 1), notes) as fig:
        ax = fig.add_subplot()
        place = np.arange(len(rows))[::-1]
        ax.axvline(1.0, color=GREY, linewidth=1)
        for y, (_, ratio, off) in zip(place, rows, strict=True):
            ax.errorbar(ratio, y, xerr=off, fmt="o", color=BLUE, capsize=3, markersize=5)
            ax.text(1.01, y, f"{ratio:.3f} ± {off:.3f}", transform=ax.get_yaxis_transform(), va="center", fontsize=9)
        ax.set_yticks(place, [row[0] for row in rows])
        ax.set_xlabel("identified over file (1)")
        ax.grid(axis="y", visible=False)


def _plot_prediction(path: Path, each: Found, outside: Prediction) -> None:
    names = list(outside.before)
    notes = [
        f"{int(each.held_out.sum())} windows that the fit did not see, simulated from their starts; root mean square"
    ]
    with figure(path, "Foretelling what was not seen", 0.9 + 2.1 * -(-len(names) // 3), notes) as fig:
        for i, name in enumerate(names):
            ax = fig.add_subplot(-(-len(names) // 3), 3, i + 1)
            there = np.isfinite(outside.before[name])  # a slow stream has no sample after some times
            ax.plot(outside.time[there], outside.before[name][there], color=GREY, label="by the file")
            ax.plot(outside.time[there], outside.after[name][there], color=BLUE, label="identified")
            ax.set_title(_NAMES[name])
            ax.set_ylabel(UNITS[name])
            ax.set_xlabel("time ahead (s)")
            ax.set_ylim(0, float(np.quantile(outside.before[name][there], 0.98)) * 1.3 + 1e-9)
            if i == 0:
                ax.legend(loc="upper left")


def _plot_fit(path: Path, each: Found, outside: Prediction) -> None:
    """The held-out windows with the most motion, one after the other."""
    windows = each.windows.some(each.held_out)
    names = [name for name in ("body_rate", "specific_force", "velocity", "position") if name in outside.measured][:2]
    lively = np.argsort(-np.var(outside.measured[names[0]], axis=1).sum(-1))[:6]
    notes = ["six lively windows that the fit did not see; dots: measured; lines: simulated from their starts"]
    with figure(path, "Fit against data", 1.0 + 1.5 * 3 * len(names), notes) as fig:
        for n, name in enumerate(names):
            for axis in range(3):
                ax = fig.add_subplot(3 * len(names), 1, 3 * n + axis + 1)
                for k, w in enumerate(lively):
                    t = outside.time + k * (outside.time[-1] + 0.05)
                    there = windows.there[name][w] > 0
                    ax.plot(
                        t[there],
                        outside.measured[name][w, there, axis],
                        ".",
                        color=INK,
                        markersize=2,
                        label="measured" if not k else None,
                    )
                    ax.plot(
                        t,
                        outside.old[name][w, :, axis],
                        color=GREY,
                        linewidth=1,
                        label="by the file" if not k else None,
                    )
                    ax.plot(t, outside.new[name][w, :, axis], color=BLUE, label="identified" if not k else None)
                measured = outside.measured[name][lively][..., axis]
                low, high = float(measured.min()), float(measured.max())
                ax.set_ylim(low - 0.4 * (high - low) - 0.1, high + 0.4 * (high - low) + 0.1)
                ax.set_ylabel(f"{_NAMES[name]}\n{'xyz'[axis]} ({UNITS[name]})", fontsize=8)
                if not (n or axis):
                    ax.legend(loc="upper right", ncol=3, fontsize=8)
        fig.axes[-1].set_xlabel("time in the windows, one after the other (s)")


def _plot_residuals(path: Path, each: Found, outside: Prediction) -> None:
    windows = each.windows.some(each.held_out)
    names = [name for name in outside.before if name != "quaternion" and name in each.fit.noise]
    notes = ["measured less simulated, over the spread that the fit gives each sensor; line: a normal distribution"]
    with figure(path, "What is left", 0.9 + 2.1 * -(-len(names) // 3), notes) as fig:
        bins = np.linspace(-5, 5, 61)
        normal = np.exp(-(bins**2) / 2) / np.sqrt(2 * np.pi)
        for i, name in enumerate(names):
            ax = fig.add_subplot(-(-len(names) // 3), 3, i + 1)
            there = windows.there[name] > 0
            left = (outside.measured[name] - outside.new[name])[there] / each.fit.noise[name]
            ax.hist(np.clip(left.ravel(), -5, 5), bins=list(bins), density=True, color=BLUE, alpha=0.6)
            ax.plot(bins, normal, color=VERMILLION, linewidth=1)
            ax.set_title(f"{_NAMES[name]}: {each.fit.noise[name]:.2g} {UNITS[name]}")
            ax.set_yticks([])
