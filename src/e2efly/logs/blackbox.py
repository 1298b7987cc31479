"""Betaflight's blackbox logs: reading, and alignment with the clock of a flight log.

They are decoded by the package `betaflight-chirp-core`. The firmware (4.6; found by feeding it known body rates) logs
gyro and setpoint in deg/s (in tenths with `blackbox_high_resolution`), with the signs of FLU: roll to the right, nose
down and yaw to the left are positive. Its estimator of attitudes takes the accelerometer in the same axes, where it
shows the reaction to gravity: at rest, z is the header's `acc_1G`. Motors are in the range of the header `motorOutput`.
`eRPM` is in hundreds of electrical revolutions per minute. The battery is in hundredths of a volt from Betaflight 4.0
on, in tenths from 3.1 on, and in counts of the converter before. Time is in us since the controller started.
"""

import math
from array import array
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.vehicles.gravity import GRAVITY

WINDOW = 1.0
"""Length of the pieces that are aligned, s."""
AGREEMENT = 0.8
"""Correlation of the gyros in a piece above which they count as the same motion."""
_RATE = 200.0  # Hz: grid of the tried shifts; parabolas refine them
_SEEDS = 8  # windows that are searched for in the whole flight
_REACH = (0.1, 1.0)  # s: change of the shift between pieces; the second if the first finds nothing
_AXES = range(3)
START = b"H Product:Blackbox"
"""First bytes of a session."""
SESSIONS, FRAMES, FIELDS = 200, 2_000_000, 256
"""Largest numbers of sessions in a file, of frames in a session (16 minutes at 2 kHz), and of fields in a frame. A log
of Betaflight has some 40 fields."""
_WORK, _FIELDS_A_BYTE = 500_000, 16  # fields decoded per byte; a whole log has one per byte, a damaged one many
_WANTED = (
    "time", *(f"gyroADC[{i}]" for i in range(3)), *(f"setpoint[{i}]" for i in range(3)),
    *(f"motor[{i}]" for i in range(4)), *(f"accSmooth[{i}]" for i in range(3)), *(f"eRPM[{i}]" for i in range(4)),
    "vbatLatest",
)  # fmt: skip
TERMS = {"P": "axisP", "I": "axisI", "D": "axisD", "F": "axisF"}
"""Terms of the rate loop by name, with the fields that log them."""
_TUNING = ("gyroUnfilt", "debug", *TERMS.values())  # read on request alone, because of their size
_SCALED = 6  # the debug mode GYRO_SCALED: the gyro before its filters, deg/s
_WHOLE = 1000.0  # a term that alone asks for the full range of the mixer
_TOLD = 3  # reasons that an error or a note tells
_STEP = 1000  # largest denominator of the share of loops that are logged
_ERPM = 100 * 2 * math.pi / 60  # rad/s of the field, in a count of `eRPM`
_COUNT = 3.3 / 4095 / 10  # V at the converter, in a count, over the tenths of `vbatscale`
_GUESSED = ("gyroScale", "acc_1G", "motor_poles")  # headers for which the decoder has values of its own


@dataclass(frozen=True)
class Blackbox:
    """One session of a blackbox log: from arming to disarming."""

    time: np.ndarray
    """(n,) s since its first frame."""
    gyro: np.ndarray
    """(n, 3) filtered body rate, FLU, rad/s."""
    setpoint: np.ndarray
    """(n, 3) body rate setpoint of the rate loop, FLU, rad/s. NaN if it was not logged."""
    motor: np.ndarray
    """(n, 4) motor outputs above idle, 0 to 1, in Betaflight's order. NaN if they were not logged."""
    firmware: str
    """The firmware, from the header."""
    session: int
    """Number of the session in the file, from 1."""
    unfiltered: np.ndarray | None = None
    """(n, 3) body rate before the gyro's filters, FLU, rad/s. None if it was not logged, or not requested."""
    terms: Mapping[str, np.ndarray] = field(default_factory=dict)
    """By the names of `TERMS`, (n, 3) what each term of the rate loop asks for about each axis, as a share of the
    mixer's full range. Empty if they were not logged, or not requested."""
    reach: tuple[float, float] = (0.0, 1.0)
    """The ESC commands at which `motor` is 0 and 1. Here 0 is 1000 us or DShot's 48, and 1 is 2000 us or DShot's
    2047."""
    force: np.ndarray | None = None
    """(n, 3) specific force, FLU, m/s^2, as the flight controller filters it. None if it was not logged."""
    rotor_speed: np.ndarray | None = None
    """(n, 4) speeds of the rotors, rad/s, in Betaflight's order. None if they were not logged."""
    voltage: np.ndarray | None = None
    """(n, 1) of the battery, V. None if it was not logged."""
    motors: int = 4
    """How many motor outputs were logged."""
    unused: tuple[str, ...] = ()
    """Fields of the log that are not read."""
    notes: tuple[str, ...] = ()
    """What was not read, in words."""

    @property
    def output(self) -> np.ndarray:
        """(n, 4) ESC commands, 0 to 1, in the scale that MSP also uses."""
        idle, full = self.reach
        return idle + (full - idle) * self.motor


