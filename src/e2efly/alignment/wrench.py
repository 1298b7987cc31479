"""Thrust, drag and inertia from measured rotor speeds: the forces and torques of the physics against the sensors.

Nothing is simulated. The accelerations that the physics gives for the measured rotor speeds, attitudes and body rates
are summed up over short windows, each with a free start, and compared with gyroscope and velocity; the specific force
is compared with the accelerometer. Neither the lag of the rotors nor the flight controller matters.
"""

from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from e2efly.alignment.least_squares import Solution, between, solve
from e2efly.alignment.misfit import LeftOver, left_over
from e2efly.alignment.model import (
    FACTOR,
    FORCE,
    NUISANCES,
    POSE_DELAY,
    TILT,
    WIND,
    Model,
    from_zero,
    shares,
    turned,
    vehicle_of,
    wind_of,
)
from e2efly.alignment.shooting import Fit
from e2efly.alignment.windows import STEP, Windows, on_grid
from e2efly.control.vectors import Quat, Vec3
from e2efly.logs.recording import Record
from e2efly.simulation.physics.airframe import Airframe
from e2efly.simulation.physics.body import accelerations
from e2efly.simulation.physics.state import Parts, split
from e2efly.vehicles.gravity import GRAVITY

SHORT = 10
"""Steps over which the angular acceleration is summed up. The noise of the rotor speeds adds up, too."""
FLOOR = {"body_rate": 2e-3, "specific_force": 0.02, "velocity": 2e-3}
"""The smallest spread of each sensor, in its unit."""


def solved(model: Model, windows: Windows, records: Sequence[Record], fixed: np.ndarray) -> Fit:
    """The unknowns of the vehicle and the nuisances of each flight. Those unknowns that are `fixed`, (u,), are zero.

    The windows must be those of the driver rotor_speed.
    """
    flights, u = len(records), len(model.unknowns)
    data, there = measurements(windows, records)
    prior_q = np.tile([sigma for _, sigma in NUISANCES], (flights, 1))
    if flights == 1:
        prior_q[:, FACTOR] = 1e-6  # one flight cannot tell its own factor from the vehicle's
    if "velocity" not in there:
        prior_q[:, FORCE], prior_q[:, WIND] = 1e-6, 1e-6  # neither can be told from the thrust
    prior = np.concatenate([[x.prior for x in model.unknowns], prior_q.ravel()])
    least, held = np.full(len(prior), -np.inf), np.zeros(len(prior), bool)
    least[:u][from_zero(model.base, model.unknowns) > 0] = 0.0
    held[:u] = fixed
    with jax.enable_x64(True):
        found = solve(_residuals, (model, data), there, np.zeros(len(prior)), prior, FLOOR, least, held)
    return Fit(
        found.x[:u],
        found.x[u:].reshape(flights, -1),
        found.covariance[:u, :u],
        found.assumed[:u, :u],
        between(found, windows.flight)[:u],
        found.noise,
        found.iterations,
        tuple(_left_over(name, found, data, there[name], u) for name in found.left),
    )


def _left_over(name: str, found: Solution, data: dict[str, Any], there: np.ndarray, u: int) -> LeftOver:
    """What is left over of a sensor. Of the body rates, whose pieces have a free start, by the slopes of the pieces."""
    n, noise, white = len(there), found.noise[name], found.white[name][:u]
    off, mask = found.left[name].reshape(n, -1, 3), there.reshape(n, -1, 3)[..., 0]
    seen = (data[name][:, 1:] + data[name][:, :-1]) / 2 if name == "specific_force" else data[name]
    if name != "body_rate":
        return left_over(name, off, seen, mask, noise, white)
    ramp = np.arange(SHORT) - (SHORT - 1) / 2
    ramp /= np.sqrt(SHORT * np.sum(ramp**2))

    def slopes(values: np.ndarray) -> np.ndarray:
        return np.einsum("npsk,s->npk", values.reshape(n, -1, SHORT, 3), ramp)

    whole = mask.reshape(n, -1, SHORT).all(-1).astype(float)
    return left_over(name, slopes(off), slopes(seen[:, : off.shape[1]]), whole, noise / SHORT**0.5, white, span=1)


