"""Readers of flight logs under fuzzing: damaged files of every format, and then the checks of what was read.

Each is read, or refused by a `ValueError` that names the file. Any other error, more than 5 s or more than 1 GB ends
the run.
"""

import contextlib
import random
import resource
import tempfile
from pathlib import Path

import common
from tests.logs.log_samples import TOKENS, bytes_of
from tests.mutations import Endured, mutated

from e2efly.alignment.checks import checked
from e2efly.logs.readers import read_flights
from e2efly.vehicles.loading import load_vehicle

MEMORY = 1.0
"""Largest memory of the process, GB."""


def main() -> None:
    """Fuzz, and write figures."""
    args = common.arguments(__doc__ or "", count=10_000, seed=0, only=[""])
    vehicle, rows, faults = load_vehicle("vis_r"), [], []

    def read(path: Path) -> None:
        records = read_flights(path)
        with contextlib.suppress(ValueError):
            checked(records, vehicle)

    with tempfile.TemporaryDirectory() as folder:
        samples = bytes_of(Path(folder) / "samples")
        for name, data in samples.items():
            if not any(word in name for word in args.only):
                continue
            rng, endured = random.Random(f"{args.seed} {name}"), Endured()
            for _ in range(args.count):
                endured.attempt(read, Path(folder) / "log", mutated(data, rng, list(samples.values()), TOKENS))
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
            faults += [f"{name}: {fault}" for fault in endured.faults]
            faults += [f"{name}: {memory:.2f} GB"] if memory > MEMORY else []
            row = {"format": name, "files": args.count, "read": endured.read, "refused": endured.refused}
            rows.append(row | {"slowest (s)": round(endured.slowest, 2), "memory (GB)": round(memory, 2)})
            print(rows[-1], *endured.faults[:10], sep="\n  ", flush=True)
    print(common.table(rows))
    if faults:
        raise SystemExit(f"{len(faults)} faults; seed {args.seed}:\n" + "\n".join(faults[:20]))
    common.write("log_fuzz", args.json, {"table": rows})


if __name__ == "__main__":
    main()
