"""A run's progress in the terminal."""

from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn


class TerminalProgress:
    """A bar with the rate, the time left and the success of the last and the best evaluation."""

    def __init__(self, console: Console, title: str) -> None:
        self._bar = Progress(
            SpinnerColumn("dots" if console.encoding.startswith("utf") else "line"),
            TextColumn("{task.description}", "bold", markup=False),
            BarColumn(bar_width=24),
            TextColumn("{task.fields[figures]}", markup=False),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=console,
            transient=False,
        )
        self._task = self._bar.add_task(title, total=None, figures="")

    def __enter__(self) -> "TerminalProgress":
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()

    def compiling(self) -> None:
        """Show that nothing is flying yet."""
        self._bar.update(self._task, figures="compiling (seconds; cached for the next run)")

    def progress(self, steps: int, total: int, rate: float, success: float, best: float, stage: str) -> None:
        """Move the bar."""
        figures = f"{steps / 1e6:.2f}M steps  {rate / 1e3:.0f}k/s  success {success:.1%}  best {best:.1%}"
        figures += f"  {stage}" if stage else ""
        self._bar.update(self._task, completed=steps, total=total, figures=figures)
