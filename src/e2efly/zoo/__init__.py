"""The policy zoo: a trained `policy.onnx` for each vehicle and task, as package data; `make zoo` makes them again."""

import hashlib
import json
from pathlib import Path
from typing import Any

from e2efly.vehicles import unknown

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


def policy_path(name_or_path: Path, vehicle: str | None = None) -> Path:
    """A policy's path: what is there under the name, or the zoo's policy of the task of that name.

    Args:
        name_or_path: a run directory, a policy.onnx, or a task.
        vehicle: whose policy, of the zoo's; `USUAL` when left out.

    Raises:
        ValueError: when there is neither, with what the zoo has; when the zoo's file is not what zoo.json says.
    """
    if name_or_path.exists() or len(name_or_path.parts) > 1 or name_or_path.suffix:
        return name_or_path
    zoo, task = contents(), str(name_or_path)
    if not any(task in tasks for tasks in zoo.values()):
        tasks = sorted({task for tasks in zoo.values() for task in tasks})
        raise ValueError(unknown("policy", task, tasks) + ", a run directory, or the path of a policy.onnx")
    if task not in zoo.get(vehicle or USUAL, {}):
        having = [known for known, tasks in zoo.items() if task in tasks]
        raise ValueError(
            f"the zoo has no policy {task!r} of vehicle {vehicle or USUAL!r}; accepted: {', '.join(having)}"
        )
    file = FOLDER / (vehicle or USUAL) / f"{task}.onnx"
    found = hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else "missing"
    if found != zoo[vehicle or USUAL][task].get("sha256"):
        raise ValueError(f"{file}: SHA-256 is {found}, another than zoo.json says; install e2efly again")
    return file


def beside(policy: Path) -> Path:
    """Where to write what belongs to a policy's file: its folder; for one of the zoo, a folder of runs."""
    return policy.parent if policy.parent.parent != FOLDER else Path("runs") / f"zoo-{policy.stem}-{policy.parent.name}"
