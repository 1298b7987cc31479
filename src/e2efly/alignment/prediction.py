"""Open-loop simulation of windows from their measured starts, and how far it is from what was measured."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from e2efly.alignment.found import Found
from e2efly.alignment.model import NUISANCES, Model, attitude_error, simulate
from e2efly.alignment.shooting import measured_starts
from e2efly.alignment.windows import STEP, Windows


@dataclass(frozen=True)
class Prediction:
    """Windows that the fit did not see, simulated from their measured starts."""

    time: np.ndarray
    """(m + 1,) time since the start of a window, s."""
    before: dict[str, np.ndarray]
    """By stream, (m + 1,): root mean square error of the file's vehicle at that time. NaN: nothing was measured."""
    after: dict[str, np.ndarray]
    """The same for the identified vehicle."""
    measured: dict[str, np.ndarray]
    """Measurements by stream, (n, m + 1, k)."""
    old: dict[str, np.ndarray]
    new: dict[str, np.ndarray]

    def at(self, errors: np.ndarray, seconds: Sequence[float]) -> np.ndarray:
        """Errors (m + 1,) at some times since the start of a window, between those that were measured. NaN beyond."""
        told = np.isfinite(errors)
        if not told.any():
            return np.full(len(seconds), np.nan)
        return np.interp(seconds, self.time[told], errors[told], right=np.nan)


def judged(found: Found) -> Prediction:
    """Predict the windows that were held out of the fit."""
    windows = found.windows.some(found.held_out)
    still = np.zeros((windows.count, len(NUISANCES)))
    old = simulated(found.model, np.zeros(len(found.p)), still, windows)
    new = simulated(found.model, found.p, found.fit.q[windows.flight], windows)

    def wrong(seen: dict[str, np.ndarray], name: str) -> np.ndarray:
        square = np.sum(off(windows, seen, name) ** 2, -1)
        count = np.isfinite(square).sum(0)
        return np.sqrt(np.where(count, np.nansum(square, 0) / np.maximum(count, 1), np.nan))

    names = [name for name in windows.measured if windows.there[name].any()]
    return Prediction(
        np.arange(windows.steps + 1) * STEP,
        {name: wrong(old, name) for name in names},
        {name: wrong(new, name) for name in names},
        windows.measured, old, new,
    )  # fmt: skip


def simulated(
    model: Model, p: np.ndarray, q: np.ndarray, windows: Windows, start: np.ndarray | None = None
) -> dict[str, np.ndarray]:
    """The simulated sensor readings of windows, by stream, (n, m + 1, k).

    Args:
        model: the model to simulate.
        p: unknowns of the vehicle, (u,).
        q: nuisances of the flight of each window, (n, len(NUISANCES)).
        windows: the windows.
        start: correction that is added to each measured start, (`model.start`,). If omitted, none.
    """
    first = np.zeros(model.start) if start is None else start
    with jax.enable_x64(True):
        return jax.tree.map(np.asarray, _simulated(model, p, q, first, measured_starts(model, windows)))


@jax.jit
def _simulated(model: Model, p: Array, q: Array, start: Array, data: dict[str, Any]) -> dict[str, Array]:
    return jax.vmap(lambda q, window: simulate(model, p, q, start, window))(q, data)


def off(windows: Windows, seen: dict[str, np.ndarray], name: str) -> np.ndarray:
    """Simulated minus measured values of a stream, (n, m + 1, k); of an attitude, the angle between the two about body
    axes, (n, m + 1, 3) rad. NaN where nothing was measured.
    """
    there, measured = windows.there[name][..., None] > 0, windows.measured[name]
    if name == "quaternion":
        quiet = np.where(there, measured, [1.0, 0, 0, 0])
        return np.where(there, np.asarray(attitude_error(jnp.asarray(quiet), jnp.asarray(seen[name]))), np.nan)
    return np.where(there, seen[name] - measured, np.nan)
