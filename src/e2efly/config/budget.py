"""Memory and time that a command would need, compared with what is available. Impossible commands are refused early.

Estimates are low rather than high: a refused command would not fit, but an accepted one may still be too large.
"""

import math
import os
import sys
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

FASTEST = 1e8
"""Limit of environment steps per second. No machine trains or evaluates faster."""
LONGEST_S = 30 * 86_400.0
"""A command that takes longer than this, s, even at `FASTEST`, is a mistake."""
_UNITS = {"year": 365.25 * 86_400, "day": 86_400.0, "hour": 3600.0, "minute": 60.0}


def machine_memory() -> float:
    """Main memory, including swap, that this process may use, bytes. Infinite on Windows, which is not asked."""
    limits = [math.inf]
    if sys.platform != "win32":
        import resource

        limits.append(float(os.sysconf("SC_PAGE_SIZE")) * os.sysconf("SC_PHYS_PAGES") + _swap())
        limits.append(float(resource.getrlimit(resource.RLIMIT_AS)[0] % 2**64))  # -1 means no limit
    for file in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        with suppress(OSError, ValueError):  # "max", or no such group
            limits.append(float(Path(file).read_text(encoding="ascii")))
    return min(limits)


def check_memory(parts: Mapping[str, float], memory: float | None = None) -> None:
    """Refuse a command that does not fit into memory.

    Args:
        parts: bytes, by the options that determine them, as `NAME is VALUE, ...`.
        memory: available memory, bytes. If left out: that of the machine.

    Raises:
        ValueError: naming the options of the largest part, the memory of all parts, and the available memory.
    """
    total, has = sum(parts.values()), machine_memory() if memory is None else memory
    if total > has:
        raise ValueError(
            f"{max(parts, key=lambda name: parts[name])}: about {_bytes(total)} of memory; accepted: what fits into "
            f"the {_bytes(has)} of this machine"
        )


def check_time(seconds: Mapping[str, float], how: str = f"even at {FASTEST / 1e6:g} million steps per second") -> None:
    """Refuse a command that takes too long.

    Args:
        seconds: the least time of each part, by the options that determine it, as `NAME is VALUE, ...`.
        how: the assumption behind this time.

    Raises:
        ValueError: naming the options of the longest part, the time of all parts, and what is accepted.
    """
    total = sum(seconds.values())
    if total > LONGEST_S:
        raise ValueError(
            f"{max(seconds, key=lambda name: seconds[name])}: about {_time(total)}, {how}; accepted: what takes at "
            f"most {_time(LONGEST_S)}"
        )


def _swap() -> float:
    with suppress(OSError, StopIteration):
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        return 1024.0 * int(next(line for line in lines if line.startswith("SwapTotal:")).split()[1])
    return 0.0


def _bytes(count: float) -> str:
    unit = next((unit for unit in ("GB", "TB", "PB") if count < 1e3 * _SCALE[unit]), "EB")
    return f"{count / _SCALE[unit]:.3g} {unit}"


_SCALE = {"GB": 1e9, "TB": 1e12, "PB": 1e15, "EB": 1e18}


def _time(seconds: float) -> str:
    unit = next((unit for unit, size in _UNITS.items() if seconds >= 2 * size), "minute")
    return f"{seconds / _UNITS[unit]:.3g} {unit}s"