@dataclass(frozen=True)
class LogClock:
    """How a blackbox log is aligned with a flight log."""

    time: np.ndarray
    """(n,) time in the flight log of each frame of the blackbox, s."""
    correlation: float
    """Correlation of the two gyros where they overlap, -1 to 1."""
    overlap: float
    """Length of the overlap, s."""
    drift: float
    """How much faster the blackbox's clock runs over the overlap, as a ratio minus 1."""


def read_blackbox(path: str | Path, tuning: bool = False, numbers: Sequence[int] = ()) -> list[Blackbox]:
    """The sessions of a blackbox log that have frames: at most `SESSIONS`, with at most `FRAMES` frames each. With
    `tuning`, also the unfiltered gyro and the terms of the rate loop. With `numbers`, the sessions with these numbers,
    from 1, alone.

    Raises:
        ValueError: if there is no such file, no session with gyro data in it, no session of these numbers, or no
            decoder.
    """
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"blackbox log {str(path)!r} does not exist")
    try:
        from betaflight_chirp_core import decoder
    except ImportError as error:
        missing = f"the package betaflight-chirp-core is missing ({error})"
        raise ValueError(f"blackbox log: {missing}; accepted: pip install 'e2efly[blackbox]'") from None
    data = path.read_bytes()
    places = dict(enumerate(decoder.split_sessions(data), 1))
    if missing := [number for number in numbers if number not in places]:
        raise ValueError(f"{path}: has no session {missing[0]}; accepted: a session from 1 to {len(places)}")
    asked = [number for number in places if number in numbers or not numbers]
    sessions: list[Blackbox] = []
    reasons: list[str] = []
    for number in asked[:SESSIONS]:
        start, end = places[number]
        try:
            sessions.append(_session(decoder.FlightLogParser(data, start, end), number, tuning))
        except Exception as error:  # the decoder trusts its input: one bad session must not affect the others
            reasons.append(f"session {number}: {type(error).__name__}: {error}")
    told = reasons[:_TOLD] + ([f"{len(reasons) - _TOLD} more without frames"] if len(reasons) > _TOLD else [])
    if len(asked) > SESSIONS:
        told.append(f"only the first {SESSIONS} of {len(asked)} sessions are read")
    if len(asked) < len(places):
        told.append(f"{len(places) - len(asked)} of {len(places)} sessions, as asked")
    if not sessions:
        why = "; ".join(told) or "no session in it"
        raise ValueError(f"{path}: no blackbox log that can be read ({why}); accepted: a Betaflight .bbl or .bfl file")
    sessions[0] = replace(sessions[0], notes=(*sessions[0].notes, *(f"left out: {reason}" for reason in told)))
    return sessions


class _Frames:
    """The wanted fields of the frames of a session."""

    def __init__(self, names: Sequence[str], tuning: bool) -> None:
        more = [f"{name}[{i}]" for name in _TUNING for i in _AXES] if tuning else []
        self.fields = [name for name in (*_WANTED, *more) if name in names]
        self._places, self._numbers = [names.index(name) for name in self.fields], array("d")

    def __len__(self) -> int:
        return len(self._numbers) // len(self.fields)

    def append(self, frame: Sequence[float]) -> None:
        if len(self) == FRAMES:
            raise _EnoughError(f"the first {FRAMES} frames are read, and no more")
        self._numbers.extend([frame[place] for place in self._places])

    def table(self) -> np.ndarray:
        return np.array(self._numbers).reshape(-1, len(self.fields))


class _EnoughError(Exception):
    """A session has more frames than are read, or is too badly damaged to be searched further."""


def _bounded(stream: Any, fields: int, markers: frozenset[str]) -> Any:
    """A stream of the decoder that ends the work when much more is decoded than whole frames need."""
    read, begin, work = stream.read_char, stream.pos, 0

    def read_char() -> Any:
        nonlocal work
        char = read()
        if char in markers:
            work += fields
            if work > _WORK + _FIELDS_A_BYTE * (stream.pos - begin):
                raise _EnoughError("is too badly damaged to be read further")
        return char

    stream.read_char = read_char
    return stream


