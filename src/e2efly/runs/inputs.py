"""A configuration as a run keeps it: as JSON, with copies of the files that it names (vehicle, track, reference, table
of a noise, first policy, teacher), and compared by their content.
"""

import dataclasses
import hashlib
import json
import reprlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from e2efly.config import ALGORITHMS, TrainConfig
from e2efly.config.numbers import ADDED
from e2efly.config.reading import read
from e2efly.courses.random_tracks import ANY
from e2efly.courses.tracks import track_file
from e2efly.runs.presets import preset
from e2efly.tasks import TASKS
from e2efly.vehicles.loading import vehicle_file

OWN_FILES = (".toml", ".csv", ".npy")
"""Endings of names that refer to the user's files. Other names refer to files that come with the package."""


def input_files(config: TrainConfig) -> dict[str, Path]:
    """The files that a configuration names, by the dotted path of the field.

    Raises:
        ValueError: for a vehicle or track that does not exist.
    """
    found = {"env.vehicle": vehicle_file(config.env.vehicle)}
    track = getattr(config.task, "track", ())
    tracks = {"task.track": track} if isinstance(track, str) else {f"task.track.{i}": x for i, x in enumerate(track)}
    found |= {field: track_file(name) for field, name in tracks.items() if name != ANY}
    for field in ("start_from", "algo.teacher"):
        if (name := value_at(config, field)) and name.endswith(".onnx"):
            found[field] = Path(name)
    named = {"task.reference": getattr(config.task, "reference", "")}
    named |= {f"env.cameras.{i}.noise.redwood": c.noise.redwood or "" for i, c in enumerate(config.env.cameras)}
    return found | {field: Path(name) for field, name in named.items() if name.endswith(OWN_FILES)}


def value_at(tree: Any, field: str) -> Any:
    """The value at a dotted path through nested dataclasses and tuples. None if there is no such field."""
    name, _, rest = field.partition(".")
    value = {str(i): x for i, x in enumerate(tree)}.get(name) if isinstance(tree, tuple) else getattr(tree, name, None)
    return value_at(value, rest) if rest else value


def replaced(tree: Any, field: str, value: str) -> Any:
    """A copy of nested dataclasses and tuples with another value at a dotted path."""
    name, _, rest = field.partition(".")
    if isinstance(tree, tuple):
        return tuple((replaced(x, rest, value) if rest else value) if str(i) == name else x for i, x in enumerate(tree))
    return dataclasses.replace(tree, **{name: replaced(getattr(tree, name), rest, value) if rest else value})


def content_of(path: Path) -> bytes:
    """The content of a file.

    Raises:
        ValueError: naming the file, when it cannot be read.
    """
    try:
        return path.read_bytes()
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror}") from None


def sha256(data: bytes) -> str:
    """The SHA-256 hash, as hexadecimal digits."""
    return hashlib.sha256(data).hexdigest()


@dataclass(frozen=True)
class Kept:
    """A copy of a file, kept in a run."""

    copy: Path
    """Path of the copy."""
    original: Path
    """Path of the file when the run began."""
    named: str
    """Its name in the configuration: a path, or the name of a file that comes with the package."""
    sha256: str
    """SHA-256 hash of the content."""

    def as_json(self) -> dict[str, str]:
        """What the run's inputs.json says of it."""
        return {"named": self.named, "original": str(self.original), "sha256": self.sha256}

    @property
    def own(self) -> bool:
        """Whether it is the user's file."""
        return self.named.endswith(OWN_FILES)

    def usable(self) -> str:
        """What to load: the copy, or, for an unchanged file of the package, its name.

        Raises:
            ValueError: when the copy is missing or has changed.
        """
        if not self.own and self._now() == self.sha256:
            return self.named
        if (found := sha256(content_of(self.copy))) != self.sha256:
            raise ValueError(f"{self.copy}: SHA-256 is {found}; accepted: {self.sha256}, what the run was made with")
        return str(self.copy)

    def check_original(self) -> None:
        """Refuse a user's file whose content has changed. A file that was moved or deleted is accepted.

        Raises:
            ValueError: naming both files and both hashes.
        """
        now = self._now() if self.own else None
        if now not in (None, self.sha256):
            raise ValueError(
                f"{self.original} has changed: its SHA-256 is {now}, but the run was made with {self.copy}, "
                f"SHA-256 {self.sha256}; accepted: the file as it was (copy the kept one back), or the changed file "
                "under another name, for a new run"
            )

    def _now(self) -> str | None:
        """Hash of the file that is now at the original's path. None if there is no readable file."""
        try:
            return sha256(self.original.read_bytes())
        except OSError:
            return None


