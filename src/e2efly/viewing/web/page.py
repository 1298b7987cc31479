"""The files of a page in which a policy flies: the built assets, the policy, and the numbers of vehicle and task."""

import base64
import dataclasses
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax
import numpy as np

from e2efly import __version__
from e2efly.config.registry import origin
from e2efly.config.storage import write_atomically
from e2efly.environment import UNSEEN, Env, EnvState, random_key
from e2efly.policy.loader import load_policy
from e2efly.simulation.device import fast_compile
from e2efly.tasks import TASKS
from e2efly.tasks.task import world_of
from e2efly.validation.evaluation import SEED, Candidate

ASSETS = Path(__file__).parent / "assets"
"""The folder of the files that `make web` builds."""
COPIED = ("index.html", "page.css", "page.js", "licenses.txt")
"""Assets that are copied to a page unchanged."""
RUNTIME = "runtime.wasm.gz"
"""ONNX Runtime as WebAssembly."""
STARTS = 12
"""Number of starts of each course."""
ENDLESS = 1e300
"""Stands for infinity, which JSON does not have."""


def write_page(folder: Path, found: Candidate) -> None:
    """Write a page that flies a policy: `index.html` and the files that it loads.

    It needs no server. A browser can open the file itself, and any static file host can serve it.

    Args:
        folder: the folder to write to. It is created if it does not exist.
        found: the policy, its task and its environment.

    Raises:
        ValueError: for a policy with cameras, a task that the page does not know, and a path that is not a folder.
        OSError: when a file cannot be written.
    """
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"--web is {str(folder)!r}, a file; accepted: a folder, which is made where it is not there")
    about = flight(found)
    policy = base64.b64encode(load_policy(found.file).content).decode()
    runtime = base64.b64encode((ASSETS / RUNTIME).read_bytes()).decode()
    folder.mkdir(parents=True, exist_ok=True)
    for name in COPIED:
        write_atomically(folder / name, (ASSETS / name).read_bytes())
    for name, variable, value in (
        ("runtime.js", "e2eflyRuntime", runtime),
        ("policy.js", "e2eflyPolicy", policy),
        ("flight.js", "e2eflyFlight", about),
    ):
        text = json.dumps(value, allow_nan=False, separators=(",", ":"))
        write_atomically(folder / name, f"globalThis.{variable} = {text};\n".encode())


def flight(found: Candidate, starts: int = STARTS) -> dict[str, Any]:
    """The data of a policy for a page: the numbers of its contract, and those of `numbers`, as JSON.

    Raises:
        ValueError: for a policy with cameras, and for a task that the page does not know.
    """
    contract = found.policy.contract
    _check(found)
    envs = {name: found.environment(suite) for name, suite in found.task.criteria().items()}
    return {
        "e2efly": __version__,
        "task": contract.task,
        "vehicle": found.vehicle,
        "trained_on": contract.vehicle,
        "memory_size": contract.memory_size,
    } | numbers(envs, starts)


def numbers(envs: Mapping[str, Env], starts: int = STARTS) -> dict[str, Any]:
    """The numbers of vehicle and task with which the page simulates an environment, as JSON; see `still`.

    Args:
        envs: the environments by the name of their course. They differ only in their tasks.
        starts: number of starts of each course.
    """
    envs = {name: still(env) for name, env in envs.items()}
    env = next(iter(envs.values()))
    physics = env.physics
    return {
        "past_actions": env.seen_actions,
        "hover_action": plain(env.hover),
        "imu": env.imu is not None,
        "latency": plain(env.latency_range[0]),
        "observation_latency": plain(np.mean(env.observation_latency_range)),
        "command": {"center": plain(env.center), "half": plain(env.half)},
        "physics": {
            "command_mode": physics.command_mode,
            "integrator": physics.integrator,
            "control_period": physics.control_period,
            "substeps": physics.substeps,
            "nominal": plain(physics.nominal),
            "body": plain(physics.flown),
            "full_speed": plain(physics.full_speed),
            "mixer": plain(physics.mixer),
        },
        "courses": [_course(name, env, starts) for name, env in envs.items()],
    }


def still(env: Env) -> Env:
    """The environment that the page simulates: the vehicle of the file, its delay, still air, and nothing random except
    the starts. For a family, the vehicle in the middle of its ranges.
    """
    return dataclasses.replace(env, family=None).undisturbed()


def _check(found: Candidate) -> None:
    if images := found.policy.contract.images:
        seen = ", ".join(f"{i.name} ({i.sees}, {i.height} x {i.width})" for i in images)
        raise ValueError(
            f"--web: the policy {found.file} sees by cameras: {seen}; accepted: a policy without cameras, as the page "
            f"renders no images: train one of {_simulated()}, or let `e2efly eval` draw the flights of this one"
        )


def _kind(task: Any) -> str:
    """The page's name for a task's world. Only the class itself can define it, not a parent class, because a class that
    extends another may fly differently.
    """
    kind = vars(type(task)).get("page")
    if kind is None:
        raise ValueError(
            f"--web: the task of the policy is flown by {origin(type(task))}, which the page does not simulate; "
            f"accepted: {_simulated()}; let `e2efly eval` draw the flights of this one"
        )
    return kind


def _simulated() -> str:
    return ", ".join(name for name, options in TASKS.items() if "page" in vars(world_of(options)))


def _course(name: str, env: Env, starts: int) -> dict[str, Any]:
    """A criterion: the numbers of its task, and the starts of its episodes."""
    kind, drawn = _kind(env.task), beginnings(env, starts)
    rows = [jax.tree.map(lambda x, i=i: np.asarray(x[i]), (drawn.vehicle, drawn.memory)) for i in range(starts)]
    return {
        "name": name,
        "kind": kind,
        "task": plain(env.task),
        "starts": [{"vehicle": plain(vehicle), "memory": plain(memory)} for vehicle, memory in rows],
    }


def beginnings(env: Env, starts: int) -> EnvState:
    """The starts of a course."""
    begun = jax.jit(lambda env, key: env.reset(key, starts)[0], compiler_options=fast_compile())
    return begun(env, random_key(SEED, UNSEEN, 0))


def plain(value: Any) -> Any:
    """A value in JSON form: dataclasses as objects, arrays as lists, infinities as `ENDLESS`.

    A number in single precision becomes the shortest decimal number that rounds to it, so that 0.03 in the file is
    written as 0.03.
    """
    if dataclasses.is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, (list, tuple)):
        return [plain(x) for x in value]
    if value is None or isinstance(value, (str, bool, int)):
        return value
    array = np.asarray(value)
    if array.ndim:
        return [plain(x) for x in array]
    number = float(str(array)) if array.dtype == np.float32 else array.item()
    return number if not isinstance(number, float) or math.isfinite(number) else math.copysign(ENDLESS, number)
