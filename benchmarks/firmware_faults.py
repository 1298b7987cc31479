"""Faults injected into flights through the real Betaflight firmware, each several times with another seed.

python benchmarks/firmware_faults.py [--times 5] [--only TEXT ...] [--policy policy.onnx] [--json FILE]

`--policy` is a hover policy; left out, one is trained (some 10 s). Time is virtual: the figures do not depend on the
machine. Exit status 1 when any ends otherwise than documented.
"""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from common import arguments
from fault_table import run
from tests.faults.fault_run import strike
from tests.faults.faults import FAULTS, End
from tests.faults.stage import LATENCY_S, TARGET, Stage

from e2efly.policy.loader import load_policy
from e2efly.tasks.hover.goal import HoverRoute
from e2efly.tasks.route import course_for
from e2efly.validation import firmware_program
from e2efly.validation.rig import Rig
from e2efly.vehicles.loading import load_vehicle


def virtual(policy_file: Path, folder: Path, seed: int, only: list[str]) -> list[dict[str, Any]]:
    """Every fault once, in virtual time; a rig that a fault has left unfit is replaced."""
    policy, vehicle = load_policy(policy_file), load_vehicle("vis_r")
    goal = course_for(policy.contract, vehicle, HoverRoute(target=TARGET))
    left = [fault for fault in FAULTS if not only or any(text in fault.name for text in only)]
    rows: list[dict[str, Any]] = []
    while left:
        with Rig(
            firmware_program.chosen(), folder / f"firmware-{seed}-{len(left)}", vehicle, latency=LATENCY_S, seed=seed
        ) as rig:
            stage = Stage(rig, policy, goal, seed + len(left))
            stage.fly(0.3)
            while left:
                fault = left.pop(0)
                try:
                    outcome = asdict(strike(stage, fault, folder / f"{seed}-{len(left)}.mcap"))
                except RuntimeError as error:
                    outcome = {"fault": fault.name, "end": fault.end, "problems": [str(error)]}
                rows.append({"seed": seed, **outcome})
                print(seed, fault.name, outcome["problems"] or "ok", flush=True)
                if outcome["problems"] or fault.end is End.FALLS:  # its poses have jumped
                    break
            stage.close()
    return rows


def main() -> None:
    """Fly, print a table, write JSON."""
    options = arguments(__doc__ or "", times=5, only=[""], policy=None)
    only = [text for text in options.only if text]
    run("firmware_faults", options, lambda policy, folder, seed: virtual(policy, folder, seed, only))


if __name__ == "__main__":
    main()
