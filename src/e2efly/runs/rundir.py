"""The run directory: everything that is needed to reproduce a run and to fly its policy.

config.json  versions.json  inputs.json  inputs/  metrics.csv  events/  checkpoint.safetensors  history/  plots/
policy.onnx  summary.json
"""

import csv
import io
import platform
import shutil
from collections.abc import Iterable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from e2efly.config import EnvConfig, TrainConfig
from e2efly.config.storage import held, make_folder, read_json, write_atomically, write_json
from e2efly.runs.inputs import Kept, by_content, copied, differences, from_json, to_json, with_copies

_FILES = (
    "config.json", "versions.json", "inputs.json", "metrics.csv", "checkpoint.safetensors", "policy.onnx",
    "policy.images.npz", "summary.json",
)  # fmt: skip
_FOLDERS = ("inputs", "events", "history", "plots")
"""Everything that a run writes into its folder."""
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
        """The metrics: one line per update."""
        return self.path / "metrics.csv"

    @property
    def history(self) -> Path:
        """Policies from the course of the training. See `e2efly.learning.history`."""
        return self.path / "history"

    @property
    def plots(self) -> Path:
        """The folder of the plots, PNG files."""
        return self.path / "plots"

    @property
    def events(self) -> Path:
        """TensorBoard event files."""
        return self.path / "events"

    @property
    def began(self) -> bool:
        """Whether a run in this folder ever reached a checkpoint. One that did not may be replaced."""
        if any(path.exists() for path in (self.checkpoint, self.policy, self.path / "summary.json")):
            return True
        return sum("seconds" in row for row in self.rows()) > 1  # the first evaluation comes before the checkpoint

    def held(self) -> AbstractContextManager[None]:
        """Prevent other processes from writing to the run. See `e2efly.config.storage.held`."""
        return held(self.path)

    def check_new(self) -> None:
        """Refuse a folder that holds a run.

        Raises:
            ValueError: when it does.
        """
        if self.began:
            raise ValueError(
                f"--out {self.path} already holds a run; accepted: a new folder, --resume to go on with this one, "
                "or --overwrite to delete it"
            )

    def clear(self) -> None:
        """Delete the files of the run, if the folder holds one. Other files are kept."""
        if (self.path / "config.json").is_file():
            for name in _FILES:
                (self.path / name).unlink(missing_ok=True)
            for name in _FOLDERS:
                shutil.rmtree(self.path / name, ignore_errors=True)

    def create(self, config: TrainConfig, overwrite: bool = False) -> None:
        """Create the folder. Write the configuration, the versions and copies of the input files.

        Args:
            config: everything that determines the result.
            overwrite: delete the run that the folder holds.

        Raises:
            OSError: when the folder cannot be written.
            ValueError: when the folder already holds a run.
        """
        inputs = copied(config, self.path / "inputs")
        if overwrite:  # only now, because the input files may belong to the run that is deleted
            self.clear()
        self.check_new()
        make_folder(self.path)
        self.metrics.unlink(missing_ok=True)  # of a run that never reached a checkpoint
        for kept, data in inputs.values():
            kept.copy.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(kept.copy, data)
        about = {field: kept.as_json() for field, (kept, _) in inputs.items()}
        self.write_json("inputs.json", about)
        self.write_json("versions.json", versions())
        self.write_json("config.json", to_json(config))  # last: this file marks that the folder holds a run

    def inputs(self) -> dict[str, Kept]:
        """The input files of the run, by the dotted path of the field. Runs of older versions have none.

        Raises:
            ValueError: when inputs.json is damaged.
        """
        if not (self.path / "inputs.json").exists():
            return {}
        content, found = self.read_json("inputs.json"), {}
        for field, about in content.items():
            try:
                named, original, digest = (str(about[name]) for name in ("named", "original", "sha256"))
            except (TypeError, KeyError):
                accepted = "accepted: named, original and sha256"
                raise ValueError(f"{self.path / 'inputs.json'}: {field} is {about!r}; {accepted}") from None
            copy = self.path / "inputs" / field / Path(original).name
            found[field] = Kept(copy, Path(original), named, digest)
        return found

    def with_copies(self, config: TrainConfig) -> TrainConfig:
        """A configuration of the run in which the run's own copies replace the files that it names."""
        return with_copies(config, self.inputs())

    def write_json(self, name: str, content: dict[str, Any]) -> None:
        """Write a JSON file atomically."""
        write_json(self.path / name, content, indent=2)

    def read_json(self, name: str) -> dict[str, Any]:
        """Read a JSON file.

        Raises:
            ValueError: when the file is missing, is not JSON, or does not contain a JSON object.
        """
        return read_json(self.path / name)

    def config(self, names_vehicle: bool = False) -> TrainConfig:
        """The configuration of the run, with its own copies of its input files.

        Args:
            names_vehicle: whether the caller names the vehicle that flies. It then does not matter whether the run's
                vehicle file has changed.

        Raises:
            ValueError: when the folder holds no run, or a run that this version does not understand; when an input file
                of the run has changed, naming the file and its copy.
        """
        if not (self.path / "config.json").is_file():
            raise ValueError(f"{self.path} holds no run: there is no config.json")
        config = from_json(self.read_json("config.json"), str(self.path / "config.json"))
        for field, kept in self.inputs().items():
            if not (names_vehicle and field == "env.vehicle"):
                kept.check_original()
        return self.with_copies(config)

    def check_same(self, config: TrainConfig) -> None:
        """Refuse a configuration that differs from that of the run. The files that they name are compared by content.

        Raises:
            ValueError: naming every field that differs.
        """
        wanted = self.config()
        if type(config.task) is not type(wanted.task):  # no other difference matters, and other files are named
            raise self._another(differences(wanted, config))
        config = with_copies(config, self.inputs(), gone=True)
        if different := list(differences(by_content(wanted), by_content(config))):
            raise self._another(different)

    def _another(self, different: Iterable[str]) -> ValueError:
        return ValueError(f"{self.path} holds a run of another configuration: {'; '.join(different)}")

    def check_resumable(self) -> None:
        """Refuse to start from the beginning when a run has lost its checkpoint.

        Raises:
            ValueError: when the checkpoint is missing.
        """
        if self.began and not self.checkpoint.exists():
            raise ValueError(
                f"{self.checkpoint} is missing, but {self.path} holds a run that had one: it cannot go on; accepted: "
                "that file in its place, or another --out, without --resume"
            )

    def rows(self) -> list[dict[str, float]]:
        """The metrics, one row per update, without an incomplete last line."""
        return [{k: float(v) for k, v in row.items() if v} for row in csv.DictReader(self._whole_lines())]

    def _whole_lines(self) -> list[str]:
        """The lines of the metrics that were written completely: the header and one line per update."""
        if not self.metrics.is_file():
            return []
        with self.metrics.open(newline="", encoding="utf-8") as file:
            return [line for line in file if line.endswith("\n")]

    def append(self, rows: list[dict[str, float]]) -> None:
        """Append rows to the metrics."""
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
        """Delete the metrics and policies of updates that a resumed run will repeat, and the files that a killed run
        did not finish.
        """
        for part in (*self.path.glob("*.part"), *self.history.glob("*.part")):
            part.unlink()
        for policy in self.history.glob("*.safetensors"):
            if policy.stem.isdigit() and int(policy.stem) > update:
                policy.unlink()
        header, *lines = self._whole_lines() or [""]
        if header:
            kept = [line for line in lines if int(line.split(",", 1)[0]) <= update]
            write_atomically(self.metrics, "".join([header, *kept]).encode())
        else:  # a full disk, or an incomplete header
            self.metrics.unlink(missing_ok=True)


def least_success(row: dict[str, float]) -> float:
    """The success rate of the worst criterion in a row of the metrics. 0 if it holds no evaluation."""
    return min((x for key, x in row.items() if key.startswith("eval/") and key.endswith("/success")), default=0.0)


def run_folder(config: TrainConfig) -> Path:
    """The default folder of a run: runs/TASK-ALGO-SEED. If the vehicle is not the default one, its name comes before
    the seed.
    """
    usual = config.env.vehicle == EnvConfig().vehicle
    parts = config.task.name, config.algo.name, *(() if usual else (Path(config.env.vehicle).stem,))
    return Path("runs") / "-".join((*parts, str(config.seed)))


def run_of(path: Path) -> RunDirectory | None:
    """The run whose folder or policy.onnx this path is."""
    folder = path.parent if path.name == "policy.onnx" else path
    return RunDirectory(folder) if path.is_dir() or (folder / "config.json").is_file() else None


def versions() -> dict[str, str]:
    """Versions of the software that determines the result."""
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
