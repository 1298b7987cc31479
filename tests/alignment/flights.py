"""What MuJoCo's flights leave behind, as the alignment and the identification find it."""

import time
from pathlib import Path
from typing import Any

from e2efly.logs.recording import Record
from e2efly.logs.telemetry import Telemetry
from e2efly.validation.plant_excitation import Sensors, fly_excitation, sensed
from e2efly.validation.plants import find_plant
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle

FILE = load_vehicle("vis_r")
USUAL = Sensors()
PERFECT = Sensors(*[0.0] * 9, gaps=0)


def flown(body: Vehicle, seconds: float, sensors: Sensors = USUAL, seed: int = 0, **excitation: Any) -> Record:
    """The record of a body whose flight controller believes in the file."""
    plant = find_plant("mujoco")(FILE)  # type: ignore[call-arg]
    plant.meet(body)
    return sensed(fly_excitation(plant, FILE, body.latency, seconds=seconds, **excitation), sensors, seed)


def as_mcap(record: Record, path: Path, late: float = 0.0, age: float = 0.0) -> None:
    """By way of the bridge's telemetry, which says no rotor speeds; poses come late by so many s, and say an age."""
    start, at = time.monotonic() + 1, {name: s.time for name, s in record.streams.items()}
    streams = {name: s.values.tolist() for name, s in record.streams.items()}
    with Telemetry(path, queue_size=100_000) as log:
        for i, t in enumerate(at["body_rate"]):
            imu = {"gyro": streams["body_rate"][i], "specific_force": streams["specific_force"][i]}
            log.record("imu", start + t, imu)
        for i, t in enumerate(at["position"]):
            motion = {name: streams[name][i] for name in ("position", "velocity", "quaternion")}
            log.record("odometry", start + t + late, {"age": age, "body_rate": [0.0, 0.0, 0.0], **motion})
        for t, command in zip(at["command"], streams["command"], strict=True):
            log.record("command", start + t, {"collective_thrust": command[0], "body_rate": command[1:]})
