"""Output of commands: plain text, tables, and the progress of a run."""

import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from e2efly.flight.process import UNREAD, printable, write_nowhere


class Terminal(Console):
    """A console that prints text unchanged, although paths and messages may contain rich markup or emoji codes.

    Escape sequences in text, which could change the terminal, are shown and not sent. Lines are not broken in a narrow
    terminal, so that commands and paths in them can be copied.
    """

    def __init__(self, *, stderr: bool = False, quiet: bool = False) -> None:
        super().__init__(stderr=stderr, quiet=quiet, markup=False, emoji=False, highlight=False, soft_wrap=True)
        if not self.file.isatty():  # also where FORCE_COLOR makes rich believe that it is a terminal
            self.width = WIDE

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Pieces of text, with their styles, and the control codes of rich itself. No cell of a table is cut."""
        for column in renderable.columns if isinstance(renderable, Table) else ():
            column.overflow = "fold"
        for segment in super().render(renderable, options):
            lines = segment.text.split("\n")
            yield segment if segment.control else Segment("\n".join(map(printable, lines)), segment.style)

    def on_broken_pipe(self) -> None:
        """End like a process that receives SIGPIPE, if the reader, such as `head`, has stopped.

        Only in the main thread.
        """
        self.quiet = True
        write_nowhere()
        if threading.current_thread() is threading.main_thread():
            raise SystemExit(UNREAD)


WIDE = 1000
"""Width of what is no terminal in columns: tables in a pipe or a file are whole."""
NARROW = 150
"""Width of a terminal in columns below which the bar is short and shows less. The time left must stay visible."""
LINES_S = 5.0
"""Interval between two lines if the output is not a terminal, s."""


class _TimeLeft(TimeRemainingColumn):
    """The time left. Until something has flown, the time that has passed: compilation says nothing about the rest."""

    def render(self, task: Task) -> Text:
        if not task.completed:
            return TimeElapsedColumn().render(task)
        return super().render(task).append(" left")


class TerminalProgress:
    """A progress bar with the rate, the time left and the success of the last and the best evaluation.

    If the output is not a terminal, it prints lines instead.
    """

    def __init__(self, console: Console, title: str) -> None:
        self._console, self._title, self._narrow = console, title, console.is_terminal and console.width < NARROW
        self._bar = Progress(
            SpinnerColumn("dots" if console.encoding.startswith("utf") else "line"),
            TextColumn("{task.description}", "bold", markup=False),
            BarColumn(bar_width=4 if self._narrow else 24),
            TextColumn("{task.fields[figures]}", markup=False),
            *(() if self._narrow else (TimeElapsedColumn(),)),
            _TimeLeft(),
            console=console,
            transient=False,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task(title, total=None, figures="")
        self._begun: tuple[float, int] | None = None
        """When the first progress was told, s, and how many steps were done: what came before was compilation."""
        self._told = -LINES_S
        self.end: tuple[Any, ...] = ()
        """The arguments of `ended`."""

    def __enter__(self) -> "TerminalProgress":
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()

    def compiling(self) -> None:
        """Show that programs are being compiled and nothing flies yet."""
        self._say("compiling" if self._narrow else "compiling (seconds; cached for the next run)")

    def progress(self, steps: int, total: int, rate: float, success: float, best: float, flown: str) -> None:
        """Move the bar, or print a line."""
        figures = f"{steps / 1e6:.2f}M steps  {rate / 1e3:.0f}k/s  success {success:.1%}, best {best:.1%} ({flown})"
        if self._narrow:
            figures = f"{success:.0%} {flown}"
        self._bar.update(self._task, completed=steps, total=total, figures=figures)
        now = time.monotonic()
        self._begun = began, done = self._begun or (now, steps)
        if not self._console.is_terminal and (now - self._told >= LINES_S or steps >= total):
            left = f"  {(now - began) * (total - steps) / (steps - done):.0f} s left" if steps > done else ""
            self._console.print(f"{self._title}: {figures}{left}")
            self._told = now

    def judging(self, starts: int) -> None:
        """Show that the training is over, and that the policy is flown from starts that it never saw."""
        self._say(f"flying {starts} starts" if self._narrow else f"flying {starts} starts that it never saw")

    def ended(self, *end: Any) -> None:
        """Keep the final results of the run, for the plots."""
        self.end = end

    def _say(self, text: str) -> None:
        self._bar.update(self._task, figures=text)
        if not self._console.is_terminal:
            self._console.print(f"{self._title}: {text}")


@contextmanager
def doing(console: Console, what: str) -> Iterator[None]:
    """Show what is being done: a line that moves, or if the output is not a terminal, one line."""
    if not console.is_terminal:
        console.print(what)
    with console.status(what):
        yield


def counted(console: Console, title: str, items: Iterable[Any], total: int) -> Iterator[Any]:
    """The items of which there are `total`, with a bar and the time left, or lines if the output is not a terminal."""
    columns = TextColumn("{task.description}", markup=False), BarColumn(24), MofNCompleteColumn(), _TimeLeft()
    began, told = 0.0, time.monotonic()
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(title, total=total)
        for done, item in enumerate(items, 1):
            yield item
            now = time.monotonic()
            began = began or now  # the first one was compiled, too
            bar.update(task, completed=done)
            if not console.is_terminal and done > 1 and (now - told >= LINES_S or done == total):
                console.print(f"{title}: {done} of {total}, {(now - began) * (total - done) / (done - 1):.0f} s left")
                told = now


def headed(*headings: str) -> Table:
    """An empty table for `rich` with these headings, in the style of all tables."""
    return Table(*headings, box=None, header_style="bold", pad_edge=False)


def console_table(rows: list[dict[str, Any]]) -> Table:
    """A table for `rich`. The keys of the first row are the headings."""
    table = headed(*rows[0])
    for row in rows:
        table.add_row(*map(str, row.values()))
    return table


def markdown(rows: list[dict[str, Any]]) -> list[str]:
    """Lines of a markdown table. The keys of the first row are the headings."""
    heads = list(rows[0])
    return [
        "| " + " | ".join(heads) + " |",
        "| " + " | ".join("---" for _ in heads) + " |",
        *("| " + " | ".join(str(row[head]) for head in heads) + " |" for row in rows),
    ]


def seconds(value: float | None) -> str:
    """A time for a table. None: there is no time."""
    return "none" if value is None else f"{value:.2f} s"
