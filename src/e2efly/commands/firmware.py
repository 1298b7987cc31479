"""`e2efly firmware`."""

import time
from pathlib import Path

from e2efly.commands.terminal import Terminal
from e2efly.validate import firmware


def firmware_command(archive: Path | None) -> int:
    """Build the real Betaflight firmware for this machine, once, and say where it lies.

    Raises:
        OSError: when it cannot be fetched or built.
        ValueError: when the archive is not the known one.
    """
    console = Terminal()
    if found := firmware.built():
        console.print(f"Built before: {found.program}")
        return 0
    began = time.monotonic()
    with console.status(f"fetching and building {firmware.PACKAGE} {firmware.VERSION} (a minute or two, once)"):
        found = firmware.build(archive)
    console.print(f"Built in {time.monotonic() - began:.0f} s: {found.program}")
    return 0
