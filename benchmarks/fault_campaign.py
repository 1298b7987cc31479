"""Pairs and triples of faults by chance, injected into flights through the real firmware; virtual time.

python benchmarks/fault_campaign.py [--count 240] [--first 0] [--only SEED ... | --cases | --publish] [--processes 2]
    [--keep FOLDER]

Each seed is one flight, which is always the same: `--only` flies some again and tells them in full. `--cases` flies the
named ones instead. Every flight is kept in `--keep` as it ends: a campaign that was killed goes on where it was, as
long as nothing that flies has changed. Exit status 1 when a rule is broken that the bridge could have kept.

Seeds below 10,000 are for work. `--publish` flies the next block of 500 seeds from there on, and it alone writes
figures: no change can have been tuned on a block that no other state of the package has flown.
"""

import argparse
import hashlib
import json
import multiprocessing
import os
import sys
import tempfile
import time
import traceback
from dataclasses import asdict
from pathlib import Path
from typing import Any

from common import RESULTS, table, today, write, write_rows
from tests.faults import blocks
from tests.faults.campaign import Scenario, fly
from tests.faults.scenarios import CASES, drawn

import e2efly
from e2efly.config.storage import read_json
from e2efly.policy.loader import load_policy
from e2efly.simulation.device import cores
from e2efly.validation import firmware_program
from e2efly.vehicles.loading import load_vehicle

KEPT = Path(tempfile.gettempdir()) / "e2efly-fault-campaign"


def flown(scenario: Scenario) -> dict[str, Any]:
    """One flight, and how long it took; one that cannot be brought to its faults says why."""
    began = time.perf_counter()
    policy, vehicle = load_policy("hover"), load_vehicle("vis_r")
    with tempfile.TemporaryDirectory() as folder:
        try:
            outcome = asdict(fly(scenario, policy, vehicle, firmware_program.chosen(), Path(folder)))
        except Exception:  # whatever it is, it is a finding, and the campaign goes on
            outcome = {"problem": traceback.format_exc()}
    known = {key: None if value != value else value for key, value in outcome.items()}  # JSON has no NaN
    return {"scenario": asdict(scenario), **known, "took_s": time.perf_counter() - began}


def kept_flight(task: tuple[Scenario, Path]) -> dict[str, Any]:
    """The flight, from its file where there is one."""
    scenario, folder = task
    digest = hashlib.sha256(json.dumps(asdict(scenario)).encode()).hexdigest()[:16]
    file = folder / f"{digest}.json"
    if not file.exists():
        draft = file.with_suffix(f".{os.getpid()}")
        draft.write_text(json.dumps(flown(scenario)))
        draft.replace(file)
    row = json.loads(file.read_text())
    print(told(row), flush=True)
    return row


def told(row: dict[str, Any]) -> str:
    """One line a flight."""
    scenario = row["scenario"]
    if "problem" in row:
        return f"{scenario['name']}: could not be flown: {row['problem'].splitlines()[-1]}"
    broken = [f"{v['rule']} {v['value']:.2f}" + (" (beyond)" if v["beyond"] else "") for v in row["violations"]]
    since = f" from {row['changes'][-1][0]:.2f} s on" if row["changes"] else ""
    touch = "" if row["touch_speed"] is None else f"touch {row['touch_speed']:.2f} m/s, tilt {row['touch_tilt']:.2f}, "
    return (
        f"{scenario['name']} [{scenario['mode']}, {scenario['height']:g} m]: off {row['off_height']:.2f} m, "
        f"climb {row['climb']:.2f} m, {touch}armed {row['armed_s']:.1f} s, drift {row['drift']:.1f} m; "
        f"{'; '.join(broken) or 'ok'}; "
        f"{row['mode']}{since}: {', '.join(row['reasons'])}"
    )


def blamed(row: dict[str, Any]) -> bool:
    """Whether a rule was broken that the bridge could have kept."""
    return "problem" in row or any(not v["beyond"] for v in row["violations"])


def excused(row: dict[str, Any]) -> bool:
    """Whether all that was broken is beyond the bridge."""
    return not blamed(row) and bool(row["violations"])


