"""Gauss-Newton multiple shooting: finds the vehicle's unknowns that explain all windows, each with its own start.

The start of every window is free, with a prior, and is eliminated with the Schur complement. Residuals are weighted
with Huber's weights (P. J. Huber, "Robust Estimation of a Location Parameter", 1964), and with the spread that each
sensor shows. Multiple shooting: H. G. Bock, "Numerical treatment of inverse problems in chemical reaction kinetics",
1981.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from e2efly.alignment.least_squares import HUBER, huber, jackknife
from e2efly.alignment.misfit import LeftOver, left_over, white_by
from e2efly.alignment.model import FACTOR, FORCE, GYRO, NUISANCES, WIND, Model, attitude_error, from_zero, simulate
from e2efly.alignment.windows import LENGTH, Windows

NOISE = {
    "body_rate": 0.05, "specific_force": 0.5, "rotor_speed": 20.0, "velocity": 0.05, "quaternion": 0.02,
    "position": 0.01,
}  # fmt: skip
"""The first value of each sensor's spread about the model, in its unit. Later it is the spread of the residuals."""
FLOOR = {
    "body_rate": 2e-3, "specific_force": 0.02, "rotor_speed": 0.5, "velocity": 2e-3, "quaternion": 5e-4,
    "position": 2e-4,
}  # fmt: skip
"""The smallest spread of each sensor, in its unit."""
CALM = 0.9
"""The spread of a sensor is chosen so that this share of the windows is closer to the model. In calm flight, the flight
controller mainly reacts to disturbances, and only the lively windows show the vehicle itself."""
JUDGES = (("body_rate",), ("rotor_speed",), ("velocity", "specific_force", "position"))
"""Sensors that judge the fit: of each group the first that was measured. The velocity is the sum of the specific force,
without the accelerometer's own faults. The attitude follows from the body rates."""
FREE, FREE_ROTOR = np.array([0.05] * 3 + [0.5] * 3 + [0.1] * 3 + [0.5] * 3), 0.3
"""Standard deviations of a window's start about the measured start: of the body, and of each rotor."""
SPUN = 0.003
"""The same for rotor speeds that follow from the motor outputs before the window. If it were larger, disturbances would
be explained by rotors that have not settled yet, and the motor lag by the duration of the disturbances."""
STILL = 0.02
"""If a step changes every unknown by less than this number of its standard deviations, it is the last."""
BATCH = 4
"""The number of windows that are computed together, so that one compiled program serves flights of any length. A larger
batch is not faster per window, and a short flight could not fill it. The batches are computed one after the other: if
several threads start programs at once, they wait for each other for ever, because they share XLA's own threads."""


@dataclass(frozen=True)
class Fit:
    """The result of the fit."""

    p: np.ndarray
    """(u,) unknowns of the vehicle."""
    q: np.ndarray
    """(flights, nuisances) nuisance parameters of each flight."""
    covariance: np.ndarray
    """(u, u) covariance of `p`: the sandwich estimate over the windows, which also holds if residuals are not white."""
    assumed: np.ndarray
    """(u, u) covariance of `p` for white residuals: that of Gauss-Newton."""
    between: np.ndarray
    """(u,) standard deviations of `p` by the spread between flights; zeros for one flight."""
    noise: dict[str, float]
    """Spread of each sensor about the fitted model."""
    iterations: int
    misfits: tuple[LeftOver, ...]
    """What the fit leaves over, by sensor."""


def fit(
    model: Model,
    windows: Windows,
    p: np.ndarray | None = None,
    iterations: int = 30,
    told: Callable[[int, float], None] = lambda i, cost: None,
    fixed: np.ndarray | None = None,
) -> Fit:
    """Find the unknowns.

    Args:
        model: the vehicle of the file, and the signal that drives it.
        windows: the windows of one or several flights.
        p: the first values of the unknowns. None: the values of the file.
        iterations: the largest number of iterations.
        told: called with (iteration, cost) after each iteration.
        fixed: (u,) marks the unknowns that keep the values of the file. None: no unknown is fixed.
    """
    with jax.enable_x64(True):
        return _fit(model, windows, p, iterations, told, fixed)


