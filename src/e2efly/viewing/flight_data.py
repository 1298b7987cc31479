"""The data of a flight log for a report: intervals of modes, responses, and figures of merit as plain numbers."""

import datetime
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from e2efly.config.storage import finite
from e2efly.control import Quat
from e2efly.logs.blackbox import Blackbox, LogClock
from e2efly.logs.flight_log import FlightLog, Series
from e2efly.vehicles.loading import load_vehicle, vehicle_names
from e2efly.viewing.rate_response import EXCITATION, StepResponse, step_response

AXES = ("roll", "pitch", "yaw")
GROUNDED = ("INIT", "DONE", "DISARMED", "")
"""Modes in which the vehicle does not follow commands."""
ALIGNED_S = 5.0
"""Time in all other modes that an alignment needs, s."""
TOGETHER_S = 0.3
"""Changes by the filter for the same limit that are closer in time than this, s, are reported as one."""


@dataclass(frozen=True)
class Interval:
    """The interval of a mode."""

    mode: str
    """Its name."""
    start: float
    """Time when it began, s since the start of the log."""
    end: float
    """Time when it ended, s since the start of the log."""
    reasons: tuple[str, ...]
    """The reasons why it began."""


def intervals(log: FlightLog) -> list[Interval]:
    """The modes of a flight in order. If none was recorded, one mode without a name."""
    changes = log["mode"]
    if not len(changes):
        return [Interval("", 0.0, log.duration, ())]
    starts = [0.0, *map(float, changes.time)]
    names = [changes.texts("previous")[0], *changes.texts("mode")]
    reasons: list[tuple[str, ...]] = [(), *(tuple(map(str, m.get("reasons") or ())) for m in changes.values)]
    ends = [*starts[1:], log.duration]
    found = [Interval(*x) for x in zip(names, starts, ends, reasons, strict=True)]
    return found if found[0].end > found[0].start else found[1:]


def in_flight(log: FlightLog) -> list[Interval]:
    """The modes in which commands are followed."""
    return [i for i in intervals(log) if i.mode.upper() not in GROUNDED]


def gyro(log: FlightLog) -> tuple[np.ndarray, np.ndarray, str]:
    """Measured body rate: times (n,) s, values (n, 3) rad/s, and the source. Without an IMU: the odometry."""
    for source, field in (("imu", "gyro"), ("odometry", "body_rate")):
        rate = log[source].numbers(field, 3)
        known = np.isfinite(rate).all(axis=1)  # messages of a channel may have only some of its fields
        if known.any():
            break
    return log[source].time[known], rate[known], f"{source}.{field}"


def responses(log: FlightLog) -> dict[str, StepResponse]:
    """The rate loop's step response by axis, from the flight in all modes in which commands are followed."""
    commands = log["command"]
    asked = commands.numbers("body_rate", 3)
    time, rate, _ = gyro(log)
    flown = [(i.start, i.end) for i in in_flight(log)] or None
    return {axis: step_response(commands.time, asked[:, i], time, rate[:, i], flown) for i, axis in enumerate(AXES)}


def align_command(log: FlightLog, found: Mapping[str, StepResponse]) -> str | None:
    """The command to align the simulator with this flight. None if the log does not have the data for it.

    Args:
        log: the flight.
        found: the step responses of its axes.
    """
    flown = sum(i.end - i.start for i in in_flight(log))
    felt = np.isfinite(log["imu"].numbers("gyro", 3)).any()
    if not felt or flown < ALIGNED_S or all(r.excitation < EXCITATION for r in found.values()):
        return None
    name, _, known = log.meta.get("vehicle", "").partition(" ")
    shipped = name in vehicle_names() and load_vehicle(name).hash == known
    return shlex.join(["e2efly", "align", str(log.path), "--vehicle", name if shipped else f"{name or 'my'}.toml"])


def blackbox_responses(blackbox: Blackbox) -> dict[str, StepResponse]:
    """The step responses from the blackbox's own setpoint and gyroscope: without the link, and finer in time."""
    t, x, y = blackbox.time, blackbox.setpoint, blackbox.gyro
    return {axis: step_response(t, x[:, i], t, y[:, i]) for i, axis in enumerate(AXES)}


def errors(log: FlightLog) -> tuple[np.ndarray, np.ndarray]:
    """Distance from the position to the setpoint held at that time: times (n,) s and distances (n,) m."""
    motion, commands = log["odometry"], log["command"]
    position, setpoint = motion.numbers("position", 3), commands.numbers("setpoint", 3)
    if not len(motion) or not len(commands):
        return motion.time, np.full(len(motion), np.nan)
    latest = np.searchsorted(commands.time, motion.time, side="right") - 1
    held = np.where(latest[:, None] >= 0, setpoint[np.maximum(latest, 0)], np.nan)
    return motion.time, np.linalg.norm(position - held, axis=1)


def stepped_in(log: FlightLog) -> list[Interval]:
    """The intervals in which the filter changed commands. Changes less than `TOGETHER_S` apart are one interval, and
    its mode is the name of the limit.
    """
    changes = log["filter"]
    limits, found = changes.texts("limit"), list[Interval]()
    for i in range(len(changes)):
        at = float(changes.time[i])
        if found and found[-1].mode == limits[i] and at - found[-1].end < TOGETHER_S:
            found[-1] = replace(found[-1], end=at)
        else:
            found.append(Interval(limits[i], at, at, ()))
    return found


