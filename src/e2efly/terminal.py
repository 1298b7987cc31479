"""What commands print: text as it is, tables, and the progress of a run."""

import signal
import threading
import time
from types import TracebackType
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from e2efly.process import write_nowhere


class Terminal(Console):
    """A console that prints text as it is: paths and messages may hold what rich would take for markup or emojis.

    A line goes on where the terminal is too narrow, so that commands and paths in it can be copied.
    """

    def __init__(self, *, stderr: bool = False, quiet: bool = False) -> None:
        super().__init__(stderr=stderr, quiet=quiet, markup=False, emoji=False, highlight=False, soft_wrap=True)

    def on_broken_pipe(self) -> None:
        """End as SIGPIPE would when whoever reads, as `head`, has enough; but from no thread beside the main one."""
        self.quiet = True
        write_nowhere()
        if threading.current_thread() is threading.main_thread():
            raise SystemExit(128 + signal.SIGPIPE)


NARROW = 110
"""Columns of a terminal below which the bar is short and tells less: the time left must be seen."""
LINES_S = 5.0
"""Between two lines where the output is no terminal, s."""


class TerminalProgress:
    """A bar with the rate, the time left and the success of the last and the best evaluation; lines where the output is
    no terminal.
    """

    def __init__(self, console: Console, title: str) -> None:
        self._console, self._title, self._narrow = console, title, console.width < NARROW
        self._bar = Progress(
            SpinnerColumn("dots" if console.encoding.startswith("utf") else "line"),
            TextColumn("{task.description}", "bold", markup=False),
            BarColumn(bar_width=8 if self._narrow else 24),
            TextColumn("{task.fields[figures]}", markup=False),
            *(() if self._narrow else (TimeElapsedColumn(),)),
            TimeRemainingColumn(),
            TextColumn("left"),
            console=console,
            transient=False,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task(title, total=None, figures="")
        self._began, self._told = time.monotonic(), -LINES_S
        self.end: tuple[Any, ...] = ()
        """Of `ended`."""

    def __enter__(self) -> "TerminalProgress":
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()

    def compiling(self) -> None:
        """Show that nothing is flying yet."""
        self._say("compiling" if self._narrow else "compiling (seconds; cached for the next run)")

    def progress(self, steps: int, total: int, rate: float, success: float, best: float, stage: str) -> None:
        """Move the bar, or print a line."""
        figures = f"{steps / 1e6:.2f}M steps  {rate / 1e3:.0f}k/s  success {success:.1%}  best {best:.1%}"
        if self._narrow:
            figures = f"{steps / 1e6:.2f}M  success {success:.0%}"
        figures += f"  {stage}" if stage else ""
        self._bar.update(self._task, completed=steps, total=total, figures=figures)
        now = time.monotonic()
        if not self._console.is_terminal and (now - self._told >= LINES_S or steps >= total):
            left = (now - self._began) * (total - steps) / max(steps, 1)
            self._console.print(f"{self._title}: {figures}  {left:.0f} s left")
            self._told = now

    def judging(self, starts: int) -> None:
        """Show that the training is over, and the policy flown from starts that it never saw."""
        self._say(f"flying {starts} starts" if self._narrow else f"flying {starts} starts that it never saw")

    def ended(self, *end: Any) -> None:
        """Keep what the run has ended with, for the plots."""
        self.end = end

    def _say(self, text: str) -> None:
        self._bar.update(self._task, figures=text)
        if not self._console.is_terminal:
            self._console.print(f"{self._title}: {text}")


def console_table(rows: list[dict[str, Any]]) -> Table:
    """For `rich`: the first row's keys are the headings."""
    table = Table(box=None, header_style="bold", pad_edge=False)
    for heading in rows[0]:
        table.add_column(heading, no_wrap=True)
    for row in rows:
        table.add_row(*map(str, row.values()))
    return table


def markdown(rows: list[dict[str, Any]]) -> list[str]:
    """Lines of a markdown table: the first row's keys are the headings."""
    heads = list(rows[0])
    return [
        "| " + " | ".join(heads) + " |",
        "| " + " | ".join("---" for _ in heads) + " |",
        *("| " + " | ".join(str(row[head]) for head in heads) + " |" for row in rows),
    ]


def seconds(value: float | None) -> str:
    """A time for a table; None: of nothing."""
    return "none" if value is None else f"{value:.2f} s"
