"""The paper's alignment: find the delay, the rate loop and the motor lag with which the simulator responds to commands
as the vehicle did.

The thrust's response to its steps shows the motor lag (`thrust_response`). With this lag, the body rates show delay and
rate loop. Where the log shows when a command became the setpoint of the rate loop, this time is the delay.
"""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from e2efly.alignment.comparison import lagged
from e2efly.alignment.estimates import Estimate
from e2efly.alignment.found import Found, Refusal
from e2efly.alignment.identification import identify
from e2efly.alignment.model import Model
from e2efly.alignment.replay import Stretches, asking, replay, rms, stretches, thrust_is_told, wrong
from e2efly.alignment.thrust_response import FLY as THRUST_STEPS
from e2efly.alignment.thrust_response import ThrustResponse, thrust_response
from e2efly.alignment.windows import REACH, STEP
from e2efly.logs.blackbox_merge import DELAY_SIGMA, setpoint_delay
from e2efly.logs.recording import Record
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

EARLY_S = 0.025
"""Time by which a response may seem to come before its command, s. This happens when the vehicle is quicker than the
motors and the rate loop of its file."""
AXES = {"rate_gain_x": "roll", "rate_gain_y": "pitch", "rate_gain_z": "yaw"}
FLY = "steps or doublets of {} rate, 2 rad/s and more, 0.2 s and longer each, three of them or more"
WORSE = 1.5
"""By how much the error of the rates may rise where the fit did not look. A flight without steps may show gains that
no other part of it has."""
SHOWN_S = 0.8
"""Length of the sections that are shown, s."""
LEAD_S = 0.12
"""Part of a shown section before the step, s."""
JUMP_S = 0.06
"""A command that changes within this time counts as a step, s."""


@dataclass(frozen=True)
class Alignment:
    """The result of an alignment, and its accuracy."""

    found: Found
    """The fit. In it, the vehicle's latency is only the delay from the command to the rate loop."""
    model: Model
    """The model whose zeros are the vehicle of the file."""
    delay: tuple[float, float, float]
    """Delay from the sending of a command to the rate loop, s: by the file, as found, and its standard deviation. NaN
    if none was found."""
    early: float
    """Time by which the response seemed to come before the command, s, if the delay is fixed at zero. Otherwise 0."""
    pose_delay: float
    """Delay of the poses from which the commands were computed, s. It is a part of the vehicle's latency."""
    estimates: list[Estimate]
    """Estimates for the vehicle file."""
    refusals: list[Refusal]
    before: dict[str, float]
    """By signal, root mean square error of the file's vehicle in sections that the fit did not see."""
    after: dict[str, float]
    """The same for the aligned vehicle."""
    thrust: float
    """Measured specific force along body z divided by that of the aligned simulator, in the same sections. NaN if not
    known."""
    response: ThrustResponse | None
    """The response of the thrust. None: the flights do not show it."""
    measured: bool
    """Whether the delay was measured, between the commands and the setpoints of the rate loop."""

    def replayed(self, flown: Stretches, aligned: bool) -> dict[str, np.ndarray]:
        """The replay of sections, with the vehicle of the file or the aligned one. The aligned one gives as much of the
        commanded thrust as the real one did. The thrust is as the flight controller's accelerometer shows it.
        """
        found, told = self.found, self.response
        if not aligned:
            return felt(replay(self.model, np.zeros(len(self.model.names)), flown), told)
        return felt(replay(found.model, found.p, asking(flown, 1.0 if told is None else told.gain[0])), told)


