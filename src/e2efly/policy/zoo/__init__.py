"""The policy zoo: a trained `policy.onnx` for each vehicle and task, as package data; `make zoo` makes them again."""

import hashlib
import json
import math
import os
from pathlib import Path
from typing import Any

from e2efly.config.names import unknown
from e2efly.vehicles.family import load_family
from e2efly.vehicles.loading import FAMILIES, load_vehicle, vehicle_file

FOLDER = Path(__file__).parent
USUAL = "vis_r"
"""The vehicle of a policy that is named by its task alone."""


def contents() -> dict[str, dict[str, dict[str, Any]]]:
    """What there is: by vehicle and task, how the policy was made, its success by criterion, its file's SHA-256.

    Raises:
        ValueError: where the package's file is damaged.
    """
    file = FOLDER / "zoo.json"
    try:
        zoo = json.loads(file.read_text(encoding="utf-8"))
        if not all(isinstance(about, dict) for tasks in zoo.values() for about in tasks.values()):
            raise TypeError("an entry is no object")
    except (OSError, ValueError, RecursionError, AttributeError, TypeError) as error:
        raise ValueError(f"{file}: damaged ({type(error).__name__}: {error}); install e2efly again") from None
    return zoo


def names() -> list[str]:
    """Every name of a policy: a task, or a vehicle or family and a task, as in `any/hover`.

    Raises:
        ValueError: where the package's file is damaged.
    """
    zoo = contents()
    return [*zoo[USUAL], *(f"{whose}/{task}" for whose, tasks in zoo.items() for task in tasks)]


def is_policy(text: str | os.PathLike[str]) -> bool:
    """Whether a text is meant as a policy: the name of one, a .onnx file, or the folder of a run."""
    path = Path(text)
    return path.suffix == ".onnx" or (path / "config.json").is_file() or _entry(path) is not None


def policy_file(policy: str | os.PathLike[str], vehicle: str | Path | None = None) -> Path:
    """The file of a policy: every command and function that takes a policy finds it by this.

    Args:
        policy: a policy.onnx, a run directory (its policy.onnx), the name of a task (the zoo's policy of it), or a
            vehicle of the zoo and a task, as in `any/hover`, whatever flies.
        vehicle: whose policy, of the zoo's: a shipped name, or a file: that of the shipped vehicle with the same
            values, or else of the same name, or else of the nearest mass. When left out: `USUAL`.

    Raises:
        ValueError: for what is no policy, with all names; when the zoo's file is not what zoo.json says.
    """
    path = Path(policy)
    if path.exists():
        return path / "policy.onnx" if path.is_dir() else path
    entry = _entry(path)
    if entry is None:
        raise ValueError(unknown("policy", str(policy), names()) + ", a run directory, or the path of a policy.onnx")
    zoo, (whose, task) = contents(), entry
    having = [known for known, tasks in zoo.items() if task in tasks]
    name = whose or _whose(vehicle_file(vehicle or USUAL), having)
    if name not in having:
        raise ValueError(f"the zoo has no policy {task!r} of vehicle {name!r}; accepted: {', '.join(having)}")
    file = FOLDER / name / f"{task}.onnx"
    found = hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else "missing"
    if found != zoo[name][task].get("sha256"):
        raise ValueError(f"{file}: SHA-256 is {found}, another than zoo.json says; install e2efly again")
    return file


def _entry(path: Path) -> tuple[str, str] | None:
    """The vehicle (empty: the one that flies) and the task of a policy's name. None: the zoo has no such policy."""
    whose, _, task = path.as_posix().rpartition("/")
    zoo = contents()
    tasks = zoo.get(whose, {}) if whose else {task for tasks in zoo.values() for task in tasks}
    return (whose, task) if task in tasks else None


def shipped_name(content: bytes) -> str | None:
    """The name of the policy of the zoo that these bytes are, wherever they were read. None: they are none.

    Raises:
        ValueError: where the package's file is damaged.
    """
    digest = hashlib.sha256(content).hexdigest()
    every = ((f"{whose}/{task}", about) for whose, tasks in contents().items() for task, about in tasks.items())
    return next((name for name, about in every if about.get("sha256") == digest), None)


def curve_file(policy: Path) -> Path:
    """Where the curve of a policy's training is, where it was kept: hover.curve.csv beside hover.onnx, by evaluation
    the columns `steps`, `seconds` and, by criterion, success.
    """
    return policy.with_suffix(".curve.csv")


def config_file(policy: Path) -> Path:
    """The configuration of a policy's training, as a run's config.json has it: hover.config.json beside hover.onnx."""
    return policy.with_suffix(".config.json")


def _whose(body: Path, having: list[str]) -> str:
    """The shipped vehicle whose policy flies the vehicle of a file, where these have one."""
    if body.parent in (vehicle_file(USUAL).parent, FAMILIES) or load_family(body) is not None:
        return body.stem
    having = [name for name in having if load_family(name) is None]
    own, known = load_vehicle(body), {name: load_vehicle(name) for name in having}
    same = [name for name, vehicle in known.items() if vehicle.hash == own.hash]
    near = sorted(known, key=lambda name: abs(math.log(known[name].mass / own.mass)))
    return next((name for name in (*same, body.stem, *near) if name in having), USUAL)


def beside(policy: Path) -> Path:
    """Where to write what belongs to a policy's file: its folder; for one of the zoo, a folder of runs."""
    return policy.parent if policy.parent.parent != FOLDER else Path("runs") / f"zoo-{policy.stem}-{policy.parent.name}"