def _filter(log: FlightLog, modes: list[Interval]) -> dict[str, Any] | None:
    """The interventions of the filter. None if there were none."""
    changes = log["filter"]
    if not len(changes):
        return None
    time, share = changes.time, changes.numbers("share")
    commands = log["command"].time
    flown = sum(int(((commands >= i.start) & (commands < i.end)).sum()) for i in modes if i.mode.upper() == "POLICY")
    rows = []
    for i in stepped_in(log):
        mine = (time >= i.start) & (time <= i.end) & (np.array(changes.texts("limit")) == i.mode)
        row = {"limit": i.mode, "start_s": i.start, "end_s": i.end, "commands": int(mine.sum())}
        rows.append({**row, "largest_share": float(share[mine].max()), "least_room_m": _least(changes, mine)})
    return {"commands": len(changes), "of": flown, "stepped_in": rows}


def _least(changes: Series, mine: np.ndarray) -> float:
    return float(changes.numbers("room")[mine].min())


def summary(log: FlightLog, blackbox: Blackbox | None = None, alignment: LogClock | None = None) -> dict[str, Any]:
    """The flight in numbers, SI units. None where nothing is known. It can be written as JSON."""
    motion, timing, link, battery = log["odometry"], log["timing"], log["link"], log["battery"]
    speed = np.linalg.norm(motion.numbers("velocity", 3), axis=1)
    began = datetime.datetime.fromtimestamp(log.start * 1e-9, datetime.UTC) if log.series else None
    changes = [i for i in intervals(log) if i.mode]
    found = responses(log)
    table = {
        "file": str(log.path),
        "start": began.isoformat(timespec="milliseconds") if began else None,
        "duration_s": log.duration,
        "cut_off": log.cut_off or None,
        "vehicle": log.meta.get("vehicle"),
        "messages": {name: len(series) for name, series in sorted(log.series.items())},
        "modes": [{"mode": i.mode, "start_s": i.start, "end_s": i.end, "reasons": list(i.reasons)} for i in changes],
        "error_m": _errors(log, changes),
        "speed_max_m_s": _largest(speed),
        "tilt_max_rad": _largest(Quat.of(motion.numbers("quaternion", 4)).tilt()),
        "odometry_age_s": _spread(motion.numbers("age")),
        "rate_response": {axis: response_numbers(r) for axis, r in found.items()},
        "align": align_command(log, found),
        "loop": {
            "rounds": len(timing),
            "deadlines_missed": int(np.nansum(timing.numbers("deadline_missed"))),
            "period_s": _spread(timing.numbers("period_s")),
            "work_s": _spread(timing.numbers("work_s")),
            "lateness_s": _spread(timing.numbers("lateness_s")),
        },
        "inference_s": _spread(log["policy"].numbers("inference_s")),
        "cpu_load": {
            "controller": _spread(log["status"].numbers("cpu_load")),
            "companion": _spread(timing.numbers("cpu_load")),
        },
        "battery": {"voltage_v": _ends(battery.numbers("voltage")), "current_a": _spread(battery.numbers("current"))},
        "link": {
            **{name: _last(link.numbers(name)) for name in ("requests", "replies", "timeouts", "errors", "reconnects")},
            "round_trip_s": _spread(link.numbers("round_trip")),
        },
        "throttle_map": {name: _ends(log["throttle_map"].numbers(name)) for name in ("scale", "voltage_gain")},
        "filter": _filter(log, changes),
        "events": [
            {"time_s": float(t), "level": level, "text": text}
            for t, level, text in zip(
                log["event"].time, log["event"].texts("level"), log["event"].texts("text"), strict=True
            )
        ],
    }
    if blackbox is not None and alignment is not None:
        table["blackbox"] = {
            "firmware": blackbox.firmware,
            "session": blackbox.session,
            "start_s": float(alignment.time[0]),
            "correlation": alignment.correlation,
            "overlap_s": alignment.overlap,
            "clock_drift": alignment.drift,
            "rate_response": {axis: response_numbers(r) for axis, r in blackbox_responses(blackbox).items()},
        }
    return finite(table)


def _errors(log: FlightLog, modes: list[Interval]) -> dict[str, dict[str, float]]:
    """Root mean square and maximum of the distance to the setpoint, by mode."""
    time, error = errors(log)
    found: dict[str, list[np.ndarray]] = {}
    for i in modes:
        found.setdefault(i.mode, []).append(error[(time >= i.start) & (time < i.end) & np.isfinite(error)])
    joined = {mode: np.concatenate(parts) for mode, parts in found.items()}
    return {mode: {"rms": float(np.sqrt(np.mean(e**2))), "max": float(e.max())} for mode, e in joined.items() if len(e)}


def response_numbers(r: StepResponse) -> dict[str, Any]:
    """A step response in numbers. None where they are not to be believed."""
    numbers = {"delay_s": r.delay, "rise_63_s": r.rise, "overshoot": r.overshoot, "gain": r.gain}
    believed = {key: value if not r.reason else None for key, value in numbers.items()}
    return {**believed, "excitation_rad_s": r.excitation, "explained": r.explained, "reason": r.reason or None}


def _spread(x: np.ndarray) -> dict[str, float] | None:
    x = x[np.isfinite(x)]
    if not len(x):
        return None
    return {
        "mean": float(x.mean()),
        "p50": float(np.median(x)),
        "p99": float(np.quantile(x, 0.99)),
        "max": float(x.max()),
    }


def _ends(x: np.ndarray) -> dict[str, float] | None:
    x = x[np.isfinite(x)]
    return {"first": float(x[0]), "last": float(x[-1]), "min": float(x.min())} if len(x) else None


def _last(x: np.ndarray) -> int | None:
    x = x[np.isfinite(x)]
    return int(x[-1]) if len(x) else None


def _largest(x: np.ndarray) -> float | None:
    x = x[np.isfinite(x)]
    return float(x.max()) if len(x) else None
