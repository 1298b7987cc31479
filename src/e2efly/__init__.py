"""e2efly: train an end-to-end quadrotor policy in seconds, check it, and fly it.

Importing the package imports no JAX; import the modules that you need.
"""

import os
import sys
import warnings

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
