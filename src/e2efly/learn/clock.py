"""Time since the process began: what a user waits for includes imports."""

import os
import time

_IMPORTED = time.time()


def since_process_start() -> float:
    """Seconds since the operating system started this process (where it does not tell: since this was imported)."""
    try:
        with open("/proc/self/stat", encoding="ascii") as file:
            ticks = float(file.read().rsplit(")", 1)[1].split()[19])
        with open("/proc/uptime", encoding="ascii") as file:
            uptime = float(file.read().split()[0])
        return uptime - ticks / os.sysconf("SC_CLK_TCK")
    except (OSError, ValueError, IndexError):
        return time.time() - _IMPORTED