def summary(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """One line a mode, and one for all."""
    lines = []
    for mode in [*dict.fromkeys(row["scenario"]["mode"] for row in rows), "all"]:
        mine = [row for row in rows if mode in ("all", row["scenario"]["mode"])]
        fair = [row for row in mine if "problem" not in row and not excused(row)]

        def worst(key: str, rows: list[dict[str, Any]] = fair) -> str:
            known = [row[key] for row in rows if row[key] is not None]
            return f"{max(known):.2f}" if known else ""

        lines.append(
            {
                "struck in": mode,
                "flights": len(mine),
                "motors off at, m": worst("off_height"),
                "climb, m": worst("climb"),
                "touch, m/s": worst("touch_speed"),
                "armed on the ground": sum(
                    any(v["rule"] == "armed on the ground" for v in row["violations"]) for row in fair
                ),
                "rules broken": sum(map(blamed, mine)),
                "beyond the bridge": sum(map(excused, mine)),
            }
        )
    return lines


def state_of_package() -> str:
    """A digest of all that flies and judges: what was flown with other files is not taken for this."""
    package, built = Path(e2efly.__file__).parent, firmware_program.chosen()
    folders = [file for folder in (package, Path(blocks.__file__).parent) for file in folder.rglob("*")]
    parts = sorted(file for file in folders if file.is_file() and "__pycache__" not in file.parts)
    digest = hashlib.sha256(str(built.release).encode())
    for file in (*parts, Path(__file__), built.program, built.shim):
        digest.update(f"{file.name} {file.stat().st_size} ".encode() + file.read_bytes())
    return digest.hexdigest()[:12]


def main() -> None:
    """Fly, print a table, write JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=240, help="flights")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    others = parser.add_mutually_exclusive_group()
    others.add_argument("--only", type=int, nargs="+", help="these seeds alone, each in full")
    others.add_argument("--cases", nargs="?", const="", help="the named flights alone, or those with this text")
    others.add_argument("--publish", action="store_true", help="fly the next block of seeds, and write the figures")
    parser.add_argument("--processes", type=int, choices=range(1, cores() + 1), default=cores(), metavar="N")
    parser.add_argument("--keep", type=Path, default=KEPT, help="where finished flights are kept")
    options = parser.parse_args()
    results, package = read_json(RESULTS / "fault_campaign.json"), state_of_package()
    used = blocks.used_in(results)
    seeds = options.only or range(options.first, options.first + options.count)
    if options.publish:
        used, block = blocks.next_of(used, package, today())
        seeds = block.seeds
        write_rows(RESULTS / "fault_campaign.json", results | blocks.told(used))  # from the first flight on it is known
    elif problem := blocks.problem_of(seeds, used):
        parser.error(problem)
    if options.only:
        rows = [flown(drawn(seed)) for seed in options.only]
        print(json.dumps(rows, indent=1))
        sys.exit(any(map(blamed, rows)))
    if options.cases is not None:
        scenarios = [case for case in CASES if options.cases in case.name]
    else:
        scenarios = [drawn(seed) for seed in seeds]
    folder = options.keep / package
    folder.mkdir(parents=True, exist_ok=True)
    with multiprocessing.get_context("spawn").Pool(options.processes) as pool:
        rows = list(pool.imap(kept_flight, [(scenario, folder) for scenario in scenarios]))
    lines = summary(rows)
    print(table(lines))
    for title, some in (("Rules broken", blamed), ("Beyond the bridge", excused)):
        print(f"\n{title}:", *(told(row) for row in rows if some(row)), sep="\n")
    took = [row["took_s"] for row in rows]
    print(f"\n{sum(took) / len(took):.1f} s a flight")
    if options.publish:
        flights = [{"seed": row["scenario"]["seed"], "flight": told(row)} for row in rows]
        write("fault_campaign", None, {**blocks.told(used), "table": lines, "flights": flights, "took_s": sum(took)})
    sys.exit(any(map(blamed, rows)))


if __name__ == "__main__":
    main()
