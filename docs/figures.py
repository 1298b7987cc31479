"""Make the pictures of the README and the tables of docs/benchmarks.md from benchmarks/results: `make docs`."""

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

DOCS = Path(__file__).parent
RESULTS = DOCS.parent / "benchmarks" / "results"
TITLES = {
    "rates": "Rates",
    "time_to_criterion": "Time to the criterion, from process start",
    "success": "Success over 1000 unseen starts, full presets",
    "sim_to_sim": "The same policies in MuJoCo, 200 starts",
    "firmware_flights": "Whole flights through real Betaflight firmware, nobody helping",
    "firmware_faults": "Faults injected into flights of the real firmware",
    "process_faults": "The bridge's process killed, stopped, its disk full, in flight",
    "bridge_loop": "The bridge's control loop, flying the firmware in real time",
    "runtime_speed": "The runtime on a companion computer",
    "msp_fuzz": "MSP codec under fuzzing",
}


def markdown(rows: list[dict[str, str]]) -> list[str]:
    """A markdown table."""
    heads = list(rows[0])
    return [
        "| " + " | ".join(heads) + " |",
        "| " + " | ".join("---" for _ in heads) + " |",
        *("| " + " | ".join(str(row[h]) for h in heads) + " |" for row in rows),
    ]


def main() -> None:
    """Write docs/benchmarks.md; with `--pictures` train the racer and copy its plots."""
    source = "Written by `make docs` from `benchmarks/results/*.json`; measured by the scripts in `benchmarks/`."
    lines = ["# Benchmarks", "", source, ""]
    for name, title in TITLES.items():
        path = RESULTS / f"{name}.json"
        if path.exists():
            content = json.loads(path.read_text())
            m = content["machine"]
            about = f"`benchmarks/{name}.py`, {content['date']}, {m['cores']} cores of {m['cpu']}, JAX {m['jax']}."
            lines += [f"## {title}", "", about, "", *markdown(content["table"]), ""]
    (DOCS / "benchmarks.md").write_text("\n".join(lines))
    if "--pictures" in sys.argv:
        with tempfile.TemporaryDirectory() as folder:
            run = Path(folder) / "run"
            subprocess.run([sys.executable, "-m", "e2efly", "train", "race", "--out", str(run)], check=True)
            for name in ("flights_race", "learning", "time_race"):
                shutil.copy(run / "plots" / f"{name}.png", DOCS / f"{name}.png")


if __name__ == "__main__":
    main()
