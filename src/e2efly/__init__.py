"""e2efly: train an end-to-end quadrotor policy in seconds, check it, and fly it.

`e2efly.train("hover")` trains. `e2efly.evaluate("runs/hover-bptt-0")` flies the trained policy from unseen starts,
`e2efly.validate` flies it on another physics, and `e2efly.load_policy` loads it. Importing the package imports no JAX:
each name of this interface is imported when it is used.
"""

import importlib
import os
import sys
import warnings
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from e2efly.adapters.export_policy import export
    from e2efly.api import list_tasks, make_env, preset, train
    from e2efly.config.algorithms import register as register_algorithm
    from e2efly.flight.pose.registry import register as register_pose_source
    from e2efly.policy.loader import load_policy
    from e2efly.simulation.rewards import register as register_reward
    from e2efly.tasks import register as register_task
    from e2efly.validation.evaluation import evaluate
    from e2efly.validation.plant import Plant, RigidState
    from e2efly.validation.plant_validation import validate
    from e2efly.validation.plants import register as register_plant
    from e2efly.vehicles.loading import load_vehicle

__all__ = [
    "Plant",
    "RigidState",
    "evaluate",
    "export",
    "list_tasks",
    "load_policy",
    "load_vehicle",
    "make_env",
    "preset",
    "register_algorithm",
    "register_plant",
    "register_pose_source",
    "register_reward",
    "register_task",
    "train",
    "validate",
]

__version__ = "0.1.0"

_SILENT = {"ORT_DISABLE_TELEMETRY": "1", "RAY_USAGE_STATS_ENABLED": "0"}
"""Environment variables that stop ONNX Runtime and Ray from sending usage reports. Processes started from here inherit
them."""

_too_late = "onnxruntime" in sys.modules and not os.environ.get("ORT_DISABLE_TELEMETRY")
for _name, _value in _SILENT.items():
    if not os.environ.get(_name):  # a value of the user's environment stays
        os.environ[_name] = _value
if _too_late:  # ONNX Runtime reads its variable once, while it is imported
    sys.modules["onnxruntime"].disable_telemetry_events()
    warnings.warn(
        "onnxruntime was imported before e2efly: its telemetry (from version 1.29 on) is reduced, but cannot be "
        "stopped in this process; import e2efly first, or set ORT_DISABLE_TELEMETRY=1",
        stacklevel=2,
    )

_FACE = {
    "Plant": "e2efly.validation.plant", "RigidState": "e2efly.validation.plant",
    "evaluate": "e2efly.validation.evaluation",
    "export": "e2efly.adapters.export_policy",
    "list_tasks": "e2efly.api", "load_policy": "e2efly.policy.loader", "load_vehicle": "e2efly.vehicles.loading",
    "make_env": "e2efly.api", "preset": "e2efly.api", "register_algorithm": "e2efly.config.algorithms:register",
    "register_plant": "e2efly.validation.plants:register",
    "register_reward": "e2efly.simulation.rewards:register", "register_task": "e2efly.tasks:register",
    "train": "e2efly.api",
    "validate": "e2efly.validation.plant_validation",
    "register_pose_source": "e2efly.flight.pose.registry:register",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _FACE:
        raise AttributeError(f"module 'e2efly' has no attribute {name!r}; it offers {', '.join(sorted(_FACE))}")
    module, _, other = _FACE[name].partition(":")
    return getattr(importlib.import_module(module), other or name)


def __dir__() -> list[str]:
    return sorted({*(name for name in globals() if name.startswith("__")), *_FACE})
