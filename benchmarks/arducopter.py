"""Whole flights and faults through the real ArduCopter, over `--link mavlink:`, in virtual time.

    python benchmarks/arducopter.py --arducopter PATH [--only NAME ...] [--count 5] [--seed 7100000] [--json FILE]

PATH is ArduPilot's SITL program, which is not part of this repository; E2EFLY_ARDUCOPTER may name it, too. Our rigid
body stands behind its JSON interface. Policies, faults and verdicts are those of `mavlink.py`, where a peer of ours
stands in for the firmware. The version is what the firmware tells. Each row has its first seed. `--only` flies some of
the flights (`race`) and faults (`"the poses end"`); the rows of others stay in the file.
"""

import dataclasses
import tempfile
from collections.abc import Container, Iterator
from pathlib import Path
from typing import Any

from common import arguments, with_earlier, write
from mavlink import POLICIES, VEHICLE
from tests.validation.copter_bench import CopterBench
from tests.validation.link_faults import flown
from tests.validation.mavlink_faults import FAULTS

from e2efly.flight.mavlink.mavlink import Mavlink
from e2efly.flight.pilot.hovering import hover_controller
from e2efly.flight.settings import FlightSettings
from e2efly.policy.loader import load_policy
from e2efly.simulation.device import prepare
from e2efly.tasks.route import Route, route_of
from e2efly.validation.bridge_session import Session, rehearsal_settings
from e2efly.validation.copter_rig import CopterRig
from e2efly.validation.copter_sitl import copter_program
from e2efly.validation.rehearsal import LINK_S, parked, whole_course, whole_flight

SEED = 7100000


def flights(program: Path, count: int, seed: int, wanted: Container[str]) -> Iterator[dict[str, Any]]:
    """A row for each policy that is wanted."""
    for name, (policy_name, goal) in POLICIES.items():
        if name not in wanted:
            continue
        policy = load_policy(policy_name)
        usual: Route = route_of(policy.contract)()
        route = dataclasses.replace(usual, outside=True, **usual.whole, **goal) if goal else None
        course, good, told = whole_course(policy, VEHICLE, route), 0, []
        for i in range(count):
            with tempfile.TemporaryDirectory() as folder:
                rig = CopterRig(
                    program, Path(folder), VEHICLE, latency=max(policy.contract.latency_of(VEHICLE) - LINK_S, 0.0),
                    seed=seed + i,
                )  # fmt: skip
                rig.state = parked(rig.world, course, seed + i)
                with rig:
                    flight = whole_flight(rig, policy, course, seed + i, None, [], None)
            good += flight.complete and flight.success
            told.append(flight.told if flight.complete and flight.success else f"{flight.told}: {flight.reasons}")
        yield {
            "flight": name, "seed": seed, "ArduCopter": f"{good} of {count}", "the last": told[-1],
            "what failed": "; ".join(text for text in told if ": (" in text),
        }  # fmt: skip


def faults(program: Path, count: int, seed: int, wanted: Container[str]) -> Iterator[dict[str, Any]]:
    """A row for each fault that is wanted."""
    settings = dataclasses.replace(rehearsal_settings(1.2), battery_unknown=False)
    for fault in FAULTS:
        if fault.name not in wanted:
            continue
        ends = []
        for i in range(count):
            with (
                tempfile.TemporaryDirectory() as folder,
                CopterBench(program, Path(folder), VEHICLE, latency=0.02, seed=seed + i) as rig,
            ):
                session = Session(rig, settings, hover=hover_controller("geometric", VEHICLE, 0.03))
                session.take_off(1.0 + 0.2 * i)
                ends.append(flown(rig, session, fault))
                session.close()
        yield {
            "fault": fault.name, "seed": seed, "acts": "autopilot" if fault.autopilot_acts else "bridge",
            "ArduCopter": f"{sum(end.good for end in ends)} of {count}", "the last": ends[-1].told,
            "what failed": "; ".join(end.told for end in ends if not end.good),
        }  # fmt: skip


def check(program: Path) -> tuple[str, list[dict[str, Any]]]:
    """Its version, and the rows of `fly --check`."""
    with tempfile.TemporaryDirectory() as folder, CopterRig(program, Path(folder), VEHICLE) as rig:
        autopilot: Mavlink = rig.autopilot(FlightSettings())
        rows = autopilot.check(VEHICLE, FlightSettings(), None)
        version = autopilot.versions["firmware"]
        autopilot.close()
    return version, [{"setting": row.setting, "is": row.value, "good": row.good} for row in rows]


def main() -> None:
    """Fly, print each row, write the figures after each."""
    every = [*POLICIES, *(fault.name for fault in FAULTS)]
    args = arguments(__doc__ or "", arducopter="", only=every, count=5, seed=SEED)
    if unknown := set(args.only) - set(every):
        raise SystemExit(f"--only is {unknown}; accepted: {every}")
    program = copter_program(Path(args.arducopter) if args.arducopter else None)
    prepare("cpu")
    version, checked = check(program)
    flown = (program, args.count, args.seed, args.only)
    for part, key, rows in (("table", "flight", flights(*flown)), ("faults", "fault", faults(*flown))):
        other = "faults" if part == "table" else "table"
        for row in rows:
            print(row, flush=True)
            found = {part: with_earlier("arducopter", args.json, part, (key,), [row])}
            found[other] = with_earlier("arducopter", args.json, other, (), [])
            write("arducopter", args.json, {"firmware": version, "check": checked, **found})


if __name__ == "__main__":
    main()