def align(
    vehicle: Vehicle,
    records: Sequence[Record],
    pose_delay: float = 0.0,
    told: Callable[[int, float], None] = lambda i, cost: None,
) -> Alignment:
    """Fit the delay and the rate loop to flights, and judge both on held-out windows.

    Args:
        vehicle: the vehicle of the file. Its latency includes the delay of the poses.
        records: the flights, checked.
        pose_delay: delay of the poses from which the commands were computed, s.
        told: called with (iteration, cost) after each iteration of the fit.

    Raises:
        ValueError: naming the flight and what it lacks; when no parameter can be found, naming all parameters and what
            to fly.
    """
    links = [late for late in map(_link, records) if late is not None]
    found = _aligned(vehicle, records, pose_delay, links, told)
    if links and _turning(found.after) > _turning(found.before):
        # a rate loop that is unlike the model: the delay that fits best hides the difference
        other = _aligned(vehicle, records, pose_delay, [], told)
        found = min(found, other, key=lambda each: _turning(each.after))
    if _turning(found.after) > WORSE * _turning(found.before):
        raise ValueError(
            f"{', '.join(str(r.path) for r in records)}: nothing can be aligned: where the fit did not look, the error "
            f"of roll and pitch rate together rises from {_turning(found.before):.3g} to {_turning(found.after):.3g} "
            f"rad/s; fly {FLY.format('body')} (e2efly fly steps)"
        )
    return found


def _turning(errors: dict[str, float]) -> float:
    return errors["roll_rate"] + errors["pitch_rate"]


def _aligned(
    vehicle: Vehicle,
    records: Sequence[Record],
    pose_delay: float,
    links: Sequence[tuple[float, float]],
    told: Callable[[int, float], None],
) -> Alignment:
    """The alignment with measured delays from command to setpoint and their standard deviations, s, if there are any,
    or with the delay that fits best.
    """
    own = max(float(vehicle.latency) - pose_delay, 0.0)
    link = float(np.mean([late for late, _ in links])) if links else None
    spread = float(np.max([off for _, off in links])) if links else np.inf
    response = thrust_response(records, float(vehicle.motor_time_constant), link, spread)
    base = dataclasses.replace(vehicle, latency=own)
    lag = None if response is None or response.reason else response.lag
    tuned = base if lag is None else dataclasses.replace(base, motor_time_constant=lag[0])
    if link is not None:
        tuned = dataclasses.replace(tuned, latency=max(link, 0.0))
    found = identify(tuned, records, believed=base, step=True, delay=link is None, told=told)
    late = next((e for e in found.estimates if e.name == "latency"), None)
    early = max(-(0.0 if link is None else link) if late is None else -float(late.value), 0.0)
    if early > EARLY_S:
        raise ValueError(
            f"{records[0].path}: the body rates answer {1e3 * early:.0f} ms before the commands were sent; accepted: "
            "times of both by one clock"
        )
    if late is not None and early:
        prompt = dataclasses.replace(tuned, latency=0.0)
        found = identify(prompt, records, believed=base, step=True, delay=False, told=told)
    if late is None and not found.estimates:
        reasons = "; ".join(refused(refusal) for refusal in found.refusals)
        raise ValueError(f"{', '.join(str(r.path) for r in records)}: nothing can be aligned: {reasons}")
    source = f"{', '.join(r.path.name for r in records)}; align"
    delay, estimates = (own, np.nan, np.nan), [e for e in found.estimates if e.name != "latency"]
    estimates = [dataclasses.replace(e, source=source) for e in estimates]
    if late is not None or link is not None:
        value, sigma = (tuned.latency, spread) if late is None else (float(late.value), float(late.sigma))
        if late is not None and lag is not None:  # what the lag takes too much, the delay has too little
            sigma = float(np.hypot(sigma, lag[1]))
        value, sigma = max(value, 0.0), float(np.hypot(sigma, early))
        delay = own, value, sigma
        estimates.append(Estimate("latency", np.array(value + pose_delay), np.array(sigma), source))
    if lag is not None:
        estimates.append(Estimate("motor_time_constant", np.array(lag[0]), np.array(lag[1]), source))
    model = Model.of(base, found.model.driver, base, found.model.names)
    part = Alignment(
        found, model, delay, early, pose_delay, estimates, found.refusals, {}, {}, np.nan, response, link is not None
    )  # fmt: skip
    before, _ = _held_out(part, records, aligned=False)
    after, thrust = _held_out(part, records, aligned=True)
    return dataclasses.replace(part, before=before, after=after, thrust=thrust)


