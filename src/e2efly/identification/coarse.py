"""Where the fit begins: a search over whole ranges, one quantity after the other, for vehicles far from their file."""

import numpy as np

from e2efly.identification.model import Model
from e2efly.identification.shooting import cost
from e2efly.identification.windows import Windows

FEW = 64
"""Windows that the search looks at."""
PASSES = 2
"""Times that all quantities are searched."""
LOGS = np.linspace(-0.7, 0.7, 15)
"""Logarithms of the factors that are tried: half to twice."""
DELAYS = np.arange(-0.1, 0.155, 0.01)
"""Delays that are tried, s; below zero, so that clocks that do not fit together show."""
GROUPS: tuple[tuple[str, ...], ...] = (
    ("thrust",),
    ("latency",),
    ("motor_time_constant",),
    ("inertia_x", "inertia_y", "inertia_z"),
    ("rate_gain_x", "rate_gain_y", "rate_gain_z"),
    ("torque_ratio",),
)
"""Unknowns that are tried, those of a group at one value; in the order of what moves a flight most."""


def begin(model: Model, windows: Windows) -> np.ndarray:
    """A start of the fit, (u,): what explains the windows best among a few values of each quantity.

    The cost has valleys of its own far from the truth: 30 % less thrust looks like drag to Gauss-Newton, which goes
    downhill only.
    """
    names = [unknown.name for unknown in model.unknowns]
    some = windows.some(np.linspace(0, windows.count - 1, min(windows.count, FEW)).astype(int))
    p = np.zeros(len(names))
    best = cost(model, some, p)
    for _ in range(PASSES):
        for group in GROUPS:
            at = [names.index(name) for name in group if name in names]
            values = DELAYS - float(model.base.latency) if group == ("latency",) else LOGS
            for value in values if at else ():
                tried = p.copy()
                tried[at] = value
                if (now := cost(model, some, tried)) < best:
                    p, best = tried, now
    return p
