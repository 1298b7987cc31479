"""The device on which JAX computes, and how it compiles. Call `prepare` before anything computes with JAX."""

import ctypes
import os
import platform
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from e2efly.config.storage import cache_folder


def programs_folder() -> Path:
    """Folder of the compiled programs."""
    return cache_folder() / "programs"


XLA_OPTIONS = {
    # a loop over small arrays runs as one machine function instead of a task for each of its operations
    "xla_backend_extra_options": "xla_cpu_small_while_loop_byte_threshold=1000000",
    # each core works on its own vehicles (e2efly.learning.devices), not together with others on one small matrix
    "xla_cpu_multi_thread_eigen": "false",
    # see wide_vectors
    "xla_cpu_prefer_vector_width": "128",
}
"""Options that make XLA fast on small batches on a CPU. docs/decisions.md gives the reasons."""


_USUAL = {
    "jax_enable_x64": False, "jax_disable_jit": False, "jax_numpy_dtype_promotion": "standard",
    "jax_numpy_rank_promotion": "allow",
}  # fmt: skip
"""Settings of JAX that the programs here need in order to compute, or to finish."""


def wide_vectors(vehicles: int) -> dict[str, Any]:
    """Options of XLA for a program in which a device steps `vehicles` vehicles: `jax.jit(f, compiler_options=...)`.

    Programs on many vehicles take a third of the time with full vectors of AVX-512. If arrays are no longer than one
    vector, LLVM makes one block of all operations of a step, and needs gigabytes to compile its gradient. Vectors are
    therefore narrow for few vehicles, and if the number is not known. Options in the user's XLA_FLAGS stay.
    """
    import jax

    ours = f"--xla_cpu_prefer_vector_width={XLA_OPTIONS['xla_cpu_prefer_vector_width']}"
    many = vehicles > 16 and jax.default_backend() == "cpu" and ours in os.environ.get("XLA_FLAGS", "").split()
    return {"xla_cpu_prefer_vector_width": 512} if many else {}


FAST_COMPILE: dict[str, dict[str, Any]] = {
    "cpu": {"xla_cpu_use_fusion_emitters": False, "xla_backend_optimization_level": 1},
    # cuBLAS has its matrix products ready; otherwise XLA compiles and times dozens of kernels for each of them
    "gpu": {"xla_gpu_enable_triton_gemm": False, "xla_gpu_autotune_level": 0},
}
"""XLA options that shorten the compilation, by device. On a CPU they halve it."""


def fast_compile() -> dict[str, Any]:
    """Options of XLA for a program that runs only for seconds."""
    import jax

    return unless_said(FAST_COMPILE.get(jax.default_backend(), {}))


def unless_said(options: dict[str, Any]) -> dict[str, Any]:
    """Options of XLA without those that the user's XLA_FLAGS name. The user's options stay."""
    said = {flag.removeprefix("--").partition("=")[0] for flag in os.environ.get("XLA_FLAGS", "").split()}
    return {name: value for name, value in options.items() if name not in said}


def set_xla_options() -> None:
    """Set `XLA_OPTIONS` and make one device per core, unless the user's environment says otherwise.

    It has no effect once JAX has begun to compute.
    """
    flags = os.environ.get("XLA_FLAGS", "")
    ours = {f"--{name}={value}" for name, value in XLA_OPTIONS.items()}
    if not ours >= set(flags.split()):
        _check_flags(flags)
    wanted = [f"--{name}={value}" for name, value in XLA_OPTIONS.items() if name not in flags]
    os.environ["XLA_FLAGS"] = " ".join([*flags.split(), *wanted])
    if "xla_force_host_platform_device_count" not in flags:
        with suppress(RuntimeError):  # JAX has begun to compute: the devices stay as they are
            _configure("jax_num_cpu_devices", cores())


@cache
def _check_flags(flags: str) -> None:
    """Refuse flags for which XLA would abort the process, by a test in another process."""
    code = "from jaxlib import xla_client; xla_client.CompileOptions()"  # reads the flags, and takes no device
    tried = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    if tried.returncode:
        told = (line.rpartition("] ")[2] for line in tried.stderr.splitlines())
        lines = [line for line in told if "XLA_FLAGS" in line or "flag" in line]
        said = f" ({lines[0]})" if lines else ""
        raise ValueError(f"XLA_FLAGS is {flags!r}; accepted: flags and values that XLA knows{said}")


def device_kind(asked: str | None = None) -> str:
    """The kind of device on which JAX will compute, `cpu` or `gpu`, found without importing JAX.

    It is the device that is asked for, or the first of JAX's own variable JAX_PLATFORMS. Otherwise it is a GPU if JAX's
    package for CUDA is installed and the driver has a GPU for this process. `prepare` refuses a device that JAX then
    does not have.
    """
    if asked is not None:
        return asked
    if first := os.environ.get("JAX_PLATFORMS", "").partition(",")[0]:
        return "gpu" if first in ("cuda", "gpu") else "cpu"
    installed = metadata.entry_points(group="jax_plugins")
    return "gpu" if any("cuda" in plugin.name for plugin in installed) and _gpus() else "cpu"


