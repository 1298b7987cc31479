"""Identification of a vehicle from flights: streams are checked, cut into windows, and fitted by multiple shooting."""

import dataclasses
from collections.abc import Callable, Sequence

import jax.numpy as jnp
import numpy as np

from e2efly.alignment.coarse import begin
from e2efly.alignment.estimates import Estimate
from e2efly.alignment.found import FittedPart, Found, Refusal, estimates_of, is_vague, refusals_of, whole_covariance
from e2efly.alignment.misfit import LeftOver, widened
from e2efly.alignment.model import FROM_ZERO, POSE_DELAY, UNKNOWNS, Model, from_zero, vehicle_of
from e2efly.alignment.rotor_response import LITTLE, RESPONSE, responded
from e2efly.alignment.shooting import Fit, fit
from e2efly.alignment.windows import LENGTH, LENGTHS, REACH, Windows, cut, join
from e2efly.alignment.wrench import solved
from e2efly.logs.blackbox_merge import DELAY_SIGMA, setpoint_delay
from e2efly.logs.recording import MOTORS, Record
from e2efly.vehicles.vehicle import RATE_LOOP, Vehicle

STRUCTURE = {"thrust_map": 0.002, "inertia": 0.004, "rate_gain": 0.01, "motor_time_constant": 0.01, "latency": 3e-4}
"""Spread of the results between models that differ in properties that no log shows: how often the flight controller
runs, and how the accelerometer is filtered. In s for the delay, else relative."""
ROTOR_STRUCTURE = STRUCTURE | {
    "motor_time_constant_down": 0.015, "rate_gain": 0.02, "rate_integral_gain": 3.0, "gyro_time_constant": 5e-4,
    "centre_of_mass": 1e-4, "inertia_products": 6e-6, "drag_linear": 0.1, "drag_quadratic": 0.1,
}  # fmt: skip
"""The same when rotor speeds were measured. Fields that are added: in their unit. Gusts, and the drag of the rotors
themselves, count as drag of the body."""
MOTOR_STRUCTURE = STRUCTURE | {"thrust_map": 0.035, "inertia": 0.02, "torque_ratio": 0.1, "motor_time_constant": 0.12}
"""The same when motor outputs drive the simulation. The relation between outputs and thrust is then assumed, and so are
one lag up and down, and the accelerometer's filter. Measured on such vehicles as `PULLED` in `misfit`, seeds
0 to 8."""
STRUCTURES = {"motor": MOTOR_STRUCTURE, "motor_and_rate": MOTOR_STRUCTURE, "rotor_speed": ROTOR_STRUCTURE}
HELD_OUT = 5
"""One window out of this many is held out of the fit, to judge the result."""
LEAST = 1.5
"""Minimum flight time that a fit needs, s: half a lap of a race shows all parameters. What a flight does not show is
refused by its standard deviation."""
TORQUES = 200.0
"""Sampling rate of motor outputs and rotor speeds from which on they show the torques on the body, Hz."""
GUESSED = 0.2
"""Standard deviation of a moment of inertia that is guessed by the two others, relative."""
NEAR, REFITS = 1.0, 2
"""`NEAR`: the number of standard deviations by which the other unknowns may change when refused ones are set to the
values of the file; beyond it, the fit is repeated. Those standard deviations hold for known refused ones. `REFITS`: the
largest number of such repetitions."""


def driver_of(records: Sequence[Record], step: bool = False) -> str:
    """The stream that drives the simulation of these flights (`Model.driver`).

    Raises:
        ValueError: naming the flight that has no such stream.
    """
    wanted = ("command",) if step else ("command", "rotor_speed", "motor")
    if not step and all(r.has("rotor_speed") and r.streams["rotor_speed"].rate >= TORQUES for r in records):
        wanted = ("rotor_speed",)
    elif not step and all(_shows_motors(record) and not _drives(record, "rotor_speed") for record in records):
        wanted = ("motor",)
    for name in wanted:
        if all(_drives(record, name, step) for record in records):
            slow = name == "motor" and any(record.streams[name].rate < TORQUES for record in records)
            return "motor_and_rate" if slow and all(r.has("quaternion", "position") for r in records) else name
    lacking = next((r for r in records if not any(_drives(r, name, step) for name in wanted)), records[0])
    raise ValueError(
        f"{lacking.path}: has the streams {', '.join(lacking.streams) or 'none'}; accepted: "
        f"{' or '.join(wanted)} in every flight, besides body_rate (rotor speeds {MOTORS:g} times a second, commands "
        "whose thrust changes)"
    )


