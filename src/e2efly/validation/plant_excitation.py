"""Fly on a plant the manoeuvres that identification needs, and keep the log that a vehicle would keep.

Imports no JAX.
"""

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from e2efly.control import COMMAND_MODES, Quat, Vec3
from e2efly.control.cascade import limited
from e2efly.control.manoeuvres import (
    DURATION,
    ManoeuvreProgress,
    ManoeuvreRoom,
    doublets,
    excite,
    lines,
    softened,
    trimmed,
)
from e2efly.control.step_schedule import Steps
from e2efly.logs.recording import Record, Stream
from e2efly.validation.log import motion_streams
from e2efly.validation.plant import Delay, Plant, PlantMotion, RigidState
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

RATE, POSES, COMMANDS = 250.0, 100.0, 50.0
"""Sample rates of gyroscope, accelerometer and rotor speeds, of the poses, and of the commands, Hz."""
LIFT, WEAKEST = 2.0, 8.0
"""Growth of the trim, 1/s^2, and its limit, m/s^2. The flight controller may be tuned to far more thrust than there is,
and the vehicle must not sink to the ground."""
WIDE = ManoeuvreRoom(np.array([-50.0, -50.0, 0.0]), np.array([50.0, 50.0, 100.0]), 3.5, 0.45)
"""The room of a flight of steps."""


@dataclass(frozen=True)
class Sensors:
    """Errors of a log: standard deviations of white noise, and errors that are constant over a flight."""

    body_rate: float = 0.02
    """White noise, rad/s."""
    specific_force: float = 0.3
    """White noise, m/s^2."""
    rotor_speed: float = 10.0
    """White noise, rad/s."""
    position: float = 0.001
    """White noise, m."""
    velocity: float = 0.02
    """White noise, m/s."""
    attitude: float = 0.003
    """White noise, rad."""
    gyro_bias: float = 0.01
    """Constant bias, rad/s."""
    force_bias: float = 0.1
    """Constant bias, m/s^2."""
    pose_delay: float = 0.03
    """Largest delay of the poses, s. The delay is uniform from zero."""
    gaps: int = 5
    """Number of gaps of 20 to 100 ms in gyroscope, accelerometer and rotor speeds."""


def fly_excitation(
    plant: Plant,
    believed: Vehicle,
    latency: float,
    *,
    seconds: float = DURATION,
    speed: float = 5.0,
    sag: float = 0.0,
    pulses: bool = True,
    steps: Steps | None = None,
) -> Record:
    """Fly lines and doublets on a plant in the command mode ctbr, and record everything without errors. With `steps`,
    fly these.

    The plant's flight controller is tuned to `believed`, whose gains steer, softened for a vehicle that is not known.
    `latency` is the time from sending a command to the rate loop, s; `speed` that of the fastest line, m/s; `sag` the
    share of the thrust that is lost by the end, at a constant rate.
    """
    steer = softened(believed)
    wanted = COMMAND_MODES["velocity"].controller
    assert wanted is not None
    hover = np.array([GRAVITY, 0.0, 0.0, 0.0])
    plant.reset(RigidState(np.array([0.0, 0.0, 50.0]), np.zeros(3), np.eye(4)[0], np.zeros(3)))
    delay, ticks = Delay.of(latency, hover), round(RATE / COMMANDS)
    seconds = seconds if steps is None else steps.seconds
    progress = ManoeuvreProgress.begin(WIDE, plant.state.position, 0.0)
    states, rotors, commands, trim = [], [], [], 0.0
    for k in range(round(seconds * RATE)):
        now, then = k / RATE, (k + 1) / RATE
        state = plant.state
        states.append(state)
        rotors.append(getattr(plant, "rotor_speed", np.full(believed.rotor_count, np.nan)))
        if sag:
            plant.disturb(np.zeros(3), np.full(believed.rotor_count, 1 - sag * now / seconds))
        if k % ticks == 0:
            motion = PlantMotion(Vec3(*state.position), Vec3(*state.velocity), Quat(*state.quaternion))
            if steps is not None:
                progress, sent = excite(steer, WIDE, steps, progress, now, motion)
            else:
                found = wanted(steer, motion, (*lines(now, speed), 0.0))
                rates, thrust = doublets(now) if pulses else (np.zeros(3), 0.0)
                trim = trimmed(trim, lines(now, speed)[2] - state.velocity[2], 1 / COMMANDS, LIFT, WEAKEST)
                sent = limited(believed, max(float(found.thrust) + thrust + trim, 0.0), found.rate + Vec3(*rates))
            command = np.array([sent.thrust, sent.rate.x, sent.rate.y, sent.rate.z])
            commands.append((now, command))
            delay = delay.send(command, now)
        delay, parts = delay.until(now, then)
        for command, held in parts:
            plant.step(command, held)
    time = np.arange(len(states)) / RATE
    streams = motion_streams(time, states, np.array(rotors))
    times, values = zip(*commands, strict=True)
    return Record(Path("excitation.csv"), streams | {"command": Stream(np.array(times), np.array(values))})


def sensed(record: Record, sensors: Sensors, seed: int) -> Record:
    """The log of imperfect sensors: poses at their own rate and with a delay, gaps, noise and biases."""
    rng, streams = np.random.default_rng(seed), dict(record.streams)
    time = streams["body_rate"].time
    keep = np.ones(len(time), bool)
    for _ in range(sensors.gaps):
        begin, length = rng.uniform(time[0], time[-1]), rng.uniform(0.02, 0.1)
        keep &= ~((time > begin) & (time < begin + length))
    late = rng.uniform(0, sensors.pose_delay)
    every = round(RATE / POSES * 2) / 2
    chosen = np.unique((np.arange(0, len(time), every)).astype(int))
    for name, stream in record.streams.items():
        values = stream.values
        if name == "quaternion":
            half = 0.5 * sensors.attitude * rng.standard_normal((len(values), 3))
            turned = Quat(*values.T).compose(Quat(np.ones(len(values)), *half.T)).normalized()
            values = np.stack([turned.w, turned.x, turned.y, turned.z], -1)
        elif name != "command":
            values = values + getattr(sensors, name) * rng.standard_normal(values.shape)
        if name == "body_rate":
            values = values + sensors.gyro_bias * rng.standard_normal(3)
        if name == "specific_force":
            values = values + sensors.force_bias * rng.standard_normal(3)
        if name in ("position", "velocity", "quaternion"):
            streams[name] = Stream(stream.time[chosen] + late, values[chosen])
        elif name != "command":
            streams[name] = Stream(stream.time[keep], values[keep])
    return dataclasses.replace(record, streams=streams)