def _gpus() -> int:
    """Number of GPUs that NVIDIA's driver has for this process. 0 if there is no driver."""
    count = ctypes.c_int(0)
    try:
        driver = ctypes.CDLL("libcuda.so.1")
    except OSError:
        return 0
    return 0 if driver.cuInit(0) or driver.cuDeviceGetCount(ctypes.byref(count)) else count.value


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def processor(told: str | None = None) -> tuple[str, bool | None]:
    """The model of the processor, and whether it has AVX-512, which determines the cost of physics. None: not known.

    `told` is the system's description of its processors. If left out: /proc/cpuinfo, if it exists.
    """
    file = Path("/proc/cpuinfo")
    told = told if told is not None else file.read_text(encoding="utf-8") if file.exists() else ""
    about = {
        name.strip(): value.strip() for name, colon, value in (x.partition(":") for x in told.splitlines()) if colon
    }
    flags = about.get("flags", about.get("Features"))
    return about.get("model name") or platform.processor(), None if flags is None else "avx512f" in flags.split()


@contextmanager
def one_core() -> Iterator[None]:
    """Keep the calling thread, and the threads and processes that it starts, on its present core, if possible.

    This is right for processes that wait for each other in turn: waking a process on another core takes several times
    as long. If two uses overlap in one thread, end the later one first.
    """
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    whole = os.sched_getaffinity(0)
    told = Path("/proc/thread-self/stat").read_text(encoding="ascii")
    core = int(told.rsplit(")", 1)[1].split()[36])  # its 39th field
    os.sched_setaffinity(0, {core})
    try:
        yield
    finally:
        os.sched_setaffinity(0, whole)


def _configure(name: str, value: Any) -> None:
    """Set an option of JAX that the user's environment does not set. JAX may be imported already."""
    import jax

    if name.upper() not in os.environ and getattr(jax.config, name) != value:
        jax.config.update(name, value)


def compute_at_once() -> None:
    """Compute in the calling thread, if JAX has not begun to compute yet.

    This is right for one tiny program that is called again and again: passing it to another thread takes longer than
    the program itself.
    """
    import jax

    jax.config.update("jax_cpu_enable_async_dispatch", False)


@dataclass(frozen=True)
class Hosts:
    """Processes that train together, each on the devices of its own machine."""

    coordinator: str | None = None
    """HOST:PORT that process 0 opens and to which the others connect. If left out: a single process."""
    count: int = 1
    """Number of processes."""
    index: int = 0
    """Index of this process. Process 0 writes the files."""

    def join(self) -> None:
        """Wait for the other processes. Call it before anything computes.

        Raises:
            ValueError: naming the option, its value and what is accepted.
            OSError: when not all processes come within a minute.
        """
        if self.coordinator is None:
            if (self.count, self.index) != (1, 0):
                raise ValueError("hosts.coordinator is missing; accepted with hosts.count: HOST:PORT of process 0")
            return
        host, _, port = self.coordinator.rpartition(":")
        if not host or not port.isdigit():
            raise ValueError(f"hosts.coordinator is {self.coordinator!r}; accepted: HOST:PORT of process 0")
        if self.count < 1:
            raise ValueError(f"hosts.count is {self.count}; accepted: 1 or more")
        if not 0 <= self.index < self.count:
            raise ValueError(f"hosts.index is {self.index}; accepted: 0 to hosts.count - 1 ({self.count - 1})")
        import jax

        try:
            jax.distributed.initialize(
                self.coordinator, self.count, self.index, coordinator_bind_address=self.coordinator,
                initialization_timeout=60, heartbeat_timeout_seconds=20,
            )  # fmt: skip
        except RuntimeError as error:
            reason = str(error).splitlines()[0]
            raise OSError(f"not all {self.count} processes met at {self.coordinator}: {reason}") from None


def _check_configuration() -> None:
    """Refuse settings of JAX with which the programs here cannot compute."""
    import jax

    for name, wanted in _USUAL.items():
        if (value := getattr(jax.config, name)) != wanted:
            raise ValueError(f"{name.upper()} is {value}; accepted: {wanted}, which the programs here need")


def prepare(device: str | None = None, hosts: Hosts = Hosts()) -> None:
    """Choose the device, set `XLA_OPTIONS` and turn on the persistent compilation cache, with digests.

    Values of JAX's own variables and of XLA_FLAGS stay. Call it before anything computes with JAX.

    Args:
        device: `cpu`, `gpu`, or None for the device that JAX finds.
        hosts: the processes of the run.

    Raises:
        ValueError: for an unknown device, or one that this machine or this JAX does not have. Another device is never
            used instead.
        OSError: when the processes do not come together.
    """
    if device not in (None, "cpu", "gpu"):
        raise ValueError(f"--device is {device!r}; accepted: cpu, gpu")
    if device and "jax" not in sys.modules:
        os.environ["JAX_PLATFORMS"] = {"cpu": "cpu", "gpu": "cuda"}[device]
    from e2efly.simulation.compiled import check_programs

    set_xla_options()
    _check_configuration()
    _configure("jax_compilation_cache_dir", str(programs_folder()))
    check_programs(programs_folder)
    _configure("jax_persistent_cache_min_compile_time_secs", 0.05)
    _configure("jax_persistent_cache_min_entry_size_bytes", -1)
    hosts.join()
    import jax

    try:
        found = jax.devices()[0].platform
    except (RuntimeError, AssertionError) as error:  # JAX 0.10 asserts where CUDA's plug-in sees no GPU
        reason = (str(error) or "JAX finds none").splitlines()[0]
        asked = f"--device {device}" if device else f"JAX_PLATFORMS={os.environ.get('JAX_PLATFORMS', '')}"
        told = "NVIDIA GPUs: pip install 'e2efly[cuda]'; without one: --device cpu"
        raise ValueError(f"{asked} is not available: {reason} ({told})") from None
    if device and found != device:
        raise ValueError(f"--device {device} is not available: JAX computes on {found}")
