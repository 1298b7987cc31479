"""e2efly: train an end-to-end quadrotor policy in seconds, check it, and fly it.

`e2efly.train("hover")` trains, `e2efly.load_policy(FILE)` loads what was trained. Importing the package imports no JAX:
each name of this face is imported when it is used.
"""

import importlib
import os
import sys
import warnings
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from e2efly.api import list_tasks, make_env, preset, train
    from e2efly.deploy.policy import load_policy
    from e2efly.rewards import register as register_reward
    from e2efly.tasks import register as register_task
    from e2efly.vehicles import load_vehicle

__all__ = [
    "list_tasks",
    "load_policy",
    "load_vehicle",
    "make_env",
    "preset",
    "register_reward",
    "register_task",
    "train",
]

__version__ = "0.1.0"

_SILENT = {"ORT_DISABLE_TELEMETRY": "1", "RAY_USAGE_STATS_ENABLED": "0"}
"""Environment variables with which ONNX Runtime and Ray report to nobody. Processes started from here inherit them."""

_too_late = "onnxruntime" in sys.modules and not os.environ.get("ORT_DISABLE_TELEMETRY")
for _name, _value in _SILENT.items():
    if not os.environ.get(_name):  # what the user's environment says stays
        os.environ[_name] = _value
if _too_late:  # ONNX Runtime reads its variable once, while it is imported
    sys.modules["onnxruntime"].disable_telemetry_events()
    warnings.warn(
        "onnxruntime was imported before e2efly: its telemetry (from version 1.29 on) is reduced, but cannot be "
        "stopped in this process; import e2efly first, or set ORT_DISABLE_TELEMETRY=1",
        stacklevel=2,
    )

_FACE = {
    "list_tasks": "e2efly.api", "load_policy": "e2efly.deploy.policy", "load_vehicle": "e2efly.vehicles",
    "make_env": "e2efly.api", "preset": "e2efly.api", "register_reward": "e2efly.rewards:register",
    "register_task": "e2efly.tasks:register", "train": "e2efly.api",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _FACE:
        raise AttributeError(f"module 'e2efly' has no attribute {name!r}; it offers {', '.join(sorted(_FACE))}")
    module, _, other = _FACE[name].partition(":")
    return getattr(importlib.import_module(module), other or name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_FACE})
