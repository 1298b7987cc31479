"""Faults of the bridge's own process: killed, stopped, its disk full, while it flies the real firmware in real time.

python benchmarks/process_faults.py [--times 5] [--policy policy.onnx] [--json FILE]

Let the machine be quiet. `--policy` is a hover policy; left out, one is trained. Exit status 1 when any ends otherwise
than documented.
"""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from common import arguments
from fault_table import run
from tests.faults.process_faults import FAULTS, strike


def real(policy: Path, folder: Path, seed: int) -> list[dict[str, Any]]:
    """Every fault once, in real time."""
    rows: list[dict[str, Any]] = []
    for fault in FAULTS:
        try:
            outcome = asdict(strike(fault, policy, folder, seed))
            if outcome["reaction"] > outcome["allowed"]:
                late = f"reacted after {outcome['reaction']:.3f} s; allowed: {outcome['allowed']:.3f}"
                outcome["problems"] = [*outcome["problems"], late]
        except RuntimeError as error:
            outcome = {"problems": [str(error)]}
        rows.append({"seed": seed, **outcome, "fault": f"bridge: {fault}"})
        print(seed, fault, outcome["problems"] or "ok", flush=True)
    return rows


def main() -> None:
    """Fly, print a table, write JSON."""
    run("process_faults", arguments(__doc__ or "", times=5, policy=None), real)


if __name__ == "__main__":
    main()
