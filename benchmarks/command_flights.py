"""A commander outside flies the real Betaflight firmware: how closely each mode is followed, and how each fault ends.

    python benchmarks/command_flights.py [--vehicle vis_r] [--flights 5] [--json FILE]

Each flight takes off, hands over to the commander by the pilot's switch, flies the five modes and all faults, lands.
Commands come by UDP at 100 Hz. Time is virtual: the figures do not depend on the machine.
"""

import math
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from common import arguments, table, write
from tests.faults.commanders import FAULTS, HEIGHT, HOME, TIMEOUT, Field, at
from tests.flight.command_streams import Loopback

from e2efly.flight.pilot.flight_state import Mode
from e2efly.validation import firmware_program
from e2efly.validation.rig import Rig
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle

SPEED = 0.5
"""Of what moves, m/s."""
Error = Callable[[Field, float], float]


def square(time: float) -> tuple[float, float]:
    """A corner of a square of 0.6 m every 4 s."""
    return ((0.6, 0.0), (0.6, 0.6), (0.0, 0.6), (0.0, 0.0))[int(time / 4.0) % 4]


def circling(time: float) -> np.ndarray:
    """A velocity that turns once in 4 s."""
    return SPEED * np.array([math.cos(math.pi / 2 * time), math.sin(math.pi / 2 * time), 0.0])


def swinging(time: float) -> np.ndarray:
    """An acceleration to and fro, once in 2 s, the velocity zero on the average."""
    return np.array([1.0 * math.cos(math.pi * time), 0.0, 0.0])


def rolling(time: float) -> float:
    """A roll to and fro, rad, once in 1 s."""
    return 0.15 * math.sin(math.tau * time)


def rocking(time: float) -> float:
    """A roll rate to and fro, rad/s, twice a second."""
    return 1.0 * math.sin(2 * math.tau * time)


def position_error(field: Field, time: float) -> float:
    """In the last second at each corner, m."""
    return math.nan if time % 4.0 < 3.0 else float(np.linalg.norm(field.position - [*square(time), HEIGHT]))


def velocity_error(field: Field, time: float) -> float:
    """After the first second, m/s."""
    return math.nan if time < 1.0 else float(np.linalg.norm((field.velocity - circling(time))[:2]))


def altitude_error(field: Field, time: float) -> float:
    """After the first two seconds, m."""
    return math.nan if time < 2.0 else abs(float(field.position[2]) - HEIGHT)


def swing_error(field: Field, time: float) -> float:
    """Of the velocity to what the accelerations add up to, m/s."""
    return abs(float(field.velocity[0]) - math.sin(math.pi * time) / math.pi)


def roll_error(field: Field, time: float) -> float:
    """Of the roll, rad."""
    w, x, y, z = (float(q) for q in np.asarray(field.rig.state.quaternion))
    return abs(math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)) - rolling(time))


def rate_error(field: Field, time: float) -> float:
    """Of the roll rate, rad/s."""
    return abs(float(np.asarray(field.rig.state.body_rate)[0]) - rocking(time))


def _velocity(time: float) -> dict[str, Any]:
    return {"mode": "velocity", "velocity": circling(time)[:2].tolist(), "altitude": HEIGHT}


