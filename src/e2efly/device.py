"""Where JAX computes, and how it compiles. Call `prepare` before anything imports JAX."""

import os
import sys
from pathlib import Path


def cache_folder() -> Path:
    """The user's cache folder of this package."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "e2efly"


XLA_OPTIONS = {
    # a loop over small arrays runs as one machine function instead of a task for each of its operations
    "xla_backend_extra_options": "xla_cpu_small_while_loop_byte_threshold=1000000",
    # cores work on vehicles of their own (e2efly.learn.devices), not together on one small matrix
    "xla_cpu_multi_thread_eigen": "false",
}
"""What makes XLA fast on a CPU here: a quarter of a million training steps a second become one million."""


def set_xla_options() -> None:
    """Set `XLA_OPTIONS` and make a device of each core, but for what the user's environment says.

    It has no effect once JAX has begun to compute.
    """
    flags = os.environ.get("XLA_FLAGS", "")
    wanted = [f"--{name}={value}" for name, value in XLA_OPTIONS.items() if name not in flags]
    os.environ["XLA_FLAGS"] = " ".join([*flags.split(), *wanted])
    if "xla_force_host_platform_device_count" not in flags:
        os.environ.setdefault("JAX_NUM_CPU_DEVICES", str(len(os.sched_getaffinity(0))))


def prepare(device: str | None = None) -> None:
    """Choose the device, set `XLA_OPTIONS` and turn on the persistent compilation cache.

    What JAX's own variables and XLA_FLAGS say stays. Call it before anything computes with JAX.

    Args:
        device: `cpu`, `gpu`, or None: whatever JAX finds.

    Raises:
        ValueError: for an unknown device, or one that this machine or this JAX does not have: never another instead.
    """
    if device not in (None, "cpu", "gpu"):
        raise ValueError(f"--device is {device!r}; accepted: cpu, gpu")
    if device and "jax" not in sys.modules:
        os.environ["JAX_PLATFORMS"] = {"cpu": "cpu", "gpu": "cuda"}[device]
    set_xla_options()
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