def with_copies(config: TrainConfig, inputs: Mapping[str, Kept], gone: bool = False) -> TrainConfig:
    """A configuration in which a run's copies (`RunDirectory.inputs`) replace the files that it names. With `gone`,
    only those with their original name that are no longer there.
    """
    for field, kept in inputs.items():
        if not gone or (value_at(config, field) == kept.named and not kept.original.exists()):
            config = replaced(config, field, kept.usable())
    return config


def copied(config: TrainConfig, folder: Path) -> dict[str, tuple[Kept, bytes]]:
    """The copies of its files that a run is to keep in a folder, and their content, by the dotted path of the field."""
    found = {}
    for field, path in input_files(config).items():
        data, copy = content_of(path), folder / field / path.name
        found[field] = Kept(copy, path.absolute(), value_at(config, field), sha256(data)), data
    return found


def by_content(config: TrainConfig) -> TrainConfig:
    """A configuration in which a hash of the content of each file replaces its path, so that two configurations can be
    compared.

    Raises:
        ValueError: when a file cannot be read.
    """
    for field, path in input_files(config).items():
        config = replaced(config, field, f"{path.name} (SHA-256 {sha256(content_of(path))})")
    return config


def to_json(config: TrainConfig) -> dict[str, Any]:
    """A configuration as JSON, with the names of its task and its algorithm, or references to them."""
    names = {"task_name": TASKS.reference(type(config.task)), "algo_name": ALGORITHMS.reference(type(config.algo))}
    return {**names, **dataclasses.asdict(config)}


def fingerprint(config: TrainConfig) -> str:
    """Twelve digits of the SHA-256 of everything that defines a training: its configuration, the content of its files,
    and its criteria. Left out are the seed, and the number of devices, which follows from the machine.

    Raises:
        ValueError: when a file of the configuration cannot be read.
    """
    content = by_content(dataclasses.replace(config, seed=0, devices=None))
    told = {**to_json(config), **_defining(content)}
    criteria = {name: _defining(suite) for name, suite in config.task.criteria().items()}
    return sha256(json.dumps([told, criteria], sort_keys=True).encode())[:12]


def _defining(part: Any) -> Any:
    """`dataclasses.asdict` without the fields that were added later and say what was done before."""
    if isinstance(part, tuple):
        return [_defining(x) for x in part]
    if not dataclasses.is_dataclass(part):
        return part
    there = ((f, getattr(part, f.name)) for f in dataclasses.fields(part))
    return {f.name: _defining(x) for f, x in there if not (f.metadata.get(ADDED) and x == f.default)}


def from_json(content: dict[str, Any], where: str) -> TrainConfig:
    """The configuration that `to_json` wrote, in this version or an older one.

    Raises:
        ValueError: for unknown keys, and for missing keys without a default, naming them; for a value of another type,
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
    """The differences between two configurations, as `field: this and that`. If the task or the algorithm differs, only
    these are given.
    """
    these, those = to_json(a), to_json(b)
    kind = [name for name in ("task_name", "algo_name") if these[name] != those[name]]
    yield from (f"{name.removesuffix('_name')}: {these[name]} and {those[name]}" for name in kind)
    if not kind:
        yield from different_values(these, those)


def different_values(a: Any, b: Any, prefix: str = "") -> Iterator[str]:
    """The differences between two JSON trees, as `field: this and that`."""
    if isinstance(a, dict) and isinstance(b, dict):
        for key in sorted({*a, *b}):
            yield from different_values(a.get(key), b.get(key), f"{prefix}.{key}" if prefix else key)
    elif a != b:
        yield f"{prefix}: {a} and {b}"
