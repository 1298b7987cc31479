"""Whole flights and faults through the real ArduCopter, over `--link mavlink:`, in virtual time.

    python benchmarks/arducopter.py --arducopter PATH [--flights 5] [--faults 5] [--only NAME ...] [--seed 7100000]
        [--json FILE]

PATH is ArduPilot's SITL program, which is not part of this repository; E2EFLY_ARDUCOPTER may name it, too. Our rigid
body stands behind its JSON interface. Policies, faults and verdicts are those of `mavlink.py`, where a peer of ours
stands in for the firmware. The version is what the firmware tells. `--only` flies some of the flights (`race`) and
faults (`"the poses end"`); the rows of others stay in the file.
"""

import dataclasses
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mavlink
from link_flights import Place
from tests.validation.copter_bench import CopterBench
from tests.validation.link_faults import Fault

from e2efly.flight.mavlink.mavlink import Mavlink
from e2efly.flight.settings import FlightSettings
from e2efly.validation.copter_rig import CopterRig
from e2efly.validation.copter_sitl import copter_program

BENCH = dataclasses.replace(mavlink.BENCH, name="arducopter", seed=7100000)


@contextmanager
def opened(
    program: Path, latency: float, seed: int, place: Place | None = None, fault: Fault | None = None
) -> Iterator[CopterRig]:
    """ArduCopter on a rig. A fault needs a wire that can be struck."""
    kind = CopterRig if fault is None else CopterBench
    with tempfile.TemporaryDirectory() as folder:
        rig = kind(program, Path(folder), BENCH.vehicle, latency=latency, seed=seed)
        if place is not None:
            rig.state = place(rig.world)
        with rig:
            yield rig


def check(program: Path) -> tuple[str, list[dict[str, Any]]]:
    """Its version, and the rows of `fly --check`."""
    with opened(program, 0.0, 0) as rig:
        autopilot: Mavlink = rig.autopilot(FlightSettings())
        rows = autopilot.check(BENCH.vehicle, FlightSettings(), None)
        version = autopilot.versions["firmware"]
        autopilot.close()
    return version, [{"setting": row.setting, "is": row.value, "good": row.good} for row in rows]


def main() -> None:
    """Read its settings, and fly."""
    asked = BENCH.options(__doc__ or "", flights=5, faults=5, arducopter="")
    program = copter_program(Path(asked.arducopter) if asked.arducopter else None)
    version, rows = check(program)
    BENCH.measure(asked, {"ArduCopter": lambda *what: opened(program, *what)}, firmware=version, check=rows)


if __name__ == "__main__":
    main()
