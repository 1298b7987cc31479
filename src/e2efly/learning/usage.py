"""Resources that a run uses: time since the start of the process (imports included), and memory."""

import math
import os
import sys
import time

_IMPORTED = time.time()


def since_process_start() -> float:
    """Seconds since the operating system started this process. If the system does not report this, seconds since this
    module was imported.
    """
    if sys.platform != "linux":
        return time.time() - _IMPORTED
    try:
        with open("/proc/self/stat", encoding="ascii") as file:
            ticks = float(file.read().rsplit(")", 1)[1].split()[19])
        with open("/proc/uptime", encoding="ascii") as file:
            uptime = float(file.read().split()[0])
        return uptime - ticks / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, IndexError):
        return time.time() - _IMPORTED


def peak_memory() -> float:
    """Largest resident memory of this process so far, bytes. NaN on Windows, which is not asked."""
    if sys.platform == "win32":
        return math.nan
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return float(peak if sys.platform == "darwin" else 1024 * peak)