def _session(parser: Any, number: int, tuning: bool) -> Blackbox:
    for guess in _GUESSED:
        parser.sys_config.pop(guess, None)
    parser.parse_header()
    names, header = parser.main_field_names, parser.sys_config
    most = max(frame["count"] for frame in parser.frame_defs.values())
    step = header["frameIntervalPNum"], header["frameIntervalPDenom"]
    if most > FIELDS:
        raise ValueError(f"frames of {most} fields; accepted: up to {FIELDS}")
    if not 1 <= step[0] <= step[1] <= _STEP:
        raise ValueError(f"P interval is {step[0]}/{step[1]}; accepted: a share of up to 1, as 1/2")
    if missing := [name for name in ("time", *(f"gyroADC[{i}]" for i in _AXES)) if name not in names]:
        raise ValueError(f"field {missing[0]} was not logged")
    parser.main_frames = kept = _Frames(names, tuning)
    parser.gps_frames, parser.slow_frames, parser.events = deque(maxlen=0), deque(maxlen=0), deque(maxlen=0)
    parser.stream = _bounded(parser.stream, most, frozenset(parser.frame_defs))
    notes: list[str] = []
    try:
        parser.parse_data()
    except _EnoughError as enough:
        notes.append(str(enough))
    if not len(kept):
        raise ValueError(*(notes or ["no frames"]))
    frames = kept.table()
    latest = np.maximum.accumulate(frames[:, 0])
    rising = np.concatenate([[True], frames[1:, 0] > latest[:-1]])
    if not rising.all():
        notes.append(f"{int((~rising).sum())} frames out of {len(frames)} whose time does not rise are left out")
    frames = frames[rising]

    def columns(name: str, count: int) -> np.ndarray:
        keys = [f"{name}[{i}]" for i in range(count)] if count > 1 else [name]
        known = all(key in kept.fields for key in keys)
        return frames[:, [kept.fields.index(key) for key in keys]] if known else np.full((len(frames), count), np.nan)

    def logged(name: str) -> np.ndarray | None:
        found = columns(name, 3)
        return None if np.isnan(found).any() else found

    raw, terms = logged("gyroUnfilt"), {name: logged(key) for name, key in TERMS.items()}
    if raw is None and int(header.get("debug_mode", 0)) == _SCALED:
        raw = logged("debug")
    fine = 0.1 if int(header.get("blackbox_high_resolution", 0)) else 1.0
    low, high = map(float, header["motorOutput"])
    time = frames[:, 0]
    least, most = (48.0, 2047.0) if low < 1000 else (1000.0, 2000.0)
    gyro = fine * float(header.get("gyroScale", math.radians(1e-6))) * 1e6  # rad/s, in a count

    def measured(name: str, count: int, unit: float, why: str) -> np.ndarray | None:
        found = columns(name, count)
        if np.isnan(found).any():
            return None
        if not unit:
            notes.append(f"{name} is left out: {why}")
            return None
        return found * unit

    unsaid = "the header does not say {}"
    one, poles = (float(header.get(name, 0)) for name in ("acc_1G", "motor_poles"))
    others = {name for kind, frame in parser.frame_defs.items() if kind != "P" for name in frame["name"]}
    return Blackbox(
        time=(time - time[0]) * 1e-6,
        gyro=columns("gyroADC", 3) * gyro,
        setpoint=np.radians(columns("setpoint", 3) * fine),
        motor=(columns("motor", 4) - low) / max(high - low, 1.0),
        firmware=str(header.get("Firmware revision") or "unknown"),
        session=number,
        unfiltered=None if raw is None else np.radians(raw * fine),
        terms={name: values / _WHOLE for name, values in terms.items() if values is not None},
        reach=((low - least) / (most - least), (high - least) / (most - least)),
        force=measured("accSmooth", 3, GRAVITY / one if one > 0 else 0.0, unsaid.format("acc_1G")),
        rotor_speed=measured("eRPM", 4, 2 * _ERPM / poles if poles > 0 else 0.0, unsaid.format("motor_poles")),
        voltage=measured("vbatLatest", 1, _volts(header), "its unit in this firmware is not known"),
        motors=sum(name.startswith("motor[") for name in names),
        unused=_grouped(others - {"time", *kept.fields}, kept.fields),
        notes=tuple(notes),
    )


def _grouped(names: Iterable[str], used: Iterable[str]) -> tuple[str, ...]:
    """Names of fields, sorted. Fields such as `axisP[0]` and `axisP[1]` go by `axisP`, unless some of them are used."""
    apart = {name.partition("[")[0] for name in used}
    groups = ((name, name.partition("[")[0]) for name in names)
    return tuple(sorted({name if group in apart else group for name, group in groups}))


def _volts(header: Mapping[str, Any]) -> float:
    """One count of `vbatLatest`, V. 0: not known."""
    kind, version = header.get("firmwareType"), tuple(map(int, str(header.get("firmwareVersion", 0)).split(".")))
    if kind == "betaflight" and version >= (4,):
        return 0.01
    if (kind == "betaflight" and version >= (3, 1)) or (kind == "cleanflight" and version >= (2,)):
        return 0.1
    return _COUNT * float(header.get("vbatscale", 0)) if kind in ("betaflight", "cleanflight", "baseflight") else 0.0


