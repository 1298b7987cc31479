"""What `eval --stress` and `validate --stress` share: the check of their options, the tables, the report."""

from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from e2efly.commands.terminal import headed, seconds
from e2efly.config.storage import write_json

if TYPE_CHECKING:
    from e2efly.validation.stress import Report


TRAINED, UNTRAINED = "Rows that trainings draw from", "Rows from laws that no training draws from"
"""The headings of the two tables."""


def check_stress(stress: bool, rows: tuple[str, ...], least: float | None) -> None:
    """Refuse `--rows` and `--least` where they have no effect or no meaning.

    Raises:
        ValueError: naming the option, its value and what is accepted.
    """
    if not stress:
        for name, value in (("rows", rows), ("least", least)):
            if value not in ((), None):
                raise ValueError(f"--{name} is {value}; accepted with --stress")
        return
    if least is not None and not 0 <= least <= 1:  # true for NaN
        raise ValueError(f"--least is {least}; accepted: 0 to 1")
    from e2efly.validation.stress import check_rows

    check_rows(rows)


def report_stress(found: "Report", console: Console, json: Path | None, plot: Path, least: float | None) -> int:
    """Print a table of each kind of rows; write the report and the plot.

    Args:
        found: the results of the policy in each row.
        console: where to print.
        json: the file for the report. None: no report is written.
        plot: the file for the plot.
        least: the success rate that each row must reach. None: no requirement.

    Returns:
        0, or 1 when a row succeeds less often than `least`.
    """
    from e2efly.viewing.stress_plot import plot_stress

    for note in found.candidate.notes:
        console.print(note, style="dim")
    for told, block in ((TRAINED, found.trained), (UNTRAINED, found.untrained)):
        if block.flown:
            console.print(told, style="bold")
            console.print(_table(block))
    for row, lack in found.left_out.items():
        console.print(f"Left out: {row}; {found.plant} cannot change {lack}", style="dim")
    if json:
        write_json(json, found.as_json())
        console.print(f"Report: {json}")
    plot.parent.mkdir(parents=True, exist_ok=True)
    plot_stress(found, plot)
    console.print(f"Plot: {plot}")
    worst = found.worst
    if least is None or found.success[worst] >= least:
        return 0
    console.print(f"{worst}: {found.success[worst]:.1%} success", style="bold red", end=", ")
    console.print(f"{least:.1%} is asked for")
    return 1


def _table(found: "Report") -> Table:
    from e2efly.environment.episodes import summary

    count = next(len(e.success) for criteria in found.flown.values() for e in criteria.values())
    table = headed(f"of {count} starts", "success", "95 % interval", "final error", "time")
    for row, criteria in found.flown.items():
        for name, episodes in criteria.items():
            s = summary(episodes)
            table.add_row(
                row if len(criteria) == 1 else f"{row}: {name}",
                f"{100 * s['success']:.1f} %",
                "{:.1f} to {:.1f} %".format(*(100 * bound for bound in s["success_interval_95"])),
                f"{100 * s['final_error_m']:.2f} cm",
                seconds(s["seconds_of_success"]),
            )
    return table
