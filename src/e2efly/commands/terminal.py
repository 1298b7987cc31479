"""What the commands write to."""

import signal
import threading

from rich.console import Console

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
