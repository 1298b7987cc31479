"""A log with wrong frames, units or clocks is refused with its remedy, or corrected, and both are said."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from e2efly.alignment.checks import checked
from e2efly.logs.csv_file import column_map, write_csv
from e2efly.logs.readers import LogReading, read_flights
from e2efly.logs.recording import Record, Stream
from e2efly.validation.plant_excitation import Sensors
from tests.alignment.corruptions import CORRUPTIONS, Corruption
from tests.alignment.flights import FILE, flown


@pytest.fixture(scope="module")
def record() -> Record:
    """With rotor speeds, and with the motor outputs that lead to them."""
    found = flown(FILE, 8.0, Sensors(pose_delay=0.0, gaps=0))
    speed = found.streams["rotor_speed"]
    outputs = np.clip(speed.values / FILE.full_rotor_speed, 0, 1) ** 2
    return replace(found, streams={**found.streams, "motor": Stream(speed.time, outputs)})


def test_right_frames_stay(record: Record) -> None:
    (found,) = checked([record], FILE)
    assert not [note for note in found.notes if "moved" not in note]


def test_a_biased_accelerometer_is_no_wrong_frame() -> None:
    slow = flown(FILE, 12.0, Sensors(pose_delay=0.0, gaps=0), speed=2.0)
    force = slow.streams["specific_force"]
    biased = replace(force, values=force.values + np.array([0.45, 0.45, 0.0]))
    (found,) = checked([replace(slow, streams={**slow.streams, "specific_force": biased})], FILE)
    assert not [note for note in found.notes if "moved" not in note]


def remedied(error: str) -> LogReading:
    """A reading of the log as an error says that it is accepted."""
    columns, without = re.search(r"--columns ((?:\w+=\w+\S* ?)+)", error), re.search(r"--without ([a-z_ ]+)$", error)
    if columns and "THEIRS" not in columns[1]:
        return LogReading(column_map(entry.strip(",)") for entry in columns[1].split()))
    assert without
    return LogReading(without=tuple(without[1].split()))


@pytest.mark.parametrize("corruption", CORRUPTIONS, ids=lambda c: c.name)
def test_what_is_wrong_is_named_or_corrected(tmp_path: Path, record: Record, corruption: Corruption) -> None:
    """What the error says to do is done, through a file, and is enough."""
    assert record.has(*corruption.streams)
    wrong = corruption.of(record, FILE)
    try:
        (found,) = checked([wrong], FILE)
    except ValueError as error:
        assert str(error).startswith(f"{record.path}: ")
        assert re.search(corruption.told, str(error)), error
        write_csv(wrong, tmp_path / "log.csv")
        checked(read_flights(tmp_path / "log.csv", remedied(str(error))), FILE)
        return
    (right,) = checked([record], FILE)
    assert re.search(corruption.told, "; ".join(found.notes)), found.notes
    for name in corruption.streams:
        if name == "command":  # so near to m/s^2 that the user is only asked
            continue
        time = right.streams[name].time
        inside = (time > found.streams[name].time[0]) & (time < found.streams[name].time[-1])
        seen = np.stack(
            [np.interp(time[inside], found.streams[name].time, x) for x in found.streams[name].values.T], -1
        )
        true = right.streams[name].values[inside]
        off = np.minimum(np.abs(seen - true), np.abs(seen + true) if name == "quaternion" else np.inf)
        assert np.quantile(off, 0.8) < 0.1 * max(true.std(), 0.1), name


def test_a_log_that_hardly_moves_says_what_was_not_checked(record: Record) -> None:
    still = {
        "body_rate": np.array([0, 0, 0.0]), "specific_force": np.array([0, 0, 9.81]), "velocity": np.zeros(3),
        "quaternion": np.array([1.0, 0, 0, 0]),
    }  # fmt: skip
    rng, time = np.random.default_rng(0), np.arange(0, 6, 0.01)
    streams = {k: Stream(time, x + rng.normal(0, 1e-4, (len(time), len(x)))) for k, x in still.items()}
    (found,) = checked([Record(Path("still.csv"), streams)], FILE)
    for told in ("body_rate cannot be checked against", "specific_force cannot be checked against"):
        assert any(note.startswith(told) for note in found.notes), found.notes


def test_streams_of_two_flights_are_refused(record: Record) -> None:
    other = flown(FILE, 8.0, Sensors(pose_delay=0.0), seed=5, speed=2.0).streams["quaternion"]
    mixed = replace(record, streams={**record.streams, "quaternion": Stream(other.time, other.values[::-1])})
    with pytest.raises(ValueError, match=r"whatever the order of the axes .* --without (body_rate|quaternion)"):
        checked([mixed], FILE)


def test_poses_without_a_time_in_common_with_the_gyroscope_are_refused(record: Record) -> None:
    streams = dict(record.streams)
    streams["quaternion"] = Stream(streams["quaternion"].time + 1e3, streams["quaternion"].values)
    with pytest.raises(ValueError, match="accepted: times by one clock"):
        checked([replace(record, streams=streams)], FILE)
