"""Checks whether a flight can be used for identification: units, ranges, order of the rotors, clocks, duplicates. Each
error names its cause.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np
from scipy.signal import lfilter

from e2efly.control import Quat, Vec3
from e2efly.logs.blackbox import vertex
from e2efly.logs.recording import KINDS, Record, Stream, percent
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

LIMITS = {
    "position": 1e4, "velocity": 100.0, "quaternion": 1.01, "body_rate": 60.0, "specific_force": 300.0,
    "rotor_speed": 1e4, "motor": 1.05, "command": 300.0, "setpoint": 60.0, "voltage": 100.0,
}  # fmt: skip
"""Largest plausible absolute value in a quadrotor's log, in the stream's unit."""
LOST = 1e-3
"""Largest fraction of a stream that may be outside these limits. Such samples are left out."""
LEAST_VOLTS = 1.0
"""Lowest plausible voltage of a battery, V. Lower values mean that there is no sensor."""
MOVING = 0.3
"""Speed above which the poses show that the vehicle moves, m/s."""
DRIFT = 0.02
"""Largest accepted change of the offset between two clocks during a flight, s."""
AGREE = 0.7
"""Lowest correlation at which two streams are taken to show the same motion."""
AT_REST, LEVEL = 0.02, 0.2
"""`AT_REST`: motor output below which a vehicle on the ground is at rest. `LEVEL`: largest tilt of the poses' axes that
is corrected, rad."""
SEEN = 0.12
"""Lowest correlation between the rotors' torques and the body's angular acceleration that shows the rotor order."""
UNIT_OFF, LIVELY = 2.0, 3.0
"""`UNIT_OFF`: ratio to what gravity and motion show from which on a specific force has another unit. `LIVELY`: up to so
many times gravity is typical of a log that shows neither."""
CALM_S, CALM_RATE = 0.2, 0.3
"""Length of a piece, s, and largest body rate in it, rad/s, of a vehicle that is at rest or hovers."""
_GRID = 0.005


def checked(records: Sequence[Record], vehicle: Vehicle) -> list[Record]:
    """The flights, reduced to the parts that can be used. Their notes say what was cut.

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
        record = _with_battery(_within_limits(record))
        _check_constant(record)
        _check_units(record)
        record = _in_the_air(_levelled(record), vehicle)
        _check_rotors(record, vehicle)
        found.append(_on_one_clock(record))
    return found


def _digest(record: Record) -> str:
    parts = hashlib.sha256()
    for name in sorted(record.streams):
        parts.update(name.encode())
        parts.update(np.ascontiguousarray(record.streams[name].values).tobytes())
    return parts.hexdigest()


def _within_limits(record: Record) -> Record:
    streams, notes = {}, list(record.notes)
    for name, stream in record.streams.items():
        bad = np.any(np.abs(stream.values) > LIMITS[name], axis=1)
        if name == "quaternion":
            bad |= np.abs(np.linalg.norm(stream.values, axis=1) - 1) > 0.02
        if name in ("motor", "rotor_speed"):
            bad |= np.any(stream.values < -0.05 * LIMITS[name], axis=1)
        if bad.mean() > LOST:
            unit = "" if KINDS[name].unit == "1" else f" {KINDS[name].unit}"
            worst = float(np.max(np.abs(stream.values)))
            raise ValueError(
                f"{record.path}: {name} is up to {worst:.4g}{unit}, and beyond what a quadrotor can do in "
                f"{percent(bad.mean())} of its samples; accepted: up to {LIMITS[name]:g}{unit} (are the units "
                "right? Splines through gaps overshoot like this, too)"
            )
        if bad.any():
            notes.append(f"{int(bad.sum())} samples of {name} that no quadrotor reaches are left out")
        streams[name] = Stream(stream.time[~bad], stream.values[~bad])
    return replace(record, streams=streams, notes=tuple(notes))


def _with_battery(record: Record) -> Record:
    """The record without invalid voltages. A flight controller without a voltage sensor reports 0 V."""
    if "voltage" not in record.streams:
        return record
    stream = record.streams["voltage"]
    there = stream.values[:, 0] > LEAST_VOLTS
    if there.all():
        return record
    streams = dict(record.streams)
    streams["voltage"] = Stream(stream.time[there], stream.values[there])
    if there.mean() < 0.5:
        del streams["voltage"]
        note = "the battery's voltage was not measured: 0 V"
    else:
        note = f"{int((~there).sum())} voltages of 0 V are left out"
    return replace(record, streams=streams, notes=(*record.notes, note))