def _drives(record: Record, name: str, step: bool = False) -> bool:
    """Whether a stream can drive a simulation. Where only the rates are fitted, a command need not tell the thrust."""
    if not record.has(name):
        return False
    stream = record.streams[name]
    if name == "command":
        return step or bool(np.ptp(stream.values[:, 0]) > 0)
    return name != "rotor_speed" or stream.rate >= MOTORS


def _shows_motors(record: Record) -> bool:
    """Whether motor outputs were logged often enough to drive a simulation."""
    return record.has("motor") and record.streams["motor"].rate >= MOTORS


def typical_volts(records: Sequence[Record]) -> float | None:
    """The typical battery voltage of these flights, V. None if one of them has no voltage."""
    if not all(record.has("voltage") for record in records):
        return None
    return float(np.median([np.median(record.streams["voltage"].values) for record in records]))


def identify(
    vehicle: Vehicle,
    records: Sequence[Record],
    *,
    believed: Vehicle | None = None,
    step: bool = False,
    delay: bool = True,
    volts: float | None = None,
    plain: bool = False,
    told: Callable[[int, float], None] = lambda i, cost: None,
) -> Found:
    """Identify a vehicle from flights.

    Args:
        vehicle: what is known of the vehicle. Thrust, inertia and drag are found relative to its mass.
        records: the flights.
        believed: the vehicle that the flight controller of the flights assumed. If omitted, `vehicle`.
        step: find only the delay and the rate loop, which steps of body rate show.
        delay: with `step`, also find the delay.
        volts: battery voltage for which the thrust is given, V. If omitted, the typical voltage of these flights.
        plain: from rotor speeds, look for nothing that the vehicle's file does not have.
        told: called with (iteration, cost) after each iteration of the fit.

    Raises:
        ValueError: naming the flight and what it lacks.
    """
    driver = driver_of(records, step)
    volts = typical_volts(records) if volts is None else volts
    parts, length = [], LENGTHS.get(driver, LENGTH)
    for number, record in enumerate(records):
        if not record.has("body_rate"):
            raise ValueError(f"{record.path}: has no body_rate; accepted: a flight with a gyroscope in its log")
        if record.duration < REACH + 3 * LENGTH:
            raise ValueError(
                f"{record.path}: lasts {record.duration:.2f} s; accepted: {REACH + 3 * LENGTH:g} s or more"
            )
        seen = (
            record
            if not step
            else dataclasses.replace(
                record, streams={k: s for k, s in record.streams.items() if k in ("command", "body_rate")}
            )
        )
        parts.append(cut(seen, driver, number, volts))
    windows = join(parts)
    if windows.count * length < LEAST:
        raise ValueError(
            f"{records[0].path}: {windows.count * length:.1f} s of flight without gaps; accepted: {LEAST:g} s or more"
        )
    only = tuple(u.name for u in UNKNOWNS if u.field == "rate_gain" or (u.field == "latency" and delay)) if step else ()
    model = Model.of(vehicle, driver, believed, only)
    every = min(HELD_OUT, windows.count)
    held_out = np.arange(windows.count) % every == every - 1
    seen = windows.some(~held_out)
    absent = np.array([plain and unknown.absent(vehicle) for unknown in model.unknowns])

    def fitted(start: np.ndarray, fixed: np.ndarray) -> Fit:
        if driver == "rotor_speed":
            return solved(model, seen, records, fixed)
        return fit(model, seen, start, told=told, fixed=fixed)

    found = fitted(np.zeros(len(absent)) if driver == "rotor_speed" else begin(model, seen), absent)
    sigma = sigmas(model, found, ())
    impossible = _impossible(model, found.p)
    refused = absent | impossible | _taken_back(model, found.p, sigma)
    # What is left over is judged without the unknowns that the flights do not show: with them, it pulls all others.
    pulled = not step and any(each.pull for each in found.misfits)
    if pulled and np.all(refused == absent):
        sigma, pulled = sigmas(model, found, found.misfits), False
        refused = refused | is_vague(model.base, model.unknowns, found.p, sigma)
    p, known = _given(found.p, whole_covariance(found, sigma), refused)
    for _ in range(REFITS):
        unclear = np.any(is_vague(model.base, model.unknowns, found.p, sigma) & ~refused)
        near = np.all(np.abs(p - found.p)[~refused] < NEAR * known[~refused])
        if not refused.any() or (near and not unclear and not pulled):
            break
        # far from the fitted values, the linear correction of `_given` is not valid
        found, pulled = fitted(np.where(refused, 0.0, found.p), refused), False
        sigma = np.where(refused, sigma, sigmas(model, found, () if step else found.misfits))
        p = np.where(refused, 0.0, found.p)
        impossible |= _impossible(model, p)
        more = refused | impossible | is_vague(model.base, model.unknowns, p, sigma)
        if np.all(more == refused):
            break
        refused = more
        p, known = _given(found.p, whole_covariance(found, sigma), refused)
    structures = _structures(model, seen, p, refused)
    if structures:
        spread = np.sqrt(np.mean([(each - p) ** 2 for each in structures.values()], 0))
        sigma = np.where(refused, sigma, np.hypot(sigma, spread))
    if step:  # a rate loop of another kind has gains that come nearest, too: it widens, and refuses none
        sigma = np.where(refused, sigma, sigmas(model, found, found.misfits))
    refusals = refusals_of(model.base, model.unknowns, sigma, refused & ~absent, impossible)
    source = f"{', '.join(r.path.name for r in records)}; {'step' if step else 'flight'}"
    estimates = estimates_of(model.base, model.unknowns, p, sigma, refused, source)
    answer, left = None, list(found.misfits)
    late = next((i for i, u in enumerate(model.unknowns) if u.field == "latency" and not refused[i]), None)
    answered = None if late is None else (float(model.base.latency) + float(p[late]), float(sigma[late]))
    if driver == "rotor_speed":
        estimates += _yaw(model, found, sigma, impossible, source)
    if driver == "rotor_speed" and all(_drives(record, "command") for record in records):
        answer, more, counted = _answer(model, records, plain)
        left += more
        held = np.array([plain and unknown.absent(vehicle) for unknown in RESPONSE])
        hidden = np.array([counted < LITTLE and unknown.field in RATE_LOOP for unknown in RESPONSE]) & ~held
        vague = is_vague(vehicle, RESPONSE, answer.p, answer.sigma) & ~held & ~hidden
        refusals += refusals_of(model.base, RESPONSE, answer.sigma, vague)
        refusals += [
            Refusal(unknown, float(answer.sigma[i]), limited=1 - counted)
            for i, unknown in enumerate(RESPONSE)
            if hidden[i]
        ]
        vague |= hidden
        estimates += estimates_of(model.base, RESPONSE, answer.p, answer.sigma, vague | held, source)
        answered = next(((float(e.value), float(e.sigma)) for e in estimates if e.name == "latency"), None)
    if not step:  # with `step`, the fitted delay from command to response is the result
        estimates = [e for e in estimates if e.name != "latency"]
        by_commands = answered if driver in ("command", "rotor_speed") else None
        estimates += _latency(records, found.q, by_commands, driver == "motor_and_rate", source)
    return Found(model, found, windows, held_out, estimates, refusals, p, sigma, structures, answer, tuple(left))