def _link(record: Record) -> tuple[float, float] | None:
    """The time from a command to the setpoint, s, and its standard deviation. None: the log does not show it."""
    late = setpoint_delay(record)
    # between two samples, every time is equally likely
    return None if late is None else (late, float(np.hypot(DELAY_SIGMA, 1 / record.streams["setpoint"].rate / 12**0.5)))


def felt(seen: dict[str, np.ndarray], response: ThrustResponse | None) -> dict[str, np.ndarray]:
    """A replay as the accelerometer of the flight controller shows it, with the filter that was found."""
    if response is None:
        return seen
    force = seen["specific_force"].copy()
    for _ in range(2):
        force[..., 2] = lagged(force[..., 2], response.filter, STEP)
    return seen | {"specific_force": force}


def refused(refusal: Refusal) -> str:
    """The reason why a parameter was not aligned, and what to fly, in words."""
    name = refusal.unknown.name
    if name in AXES:
        axis = AXES[name]
        return f"rate_gain of {axis} cannot be had (+- {100 * refusal.sigma:.0f} %); fly {FLY.format(axis)}"
    return f"the delay cannot be had (+- {1e3 * refusal.sigma:.0f} ms); fly {FLY.format('body')}"


def lag_refused(response: ThrustResponse | None) -> str:
    """The reason why the motor lag was not aligned, and what to fly, in words. Empty: it was, or no log has thrust."""
    if response is None or not response.reason:
        return ""
    return f"the motor lag cannot be had ({response.reason}); fly {THRUST_STEPS}"


def _held_out(part: Alignment, records: Sequence[Record], aligned: bool) -> tuple[dict[str, float], float]:
    """By signal, the root mean square error in windows that the fit did not see, with all their streams. And the thrust
    in these windows, measured divided by simulated for the commands as they were sent.
    """
    windows = part.found.windows.some(part.found.held_out)
    errors: dict[str, list[np.ndarray]] = {}
    lift, told = 0.0, 0.0
    for number, record in enumerate(records):
        begin = windows.begin[windows.flight == number]
        if not len(begin):
            continue
        flown = stretches(record, begin, windows.steps * STEP)
        seen = part.replayed(flown, aligned)
        for signal, error in wrong(flown, seen).items():
            errors.setdefault(signal, []).append(error)
        if "specific_force" in flown.measured and thrust_is_told(flown):
            there = flown.there["specific_force"]
            lift += float(flown.measured["specific_force"][..., 2][there].sum())
            told += float(seen["specific_force"][..., 2][there].sum())
    gain = part.response.gain[0] if aligned and part.response is not None else 1.0
    return {k: rms(np.concatenate(parts)) for k, parts in errors.items()}, gain * lift / told if told else np.nan


def clearest(record: Record, channel: int) -> Stretches:
    """The section around the largest sudden change of a command from one calm period to another.

    The channels are 0: thrust over mass, and 1 to 3: body rate about x, y, z.
    """
    sent, rates = record.streams["command"], record.streams["body_rate"]
    first, last = (f(s.time[i] for s in (sent, rates)) for f, i in ((max, 0), (min, -1)))
    grid = np.arange(first + REACH + LEAD_S, max(last - SHOWN_S + LEAD_S, first + REACH + 2 * LEAD_S), 0.01)
    past = np.arange(-LEAD_S, 1e-9, 0.01)

    def held(time: np.ndarray) -> np.ndarray:
        return sent.values[np.clip(np.searchsorted(sent.time, time, side="right") - 1, 0, None), channel]

    before, neutral = held(grid[:, None] + past), 0.0 if channel else GRAVITY
    restless = 2 * np.std(before, axis=1) + 1.5 * np.abs(before[:, -1] - neutral)
    restless += 2 * np.std(held(grid[:, None] + JUMP_S - past), axis=1)
    start = grid[int(np.argmax(np.abs(held(grid + JUMP_S) - before[:, -1]) - restless))]
    near = sent.during(start, start + JUMP_S + 0.01)
    change = np.abs(np.diff(near.values[:, channel])) if len(near.time) > 1 else np.zeros(0)
    step = near.time[1 + int(np.argmax(change))] if len(change) else start
    return stretches(record, [step - LEAD_S], SHOWN_S)