def _check_constant(record: Record) -> None:
    for name in ("body_rate", "specific_force", "rotor_speed", "motor", "velocity", "quaternion"):
        if not record.has(name):
            continue
        spread = np.ptp(record.streams[name].values, axis=0)
        if np.any(spread == 0):
            column = KINDS[name].columns[int(np.argmin(spread))]
            raise ValueError(
                f"{record.path}: {column} of {name} never changes; accepted: what was measured in flight, or the log "
                f"--without {name}"
            )


def _check_units(record: Record) -> None:
    if record.has("specific_force"):
        size = float(np.median(np.linalg.norm(record.streams["specific_force"].values, axis=1)))
        shown = _gravity_shown(record)
        told = f"rest, hover or the motion of the poses show {shown[0][1]:.3g}" if shown else f"gravity is {GRAVITY}"
        shown = shown or [(size, float(np.clip(size, GRAVITY, LIVELY * GRAVITY)))]
        off = min((measured / expected for measured, expected in shown), key=lambda x: abs(np.log(max(x, 1e-9))))
        guess = (
            "values without gravity" if abs(_lift(record)) < 0.3 * off * GRAVITY or off < 0.04
            else "" if 1 / UNIT_OFF < off < UNIT_OFF
            else "g" if off < 0.2
            else "another unit"
        )  # fmt: skip
        if guess:
            raise ValueError(
                f"{record.path}: specific_force has a median size of {size:.3g}, where {told} m/s^2: it "
                f"looks like {guess}; accepted: m/s^2, with gravity (--columns ax=ax*9.81 ay=ay*9.81 az=az*9.81, in a "
                "CSV file with its own names behind the =), or a flight --without specific_force"
            )
    if record.has("body_rate", "quaternion"):
        told, true = _rates(record)
        slope = float(np.sum(told * true) / max(np.sum(true**2), 1e-12))
        if np.std(true) > 0.1 and (slope > 20 or 0 < slope < 0.05):
            unit = "deg/s" if slope > 20 else "another unit"
            raise ValueError(
                f"{record.path}: body_rate is {slope:.3g} times what the attitude turns by: it looks like {unit}; "
                "accepted: rad/s (--columns wx=wx*0.0174533 wy=wy*0.0174533 wz=wz*0.0174533 makes it of deg/s)"
            )


def _gravity_shown(record: Record) -> list[tuple[float, float]]:
    """Where the log shows how large the specific force is: its median there, in the log's unit, and that by gravity and
    motion, m/s^2. The size of a vector does not depend on the body's axes, nor on exact clocks.
    """
    force = record.streams["specific_force"]
    sizes, shown = np.linalg.norm(force.values, axis=1), []
    if record.has("body_rate"):  # at rest or in hover: it neither turns nor shakes
        gyro = record.streams["body_rate"]
        turn = np.interp(force.time, gyro.time, np.linalg.norm(gyro.values, axis=1))
        every = max(round(CALM_S * force.rate), 2)
        count = len(sizes) // every
        pieces, turns = (x[: count * every].reshape(count, every) for x in (sizes, turn))
        calm = (turns.max(1, initial=0.0) < CALM_RATE) & (pieces.std(1) < 0.1 * pieces.mean(1))
        if calm.sum() > 2:
            shown.append((float(np.median(pieces[calm])), GRAVITY))
    if (moved := _acceleration(record)) is not None:
        time, acceleration = moved
        inside = (force.time >= time[0]) & (force.time <= time[-1])
        if inside.any():
            expected = np.linalg.norm(acceleration + np.array([0.0, 0.0, GRAVITY]), axis=1)
            shown.append((float(np.median(sizes[inside])), max(float(np.median(expected)), 1e-3)))
    return shown


def _acceleration(record: Record) -> tuple[np.ndarray, np.ndarray] | None:
    """Accelerations of the poses, (n, 3) m/s^2 in the world, and their times. None: there are no poses."""
    name = "velocity" if record.has("velocity") else "position" if record.has("position") else ""
    if not name or np.ptp(record.streams[name].time) < 5 * CALM_S:
        return None
    stream = record.streams[name]
    time = np.arange(stream.time[0], stream.time[-1], CALM_S)
    values = np.stack([np.interp(time, stream.time, x) for x in stream.values.T], -1)
    if name == "velocity":
        return 0.5 * (time[1:] + time[:-1]), np.diff(values, axis=0) / CALM_S
    return time[1:-1], np.diff(values, 2, axis=0) / CALM_S**2