def _fit(
    model: Model,
    windows: Windows,
    p0: np.ndarray | None,
    iterations: int,
    told: Callable[[int, float], None],
    fixed: np.ndarray | None,
) -> Fit:
    unknowns, flights = model.unknowns, int(windows.flight.max()) + 1
    u, v = len(unknowns), len(NUISANCES)
    prior_p = np.array([x.prior for x in unknowns])
    if fixed is not None:
        prior_p[fixed] = 1e-6
    prior_q = np.array([sigma for _, sigma in NUISANCES])
    prior_q[WIND] = 1e-6  # windows this short do not tell wind from drag
    if flights == 1 or model.driver == "rotor_speed":
        prior_q[FACTOR] = 1e-6  # one flight cannot tell its own factor from the vehicle's
    # without poses, a bias cannot be distinguished from errors of the model
    if "quaternion" not in windows.measured:
        prior_q[GYRO] = 1e-6
    if "velocity" not in windows.measured and "position" not in windows.measured:
        prior_q[FORCE] = 1e-6
    p = np.zeros(u) if p0 is None else np.array(p0)
    # motors never respond before their outputs; if they seem to respond before commands, the clocks do not match
    least = np.full(u, -np.inf)
    if model.driver in ("motor", "motor_and_rate"):
        least[[x.field == "latency" for x in unknowns]] = -float(model.base.latency)
    least[from_zero(model.base, unknowns) > 0] = 0.0
    q, starts = np.zeros((flights, v)), np.zeros((windows.count, model.start))
    noise = {name: NOISE[name] for name in windows.measured}
    data = _data(model, windows)
    free = _free(model)
    if model.driver in ("motor", "motor_and_rate"):
        free[12:] = SPUN
    if "velocity" not in windows.measured and "position" not in windows.measured:
        free[:6] = 1e-6
    if "quaternion" not in windows.measured:
        free[6:9] = 1e-6

    def total(p: np.ndarray, q: np.ndarray, costs: np.ndarray) -> float:
        return float(np.sum(costs) + 0.5 * np.sum((p / prior_p) ** 2) + 0.5 * np.sum((q / prior_q) ** 2))

    known = np.diag(np.concatenate([prior_p**-2, np.tile(prior_q**-2, flights)]))
    damping, i, held = 1e-3, 0, np.zeros(0, int)
    at = partial(_at, model, data, free)
    cost = total(p, q, at(_costs, p, q, starts, noise)["cost"])
    terms = at(_slopes, p, q, starts, noise)
    for i in range(1, iterations + 1):
        H, g = _assembled(terms, windows.flight, flights, u, v)
        H += known
        g += np.concatenate([p / prior_p**2, (q / prior_q**2).ravel()])
        held = np.flatnonzero((p <= least) & (g[:u] > 0))  # a delay below zero is impossible
        H[held, held] *= 1e12
        for _ in range(8):
            step = -np.linalg.solve(H + damping * np.diag(np.diag(H)), g)
            dp, dq = np.maximum(step[:u], least - p), step[u:].reshape(flights, v)
            both = np.concatenate([np.broadcast_to(dp, (windows.count, u)), dq[windows.flight]], 1)
            moved = starts - terms["gain"] - np.einsum("nij,nj->ni", terms["slope"], both)
            tried = at(_costs, p + dp, q + dq, moved, noise)
            now = total(p + dp, q + dq, tried["cost"])
            if np.isfinite(now) and now < cost:
                break
            damping *= 10
        else:
            break
        gained = cost - now
        p, q, starts, cost, damping = p + dp, q + dq, moved, now, max(damping / 10, 1e-9)
        told(i, cost)
        spread = _spread(_left(tried), windows.there)
        settled = all(abs(np.log(spread[name] / noise[name])) < 0.02 for name in noise)
        still = np.abs(dp) < np.maximum(STILL * np.sqrt(np.diag(np.linalg.inv(H)))[:u], 1e-4)
        if not settled:
            noise = spread
            cost = total(p, q, at(_costs, p, q, starts, noise)["cost"])
        terms = at(_slopes, p, q, starts, noise)
        if settled and (gained < 1e-3 or np.all(still)):
            break
    H, _ = _assembled(terms, windows.flight, flights, u, v)
    H += known
    inverse = np.linalg.inv(H)
    each = np.zeros((windows.count, len(H)))
    each[:, :u] = terms["g"][:, :u]
    for f in range(flights):
        own = windows.flight == f
        each[np.ix_(own, np.arange(u + f * v, u + (f + 1) * v))] = terms["g"][own, u:]
    each -= each.mean(0)
    # if windows are short, a disturbance affects several neighbouring windows
    group = np.arange(windows.count) // max(round(LENGTH / windows.length), 1)
    groups = np.zeros((group[-1] + 1, len(H)))
    np.add.at(groups, group, each)
    inner = groups.T @ groups * (len(groups) / max(len(groups) - 1, 1))
    sandwich = inverse @ (inner + known) @ inverse
    parts = [_assembled(terms, np.where(windows.flight == f, f, -1), flights, u, v) for f in range(flights)]
    pulled = np.concatenate([p / prior_p**2, (q / prior_q**2).ravel()])
    stiff = known.copy()
    stiff[held, held] *= 1e12
    between = jackknife(np.stack([H for H, _ in parts]), np.stack([g for _, g in parts]), stiff, pulled)[:u]
    left = _left(at(_costs, p, q, starts, noise))
    misfits = []
    for name in (measured[0] for group in JUDGES if (measured := [name for name in group if name in left])):
        own, _ = _assembled({"H": terms[f"H/{name}"], "g": terms["g"]}, windows.flight, flights, u, v)
        white = white_by(inverse, own)[:u]
        there = windows.there[name]
        misfits.append(left_over(name, left[name], windows.measured[name], there, noise[name], white))
    return Fit(p, q, sandwich[:u, :u], inverse[:u, :u], between, noise, i, tuple(misfits))


