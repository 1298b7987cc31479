"""Recorded flights: one log, or several together, with the others as ghosts."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from e2efly.control import Quat
from e2efly.logs.flight_log import read_log
from e2efly.logs.readers import OURS, format_of, read_flights
from e2efly.vehicles.loading import load_vehicle, vehicle_names
from e2efly.vehicles.vehicle import Vehicle
from e2efly.viewing.watch.stage import Stage, StageFrame

PERIOD = 1 / 30
"""Time between frames, s."""
POSES = ("position", "quaternion")
"""Streams that a flight needs to be shown."""


@dataclass(frozen=True)
class RecordedFlight:
    """One recorded flight on a uniform time grid with step `PERIOD`."""

    name: str
    """Name of its file."""
    position: Float[np.ndarray, "t 3"]
    """World, m."""
    quaternion: Float[np.ndarray, "t 4"]
    """wxyz, body to world."""
    velocity: Float[np.ndarray, "t 3"]
    """World, m/s."""
    rotor_speed: Float[np.ndarray, "t r"]
    """Rotor speeds, rad/s: one for each rotor, or one for all. If only motor outputs are known, they are computed from
    these. 0 if nothing is known."""
    goal: Float[np.ndarray, "t 3"]
    """Goal positions, m. NaN where not known."""
    command: Float[np.ndarray, "t 3"]
    """Commanded body rates, rad/s. NaN where not known."""
    body_rate: Float[np.ndarray, "t 3"]
    """Measured body rates, rad/s. NaN where not known."""
    notes: Sequence[tuple[float, str]] = ()
    """Events, with their time in s since the start, in order."""


def read_flight(path: Path, vehicle: Vehicle) -> RecordedFlight:
    """The first flight with poses in a log. Any log that `e2efly identify flight` reads is accepted.

    Args:
        path: the file.
        vehicle: the vehicle, whose largest rotor speed corresponds to a motor output of 1.

    Raises:
        ValueError: when the file is not a log or has no poses, naming the file.
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
    if "rotor_speed" in streams and streams["rotor_speed"][1].shape[-1] != vehicle.rotor_count:
        del streams["rotor_speed"]  # of a vehicle with other rotors
    if "setpoint" in streams:
        streams["command"] = streams["setpoint"]
    flight = even(path.name, streams)
    if found.kind == OURS:
        goal, notes = _told(path, PERIOD * np.arange(len(flight.position)))
        flight = replace(flight, goal=goal, notes=notes)
    return flight


def even(name: str, streams: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> RecordedFlight:
    """A flight on a uniform time grid, from its first to its last position.

    Args:
        name: name of the flight.
        streams: times, (n,) s, and values, (n, k), by stream: position and quaternion, and if known velocity,
            rotor_speed, goal, command and body_rate. If a stream has more columns than needed, the last ones are used.
    """
    begin, end = streams["position"][0][[0, -1]]
    time = np.arange(begin, max(end, begin + PERIOD), PERIOD)

    def at(name: str, width: int, missing: float = np.nan) -> np.ndarray:
        if name not in streams:
            return np.full((len(time), width), missing)
        when, values = streams[name]
        return np.column_stack([np.interp(time, when, column) for column in values.T[-width:]])

    position, quaternion = at("position", 3), at("quaternion", 4)
    rotors = streams["rotor_speed"][1].shape[-1] if "rotor_speed" in streams else 1
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    flown = np.gradient(position, PERIOD, axis=0) if len(time) > 1 else np.zeros_like(position)
    return RecordedFlight(
        name, position, quaternion, at("velocity", 3) if "velocity" in streams else flown,
        at("rotor_speed", rotors, 0.0), at("goal", 3), at("command", 3), at("body_rate", 3),
    )  # fmt: skip


def _told(path: Path, time: np.ndarray) -> tuple[np.ndarray, list[tuple[float, str]]]:
    """Setpoints and modes of a log of e2efly, with times in s since its first pose."""
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
    """The shipped vehicle that a log of e2efly names. None: it names no vehicle, or one that is not shipped."""
    name = read_log(path).meta.get("vehicle", "").partition(" ")[0] if format_of(path).name == OURS else ""
    return load_vehicle(name) if name in vehicle_names() else None


@dataclass
class Recording:
    """A source of frames: recorded flights, repeated endlessly."""

    flights: Sequence[RecordedFlight]
    """The flights. They begin at the same time."""
    vehicle: Vehicle
    """The vehicle that is drawn."""
    stage: Stage | None = None
    """The stage. None: level ground."""
    together: int = 1
    """Number of flights of the same world: the first ones."""
    at: int = 0
    """Number of the next frame."""
    period: float = field(default=PERIOD, init=False)
    origin: np.ndarray = field(default_factory=lambda: np.zeros(3), init=False)

    def __post_init__(self) -> None:
        self._ground = Stage(self.vehicle)

    def fly(self, flights: Sequence[RecordedFlight], stage: Stage) -> None:
        """Show other flights, the same number as before, from their beginning."""
        self.flights, self.stage, self.at = flights, stage, 0

    @property
    def length(self) -> int:
        """Number of frames of the longest flight."""
        return max(len(flight.position) for flight in self.flights)

    def stage_of(self, followed: int) -> Stage:
        """The stage. For a log, level ground."""
        del followed
        return self.stage or self._ground

    def step(self, followed: int) -> StageFrame:
        """The next frame. After the last frame comes the first. A flight that is over stays where it ended."""
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
        note = f"{i * PERIOD:.1f} s of {self.length * PERIOD:.1f} s, {series['speed (m/s)'][0]:.1f} m/s, "
        note += f"tilted {tilt:.0f} degrees\n{told.name} {mode}"
        return StageFrame(
            i * PERIOD, now("position"), now("quaternion"), now("velocity"), now("rotor_speed"), now("goal"),
            series=series, fresh=i == 0, together=self.together, note=note,
        )  # fmt: skip