def _lift(record: Record) -> float:
    """The mean specific force along the world's z, in the log's unit. It is gravity over any flight that ends about as
    fast as it begins. NaN if the log does not show it.
    """
    moved = _acceleration(record) if record.has("quaternion") else None
    if moved is None or len(moved[0]) < 5:
        return float("nan")
    time, acceleration = moved
    pose, force = record.streams["quaternion"], record.streams["specific_force"]
    q = np.stack([np.interp(time, pose.time, x) for x in _continuous(pose.values).T])
    f = np.stack([np.interp(time, force.time, x) for x in force.values.T])
    up = np.asarray(Quat(*q / np.linalg.norm(q, axis=0)).rotate(Vec3(*f)).z)
    return float(np.mean(up - acceleration[:, 2]))


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
    w, x, y, z = _continuous(ground["quaternion"].values).mean(0)
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
    hover = vehicle.hover_rotor_speed
    if record.has("rotor_speed"):
        stream, flying = record.streams["rotor_speed"], record.streams["rotor_speed"].values.mean(1) > 0.5 * hover
    elif record.has("motor"):
        stream = record.streams["motor"]
        flying = stream.values.mean(1) > 0.15
    elif record.has("position"):
        stream = record.streams["position"]
        height = stream.values[:, 2]
        # a vehicle that moves at the lowest height of a flight is not on the ground
        moves = np.linalg.norm(np.gradient(_smooth(stream.values), stream.time, axis=0), axis=1) > MOVING
        flying = (height > np.quantile(height, 0.02) + 0.1) | moves
    else:
        return record
    if not flying.any():
        raise ValueError(f"{record.path}: never leaves the ground; accepted: a flight")
    if flying.mean() > 0.98:
        return record
    edges = np.diff(np.concatenate([[0], flying.astype(int), [0]]))
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    # moments of low thrust, as in a fall, are part of a flight
    spans = [[stream.time[s], stream.time[e]] for s, e in zip(starts, ends, strict=True)]
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


def _check_rotors(record: Record, vehicle: Vehicle) -> None:
    """Check the order of the rotors by the effect of their torques on the body rates."""
    name = "rotor_speed" if record.has("rotor_speed") else "motor" if record.has("motor") else ""
    if not name or not record.has("body_rate"):
        return
    rate, rotors = record.streams["body_rate"], record.streams[name]
    grid = np.arange(max(rate.time[0], rotors.time[0]), min(rate.time[-1], rotors.time[-1]), _GRID)
    if len(grid) < 200:
        return
    w = _smooth(np.stack([np.interp(grid, rate.time, x) for x in rate.values.T], -1))
    thrust = np.stack([np.interp(grid, rotors.time, x) for x in rotors.values.T], -1)
    thrust = _smooth(thrust**2 if name == "rotor_speed" else _lagged(thrust, vehicle))
    turn = np.gradient(w, _GRID, axis=0)[:, :2]
    x, y = vehicle.rotor_position.T

    def seen(order: tuple[int, ...]) -> np.ndarray:
        torque = np.stack([thrust[:, order] @ y, -thrust[:, order] @ x], -1)
        return np.array([_correlation(torque[:, i], turn[:, i]) for i in range(2)])

    usual = seen((0, 1, 2, 3))
    best = max(permutations(range(4)), key=lambda order: float(seen(order).sum()))
    if np.all(seen(best) > SEEN) and seen(best).sum() > 1.4 * max(float(usual.sum()), 0.0):
        columns = KINDS[name].columns
        listed = ", ".join(columns[i] for i in best)
        first, other = next((columns[i], columns[k]) for i, k in enumerate(best) if i != k)
        raise ValueError(
            f"{record.path}: {name} does not turn the vehicle as its geometry says; the columns fit it in the order "
            f"{listed}; "
            f"accepted: rear right, front right, rear left, front left (--columns OURS=THEIRS, as {first}={other})"
        )


