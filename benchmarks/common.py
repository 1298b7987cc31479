"""What the benchmark scripts share: the machine, JSON files, markdown tables."""

import argparse
import json
import math
import os
import platform
import statistics
import sys
from collections.abc import Callable
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from e2efly.commands.terminal import markdown
from e2efly.commands.train import recorded
from e2efly.config import EnvConfig
from e2efly.config.storage import finite, write_atomically
from e2efly.runs.inputs import fingerprint
from e2efly.simulation.device import processor

sys.path.insert(0, str(Path(__file__).parents[1]))  # the fault laboratory is the tests'

RESULTS = Path(__file__).parent / "results"
"""Where the published figures are kept."""


def machine() -> dict[str, Any]:
    """What the figures were measured on."""
    model, avx512 = processor()
    packages = {name: metadata.version(name) for name in ("e2efly", "jax", "jaxlib", "numpy")}
    return {"cpu": model, "avx512": avx512, "cores": os.cpu_count(), "python": platform.python_version(), **packages}


def arguments(about: str, **extra: Any) -> argparse.Namespace:
    """The command line of a benchmark: `--json FILE` and what else it names."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--json", type=Path, default=None, help="where to write the figures")
    for name, default in extra.items():
        flag = "--" + name.replace("_", "-")
        if default is False:
            parser.add_argument(flag, action="store_true")
            continue
        many = isinstance(default, list)
        kind = type(default[0] if many and default else "" if many or default is None else default)
        parser.add_argument(flag, type=kind, nargs="*" if many else None, default=default)
    return parser.parse_args()


def today() -> str:
    """The day of a measurement."""
    return datetime.now(UTC).strftime("%Y-%m-%d")


def write(name: str, path: Path | None, content: dict[str, Any]) -> None:
    """Write figures with the machine and the day."""
    path = path or RESULTS / f"{name}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    write_rows(path, {"machine": machine(), "date": today(), **content})


def write_rows(path: Path, content: dict[str, Any]) -> None:
    """Write JSON with a row of a table, and a list of numbers, in one line each."""
    write_atomically(path, (laid_out(finite(content)) + "\n").encode())


def laid_out(value: Any, margin: str = "") -> str:
    """The text of `write_rows`."""
    inside = value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ()
    if not any(isinstance(part, dict | list | tuple) for part in inside):
        return json.dumps(value, allow_nan=False)
    names = [f"{json.dumps(name)}: " for name in value] if isinstance(value, dict) else [""] * len(value)
    lines = [f"{margin} {name}{laid_out(part, margin + ' ')}" for name, part in zip(names, inside, strict=True)]
    first, last = "{}" if isinstance(value, dict) else "[]"
    return "\n".join([first, ",\n".join(lines), margin + last])


@cache
def training(command: str) -> dict[str, str]:
    """What stands beside a figure of `e2efly COMMAND`: the command, its preset, its integrator, and the fingerprint of
    its configuration as it is today. The configuration is the one for a CPU, unless the command names a device.
    """
    asked = recorded(command)
    about = {"preset": asked.preset, "integrator": asked.config.env.integrator}
    return {"command": command, **about, "configuration": fingerprint(asked.config)}


def is_of_today(run: dict[str, Any]) -> bool:
    """Whether a figure is of today's integrator and, of a training, of today's configuration."""
    today = training(run["command"]) if "command" in run else {"integrator": EnvConfig().integrator}
    return "date" in run and all(run.get(name, value) == value for name, value in today.items())


def measured(
    name: str, path: Path | None, about: dict[str, Any], measure: Callable[[], dict[str, Any]], rows: Callable
) -> None:
    """Measure what a file of results does not have yet, and write it there, with the table of all that it has.

    A script that was stopped so goes on where it was. Kept are only figures of this machine, and of trainings whose
    configuration is the one of today.

    Args:
        name: name of the results.
        path: their file, if it is not the usual one.
        about: what is measured, with what `training` gives.
        measure: function that measures it.
        rows: function from all figures to the rows of the table.
    """
    path = path or RESULTS / f"{name}.json"
    known = json.loads(path.read_text()) if path.exists() else {}
    runs = [run for run in known.get("runs", []) if known["machine"] == machine() and is_of_today(run)]
    if not any(about.items() <= run.items() for run in runs):
        runs.append({**about, "date": today(), **measure()})
        print(runs[-1], flush=True)
    write(name, path, {"table": rows(runs), "runs": runs})


def with_earlier(name: str, path: Path | None, part: str, keys: tuple[str, ...], rows: list[Any]) -> list[Any]:
    """The rows, and those of a part of the file that were not measured anew: none with their values of the keys."""
    path = path or RESULTS / f"{name}.json"
    known = json.loads(path.read_text())[part] if path.exists() else []
    anew = {tuple(row[key] for key in keys) for row in rows}
    return [*rows, *(row for row in known if tuple(row[key] for key in keys) not in anew)]


def table(rows: list[dict[str, Any]]) -> str:
    """A markdown table."""
    return "\n".join(markdown(rows))


def median(values: list[float]) -> float:
    """The median, where NaN is what never came; NaN of nothing."""
    return statistics.median(math.inf if math.isnan(x) else x for x in values) if values else math.nan
