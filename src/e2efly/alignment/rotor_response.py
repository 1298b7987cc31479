"""Lag, delay and rate loop from commands and measured rotor speeds.

The rate loop and the lag of the rotors are simulated from the commands and the *measured* body rates, and the rotor
speeds compared. The vehicle's inertia and its air do not matter. The mean of the rotors answers the commanded thrust,
whatever the rate loop is like: it gives lag and delay. Their differences give the gains.
"""

import math
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from e2efly.alignment.comparison import turns
from e2efly.alignment.least_squares import Solution, solve
from e2efly.alignment.misfit import LeftOver, left_over
from e2efly.alignment.model import Model, Unknown, value_of, vehicle_of
from e2efly.alignment.windows import GAP, STEP, integral, on_grid, past_steps
from e2efly.control.vectors import Vec3
from e2efly.logs.recording import Record, Stream
from e2efly.simulation.physics.body import gyroscopic_torque, rotor_speed_for
from e2efly.simulation.physics.integrate import lagged
from e2efly.simulation.physics.state import split
from e2efly.vehicles.vehicle import allocation_matrix

LONG, PIECES = 1.0, 4
"""Length of a window, s, and the number of parts of it that are judged apart."""
FLOOR = {"mean": 0.2, "difference": 0.5}
"""The smallest spread of the rotor speeds, rad/s."""
LIMITED = 0.1
"""Share of a rotor's range within which it counts as limited."""
QUICKEST = 1e-5
"""Smallest time constant of the gyroscope's filter, s: none."""
LITTLE = 0.3
"""Share of the points that count below which they do not show the rate loop: rotors at their limits hide it."""
MOST, ELSEWHERE = 25, (-0.02, 0.02)
"""Largest number of iterations of the fit, and by how much its first delay is moved, s, in others that are made if it
does not settle within them, or has little to go by."""
SMOOTHED = 0.01
"""Typical time constant of the filter of the commanded rates whose derivative is fed forward, s."""
_FLY = "steps of thrust and body rate, logged at 200 Hz or more, with the times at which commands were sent"
RESPONSE: tuple[Unknown, ...] = (
    Unknown("motor_time_constant", "motor_time_constant", (), 0.7, (), _FLY),
    Unknown("motor_time_constant_down", "motor_time_constant_down", (), 0.7, (), _FLY),
    Unknown("latency", "latency", (), 0.05, (), _FLY, added=True),
    Unknown("command_scale", "", (), 0.1, (), _FLY),
    Unknown("rate_gain_x", "rate_gain", (0,), 0.7, (), _FLY),
    Unknown("rate_gain_y", "rate_gain", (1,), 0.7, (), _FLY),
    Unknown("rate_gain_z", "rate_gain", (2,), 0.7, (), _FLY),
    Unknown("rate_integral_gain_x", "rate_integral_gain", (0,), 60.0, (), _FLY, added=True),
    Unknown("rate_integral_gain_y", "rate_integral_gain", (1,), 60.0, (), _FLY, added=True),
    Unknown("rate_integral_gain_z", "rate_integral_gain", (2,), 60.0, (), _FLY, added=True),
    Unknown("gyro_time_constant", "gyro_time_constant", (), 0.005, (), _FLY, added=True),
    Unknown("feed_forward", "", (), 0.5, (), _FLY),
    Unknown("feed_forward_lag", "", (), 0.5, (), _FLY),
)  # fmt: skip
"""Unknowns of the response. `command_scale` is the logarithm of a factor on the rotor speeds that are asked for;
`feed_forward` the part of the commanded angular acceleration that follows the derivative of the commanded rates;
`feed_forward_lag` the logarithm of the time constant of the filter before it over `SMOOTHED`."""


LAGS = ("motor_time_constant", "motor_time_constant_down")