def _lagged(outputs: np.ndarray, vehicle: Vehicle) -> np.ndarray:
    """The approximate response of the rotors to motor outputs: with the vehicle's motor lag and a delay of two grid
    steps.
    """
    kept = float(np.exp(-_GRID / vehicle.motor_time_constant))
    late = np.concatenate([outputs[:1], outputs[:1], outputs[:-2]])
    first = kept * late[:1]
    return np.asarray(lfilter([1 - kept], [1, -kept], late, axis=0, zi=first)[0])


def _on_one_clock(record: Record) -> Record:
    """Move the poses by the offset of their clock. Refuse a flight in which the clocks drift apart."""
    if not record.has("body_rate", "quaternion"):
        return record
    start, end = record.span
    thirds = [_behind(record.during(a, a + (end - start) / 3)) for a in (start, end - (end - start) / 3)]
    whole = _behind(record)
    if whole is None:  # the age of the poses is then not known either
        return replace(record, pose_age=None)
    known = [x for x in thirds if x is not None]
    if len(known) == 2 and abs(known[1] - known[0]) > DRIFT:
        raise ValueError(
            f"{record.path}: the poses are {1e3 * known[0]:.0f} ms behind the gyroscope at first and "
            f"{1e3 * known[1]:.0f} ms at the end: their clocks run apart; accepted: {1e3 * DRIFT:g} ms over a flight"
        )
    if abs(whole) < 1e-3:
        return record
    poses = {
        k: Stream(s.time - whole, s.values)
        for k, s in record.streams.items()
        if k in ("position", "velocity", "quaternion")
    }
    note = f"poses are moved by {-1e3 * whole:.0f} ms onto the gyroscope's clock"
    age = None if record.pose_age is None else record.pose_age + whole
    return replace(record, streams={**record.streams, **poses}, notes=(*record.notes, note), pose_age=age)


def _behind(record: Record) -> float | None:
    """Time by which the poses lag behind the gyroscope, s. None if the two show no common motion."""
    if not record.has("body_rate", "quaternion"):
        return None
    told, true = _rates(record)
    if len(told) < 100 or np.std(true) < 0.05:
        return None
    reach = round(0.2 / _GRID)
    scores = []
    for shift in range(-reach, reach + 1):
        a = told[max(-shift, 0) : len(told) - max(shift, 0)]
        b = true[max(shift, 0) : len(true) - max(-shift, 0)]
        scores.append(np.mean([_correlation(a[:, i], b[:, i]) for i in range(3)]))
    i = int(np.argmax(scores))
    if scores[i] < AGREE:
        return None
    return (i - reach + vertex(np.array(scores), i)) * _GRID


def _rates(record: Record) -> tuple[np.ndarray, np.ndarray]:
    """Body rates from the gyroscope and from the derivative of the attitude, smoothed, on one grid, (n, 3)."""
    gyro, pose = record.streams["body_rate"], record.streams["quaternion"]
    grid = np.arange(max(gyro.time[0], pose.time[0]), min(gyro.time[-1], pose.time[-1]), _GRID)
    if len(grid) < 3:
        return np.zeros((0, 3)), np.zeros((0, 3))
    told = np.stack([np.interp(grid, gyro.time, x) for x in gyro.values.T], -1)
    q = np.stack([np.interp(grid, pose.time, x) for x in _continuous(pose.values).T], -1)
    q = _smooth(q / np.linalg.norm(q, axis=1, keepdims=True))
    dq = np.gradient(q, _GRID, axis=0)
    w, x, y, z = q.T
    dw, dx, dy, dz = dq.T
    true = 2 * np.stack(
        [w * dx - x * dw - y * dz + z * dy, w * dy + x * dz - y * dw - z * dx, w * dz - x * dy + y * dx - z * dw], -1
    )
    return _smooth(told), true


def _continuous(q: np.ndarray) -> np.ndarray:
    """The same attitudes as quaternions that do not change their sign from one to the next."""
    flips = np.where(np.sum(q[1:] * q[:-1], axis=1) < 0, -1.0, 1.0)
    return q * np.concatenate([[1.0], np.cumprod(flips)])[:, None]


def _smooth(x: np.ndarray) -> np.ndarray:
    kernel = np.hanning(9)[1:-1]
    kernel /= kernel.sum()
    return np.stack([np.convolve(column, kernel, "same") for column in x.T], -1)


def _correlation(a: np.ndarray, b: np.ndarray) -> float:
    a, b = a - a.mean(), b - b.mean()
    size = np.sqrt(np.sum(a**2) * np.sum(b**2))
    return float(np.sum(a * b) / size) if size > 0 else 0.0
