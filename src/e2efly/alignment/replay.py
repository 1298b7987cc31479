"""Replay of flights: the simulator gets the commands that were sent and starts from the measured state."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from e2efly.alignment.model import NUISANCES, Model, attitude_error, commanded, simulate, vehicle_of
from e2efly.alignment.windows import MEASURED, STEP, integral, on_grid, past_steps
from e2efly.control import COMMAND_MODES
from e2efly.logs.recording import Record
from e2efly.simulation.physics.airframe import Airframe
from e2efly.simulation.physics.control import control_law
from e2efly.simulation.physics.integrate import lagged
from e2efly.simulation.physics.state import Parts, State, split

SIGNALS = {
    "roll_rate": "rad/s", "pitch_rate": "rad/s", "yaw_rate": "rad/s", "thrust": "m/s^2", "attitude": "rad",
    "velocity": "m/s",
}  # fmt: skip
"""The signals in which a replay is compared with the measurement, and their units. Thrust is the specific force along
body z, attitude is the angle between the two attitudes, velocity is the length of the difference."""
RATES = ("roll_rate", "pitch_rate", "yaw_rate")


@dataclass(frozen=True)
class Stretches:
    """n sections of a flight, with m steps each, on a uniform time grid."""

    begin: np.ndarray
    """(n,) start times, s of the record's clock."""
    time: np.ndarray
    """(m + 1,) time since the start of a section, s."""
    command: np.ndarray
    """(n, m + 1, 4) commands as sent: thrust over mass, m/s^2, and body rates, rad/s."""
    driven: np.ndarray
    """(n, past + m + 1, 4) integral of the commands over time."""
    rate_before: np.ndarray
    """(n, past, 3) body rates before the start of each section, rad/s."""
    measured: dict[str, np.ndarray]
    """Measurements by stream, (n, m + 1, k)."""
    there: dict[str, np.ndarray]
    """By stream, (n, m + 1): whether there is a sample near enough in time to be used."""


def stretches(record: Record, begin: Sequence[float] | np.ndarray, length: float) -> Stretches:
    """Sections of a flight with commands and body rates, of a length in s.

    `begin` are (n,) increasing start times, s of the record's clock.
    """
    begin, past, m = np.asarray(begin, float), past_steps(), round(length / STEP)
    around = begin[:, None] + STEP * np.arange(-past, m + 1)
    inside = around[:, past:]
    sent, rates = record.streams["command"], record.streams["body_rate"]
    latest = np.clip(np.searchsorted(sent.time, inside, side="right") - 1, 0, None)
    measured, there = {}, {}
    for name in (name for name in MEASURED if record.has(name)):
        values, good = on_grid(record.streams[name], inside.ravel())
        measured[name] = values.reshape(*inside.shape, -1)
        there[name] = good.reshape(inside.shape)
    whole = integral(sent, around.ravel(), held=True).reshape(*around.shape, 4)
    before, _ = on_grid(rates, around[:, :past].ravel())
    before = before.reshape(len(begin), past, 3)
    return Stretches(begin, STEP * np.arange(m + 1), sent.values[latest], whole, before, measured, there)


def replay(model: Model, p: np.ndarray, flown: Stretches) -> dict[str, np.ndarray]:
    """The motion of the simulated vehicle in each section, by stream, (n, m + 1, k).

    It is driven by commands in open loop, from the measured start. The rotors begin with the speeds that result from
    the commands and the body rates before the start. If the log has no poses, the vehicle begins level and at rest.
    """
    n = len(flown.begin)
    window: dict[str, Any] = {"driven": flown.driven, "when": np.zeros(n), "before": flown.rate_before}
    for name, still in (("position", np.zeros(3)), ("velocity", np.zeros(3)), ("quaternion", np.eye(4)[0])):
        window[name] = flown.measured[name][:, 0] if name in flown.measured else np.tile(still, (n, 1))
    window["body_rate"] = flown.measured["body_rate"][:, 0]
    with jax.enable_x64(True):
        return jax.tree.map(np.asarray, _replayed(model, jnp.asarray(p), window))


@jax.jit
def _replayed(model: Model, p: Array, windows: dict[str, Any]) -> dict[str, Array]:
    def one(window: dict[str, Any]) -> dict[str, Array]:
        turning = {"rotor_speed": _rotors(model, p, window)}
        return simulate(model, p, jnp.zeros(len(NUISANCES)), jnp.zeros(model.start), window | turning)

    return jax.vmap(one)(windows)


def _rotors(model: Model, p: Array, window: dict[str, Any]) -> Array:
    """Rotor speeds at the start, (N,) rad/s. The motors follow the outputs that the rate loop gives at the measured
    rates.
    """
    vehicle, before = vehicle_of(model.base, model.unknowns, p), window["before"]
    plant = Airframe.of(vehicle, STEP)
    asked, _ = commanded(vehicle.latency, window["driven"])
    law = control_law(COMMAND_MODES["ctbr"])
    controller = model.controller(vehicle)

    def wanted(rate: Array, command: Array) -> Any:
        state = State(jnp.zeros(3), jnp.zeros(3), jnp.eye(4)[0], rate, jnp.zeros(vehicle.rotor_count))
        return law(controller, model.mixer, Parts.of(state), split(command), None)

    def follow(speed: Any, seen: tuple[Array, Array]) -> tuple[Any, None]:
        return lagged(speed, wanted(*seen), plant.decay), None

    speed, _ = jax.lax.scan(follow, wanted(before[0], asked[0]), (before, asked))
    return jnp.stack(speed)


def asking(flown: Stretches, gain: float) -> Stretches:
    """The sections as if this many times the thrust had been commanded."""
    more = np.array([gain, 1.0, 1.0, 1.0])
    return replace(flown, driven=flown.driven * more)


def wrong(flown: Stretches, seen: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """By signal, (n, m + 1): the difference between a replay and the measurement. NaN where nothing was measured.

    Thrust and velocity are omitted if the log does not contain the commanded thrust.
    """
    out: dict[str, np.ndarray] = {}

    def put(signal: str, stream: str, size: np.ndarray) -> None:
        out[signal] = np.where(flown.there[stream], size, np.nan)

    for axis, signal in enumerate(RATES):
        off = seen["body_rate"][..., axis] - flown.measured["body_rate"][..., axis]
        put(signal, "body_rate", np.abs(off))
    if "specific_force" in flown.measured and thrust_is_told(flown):
        off = seen["specific_force"][..., 2] - flown.measured["specific_force"][..., 2]
        put("thrust", "specific_force", np.abs(off))
    if "quaternion" in flown.measured:
        off = np.asarray(attitude_error(jnp.asarray(flown.measured["quaternion"]), jnp.asarray(seen["quaternion"])))
        put("attitude", "quaternion", np.linalg.norm(off, axis=-1))
    if "velocity" in flown.measured and "quaternion" in flown.measured and thrust_is_told(flown):
        put("velocity", "velocity", np.linalg.norm(seen["velocity"] - flown.measured["velocity"], axis=-1))
    return out


def thrust_is_told(flown: Stretches) -> bool:
    """Whether the thrust in the commands ever changes. Some logs, such as a blackbox, contain only body rates."""
    return bool(np.ptp(flown.command[..., 0]) > 0)


def rms(error: np.ndarray) -> float:
    """Root mean square of the known values, those that are not NaN."""
    return float(np.sqrt(np.nanmean(error**2))) if np.isfinite(error).any() else float("nan")