def measurements(model: Model, records: Sequence[Record]) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Windows of flights with commands, body rates and rotor speeds, and which of their points count: those that were
    measured, before the body rates have a gap and before any rotor comes near its limits, where flight controllers
    differ.
    """
    past, m = past_steps(), round(LONG / STEP)
    parts: list[dict[str, np.ndarray]] = []
    for record in records:
        spans = [record.streams[name] for name in ("command", "body_rate", "rotor_speed")]
        first, last = max(s.time[0] for s in spans) + 2 * past * STEP, min(s.time[-1] for s in spans)
        begin = first + LONG * np.arange(max(int((last - first) / LONG), 0))
        around = begin[:, None] + STEP * np.arange(-2 * past, m + 1)
        rates, _ = on_grid(record.streams["body_rate"], around[:, past:].ravel())
        speeds, near = on_grid(record.streams["rotor_speed"], around[:, past:].ravel())
        driven = integral(record.streams["command"], around.ravel(), held=True)
        n = len(begin)
        speeds = speeds.reshape(n, -1, model.base.rotor_count)
        free = _free(model, speeds) & _whole(record.streams["body_rate"], around[:, past:])
        free = np.logical_and.accumulate(free, axis=1)
        parts.append({
            "command": np.diff(driven.reshape(n, -1, 4), axis=1) / STEP,
            "rate": rates.reshape(n, -1, 3) - gyro_bias(record),
            "speed": speeds,
            "turning": _turning(model, speeds[:, 1:]),
            "free": free[:, 1:].astype(float),
            "there": (near.reshape(n, -1) & free)[:, past:].astype(float),
        })  # fmt: skip
    data = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return data, {"mean": data["there"], "difference": np.repeat(data["there"], 3, axis=1)}


def responded(model: Model, records: Sequence[Record], plain: bool = False) -> tuple[Solution, list[LeftOver], float]:
    """The unknowns of `RESPONSE`, what is left over, and the share of the points that count. `plain`: the vehicle has
    nothing that its file lacks.
    """
    data, there = measurements(model, records)
    counted = float(there["mean"].mean())
    prior = np.array([u.prior for u in RESPONSE])
    least = np.full(len(RESPONSE), -np.inf)
    names = [u.name for u in RESPONSE]
    least[names.index("latency")] = -float(model.base.latency)
    quick = names.index("gyro_time_constant")
    least[quick] = QUICKEST - value_of(model.base, "gyro_time_constant")
    start = np.zeros(len(RESPONSE))
    start[quick] = max(least[quick], 0.0) + 1e-3

    held = np.array([plain and (u.absent(model.base) or u.name.startswith("feed_forward")) for u in RESPONSE])

    def found_from(more: float) -> Solution:
        begin = start + more * np.array([u.name == "latency" for u in RESPONSE])
        return solve(_residuals, (model, np.asarray(plain), data), there, begin, prior, FLOOR, least, held, MOST)

    def spread(found: Solution) -> float:
        return sum(float(there[name].sum()) * math.log(noise) for name, noise in found.noise.items())

    with jax.enable_x64(True):
        found = found_from(0.0)
        if found.iterations >= MOST or counted < LITTLE:  # the delay moves on by whole steps
            found = min(found, *(found_from(more) for more in ELSEWHERE), key=spread)
    return found, [_left_over(name, found, data) for name in found.left], counted


def _left_over(name: str, found: Solution, data: dict[str, Any]) -> LeftOver:
    """What is left over of the mean of the rotors, or of their differences, in quiet and lively parts of windows."""
    n, points = data["there"].shape
    step = points // PIECES

    def parts(values: np.ndarray) -> np.ndarray:
        return values.reshape(n, points, -1)[:, : PIECES * step].reshape(n * PIECES, step, -1)

    there, spun = parts(data["there"])[..., 0], parts(data["speed"][:, past_steps() :])
    mean = spun.mean(-1, keepdims=True)
    seen = mean if name == "mean" else spun - mean
    left, noise, white = found.left[name], found.noise[name], found.white[name]
    return left_over(f"rotor speeds, {name}", parts(left), seen, there, noise, white)


def _residuals(x: Array, data: tuple[Model, Array, dict[str, Any]]) -> dict[str, Array]:
    """Of all windows, by sensor, (n, rows) rad/s. A plain vehicle's rotors slow down as they speed up."""
    model, plain, windows = data
    up, down = (next(i for i, u in enumerate(RESPONSE) if u.field == f) for f in LAGS)
    x = x.at[down].set(jnp.where(plain, x[up], x[down]))
    return jax.vmap(lambda window: _of_window(model, x, window))(windows)


def _of_window(model: Model, x: Array, window: dict[str, Any]) -> dict[str, Array]:
    """Of one window, by sensor, (rows,) rad/s."""
    past = past_steps()
    spun = _rotors(model, x, window)[past:]
    off = (spun - window["speed"][past:]) * window["there"][:, None]
    a, b = jnp.sign(model.base.rotor_position[:, :2]).T
    turns = off @ jnp.stack([b, -a, jnp.asarray(model.base.rotor_spin)], -1) / model.base.rotor_count
    # what the rotors do for a torque that does not change, such as of a centre of mass, is not the rate loop's
    mean = jnp.sum(turns, 0) / jnp.maximum(jnp.sum(window["there"]), 1.0)
    return {"mean": jnp.mean(off, -1), "difference": ((turns - mean) * window["there"][:, None]).ravel()}


