"""The plot of a policy's stress test."""

from pathlib import Path

import numpy as np

from e2efly.environment.episodes import wilson
from e2efly.validation.stress import Report
from e2efly.viewing.style import BLUE, GREY, ORANGE, VERMILLION, figure

GOOD, FAIR = 0.97, 0.8
"""Success rates from which on a bar is blue (`GOOD`) or orange (`FAIR`). Below `FAIR` it is red."""


def plot_stress(report: Report, path: str | Path) -> None:
    """Draw the success rate of each row for the worst criterion, with its 95 % interval (Wilson), as a PNG file."""
    contract = report.candidate.policy.contract
    rows = [*report.trained.flown, *report.untrained.flown]
    counts = [min((int(np.sum(e.success)), len(e.success)) for e in report.flown[row].values()) for row in rows]
    place = np.arange(len(rows))[::-1]
    rates = np.array([k / n for k, n in counts])
    colors = [BLUE if rate >= GOOD else ORANGE if rate >= FAIR else VERMILLION for rate in rates]
    bounds = np.array([wilson(k, n) for k, n in counts])
    believed = contract.vehicle if report.candidate.controller == "policy" else Path(report.candidate.vehicle).stem
    notes = [f"{counts[0][1]} starts per row; the flight controller believes in {believed}; lines: 95 %"]
    title = f"{contract.task} on vehicles that are not {contract.vehicle}: {report.plant}"
    own = len(report.trained.flown)
    if 0 < own < len(rows):
        notes.append("below the line: laws that no training draws from")
    with figure(path, title, 1.6 + 0.27 * len(rows), notes) as fig:
        ax = fig.add_subplot()
        ax.barh(place, 100 * rates, color=colors, height=0.7)
        ax.hlines(place, 100 * bounds[:, 0], 100 * bounds[:, 1], color=GREY, linewidth=1.5)
        for y, rate in zip(place, rates, strict=True):
            ax.text(101.5, y, f"{100 * rate:.1f} %", va="center", fontsize=9)
        if 0 < own < len(rows):
            ax.axhline(len(rows) - own - 0.5, color=GREY, linewidth=1.5)
        ax.set_yticks(place, rows)
        ax.set_xlim(0, 100)
        ax.set_ylim(-0.6, len(rows) - 0.4)
        ax.set_xlabel("success (%)")
        ax.grid(axis="y", visible=False)
