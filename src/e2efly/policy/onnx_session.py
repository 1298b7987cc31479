"""A session of ONNX Runtime. A network that is new to this machine is loaded and run in another process first.

There it has a limit of time and of memory. If it hangs or crashes, only that process ends. The digest of a network that
has run is kept in the user's cache folder, together with the version of ONNX Runtime, so each file is tried once. The
networks of the package, and those that this machine has exported itself, need no trial.
"""

import io
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

import numpy as np
import onnxruntime as ort

from e2efly.config.storage import cache_folder

SCRIPT = Path(__file__).with_name("first_run.py")
"""What runs in the other process."""
SECONDS, MIB = 20, 1024
"""Limits of time and memory for loading a network and running it once."""


def open_session(content: bytes, inputs: Sequence[np.ndarray], trusted: bool = False) -> ort.InferenceSession:
    """A session on one thread. `content` was written by `onnx_file.write`. In the trial, it is given these inputs, in
    their order. One that is `trusted` may be loaded without a trial.

    Raises:
        ValueError: if ONNX Runtime refuses it, or it does not run within the limits.
    """
    if not trusted and not _mark(content).exists():
        _try_out(content, inputs)
        remember(content)
    options = ort.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4
    try:
        return ort.InferenceSession(content, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # ONNX Runtime's errors share no other base
        raise _refused(str(error)) from None


def remember(content: bytes) -> None:
    """Note that a network runs on this machine. Where there is no place for the note, it will be tried again."""
    with suppress(OSError):
        _mark(content).parent.mkdir(parents=True, exist_ok=True)
        _mark(content).touch()


def _mark(content: bytes) -> Path:
    return cache_folder() / "networks" / sha256(ort.__version__.encode() + content).hexdigest()


def _try_out(content: bytes, inputs: Sequence[np.ndarray]) -> None:
    given = io.BytesIO()
    np.savez(given, *inputs, content=np.frombuffer(content, np.uint8))
    command = [sys.executable, str(SCRIPT), str(MIB), str(SECONDS)]
    try:
        ended = subprocess.run(command, input=given.getvalue(), capture_output=True, timeout=SECONDS, check=False)
    except subprocess.TimeoutExpired:
        raise ValueError(f"does not load and run within {SECONDS} s; accepted: a network that does") from None
    except OSError as error:
        raise ValueError(f"cannot be tried out in a process of its own: {error}") from None
    if ended.returncode:
        said = ended.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        ends = f"its process ended with status {ended.returncode}, within {SECONDS} s and {MIB} MiB"
        raise _refused(said or ends)


def _refused(said: str) -> ValueError:
    return ValueError(f"not an ONNX file that ONNX Runtime {ort.__version__} can load and run: {said}")