def _rotors(model: Model, x: Array, window: dict[str, Any]) -> Array:
    """Rotor speeds from one reach before a window to its end, (past + m + 1, N) rad/s."""
    vehicle = vehicle_of(model.base, RESPONSE, x)
    named = dict(zip((u.name for u in RESPONSE), x, strict=True))
    believed, mixer, past = model.believed, model.mixer, past_steps()
    # A command arrives within a step: before it, the one of a step earlier acts.
    whole = jax.lax.stop_gradient(jnp.floor(vehicle.latency / STEP))
    part = vehicle.latency / STEP - whole
    place = jnp.arange(past, len(window["command"])) - whole.astype(int)
    command, earlier = window["command"][jnp.clip(place, 0)], window["command"][jnp.clip(place - 1, 0)]
    decay, slowing = jnp.exp(-STEP / vehicle.motor_time_constant), jnp.exp(-STEP / vehicle.motor_time_constant_down)
    lag, smooth = vehicle.gyro_time_constant, jnp.exp(-STEP / (SMOOTHED * jnp.exp(named["feed_forward_lag"])))
    half = jnp.exp(-STEP / (2 * lag))
    gain, integral_gain = Vec3.of(vehicle.rate_gain), Vec3.of(vehicle.rate_integral_gain)
    inertia = Vec3.of(believed.inertia)

    def asked(thrust: Array, turning: Vec3, felt: Vec3) -> tuple[Array, ...]:
        torque = inertia.times(turning) + gyroscopic_torque(inertia, felt)
        return rotor_speed_for(believed, mixer.thrusts(believed.mass * thrust, torque))

    def follow(state: Any, seen: tuple[Array, ...]) -> tuple[Any, Array]:
        speed, filtered, followed, summed = state
        begin, end = Vec3.of(seen[2]), Vec3.of(seen[3])
        wanted = Vec3.of(seen[0][1:] * part + seen[1][1:] * (1 - part))
        behind = (end - begin) * (lag / STEP)  # how far the filter lags behind a steady change
        off = filtered - begin + behind
        felt, after = (begin + end) * 0.5 - behind + off * half, end - behind + off * half**2
        led = wanted + (followed - wanted) * smooth
        change = (led - followed) * (1 / STEP)
        error = wanted - felt
        total = summed + integral_gain.times(error) * STEP
        rest = (summed + total) * 0.5 + change * named["feed_forward"]
        old, new = (asked(c[0], gain.times(Vec3.of(c[1:]) - felt) + rest, felt) for c in seen[:2])
        scale = jnp.exp(named["command_scale"])
        driven = tuple(scale * (was * part + now * (1 - part)) for was, now in zip(old, new, strict=True))
        now = lagged(speed, driven, decay, slowing)
        return (now, after, led, total), jnp.stack(now)

    # The torque of a centre of mass or of uneven rotors stands in the integral part from before the window. Rotors at
    # their limits do not show it.
    first, rates = Vec3.of(window["rate"][0]), (window["rate"][1:] + window["rate"][:-1]) / 2
    error = command[:, 1:] - rates
    summed = vehicle.rate_integral_gain * jnp.cumsum(error, axis=0) * STEP
    stands = (window["turning"] - vehicle.rate_gain * error - summed) * window["free"][:, None]
    held = jnp.sum(stands, axis=0) / jnp.maximum(jnp.sum(window["free"]), 1.0)
    start = split(window["speed"][0]), first, Vec3.of(command[0, 1:]), Vec3.of(held)
    _, later = jax.lax.scan(follow, start, (earlier, command, window["rate"][:-1], window["rate"][1:]))
    return jnp.concatenate([window["speed"][:1], later])


def _turning(model: Model, speed: np.ndarray) -> np.ndarray:
    """The angular acceleration, (..., 3) rad/s^2, that rotor speeds, (..., N), give the flight controller's vehicle."""
    wrench = _thrust(model, speed) @ allocation_matrix(model.believed).T
    return wrench[..., 1:] / np.asarray(model.believed.inertia)


def _free(model: Model, speed: np.ndarray) -> np.ndarray:
    """Where no rotor, (..., N), is near its limits."""
    thrust, low, high = _thrust(model, speed), model.mixer.thrust_min, model.mixer.thrust_max
    margin = LIMITED * (high - low)
    return np.asarray(((thrust > low + margin) & (thrust < high - margin)).all(-1))


def _thrust(model: Model, speed: np.ndarray) -> np.ndarray:
    k2, k1, k0 = model.believed.thrust_map
    return (k2 * speed + k1) * speed + k0


def _whole(stream: Stream, grid: np.ndarray) -> np.ndarray:
    """Where a stream has no gap."""
    after = np.clip(np.searchsorted(stream.time, grid), 1, len(stream.time) - 1)
    return np.asarray(stream.time[after] - stream.time[after - 1] < GAP / stream.rate)


def gyro_bias(record: Record) -> np.ndarray:
    """The bias of the gyroscope, (3,) rad/s: by how much more it turned than the attitude. Zero without attitudes."""
    if not record.has("quaternion"):
        return np.zeros(3)
    pose, gyro = record.streams["quaternion"], record.streams["body_rate"]
    pose = pose.during(gyro.time[0], gyro.time[-1])
    passed, turned = np.diff(pose.time), turns(pose).values
    summed = integral(gyro, np.concatenate([gyro.time[:1], pose.time]), held=False)[1:]
    short = passed < GAP / pose.rate
    more = np.diff(summed, axis=0) - turned * passed[:, None]
    return np.asarray(more[short].sum(0) / passed[short].sum())