def measurements(windows: Windows, records: Sequence[Record]) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The windows of `_residuals`, and by sensor which of its rows were measured."""
    n, m = windows.count, windows.steps
    grid = windows.begin[:, None] + STEP * np.arange(m + 1)
    data: dict[str, Any] = {
        "flight": windows.flight,
        "when": windows.when,
        "speed": np.diff(windows.driven[:, -m - 1 :], axis=1) / STEP,
    }
    good: dict[str, np.ndarray] = {}
    still = {"body_rate": np.zeros(3), "quaternion": np.eye(4)[0], "velocity": np.zeros(3)}
    for name in ("body_rate", "quaternion", "velocity", "specific_force"):
        size = 4 if name == "quaternion" else 3
        data[name], good[name] = np.tile(still.get(name, np.zeros(size)), (n, m + 1, 1)), np.zeros((n, m + 1), bool)
        for flight, record in enumerate(records):
            own = windows.flight == flight
            if record.has(name) and own.any():
                values, near = on_grid(record.streams[name], grid[own].ravel())
                data[name][own], good[name][own] = values.reshape(-1, m + 1, size), near.reshape(-1, m + 1)
    data["quaternion"] = data["quaternion"] / np.linalg.norm(data["quaternion"], axis=-1, keepdims=True)
    pieces = m // SHORT * SHORT
    there = {"body_rate": good["body_rate"][:, :pieces]}
    if good["specific_force"].any():
        there["specific_force"] = good["specific_force"][:, 1:] & good["specific_force"][:, :-1]
    if (good["velocity"] & good["quaternion"]).any():
        there["velocity"] = good["velocity"]
    for name, mask in there.items():
        data[f"there/{name}"] = mask.astype(float)
    return data, {name: np.repeat(mask, 3, axis=1).astype(float) for name, mask in there.items()}


def _residuals(x: Array, data: tuple[Model, dict[str, Any]]) -> dict[str, Array]:
    """Of all windows, by sensor, (n, rows)."""
    model, windows = data
    u = len(model.unknowns)
    q = x[u:].reshape(-1, len(NUISANCES))
    return jax.vmap(lambda window: _of_window(model, x[:u], q[window["flight"]], window))(windows)


def _of_window(model: Model, p: Array, q: Array, window: dict[str, Any]) -> dict[str, Array]:
    """Of one window, by sensor, (rows,): x, y and z of each point."""
    vehicle = vehicle_of(model.base, model.unknowns, p)
    plant = Airframe.of(vehicle, STEP, shares(model, q, window["when"]))
    late, tilt = q[POSE_DELAY], jnp.stack([q[TILT][0], q[TILT][1], 0.0 * q[0]])
    rate, velocity, attitude = (_middle(window[name]) for name in ("body_rate", "velocity", "quaternion"))
    parts = Parts(
        Vec3.of(jnp.zeros_like(rate)), Vec3.of(velocity), Quat.of(turned(attitude, rate * late - tilt)), Vec3.of(rate),
        split(window["speed"]),
    )  # fmt: skip
    linear, angular = accelerations(plant, parts, wind_of(q))
    force = parts.attitude.unrotate(Vec3(linear.x, linear.y, linear.z + GRAVITY)).stack()
    spun, moved = _summed(angular.stack()), _summed(linear.stack())
    moved = moved - jnp.concatenate([linear.stack(), linear.stack()[-1:]]) * late
    out = {}
    pieces = window["there/body_rate"].shape[0]
    left = (spun - window["body_rate"])[:pieces].reshape(-1, SHORT, 3)
    out["body_rate"] = _freed(left, window["there/body_rate"].reshape(-1, SHORT, 1)).ravel()
    if "there/specific_force" in window:
        off = force + q[FORCE] - _middle(window["specific_force"])
        out["specific_force"] = (off * window["there/specific_force"][:, None]).ravel()
    if "there/velocity" in window:
        left = (moved - window["velocity"])[None]
        out["velocity"] = _freed(left, window["there/velocity"][None, :, None]).ravel()
    return out


def _middle(values: Array) -> Array:
    return (values[1:] + values[:-1]) / 2


def _summed(rate: Array) -> Array:
    return jnp.concatenate([jnp.zeros((1, 3)), jnp.cumsum(rate, axis=0) * STEP])


def _freed(left: Array, there: Array) -> Array:
    """Residuals, (pieces, points, 3), after the start of each piece has been set free."""
    mean = jnp.sum(left * there, 1, keepdims=True) / jnp.maximum(jnp.sum(there, 1, keepdims=True), 1.0)
    return (left - mean) * there
