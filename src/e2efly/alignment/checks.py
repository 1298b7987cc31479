"""Checks whether a flight can be used for identification: damage, units, frames, clocks, order of the rotors,
duplicates. Each error names its cause.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from e2efly.alignment.clock_checks import on_one_clock, with_clock_rate
from e2efly.alignment.comparison import continuous, runs, smooth
from e2efly.alignment.damage_checks import check_columns, with_battery, within_limits, without_frozen
from e2efly.alignment.frame_checks import in_one_frame, judged_frames
from e2efly.alignment.rotor_checks import (
    check_commanded_thrust,
    check_rotor_count,
    check_rotor_order,
    check_rotor_speed_unit,
)
from e2efly.alignment.unit_checks import check_force_unit, check_gyro_unit, check_motion_units
from e2efly.control import Quat
from e2efly.logs.recording import Record, Stream
from e2efly.vehicles.vehicle import Vehicle

MOVING = 0.3
"""Speed above which the poses show that the vehicle moves, m/s."""
FEIGNED = 4.0
"""Ratio of a specific force to what the poses show that wrong frames may lead to."""
TURNING = 0.1
"""Body rate above which the vehicle turns, rad/s."""
AT_REST, LEVEL = 0.02, 0.2
"""`AT_REST`: motor output below which a vehicle on the ground is at rest. `LEVEL`: largest tilt of the poses' axes that
is corrected, rad."""


def checked(records: Sequence[Record], vehicle: Vehicle, hovers: bool = False) -> list[Record]:
    """The flights, reduced to the parts that can be used. Their notes say what was cut. The height of flights that
    `hovers` does not tell ground from air, so that only rotor speeds or motor outputs show what is in the air.

    Raises:
        ValueError: naming the file, what is wrong with it, and what is accepted.
    """
    seen: dict[str, Record] = {}
    found = []
    for record in records:
        digest = _digest(record)
        if digest in seen:
            raise ValueError(
                f"{record.path}: holds the same numbers as {seen[digest].path}; accepted: each flight once"
            )
        seen[digest] = record
        check_rotor_count(record, vehicle)
        record = with_battery(within_limits(record))
        check_columns(record)
        check_rotor_speed_unit(record, vehicle)
        driven = record.has("rotor_speed") or record.has("motor")
        flight = _in_the_air(record, vehicle) if driven else record  # without them, height tells, if frames are right
        record = without_frozen(record, flight.span if driven else _turning(record))
        check_gyro_unit(record)
        check_motion_units(record)
        check_force_unit(record, FEIGNED)
        record = with_clock_rate(record)
        try:
            record = on_one_clock(record, record.during(*flight.span))
        except ValueError:
            if judged_frames(record.during(*flight.span)).best is None:  # wrong frames make clocks look wrong, too
                raise
        record = in_one_frame(record, record.during(*flight.span))
        check_force_unit(record)
        record = _levelled(record)
        if driven or not hovers:
            record = _in_the_air(record, vehicle)
        else:
            note = "has neither rotor speeds nor motor outputs: all of it is taken to be in the air"
            record = replace(record, notes=(*record.notes, note))
        check_rotor_order(record, vehicle)
        found.append(check_commanded_thrust(record, vehicle))
    return found


def _turning(record: Record) -> tuple[float, float]:
    """First and last time at which the gyroscope shows that the vehicle turns, s."""
    if not record.has("body_rate"):
        return 0.0, 0.0
    stream = record.streams["body_rate"]
    turns = stream.time[np.linalg.norm(smooth(stream.values), axis=1) > TURNING]
    return (float(turns[0]), float(turns[-1])) if len(turns) else (0.0, 0.0)


def _digest(record: Record) -> str:
    parts = hashlib.sha256()
    for name in sorted(record.streams):
        parts.update(name.encode())
        parts.update(np.ascontiguousarray(record.streams[name].values).tobytes())
    return parts.hexdigest()


def _levelled(record: Record) -> Record:
    """Rotate the body axes of the poses onto those of the accelerometer, as far as a vehicle at rest before take-off
    shows the difference.

    Motion capture can place the axes of a body in any direction. The tilt between accelerometer and rotors remains. It
    is the same for every flight, whereas the tilt of the poses changes whenever the markers are placed anew.
    """
    if not record.has("specific_force", "quaternion", "motor", "body_rate"):
        return record
    motor, pose = record.streams["motor"], record.streams["quaternion"]
    turning = motor.values.max(1) > AT_REST
    start = motor.time[int(np.argmax(turning))] if turning.any() else motor.time[0]
    ground = record.during(record.span[0], start - 0.2).streams
    if (
        start - record.span[0] < 0.7
        or min(len(ground[k].time) for k in ("specific_force", "quaternion", "body_rate")) < 20
    ):
        return record
    if np.any(np.abs(ground["body_rate"].values).max(0) > 0.3):
        return record
    told = ground["specific_force"].values.mean(0)
    told /= np.linalg.norm(told)
    w, x, y, z = continuous(ground["quaternion"].values).mean(0)
    true = np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])  # up, in the body's axes
    true /= np.linalg.norm(true)
    turn = np.cross(told, true)  # small, and without a rotation in heading
    size = float(np.linalg.norm(turn))
    if not 1e-3 < size < LEVEL:
        return record
    half = 0.5 * turn
    level = (
        Quat(*pose.values.T).compose(Quat(np.ones(len(pose.time)), *np.tile(half, (len(pose.time), 1)).T)).normalized()
    )
    turned = Stream(pose.time, np.stack([level.w, level.x, level.y, level.z], -1))
    note = f"poses are turned by {np.degrees(size):.1f} degrees onto the accelerometer's level before take-off"
    return replace(record, streams={**record.streams, "quaternion": turned}, notes=(*record.notes, note))


def _in_the_air(record: Record, vehicle: Vehicle) -> Record:
    """Remove the parts before take-off and after landing.

    In the air, the rotor speeds or the motor outputs are high. If the log has neither, the height and the motion of the
    poses decide.
    """
    if record.has("rotor_speed"):
        stream = record.streams["rotor_speed"]
        flying = stream.values.mean(1) > 0.5 * vehicle.hover_rotor_speed
    elif record.has("motor"):
        stream = record.streams["motor"]
        flying = stream.values.mean(1) > 0.15
    elif record.has("position"):
        stream = record.streams["position"]
        height = stream.values[:, 2]
        # a vehicle that moves at the lowest height of a flight is not on the ground
        moves = np.linalg.norm(np.gradient(smooth(stream.values), stream.time, axis=0), axis=1) > MOVING
        flying = (height > np.quantile(height, 0.02) + 0.1) | moves
    else:
        return record
    if not flying.any():
        raise ValueError(f"{record.path}: never leaves the ground; accepted: a flight")
    if flying.mean() > 0.98:
        return record
    # moments of low thrust, as in a fall, are part of a flight
    spans = [[float(stream.time[s]), float(stream.time[e])] for s, e in zip(*runs(flying), strict=True)]
    joined = [spans[0]]
    for span in spans[1:]:
        if span[0] - joined[-1][1] < 0.5:
            joined[-1][1] = span[1]
        else:
            joined.append(span)
    start, end = max(joined, key=lambda s: s[1] - s[0])
    if end - start < 2.0:
        raise ValueError(f"{record.path}: is in the air for {end - start:.1f} s at a time; accepted: 2 s or more")
    start, end = start + 0.5, end - 0.5  # neither the ground's effect nor the landing
    note = f"used from {start - record.span[0]:.1f} to {end - record.span[0]:.1f} s, when it is in the air"
    return replace(record.during(start, end), notes=(*record.notes, note))