MODES: dict[str, tuple[str, float, Callable[[float], dict[str, Any]], Error, str]] = {
    "position": (
        "a square of 0.6 m, 4 s a corner", 16.0, lambda t: at(*square(t), HEIGHT, yaw=0.5)(t), position_error,
        "m, last second of a corner",
    ),
    "velocity": (f"{SPEED} m/s, its direction turning once in 4 s", 8.0, _velocity, velocity_error, "m/s, horizontal"),
    "altitude": ("held beside that velocity", 8.0, _velocity, altitude_error, "m"),
    "acceleration": (
        "1 m/s^2 to and fro, once in 2 s", 4.0,
        lambda t: {"mode": "acceleration", "acceleration": swinging(t).tolist()}, swing_error, "m/s, of its integral",
    ),
    "attitude": (
        "roll of 0.15 rad to and fro, once a second", 2.0,
        lambda t: {"mode": "attitude", "thrust": GRAVITY, "attitude": [rolling(t), 0.0, 0.5]}, roll_error, "rad",
    ),
    "ctbr": (
        "roll rate of 1 rad/s to and fro, twice a second", 1.0,
        lambda t: {"mode": "ctbr", "thrust": GRAVITY, "body_rate": [rocking(t), 0.0, 0.0]}, rate_error, "rad/s",
    ),
}  # fmt: skip
"""What each mode flies: in words, for how long, s, the commands, the error and its unit."""


def fly(field: Field, mode: str) -> list[float]:
    """The error at each control step of one mode; the flight is then in HOVER at home again."""
    _, seconds, commands, error, _ = MODES[mode]
    field.hand_over(HOME)
    field.command(4.0, HOME)
    field.command(1.0, lambda _: {"mode": "velocity", "velocity": [0.0, 0.0], "altitude": HEIGHT})
    begun, errors = field.rig.now(), []

    def watched(time: float) -> dict[str, Any]:
        errors.append(error(field, field.rig.now() - begun))
        return commands(time)

    field.command(seconds, watched)
    if field.mode is not Mode.POLICY:
        raise RuntimeError(f"{mode}: the flight is in {field.mode}: {field.reasons}")
    return [e for e in errors if not math.isnan(e)]


def main() -> None:
    """Fly, print the tables, write the figures."""
    args = arguments(__doc__ or "", vehicle="vis_r", flights=5)
    errors: dict[str, list[float]] = {mode: [] for mode in MODES}
    reactions: dict[str, list[float]] = {fault: [] for fault in FAULTS}
    moved: dict[str, list[float]] = {fault: [] for fault in FAULTS}
    said: dict[str, str] = {}
    landed = 0
    for seed in range(args.flights):
        with tempfile.TemporaryDirectory() as folder, Loopback() as link:
            rig = Rig(firmware_program.chosen(), Path(folder), load_vehicle(args.vehicle), latency=0.03, seed=seed)
            with rig:
                rig.sleep(0.5)
                field = Field(rig, link)
                if not field.session.take_off(1.0):
                    raise RuntimeError(f"no hover: {field.mode}: {field.reasons}")
                for mode in MODES:
                    errors[mode] += fly(field, mode)
                for fault in FAULTS:
                    place = np.array(field.rest())
                    field.hand_over(at(*place))
                    took = field.strike(fault)
                    reactions[fault].append(took if field.mode is Mode.HOVER else math.inf)
                    said[fault] = "; ".join(map(str, field.reasons))
                    field.session.fly(1.0)
                    moved[fault].append(float(np.linalg.norm(field.position - place)))
                landed += field.session.land()
                field.session.close()
        print(f"flight {seed + 1} of {args.flights} flown", flush=True)
    modes = [
        {"mode": mode, "what": MODES[mode][0], "error, mean": f"{np.mean(e):.3f}",
         "error, p95": f"{np.quantile(e, 0.95):.3f}", "unit": MODES[mode][4]}
        for mode, e in errors.items()
    ]  # fmt: skip
    faults = [
        {"fault": fault, "in HOVER": f"{sum(map(math.isfinite, times))} of {len(times)}",
         "after, longest": f"{max(times):.2f} s", "from its place 1 s later, most": f"{max(moved[fault]):.2f} m",
         "said": said[fault]}
        for fault, times in reactions.items()
    ]  # fmt: skip
    print(f"{landed} of {args.flights} flights landed; time-out {TIMEOUT} s\n{table(modes)}\n\n{table(faults)}")
    write("command_flights", args.json, {"landed": landed, "flights": args.flights, "modes": modes, "faults": faults})


if __name__ == "__main__":
    main()