def _answer(model: Model, records: Sequence[Record], plain: bool) -> tuple[FittedPart, list[LeftOver], float]:
    """What the rotor speeds show of lag, delay and rate loop, what is left over, and the share of points that count."""
    found, left, counted = responded(model, records, plain)
    off = np.sqrt(np.maximum(np.diag(found.covariance), np.diag(found.assumed)))
    off = np.hypot(off, [ROTOR_STRUCTURE.get(u.field, 0.0) for u in RESPONSE])
    sigma = widened(left, off, [u.field for u in RESPONSE])
    return FittedPart(model.base, RESPONSE, found.x, sigma, found.covariance, found.noise), left, counted


def _yaw(model: Model, found: Fit, sigma: np.ndarray, impossible: np.ndarray, source: str) -> list[Estimate]:
    """Rotor speeds show the inertia about z over the torque ratio. It counts as inertia, with the file's torque ratio,
    unless no rigid body has that inertia: then the moment changes as the two others do, and the rest is the ratio's,
    which is no better known than that moment (`GUESSED`).
    """
    at = {u.name: i for i, u in enumerate(model.unknowns)}
    z = at["inertia_z"]
    if not impossible[z]:
        return []
    others = float(np.log(np.mean(np.exp(found.p[[at["inertia_x"], at["inertia_y"]]]))))
    ratio = float(model.base.torque_ratio) * float(np.exp(others - found.p[z]))
    return [Estimate("torque_ratio", np.array(ratio), np.array(ratio * np.hypot(sigma[z], GUESSED)), source)]


def _structures(model: Model, windows: Windows, p: np.ndarray, refused: np.ndarray) -> dict[str, np.ndarray]:
    """The unknowns found with other models that explain motor outputs nearly as well.

    Such logs cannot distinguish which part of the motors' response is delay and which is lag, nor how the thrust begins
    at low outputs. Lag, inertia and thrust depend on it.
    """
    names, found = [u.name for u in model.unknowns], {}
    for label, name in (("without delay", "latency"), ("no thrust at no output", "motor_idle")):
        if model.driver not in ("motor", "motor_and_rate") or name not in names or refused[names.index(name)]:
            continue
        at = names.index(name)
        other = model
        if name == "latency":
            other = dataclasses.replace(model, base=dataclasses.replace(model.base, latency=np.asarray(0.0)))
        fixed = refused.copy()
        fixed[at] = True
        found[label] = fit(other, windows, np.where(fixed, 0.0, p), iterations=8, fixed=fixed).p
        found[label][at] = p[at]  # a fixed unknown was not estimated
    return found