def cost(model: Model, windows: Windows, p: np.ndarray) -> float:
    """The cost of the windows at `p`, with their measured starts."""
    with jax.enable_x64(True):
        noise = {name: NOISE[name] for name in windows.measured}
        q, starts = np.zeros((int(windows.flight.max()) + 1, len(NUISANCES))), np.zeros((windows.count, model.start))
        return float(np.sum(_at(model, _data(model, windows), _free(model), _costs, p, q, starts, noise)["cost"]))


def _free(model: Model) -> np.ndarray:
    """Standard deviations of a window's start, (`model.start`,)."""
    return np.concatenate([FREE, np.full(model.base.rotor_count, FREE_ROTOR)])


def _by_batch(computed: Callable[[Any], Any], data: dict[str, np.ndarray]) -> Any:
    """Apply a compiled function of a batch of windows to all windows. Returns NumPy leaves (windows of whole batches,
    ...).
    """
    batches = [{k: x[i : i + BATCH] for k, x in data.items()} for i in range(0, len(data["counts"]), BATCH)]
    found = [jax.tree.map(np.asarray, computed(batch)) for batch in batches]
    return jax.tree.map(lambda *parts: np.concatenate(parts), *found)


def _data(model: Model, windows: Windows) -> dict[str, np.ndarray]:
    """The arrays of all windows, padded to whole batches, with a guess of each window's start."""
    n = windows.count
    full = -(-n // BATCH) * BATCH
    data: dict[str, Any] = {"driven": windows.driven, "when": windows.when, "flight": windows.flight}
    data |= {f"start/{name}": guess for name, guess in _guesses(windows, model).items()}
    for name in windows.measured:
        data[f"measured/{name}"], data[f"there/{name}"] = windows.measured[name], windows.there[name]
    data["counts"] = np.ones(n)
    return {k: np.concatenate([x, np.repeat(x[:1] * (k != "counts"), full - n, 0)]) for k, x in data.items()}


def measured_starts(model: Model, windows: Windows) -> dict[str, np.ndarray]:
    """The `window` argument of `simulate` for each of the windows, with their measured starts."""
    return {"driven": windows.driven, "when": windows.when} | _guesses(windows, model)


def _guesses(windows: Windows, model: Model) -> dict[str, np.ndarray]:
    """The start of each window from its streams. A missing stream is replaced by the values of a hovering vehicle."""
    n, found = windows.count, {}
    zero = np.zeros(3)
    for name, default in (
        ("position", zero), ("velocity", zero), ("quaternion", np.eye(4)[0]), ("body_rate", zero),
        ("rotor_speed", np.full(model.base.rotor_count, float(model.hover))),
    ):  # fmt: skip
        found[name] = np.tile(default, (n, 1))
        if name in windows.start:
            seen = np.isfinite(windows.start[name]).all(1)
            found[name][seen] = windows.start[name][seen]
    return found


def _at(
    model: Model,
    data: dict[str, Any],
    free: np.ndarray,
    program: Callable[..., dict[str, Array]],
    p: np.ndarray,
    q: np.ndarray,
    starts: np.ndarray,
    noise: dict[str, float],
) -> dict[str, np.ndarray]:
    """What `_costs` or `_slopes` says of each window at these unknowns, nuisances and starts."""
    n = len(starts)
    moved = np.concatenate([starts, np.zeros((len(data["counts"]) - n, model.start))])
    found = _by_batch(partial(program, model, p, q, noise, free), {**data, "moved": moved})
    return {k: x[:n] for k, x in found.items()}


def _spread(left: dict[str, np.ndarray], there: dict[str, np.ndarray]) -> dict[str, float]:
    """The spread of each sensor about the model, by its residuals."""
    spread = {}
    for name, off in left.items():
        squares = np.sum(off**2, (1, 2)) / np.maximum(there[name].sum(1) * off.shape[-1], 1)
        seen = there[name].any(1)  # only windows that have this sensor count
        spread[name] = max(float(np.sqrt(np.quantile(squares[seen], CALM))), FLOOR[name])
    return spread


def _left(found: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The residuals, by sensor, from what `_costs` says."""
    return {key.removeprefix("left/"): x for key, x in found.items() if key.startswith("left/")}


@jax.jit
def _costs(
    model: Model, p: Array, q: Array, noise: dict[str, Any], free: Array, data: dict[str, Any]
) -> dict[str, Array]:
    """The cost and the residuals of each window. It needs no derivatives, which are the most expensive part."""

    def one(data: dict[str, Any]) -> dict[str, Array]:
        left = _residuals(model, p, q[data["flight"]], data["moved"], data, noise)
        costs = sum(jnp.sum(huber(left[name] / noise[name])) for name in noise)
        told = {"cost": costs * data["counts"] + 0.5 * jnp.sum((data["moved"] / free) ** 2)}
        return told | {f"left/{name}": left[name] for name in noise}

    return jax.vmap(one)(data)


@jax.jit
def _slopes(
    model: Model, p: Array, q: Array, noise: dict[str, Any], free: Array, data: dict[str, Any]
) -> dict[str, Array]:
    """Gradient and curvature of each window after its start has been eliminated."""
    return jax.vmap(partial(_window, model, p, q, noise, free))(data)


def _window(
    model: Model, p: Array, q: Array, noise: dict[str, Any], free: Array, data: dict[str, Any]
) -> dict[str, Array]:
    """Gradient and curvature of one window after its start has been eliminated."""
    u, v, start = p.shape[0], q.shape[1], data["moved"]

    def residuals(z: Array) -> tuple[Array, Array]:
        left = _residuals(model, z[:u], z[u : u + v], z[u + v :], data, noise)
        r = jnp.concatenate([(left[name] / noise[name]).ravel() for name in noise])
        return r, r

    z = jnp.concatenate([p, q[data["flight"]], start])
    J, r = jax.jacfwd(residuals, has_aux=True)(z)
    weight = jnp.minimum(1.0, HUBER / jnp.maximum(jnp.abs(r), 1e-12)) * data["counts"]
    A, g = (J * weight[:, None]).T @ J, J.T @ (weight * r)
    k = u + v
    Axx = A[k:, k:] + jnp.diag(free**-2.0)
    gx = g[k:] + start / free**2
    solved = jnp.linalg.solve(Axx, jnp.concatenate([gx[:, None], A[k:, :k]], 1))
    gain, slope = solved[:, 0], solved[:, 1:]
    out = {"H": A[:k, :k] - A[:k, k:] @ slope, "g": g[:k] - A[:k, k:] @ gain, "gain": gain, "slope": slope}
    with_start, row = J[:, :k] - J[:, k:] @ slope, 0
    for name in noise:  # the part of each sensor
        points, columns = data[f"measured/{name}"].shape
        rows = slice(row, row := row + points * (3 if name == "quaternion" else columns))
        out[f"H/{name}"] = (with_start[rows] * weight[rows, None]).T @ with_start[rows]
    return out


def _residuals(
    model: Model, p: Array, q: Array, start: Array, data: dict[str, Any], noise: dict[str, Any]
) -> dict[str, Array]:
    """Simulated minus measured values of each stream, in its unit. Zero where nothing was measured."""
    window = {"driven": data["driven"], "when": data["when"]} | {
        name: data[f"start/{name}"] for name in ("position", "velocity", "quaternion", "body_rate", "rotor_speed")
    }
    seen = simulate(model, p, q, start, window)
    left = {}
    for name in noise:
        there, measured = data[f"there/{name}"][:, None], data[f"measured/{name}"]
        if name == "quaternion":
            quiet = jnp.where(there > 0, measured, jnp.array([1.0, 0, 0, 0]))
            left[name] = attitude_error(quiet, seen[name]) * there
        else:
            left[name] = (seen[name] - measured) * there
    return left


def _assembled(
    terms: dict[str, Any], flight: np.ndarray, flights: int, u: int, v: int
) -> tuple[np.ndarray, np.ndarray]:
    """Curvature and gradient of all windows with respect to the unknowns and the nuisances of every flight."""
    size = u + flights * v
    H, g = np.zeros((size, size)), np.zeros(size)
    for f in range(flights):
        own, at = flight == f, np.concatenate([np.arange(u), np.arange(u + f * v, u + (f + 1) * v)])
        H[np.ix_(at, at)] += terms["H"][own].sum(0)
        g[at] += terms["g"][own].sum(0)
    return H, g
