"""What the checks of `e2efly identify` and `align` say to logs whose frames, units and clocks are wrong.

    python benchmarks/log_checks.py --logs gap_0000.csv=vis_r track.mcap=vis_r nanobench/B7_oval_fast_rep2.csv=crazyflie
        [--clean zoo_logs=vis_r nanobench=crazyflie arplab=crazyflie]

Each corruption of `tests.alignment.corruptions` is applied to each of `--logs`, and what the user is told is printed.
It is `named` if this names the right cause or remedy, or says that it was corrected, `told` if the log is refused
or changed for another reason, `unseen` if the notes say that an axis of such a stream moves too little to be checked,
and `passed` if nothing is said. All logs and folders of `--clean` are checked as they
are: none may be refused. The part behind `=` is the vehicle. Columns of files in a folder `nanobench` are those of
`benchmarks/real_logs.py`, which says where these logs are from.
"""

import re
from collections.abc import Iterator
from pathlib import Path

from common import arguments, table, write
from real_logs import COLUMNS
from tests.alignment.corruptions import CORRUPTIONS

from e2efly.alignment.checks import checked
from e2efly.logs.csv_file import column_map
from e2efly.logs.readers import LogReading, is_log, read_flights
from e2efly.logs.recording import Record
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle


def flights(asked: str) -> Iterator[tuple[str, Record, Vehicle]]:
    """The flights of a log, or of all logs below a folder, from PATH=VEHICLE, each with a name for people."""
    path, _, name = asked.partition("=")
    vehicle = load_vehicle(name or "vis_r")
    root = Path(path)
    files = sorted(p for p in root.rglob("*") if is_log(p)) if root.is_dir() and not is_log(root) else [root]
    for file in files:
        reading = LogReading(column_map(COLUMNS)) if file.parent.name == "nanobench" else None
        for record in read_flights(file, reading):
            yield str(file.relative_to(root.parent)), record, vehicle


def told(record: Record, vehicle: Vehicle, known: tuple[str, ...] = ()) -> tuple[bool, str]:
    """Whether a log is refused, and what the user is told: the error, or the notes that are not known."""
    try:
        (found,) = checked([record], vehicle)
    except ValueError as error:
        return True, str(error).removeprefix(f"{record.path}: ")
    return False, "; ".join(note for note in found.notes if note not in known)


def main() -> None:
    """Corrupt and check, print what is said, write JSON."""
    options = arguments(__doc__ or "", logs=[""], clean=[""])
    rows, lines, clean = [], [], []
    for name, record, vehicle in (found for asked in options.logs if asked for found in flights(asked)):
        (right,) = checked([record], vehicle)
        for corruption in CORRUPTIONS:
            if not record.has(*corruption.streams):
                continue
            refused, said = told(corruption.of(record, vehicle), vehicle, right.notes)
            how = "named" if re.search(corruption.told, said) else "told" if said else "passed"
            unseen = [note for note in right.notes if "be checked against" in note]
            if how == "passed" and any(stream in note for stream in corruption.streams for note in unseen):
                how = "unseen"
            lines.append({
                "log": name, "corruption": corruption.name, "outcome": how, "refused": refused, "line": said,
            })  # fmt: skip
            print(f"{name}, {corruption.name}: {how}\n    {'refused: ' if refused else ''}{said}", flush=True)
    for name, record, vehicle in (found for asked in options.clean if asked for found in flights(asked)):
        refused, said = told(record, vehicle, record.notes)
        clean.append({"log": name, "refused": refused, "line": said})
        print(f"{name}, as it is: {'REFUSED ' if refused else ''}{said}", flush=True)
    names = list(dict.fromkeys(line["log"] for line in lines))
    for corruption in CORRUPTIONS:
        outcomes = {line["log"]: line["outcome"] for line in lines if line["corruption"] == corruption.name}
        rows.append({"corruption": corruption.name} | {name: outcomes.get(name, "has none") for name in names})
    print(table(rows))
    print(f"{sum(c['refused'] for c in clean)} of {len(clean)} clean logs refused")
    write("log_checks", options.json, {"table": rows, "lines": lines, "clean": clean})


if __name__ == "__main__":
    main()