def _latency(
    records: Sequence[Record], q: np.ndarray, answered: tuple[float, float] | None, seldom: bool, source: str
) -> list[Estimate]:
    """The latency from the vehicle's motion to its rate loop. It is the delay from a command to the rate loop plus, if
    the log contains it, the age of the poses from which the command was computed.

    The first delay is found from the setpoints, if the flight controller logs them, else it is what the fit of commands
    has `answered`: the delay and its standard deviation, s. A delay of motor outputs is not a property of the vehicle.
    With data of a flight controller that is logged `seldom`, the delay between that data and the poses says nothing
    about the age of the poses, because the data itself is late, by up to the time between two samples.
    """
    shown = [late for late in map(setpoint_delay, records) if late is not None]
    if shown:
        late, off = float(np.mean(shown)), DELAY_SIGMA
    elif answered is not None:
        late, off = answered
    else:
        return []
    if seldom:  # every time within an interval is equally likely
        off = float(np.hypot(off, np.median([np.median(np.diff(r.streams["motor"].time)) for r in records]) / 12**0.5))
    ages = [
        record.pose_age + (0.0 if seldom else float(own[POSE_DELAY]))
        for record, own in zip(records, q, strict=True)
        if record.pose_age is not None
    ]
    total = max(late + (float(np.mean(ages)) if ages else 0.0), 0.0)
    return [Estimate("latency", np.array(total), np.array(off), source)]


def _impossible(model: Model, p: np.ndarray) -> np.ndarray:
    """Which unknown, (u,), is a moment of inertia that is too large: the three moments must satisfy the triangle
    inequality.

    If the model explains a torque by something else, such as the rotors' own inertia, a moment has no bound in the fit.
    """
    moments = np.asarray(vehicle_of(model.base, model.unknowns, jnp.asarray(p)).inertia, float)
    largest = int(np.argmax(moments))
    at = np.array([u.field == "inertia" and u.entries == (largest,) for u in model.unknowns])
    return at & (2 * moments[largest] > moments.sum())


def _taken_back(model: Model, p: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Which unknowns, (u,), are refused at first. Two drags of one axis explain each other: if both are vague, only the
    one that the file has as zero is refused, or the less certain of two zeros.
    """
    vague, zero = is_vague(model.base, model.unknowns, p, sigma), from_zero(model.base, model.unknowns) > 0
    for axis in range(3):
        both = [i for i, u in enumerate(model.unknowns) if u.field in FROM_ZERO and u.entries == (axis,)]
        if len(both) == 2 and vague[both].all() and zero[both].any():
            vague[max(both, key=lambda i: (not zero[i], float(p[i] / sigma[i])))] = False
    return vague


def _given(p: np.ndarray, covariance: np.ndarray, refused: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The unknowns, (u,), given that the refused ones are zero (the values of the file), and their standard deviations.
    These are those of the normal distribution under that condition. The others then no longer compensate for the
    fitted values of the refused ones.
    """
    out, sigma = np.where(refused, 0.0, p), np.where(refused, 0.0, np.sqrt(np.diag(covariance)))
    if refused.any() and not refused.all():
        kept = ~refused
        slope = np.linalg.solve(covariance[np.ix_(refused, refused)], covariance[np.ix_(refused, kept)])
        out[kept] -= p[refused] @ slope
        left = np.diag(covariance)[kept] - np.sum(covariance[np.ix_(refused, kept)] * slope, 0)
        sigma[kept] = np.sqrt(np.maximum(left, 0.0))
    return out, sigma


def sigmas(model: Model, found: Fit, left: Sequence[LeftOver]) -> np.ndarray:
    """Standard deviations of the unknowns. Each is the largest of three values, the spread between windows, the spread
    between flights and the effect of white noise, combined as a root sum of squares with the uncertainty of the model
    itself (`STRUCTURES`). What is left over widens them.
    """
    noise = np.maximum(np.sqrt(np.maximum(np.diag(found.covariance), np.diag(found.assumed))), found.between)
    structure, size = STRUCTURES.get(model.driver, STRUCTURE), np.abs(found.p)
    scale = np.where(from_zero(model.base, model.unknowns) > 0, size, 1.0)  # relative, of what is no logarithm too
    off = np.hypot(noise, scale * [structure.get(u.field, 0.0) for u in model.unknowns])
    return widened(left, off, [u.field for u in model.unknowns])
