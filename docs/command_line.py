"""Write docs/reference/command-line.md, the help of every command as it prints it: `make docs`."""

import contextlib
import io
import os
from pathlib import Path

from e2efly.commands import cli

PAGE = Path(__file__).parent / "reference" / "command-line.md"
ABOUT = """# Command line

`e2efly COMMAND --help` is one screen: the texts below. `e2efly COMMAND --help-all` lists every option in full, with its
default. Options of tasks, environments and algorithms are those of the [configuration](configuration.md).
"""


def helped(*arguments: str) -> str:
    """What `e2efly ARGUMENTS --help` prints."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.suppress(SystemExit):
        cli.run([*arguments, "--help"])
    return said.getvalue().rstrip()


def page() -> str:
    """The page."""
    os.environ["COLUMNS"] = "110"
    parts = [f"## {command}\n\n```text\n{helped(command)}\n```\n" for command in cli.COMMANDS]
    return "\n".join([ABOUT, *parts])


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