def align(time: np.ndarray, gyro: np.ndarray, blackbox: Blackbox) -> LogClock:
    """Align a blackbox log with a flight log's clock by the measurements of both gyros.

    The windows with the most motion are searched for in the whole flight. From the best match, the neighbouring windows
    are followed outwards with small shifts only. The clocks may therefore run at different and changing rates. SITL's
    clock does, by some percent. The flight log has the gyro, (n, 3) rad/s, at the increasing times (n,), s.

    Raises:
        ValueError: if either has less than `WINDOW` of gyro data, or if they agree nowhere.
    """
    good = np.isfinite(gyro).all(axis=1)
    time, gyro = time[good], gyro[good]
    if len(time) < 2 or min(time[-1] - time[0], blackbox.time[-1]) < WINDOW:
        raise ValueError(f"blackbox: less than {WINDOW:g} s of gyro in the flight log or in the blackbox log")
    flight, box = _resampled(time, gyro), _resampled(blackbox.time, blackbox.gyro)
    width, hop = round(WINDOW * _RATE), round(WINDOW * _RATE / 2)
    windows = [box[i : i + width] for i in range(0, len(box) - width + 1, hop)]
    lively = np.argsort([-np.sum(np.var(w, axis=0)) for w in windows])[:_SEEDS]
    seeds = {int(k): _best(flight, windows[k], 0, len(flight) - width) for k in lively}
    seed = max(seeds, key=lambda k: seeds[k][1])
    if seeds[seed][1] < AGREEMENT:
        best = f"best correlation {seeds[seed][1]:.2f}, needed {AGREEMENT:g}"
        raise ValueError(f"blackbox: session {blackbox.session} is not of this flight ({best})")
    shifts = {seed: seeds[seed][0] - seed * hop}
    for step in (1, -1):
        shift, k = shifts[seed], seed + step
        while 0 <= k < len(windows):
            start = round(k * hop + shift)
            for reach in _REACH:
                at, agreement = _best(flight, windows[k], start - round(reach * _RATE), start + round(reach * _RATE))
                if agreement >= AGREEMENT:
                    shift = shifts[k] = at - k * hop
                    break
            k += step
    known = np.array(sorted(shifts))
    middle = (known * hop + width / 2) / _RATE
    offset = np.array([shifts[k] for k in known]) / _RATE + time[0]
    return _alignment(time, gyro, blackbox, blackbox.time + np.interp(blackbox.time, middle, offset))


def _alignment(time: np.ndarray, gyro: np.ndarray, blackbox: Blackbox, moved: np.ndarray) -> LogClock:
    inside = (time >= moved[0]) & (time <= moved[-1])
    other = np.stack([np.interp(time[inside], moved, blackbox.gyro[:, i]) for i in _AXES], axis=1)
    size = math.sqrt(float(np.sum(gyro[inside] ** 2)) * float(np.sum(other**2)))
    return LogClock(
        time=moved,
        correlation=float(np.sum(gyro[inside] * other)) / size if size else 0.0,
        overlap=float(np.ptp(time[inside])) if inside.any() else 0.0,
        drift=float(np.ptp(blackbox.time) / (moved[-1] - moved[0]) - 1),
    )


def _best(flight: np.ndarray, window: np.ndarray, low: int, high: int) -> tuple[float, float]:
    """The position in `flight`, from sample `low` to `high`, where a window agrees best, in fractions of a sample, and
    the correlation.
    """
    low, high = max(low, 0), min(high, len(flight) - len(window))
    if high < low:
        return 0.0, -1.0
    from scipy.signal import correlate

    part = flight[low : high + len(window)]
    match = np.sum([correlate(part[:, i], window[:, i], mode="valid", method="fft") for i in _AXES], axis=0)
    energy = np.cumsum(np.concatenate([[0.0], np.sum(part**2, axis=1)]))
    size = np.sqrt(np.maximum(energy[len(window) :] - energy[: -len(window)], 1e-6) * max(np.sum(window**2), 1e-6))
    agreement = match / size
    i = int(np.argmax(agreement))
    return low + i + vertex(agreement, i), float(agreement[i])


def _resampled(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    grid = np.arange(time[0], time[-1], 1 / _RATE)
    return np.stack([np.interp(grid, time, values[:, i]) for i in _AXES], axis=1)


def vertex(y: np.ndarray, i: int) -> float:
    """Offset of the vertex of the parabola through three samples from the middle sample, in samples."""
    if not 0 < i < len(y) - 1:
        return 0.0
    left, middle, right = y[i - 1 : i + 2]
    bend = left - 2 * middle + right
    return float(0.5 * (left - right) / bend) if bend < 0 else 0.0
