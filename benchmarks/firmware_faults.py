"""Faults injected into flights through the real Betaflight firmware, each several times with another seed.

python benchmarks/firmware_faults.py [--times 5] [--only TEXT ...] [--policy policy.onnx] [--json FILE]

`--policy` is a hover policy; left out, one is trained (some 10 s). Faults of the bridge's process fly in real time: let
the machine be quiet. Exit status 1 when any ends otherwise than documented.
"""

import math
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from common import arguments, table, write

from e2efly.deploy.goal_options import GoalOptions, goal_for
from e2efly.deploy.policy import load_policy
from e2efly.validate import firmware, process_faults
from e2efly.validate.fault_run import strike
from e2efly.validate.faults import FAULTS
from e2efly.validate.rig import Rig
from e2efly.validate.stage import LATENCY_S, TARGET, Stage
from e2efly.vehicles import load_vehicle


def train(folder: Path) -> Path:
    """A hover policy of the preset."""
    command = [sys.executable, "-m", "e2efly", "train", "hover", "--out", str(folder), "--no-plots", "--device", "cpu"]
    subprocess.run(command, env=os.environ, stdout=subprocess.DEVNULL, check=True)
    return folder / "policy.onnx"


def virtual(policy_file: Path, folder: Path, seed: int, only: list[str]) -> list[dict[str, Any]]:
    """Every fault once, in virtual time; a rig that a fault has left unfit is replaced."""
    policy, vehicle = load_policy(policy_file), load_vehicle("vis_r")
    goal = goal_for(policy.contract, GoalOptions(target=TARGET), vehicle)
    left = [fault for fault in FAULTS if not only or any(text in fault.name for text in only)]
    rows: list[dict[str, Any]] = []
    while left:
        with Rig(
            firmware.build(), folder / f"firmware-{seed}-{len(left)}", vehicle, latency=LATENCY_S, seed=seed
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
                if outcome["problems"]:
                    break
            stage.close()
    return rows


def real(policy: Path, folder: Path, seed: int, only: list[str]) -> list[dict[str, Any]]:
    """Every fault of the bridge's process once, in real time."""
    rows: list[dict[str, Any]] = []
    for fault in process_faults.FAULTS:
        if only and not any(text in f"bridge: {fault}" for text in only):
            continue
        try:
            outcome = asdict(process_faults.strike(fault, policy, folder, seed))
        except RuntimeError as error:
            outcome = {"problems": [str(error)]}
        rows.append({"seed": seed, **outcome, "fault": f"bridge: {fault}"})
        print(seed, fault, outcome["problems"] or "ok", flush=True)
    return rows


def summary(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """One line a fault."""
    lines = []
    for name in dict.fromkeys(row["fault"] for row in rows):
        mine = [row for row in rows if row["fault"] == name]

        def worst(key: str, rows: list[dict[str, Any]] = mine) -> float:
            known = [row[key] for row in rows if math.isfinite(row.get(key, math.nan))]
            return max(known, default=math.nan)

        def shown(value: float, digits: int) -> str:
            return "" if math.isnan(value) else f"{value:.{digits}f}"

        lines.append(
            {
                "fault": name,
                "as documented": f"{sum(not row['problems'] for row in mine)} of {len(mine)}",
                "time to react, s": shown(worst("reaction"), 3),
                "allowed, s": shown(worst("allowed"), 3),
                "touch, m/s": shown(worst("touch_speed"), 2),
                "largest tilt, rad": shown(worst("largest_tilt"), 2),
            }
        )
    return lines


def main() -> None:
    """Fly, print a table, write JSON."""
    options = arguments(__doc__ or "", times=5, only=[""], policy=None)
    only = [text for text in options.only if text]
    began = time.perf_counter()
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        policy = Path(options.policy) if options.policy else train(folder / "hover")
        for seed in range(options.times):
            rows += virtual(policy, folder, seed, only)
            rows += real(policy, folder, seed, only)
    lines = summary(rows)
    write("firmware_faults", options.json, {"table": lines, "faults": rows, "took_s": time.perf_counter() - began})
    print(table(lines))
    sys.exit(any(row["problems"] for row in rows))


if __name__ == "__main__":
    main()
