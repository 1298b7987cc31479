"""The log of a flight on a plant: the streams that `e2efly identify` reads. Imports no JAX."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from e2efly.control import Quat, Vec3
from e2efly.logs.recording import Record, Stream
from e2efly.validation.plant import RigidState
from e2efly.validation.plant_flight import Trajectory
from e2efly.vehicles.gravity import GRAVITY

SAMPLE = 0.004
"""Time between two lines of a log, s: 250 Hz."""


def motion_streams(time: np.ndarray, states: Sequence[RigidState], rotor_speed: np.ndarray) -> dict[str, Stream]:
    """Streams of a flight without errors, from the states at times (n,), s, in equal or nearly equal steps.

    Rotor speeds, (n, 4) rad/s, are NaN if the plant does not give them, and then left out.
    """
    velocity, attitude = np.array([s.velocity for s in states]), np.array([s.quaternion for s in states])
    change = np.gradient(velocity, time, axis=0) + np.array([0.0, 0.0, GRAVITY])
    pull = Quat(*attitude.T).unrotate(Vec3(*change.T))
    streams = {
        "body_rate": Stream(time, np.array([s.body_rate for s in states])),
        "specific_force": Stream(time, np.stack([pull.x, pull.y, pull.z], -1)),
        "rotor_speed": Stream(time, rotor_speed),
        "position": Stream(time, np.array([s.position for s in states])),
        "velocity": Stream(time, velocity),
        "quaternion": Stream(time, attitude),
    }
    return {name: stream for name, stream in streams.items() if np.isfinite(stream.values).all()}


def record_of(path: Path, flight: Trajectory, mode: str) -> Record:
    """The log of a flight that has kept its samples.

    In the command mode ctbr it contains the commands, at the times when they were sent.
    """
    streams = motion_streams(
        np.array([s.time for s in flight.samples]),
        [s.state for s in flight.samples],
        np.array([s.rotor_speed for s in flight.samples]),
    )
    if mode == "ctbr":
        streams["command"] = Stream(flight.time[: len(flight.command)], flight.command)
    return Record(path, streams)
