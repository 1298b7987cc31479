"""Load a network and run it once, within limits of memory and time: `python first_run.py MIB SECONDS < INPUT`.

The input is an .npz: `content`, the bytes of an ONNX file, and `arr_0`, `arr_1`, ... for the inputs of its graph, in
their order. The exit status is 0 if the network ran. Otherwise the last line of the standard error says why not.
This script needs NumPy and ONNX Runtime alone.
"""

import io
import sys

import numpy as np
import onnxruntime


def main(mib: int, seconds: int) -> None:
    """Load and run the network."""
    given = np.load(io.BytesIO(sys.stdin.buffer.read()), allow_pickle=False)
    content, inputs = given["content"].tobytes(), [given[f"arr_{i}"] for i in range(len(given.files) - 1)]
    _limit(mib, seconds)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4
    session = onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
    session.run(None, dict(zip([node.name for node in session.get_inputs()], inputs, strict=True)))


def _limit(mib: int, seconds: int) -> None:
    """Limit this process. Windows has no such limits; there, the process that waits for this one ends it."""
    if sys.platform == "win32":
        return
    import resource

    def lower(kind: int, most: int) -> None:
        _, hard = resource.getrlimit(kind)
        most = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(kind, (most, most))

    lower(resource.RLIMIT_CPU, seconds)  # also where the process that waits for this one is gone
    if sys.platform == "linux":
        with open("/proc/self/statm") as file:  # noqa: PTH123
            lower(resource.RLIMIT_AS, int(file.read().split()[0]) * resource.getpagesize() + (mib << 20))


if __name__ == "__main__":
    try:
        main(*map(int, sys.argv[1:3]))
    except Exception as error:  # ONNX Runtime's errors share no other base
        sys.exit(f"{type(error).__name__}: {error}".replace("\n", " "))
