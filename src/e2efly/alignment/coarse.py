"""The start of the fit: a search over the whole range of each quantity in turn, for vehicles far from their file."""

import numpy as np

from e2efly.alignment.model import Model
from e2efly.alignment.shooting import cost
from e2efly.alignment.windows import Windows

FEW = 64
"""Number of windows that the search uses."""
PASSES = 2
"""Number of passes over all quantities."""
LOGS = np.linspace(-0.7, 0.7, 15)
"""Logarithms of the factors that are tried: from half to twice the value."""
DELAYS = np.arange(-0.1, 0.155, 0.01)
"""Delays that are tried, s. Negative values are included, so that clocks that do not match become visible."""
GROUPS: tuple[tuple[str, ...], ...] = (
    ("thrust",),
    ("latency",),
    ("motor_time_constant",),
    ("inertia_x", "inertia_y", "inertia_z"),
    ("rate_gain_x", "rate_gain_y", "rate_gain_z"),
    ("torque_ratio",),
)
"""Unknowns that are tried. All unknowns of a group get the same value. Those with the largest effect on a flight come
first."""


def begin(model: Model, windows: Windows) -> np.ndarray:
    """The start of the fit, (u,): the values that explain the windows best, among a few values of each quantity.

    The cost has local minima far from the true values. For example, Gauss-Newton can mistake 30 % less thrust for drag,
    because it only goes downhill.
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
