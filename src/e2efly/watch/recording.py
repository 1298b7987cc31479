"""Flights that were recorded: one log, or several side by side, as ghosts of each other."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from e2efly.control import Quat
from e2efly.deploy.log.flight_log import read_log
from e2efly.identification.readers import read_flights
from e2efly.vehicles import Vehicle, load_vehicle, vehicle_names
from e2efly.watch.frames import Frame, Stage

PERIOD = 1 / 30
"""Seconds from frame to frame."""
POSES = ("position", "quaternion")
"""Streams without which there is nothing to see."""


@dataclass(frozen=True)
class Flight:
    """One recorded flight at even times, `PERIOD` apart."""

    name: str
    """Of its file."""
    position: Float[np.ndarray, "t 3"]
    """World, m."""
    quaternion: Float[np.ndarray, "t 4"]
    """wxyz, body to world."""
    velocity: Float[np.ndarray, "t 3"]
    """World, m/s."""
    rotor_speed: Float[np.ndarray, "t 4"]
    """rad/s; by the motors' outputs where only those are there; 0 where nothing is."""
    goal: Float[np.ndarray, "t 3"]
    """Where it was to be, m; NaN where it is not known."""
    command: Float[np.ndarray, "t 3"]
    """Body rates that were commanded, rad/s; NaN where they are not known."""
    body_rate: Float[np.ndarray, "t 3"]
    """As measured, rad/s; NaN likewise."""
    notes: Sequence[tuple[float, str]] = ()
    """What happened, s since the start, in order."""


def read_flight(path: Path, vehicle: Vehicle) -> Flight:
    """Of any log that `e2efly identify flight` reads; the first flight in it that has poses.

    Args:
        path: the file.
        vehicle: whose largest rotor speed the motors' outputs are shares of.

    Raises:
        ValueError: naming the file, where it is no log, or has no poses.
    """
    records = read_flights(path)
    found = next((record for record in records if record.has(*POSES)), None)
    if found is None:
        there = sorted({name for record in records for name in record.streams}) or ["nothing"]
        raise ValueError(f"{path}: has no poses ({', '.join(there)}); accepted: a log with position and quaternion")
    streams = {name: (s.time, s.values) for name, s in found.streams.items() if found.has(name)}
    if "rotor_speed" not in streams and "motor" in streams:
        time, share = streams["motor"]
        streams["rotor_speed"] = time, share * float(np.max(vehicle.rotor_speed_max))
    if "setpoint" in streams:
        streams["command"] = streams["setpoint"]
    flight = even(path.name, streams)
    if path.suffix == ".mcap":
        goal, notes = _told(path, PERIOD * np.arange(len(flight.position)))
        flight = replace(flight, goal=goal, notes=notes)
    return flight


def even(name: str, streams: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> Flight:
    """A flight at even times, from the first to the last of its positions.

    Args:
        name: of the flight.
        streams: times, (n,) s, and values, (n, k): position and quaternion; velocity, rotor_speed, goal, command and
            body_rate where they are known, of which the last columns count.
    """
    begin, end = streams["position"][0][[0, -1]]
    time = np.arange(begin, max(end, begin + PERIOD), PERIOD)

    def at(name: str, width: int, missing: float = np.nan) -> np.ndarray:
        if name not in streams:
            return np.full((len(time), width), missing)
        when, values = streams[name]
        return np.column_stack([np.interp(time, when, column) for column in values.T[-width:]])

    position, quaternion = at("position", 3), at("quaternion", 4)
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    flown = np.gradient(position, PERIOD, axis=0) if len(time) > 1 else np.zeros_like(position)
    return Flight(
        name, position, quaternion, at("velocity", 3) if "velocity" in streams else flown,
        at("rotor_speed", 4, 0.0), at("goal", 3), at("command", 3), at("body_rate", 3),
    )  # fmt: skip


def _told(path: Path, time: np.ndarray) -> tuple[np.ndarray, list[tuple[float, str]]]:
    """Setpoints and modes of a log of ours, times s since its first pose."""
    log = read_log(path)
    first = log["odometry"].stamp[0] if len(log["odometry"]) else log.start
    commands, modes = log["command"], log["mode"]
    goal = np.full((len(time), 3), np.nan)
    if len(commands):
        latest = np.searchsorted((commands.stamp - first) * 1e-9, time, side="right") - 1
        goal = np.where(latest[:, None] >= 0, commands.numbers("setpoint", 3)[np.maximum(latest, 0)], np.nan)
    when = (modes.stamp - first) * 1e-9
    return goal, [(float(t), m) for t, m in zip(when, modes.texts("mode"), strict=True)]


def vehicle_of(path: Path) -> Vehicle | None:
    """The shipped vehicle that a log of ours says it is of; None: it does not say, or that is not shipped."""
    name = read_log(path).meta.get("vehicle", "").partition(" ")[0] if path.suffix == ".mcap" else ""
    return load_vehicle(name) if name in vehicle_names() else None


@dataclass
class Recording:
    """A source of frames: recorded flights, over and over."""

    flights: Sequence[Flight]
    """They begin together."""
    vehicle: Vehicle
    """As it is drawn."""
    stage: Stage | None = None
    """What stands there; None: level ground."""
    at: int = 0
    """The next frame."""
    period: float = field(default=PERIOD, init=False)
    origin: np.ndarray = field(default_factory=lambda: np.zeros(3), init=False)

    def __post_init__(self) -> None:
        self._ground = Stage(self.vehicle)

    def fly(self, flights: Sequence[Flight], stage: Stage) -> None:
        """Show as many other flights, from their beginning."""
        self.flights, self.stage, self.at = flights, stage, 0

    @property
    def length(self) -> int:
        """Frames of the longest flight."""
        return max(len(flight.position) for flight in self.flights)

    def stage_of(self, followed: int) -> Stage:
        """What stands there; of a log, level ground."""
        del followed
        return self.stage or self._ground

    def step(self, followed: int) -> Frame:
        """The next frame; after the last the first. A flight that is over stays where it ended."""
        i, self.at = self.at, (self.at + 1) % self.length

        def now(name: str) -> np.ndarray:
            return np.stack([getattr(f, name)[min(i, len(f.position) - 1)] for f in self.flights])

        told, rates = self.flights[followed], zip(["roll", "pitch", "yaw"], now("command")[followed], strict=True)
        series: dict[str, tuple[float, ...]] = {"speed (m/s)": (float(np.linalg.norm(now("velocity")[followed])),)}
        for (axis, command), flown in zip(rates, now("body_rate")[followed], strict=True):
            if np.isfinite(flown):
                series[f"{axis} rate (rad/s)"] = (float(command), float(flown))
        mode = next((text for t, text in reversed(told.notes) if t <= i * PERIOD), "")
        tilt = np.degrees(float(Quat.of(now("quaternion")[followed]).tilt()))
        note = f"**{i * PERIOD:.1f} s** of {self.length * PERIOD:.1f} s, {series['speed (m/s)'][0]:.1f} m/s, "
        note += f"tilted {tilt:.0f} degrees  \n{told.name} {mode}"
        return Frame(
            i * PERIOD, now("position"), now("quaternion"), now("velocity"), now("rotor_speed"), now("goal"),
            series=series, fresh=i == 0, note=note,
        )  # fmt: skip
