"""Where JAX computes, and how it compiles. Call `prepare` before anything imports JAX."""

import os
import sys
from pathlib import Path


def cache_folder() -> Path:
    """The user's cache folder of this package."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "e2efly"


def prepare(device: str | None = None) -> None:
    """Choose the device and turn on the persistent compilation cache; a cache set by JAX's own variables stays.

    Args:
        device: `cpu`, `gpu`, or None: whatever JAX finds.

    Raises:
        ValueError: for an unknown device, or one that this machine or this JAX does not have: never another instead.
    """
    if device not in (None, "cpu", "gpu"):
        raise ValueError(f"--device is {device!r}; accepted: cpu, gpu")
    if device and "jax" not in sys.modules:
        os.environ["JAX_PLATFORMS"] = {"cpu": "cpu", "gpu": "cuda"}[device]
    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(cache_folder() / "jax"))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.05")
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "-1")
    import jax

    try:
        found = jax.devices()[0].platform
    except RuntimeError as error:
        reason = str(error).splitlines()[0]
        raise ValueError(
            f"--device {device} is not to be had: {reason} (NVIDIA GPUs: pip install 'e2efly[cuda]')"
        ) from None
    if device and found != device:
        raise ValueError(f"--device {device} is not to be had: JAX computes on {found}")
