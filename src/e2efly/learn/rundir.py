"""The run directory: everything needed to reproduce a run and to fly its policy.

config.json  versions.json  metrics.csv  events/  checkpoint.safetensors  plots/  policy.onnx  summary.json
"""

import csv
import dataclasses
import io
import json
import platform
import reprlib
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from e2efly.config import TrainConfig
from e2efly.config.reading import read
from e2efly.learn.checkpoint import write_atomically
from e2efly.presets import ALGORITHMS, TASKS, algorithm_name, preset, task_name

_PACKAGES = ("e2efly", "jax", "jaxlib", "numpy", "optax", "onnx", "onnxruntime")


@dataclass(frozen=True)
class RunDirectory:
    """Paths and files of a run."""

    path: Path

    @property
    def checkpoint(self) -> Path:
        """The training state, the best parameters and the progress."""
        return self.path / "checkpoint.safetensors"

    @property
    def policy(self) -> Path:
        """The policy to fly."""
        return self.path / "policy.onnx"

    @property
    def metrics(self) -> Path:
        """A line for every update."""
        return self.path / "metrics.csv"

    @property
    def plots(self) -> Path:
        """PNG files."""
        return self.path / "plots"

    @property
    def events(self) -> Path:
        """TensorBoard event files."""
        return self.path / "events"

    def create(self, config: TrainConfig) -> None:
        """Make the folder and write the configuration and the versions.

        Raises:
            OSError: when it cannot be written.
            ValueError: when it already holds a run.
        """
        if (self.path / "config.json").exists():
            raise ValueError(
                f"--out {self.path} already holds a run; accepted: a new folder, or --resume to go on with this one"
            )
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OSError(f"cannot make --out {self.path}: {error.strerror}") from error
        self.write_json("versions.json", versions())
        self.write_json("config.json", to_json(config))  # last: with it a folder holds a run

    def write_json(self, name: str, content: dict[str, Any]) -> None:
        """Write a JSON file atomically."""
        write_atomically(self.path / name, (json.dumps(content, indent=2) + "\n").encode())

    def read_json(self, name: str) -> dict[str, Any]:
        """Read a JSON file.

        Raises:
            ValueError: when it is missing, no JSON, or JSON of something else than an object.
        """
        try:
            found = json.loads((self.path / name).read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise ValueError(f"{self.path / name} cannot be read: {error}") from None
        except RecursionError:
            raise ValueError(f"{self.path / name} cannot be read: it is nested too deeply") from None
        if not isinstance(found, dict):
            raise ValueError(f"{self.path / name} is {reprlib.repr(found)}; accepted: an object")
        return found

    def config(self) -> TrainConfig:
        """The configuration of the run.

        Raises:
            ValueError: when the folder holds no run, or one that this version does not understand.
        """
        if not (self.path / "config.json").is_file():
            raise ValueError(f"{self.path} holds no run: there is no config.json")
        return from_json(self.read_json("config.json"), str(self.path / "config.json"))

    def rows(self) -> list[dict[str, float]]:
        """The metrics, a row for every update."""
        if not self.metrics.is_file():
            return []
        with self.metrics.open(newline="", encoding="utf-8") as file:
            return [
                {k: float(v) for k, v in row.items() if v} for row in csv.DictReader(file) if None not in row.values()
            ]

    def append(self, rows: list[dict[str, float]]) -> None:
        """Append metrics."""
        if not rows:
            return
        text = io.StringIO()
        writer = csv.DictWriter(text, rows[0].keys(), lineterminator="\n")
        if not self.metrics.exists():
            writer.writeheader()
        writer.writerows(rows)
        with self.metrics.open("a", encoding="utf-8") as file:
            file.write(text.getvalue())

    def forget_after(self, update: int) -> None:
        """Drop metrics of updates that a resumed run will do again, and files that a killed one had not finished."""
        for part in self.path.glob("*.part"):
            part.unlink()
        if not self.metrics.exists():
            return
        if not self.metrics.stat().st_size:  # a full disk
            self.metrics.unlink()
            return
        header, *lines = self.metrics.read_text(encoding="utf-8").splitlines(keepends=True)
        whole = [line for line in lines if line.endswith("\n") and int(line.split(",", 1)[0]) <= update]
        write_atomically(self.metrics, "".join([header, *whole]).encode())


def versions() -> dict[str, str]:
    """Versions of what decides the outcome."""
    return {
        "python": platform.python_version(),
        "platform": platform.platform(),
        **{name: _version(name) for name in _PACKAGES},
    }


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"


def to_json(config: TrainConfig) -> dict[str, Any]:
    """A configuration as JSON, with the names of its task and algorithm."""
    names = {"task_name": task_name(config.task), "algo_name": algorithm_name(config.algo)}
    return {**names, **dataclasses.asdict(config)}


def from_json(content: dict[str, Any], where: str) -> TrainConfig:
    """The configuration that `to_json` wrote, of this version or an older one.

    Raises:
        ValueError: for unknown keys and missing ones without a default, naming them; for a value of another type,
            naming the field, the value and what is accepted.
    """
    names = {"task_name": TASKS, "algo_name": ALGORITHMS}
    if missing := sorted(names.keys() - content.keys()):
        raise ValueError(f"{where}: missing key {', '.join(map(repr, missing))}")
    for name, known in names.items():
        if not isinstance(content[name], str):
            raise ValueError(f"{where}: {name} is {reprlib.repr(content[name])}; accepted: {', '.join(known)}")
    like = preset(content["task_name"], content["algo_name"])
    rest = {name: value for name, value in content.items() if name not in names}
    return read(TrainConfig, rest, where, {"task": type(like.task), "algo": type(like.algo)})


def differences(a: TrainConfig, b: TrainConfig) -> Iterator[str]:
    """Where two configurations differ, as `field: this and that`; by another task or algorithm, nothing else counts."""
    these, those = to_json(a), to_json(b)
    kind = [name for name in ("task_name", "algo_name") if these[name] != those[name]]
    yield from (f"{name.removesuffix('_name')}: {these[name]} and {those[name]}" for name in kind)
    if not kind:
        yield from different_values(these, those)


def different_values(a: Any, b: Any, prefix: str = "") -> Iterator[str]:
    """Where two trees of JSON differ, as `field: this and that`."""
    if isinstance(a, dict) and isinstance(b, dict):
        for key in sorted({*a, *b}):
            yield from different_values(a.get(key), b.get(key), f"{prefix}.{key}" if prefix else key)
    elif a != b:
        yield f"{prefix}: {a} and {b}"
