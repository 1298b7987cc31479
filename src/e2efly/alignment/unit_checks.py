"""Checks the units of a flight's streams by what they say about the same motion, and by gravity."""

import numpy as np

from e2efly.alignment.comparison import at_times, attitudes, common_times, pearson, rates, smooth
from e2efly.control import Quat, Vec3
from e2efly.logs.csv_file import UNIT, UNITS
from e2efly.logs.recording import KINDS, Record
from e2efly.vehicles.gravity import GRAVITY

AGREE = 0.7
"""Lowest correlation at which two streams are taken to show the same motion."""
UNIT_OFF, LIVELY = 2.0, 3.0
"""`UNIT_OFF`: ratio to what another stream, or gravity, shows from which on a stream has another unit. `LIVELY`: up to
so many times gravity is typical of a specific force in a log that shows neither rest nor motion."""
CALM_S, CALM_RATE = 0.2, 0.3
"""Length of a piece, s, and largest body rate in it, rad/s, of a vehicle that is at rest or hovers."""
LIKELY = {
    "position": ("cm", "mm"), "velocity": ("cm/s", "mm/s", "km/h"), "body_rate": ("deg/s",), "setpoint": ("deg/s",),
    "specific_force": ("g", "mg", "mm/s^2"), "rotor_speed": ("rpm",), "motor": ("%",), "voltage": ("mv",),
}  # fmt: skip
"""Other units in which logs have a stream."""


def scaled(name: str, factor: float, size: int = 4) -> str:
    """The option that multiplies a stream, of a vehicle with this number of rotors, by a factor."""
    entries = " ".join(f"{column}={column}*{factor:.6g}" for column in KINDS[name].names(size))
    return f"--columns {entries}, in a CSV file with its own names behind the ="


def factors(name: str) -> dict[str, float]:
    """By the likely units of a stream, what makes ours of them."""
    known = UNITS[UNIT[KINDS[name].columns[0]]]
    return {unit: known[unit] for unit in LIKELY.get(name, ())}


def check_gyro_unit(record: Record) -> None:
    """Compare the size of the body rates with that of the attitude's, which does not depend on any axes.

    Raises:
        ValueError: naming the unit and the option that converts it.
    """
    if not record.has("body_rate", "quaternion"):
        return
    told, true = (np.linalg.norm(smooth(x, 41), axis=1) for x in rates(record))
    if len(told) > 200 and np.std(true) > 0.1 and pearson(told, true) > AGREE:
        _check_ratio(record, "body_rate", float(np.std(told) / np.std(true)), "what the attitude turns by")


def check_motion_units(record: Record) -> None:
    """Compare position with velocity, and both with the specific force, by sizes that do not depend on any axes.

    Raises:
        ValueError: naming the unit and the option that converts it.
    """
    if record.has("position", "velocity"):
        time = common_times(record, "position", "velocity", step=CALM_S / 4)
        if len(time) > 20:
            moved = np.diff(at_times(record.streams["position"], time), axis=0) / (CALM_S / 4)
            told = at_times(record.streams["velocity"], time)
            there, said = np.linalg.norm(moved, axis=1), np.linalg.norm(told[1:] + told[:-1], axis=1) / 2
            if min(there.std(), said.std()) > 0 and max(there.std(), said.std()) > 0.1 and pearson(there, said) > AGREE:
                ratio = float(there.std() / said.std())
                _check_ratio(record, "position", max(ratio, 1.0), "as fast as velocity")
                _check_ratio(record, "velocity", max(1 / ratio, 1.0), "what position changes by")
    if record.has("specific_force") and (moved := _acceleration(record)) is not None:
        size = float(np.median(np.linalg.norm(record.streams["specific_force"].values, axis=1)))
        most = float(np.median(np.linalg.norm(moved[1], axis=1)))
        if most > UNIT_OFF * (size + GRAVITY) and size > GRAVITY / UNIT_OFF:
            name = "velocity" if record.has("velocity") else "position"
            _check_ratio(record, name, most / GRAVITY, "what the specific force can do")


def _check_ratio(record: Record, name: str, ratio: float, to: str) -> None:
    """Refuse a stream that is so many times what it has to be."""
    if 1 / UNIT_OFF < ratio < UNIT_OFF:
        return
    known = factors(name)
    unit = min(known, key=lambda u: abs(np.log(known[u] * ratio)))
    fits = abs(np.log(known[unit] * ratio)) < np.log(UNIT_OFF)
    factor, looks = (known[unit], unit) if fits else (1 / ratio, "another unit")
    raise ValueError(
        f"{record.path}: {name} is {ratio:.3g} times {to}: it looks like {looks}; accepted: {KINDS[name].unit} "
        f"({scaled(name, factor)}), or the log --without {name}"
    )


def check_force_unit(record: Record, most: float = UNIT_OFF) -> None:
    """Compare the specific force with gravity where the vehicle rests or hovers, and with the motion of the poses.

    Args:
        record: the flight.
        most: the ratio to these that is refused.

    Raises:
        ValueError: saying what it looks like, and what is accepted.
    """
    if not record.has("specific_force"):
        return
    size = float(np.median(np.linalg.norm(record.streams["specific_force"].values, axis=1)))
    shown = _gravity_shown(record)
    told = f"rest, hover or the motion of the poses show {shown[0][1]:.3g}" if shown else f"gravity is {GRAVITY}"
    shown = shown or [(size, float(np.clip(size, GRAVITY, LIVELY * GRAVITY)))]
    off = min((measured / expected for measured, expected in shown), key=lambda x: abs(np.log(max(x, 1e-9))))
    if not 1 / most < off < most:
        weightless = off < 0.04 or abs(_lift(record)) < 0.3 * off * GRAVITY
        guess = "values without gravity" if weightless else "g" if off < 0.2 else "another unit"
        raise ValueError(
            f"{record.path}: specific_force has a median size of {size:.3g}, where {told} m/s^2: it looks like "
            f"{guess}; accepted: m/s^2, with gravity ({scaled('specific_force', GRAVITY)}), or a flight "
            "--without specific_force"
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
    values = at_times(stream, time)
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
    up = np.asarray(Quat(*attitudes(pose, time).T).rotate(Vec3(*at_times(force, time).T)).z)
    return float(np.mean(up - acceleration[:, 2]))
