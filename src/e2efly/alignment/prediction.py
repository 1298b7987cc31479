"""Comparison of the identified vehicle and the file's vehicle in predicting unseen windows, open loop."""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from e2efly.alignment.identification import Found
from e2efly.alignment.model import NUISANCES, START, attitude_error, simulate
from e2efly.alignment.shooting import measured_starts
from e2efly.alignment.windows import STEP


@dataclass(frozen=True)
class Prediction:
    """Windows that the fit did not see, simulated from their measured starts."""

    time: np.ndarray
    """(m + 1,) time since the start of a window, s."""
    before: dict[str, np.ndarray]
    """By stream, (m + 1,): root mean square error of the file's vehicle at that time."""
    after: dict[str, np.ndarray]
    """The same for the identified vehicle."""
    measured: dict[str, np.ndarray]
    """Measurements by stream, (n, m + 1, k)."""
    old: dict[str, np.ndarray]
    new: dict[str, np.ndarray]


def judged(found: Found) -> Prediction:
    """Predict the windows that were held out of the fit."""
    windows = found.windows.some(found.held_out)
    model, p = found.model, found.p
    with jax.enable_x64(True):
        data = measured_starts(model, windows)

        def seen(p: Any, q: np.ndarray) -> dict[str, np.ndarray]:
            def one(data: dict[str, Any], q: Any) -> dict[str, Any]:
                return simulate(model, p, q, jnp.zeros(START), data)

            return jax.tree.map(np.asarray, jax.jit(jax.vmap(one))(data, q))

        still = np.zeros((windows.count, len(NUISANCES)))
        old, new = seen(np.zeros(len(p)), still), seen(p, found.fit.q[windows.flight])

    def wrong(guess: dict[str, np.ndarray], name: str) -> np.ndarray:
        there = windows.there[name] > 0
        if name == "quaternion":
            quiet = np.where(there[..., None], windows.measured[name], [1.0, 0, 0, 0])
            left = np.asarray(attitude_error(jnp.asarray(quiet), jnp.asarray(guess[name])))
        else:
            left = guess[name] - windows.measured[name]
        square = np.where(there, np.sum(left**2, -1), np.nan)
        with np.errstate(invalid="ignore"):
            count = np.maximum(np.sum(there, 0), 1)
        return np.sqrt(np.nansum(square, 0) / count)

    names_there = [name for name in windows.measured if windows.there[name].any()]
    return Prediction(
        np.arange(windows.steps + 1) * STEP,
        {name: wrong(old, name) for name in names_there},
        {name: wrong(new, name) for name in names_there},
        windows.measured, old, new,
    )  # fmt: skip
