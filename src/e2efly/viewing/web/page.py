"""The files of a page in which a policy flies: the built assets, and one file with programs and numbers."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from e2efly import __version__
from e2efly.config.storage import write_atomically
from e2efly.policy.loader import INPUT, MEMORY, load_policy
from e2efly.validation.candidate import Candidate
from e2efly.viewing.web.exported import STARTS, course, still
from e2efly.viewing.web.lowering import NoInstructionError, lowered
from e2efly.viewing.web.policy_graph import policy_function

ASSETS = Path(__file__).parent / "assets"
"""The folder of the files that `make web` builds."""
COPIED = ("index.html", "page.css", "page.js", "licenses.txt")
"""Assets that are copied to a page unchanged."""


def write_page(folder: Path, found: Candidate) -> None:
    """Write a page that flies a policy: `index.html` and the files that it loads.

    It needs no server. A browser can open the file itself, and any static file host can serve it.

    Args:
        folder: the folder to write to. It is created if it does not exist.
        found: the policy, its task and its environment.

    Raises:
        ValueError: for a policy with cameras, a task whose step the page cannot compute, and a path that is not a
            folder.
        OSError: when a file cannot be written.
    """
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"--web is {str(folder)!r}, a file; accepted: a folder, which is made where it is not there")
    text = json.dumps(flight(found), allow_nan=False, separators=(",", ":"))
    folder.mkdir(parents=True, exist_ok=True)
    for name in COPIED:
        write_atomically(folder / name, (ASSETS / name).read_bytes())
    write_atomically(folder / "flight.js", f"globalThis.e2eflyFlight = {text};\n".encode())


def flight(found: Candidate, starts: int = STARTS) -> dict[str, Any]:
    """The data of a policy for a page, as JSON: programs of the policy and of the environment, starts, and scenes.

    Raises:
        ValueError: for a policy with cameras, and for a task whose step the page cannot compute.
    """
    contract = found.policy.contract
    _check(found)
    memory = {MEMORY: np.zeros((1, contract.memory_size), np.float32)} if contract.memory_size else {}
    observation = np.zeros((1, sum(shown.size for shown in contract.observation)), np.float32)
    policy = lowered(policy_function(load_policy(found.file).content), {INPUT: observation} | memory)
    courses = found.task.criteria()
    envs = {name: still(found.environment(suite)) for name, suite in courses.items()}
    try:
        flown = {name: course(env, courses[name], starts) for name, env in envs.items()}
    except NoInstructionError as error:
        raise ValueError(f"--web: the task {found.task.name!r} {error}") from None
    return {
        "e2efly": __version__,
        "task": found.task.name,
        "vehicle": found.vehicle,
        "trained_on": contract.vehicle,
        "memory_size": contract.memory_size,
        "policy": policy,
        "courses": [{"name": name} | each for name, each in flown.items()],
    }


def _check(found: Candidate) -> None:
    if images := found.policy.contract.images:
        seen = ", ".join(f"{i.name} ({i.sees}, {i.height} x {i.width})" for i in images)
        raise ValueError(
            f"--web: the policy {found.file} sees by cameras: {seen}; accepted: a policy without cameras, as the page "
            "renders no images; let `e2efly eval` draw the flights of this one"
        )
