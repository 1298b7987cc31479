"""`e2efly compare`: runs side by side."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from e2efly.terminal import Terminal, console_table


@dataclass(frozen=True)
class Compare:
    """Compare runs side by side: the options that differ, when each run reached its criterion, and its final success.

    Write a table and a plot.
    """

    runs: tyro.conf.Positional[Annotated[tuple[Path, ...], tyro.conf.arg(metavar="RUN [RUN ...]")]]
    """Run directories."""
    out: Path = Path("runs") / "compare.png"
    """The file for the plot."""
    json: Path | None = None
    """Also write the table to this file."""


def run(options: Compare) -> int:
    """Print the table and draw the plot.

    Raises:
        ValueError: when a folder holds no run, or a run of another version.
        OSError: when a file cannot be written.
    """
    from e2efly.learn.comparison import Compared, table
    from e2efly.storage import write_json
    from e2efly.view.comparison import plot_runs

    found = [Compared.of(path) for path in options.runs]
    rows, console = table(found), Terminal()
    console.print(console_table(rows))
    options.out.parent.mkdir(parents=True, exist_ok=True)
    plot_runs(found, options.out)
    console.print(f"Plot: {options.out}")
    if options.json:
        write_json(options.json, {"runs": rows})
    return 0
