"""Logs of many kinds become the same streams: SI units, world ENU, body FLU, the vehicle file's order of rotors."""

import math
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from e2efly.logs.bag_storage import ROS1, SQLITE
from e2efly.logs.bags import export_bag
from e2efly.logs.csv_file import column_map, read_csv, write_csv
from e2efly.logs.flight_log import read_log
from e2efly.logs.mcap_records import MAGIC
from e2efly.logs.readers import read_flights, read_part
from e2efly.logs.recording import KINDS, Record, Stream
from e2efly.logs.telemetry import Telemetry
from tests.logs.log_samples import HALF, crazyflie, fly, ulog

BLACKBOX = Path(__file__).parent.parent / "data" / "blackbox"


def test_a_csv_file_is_read_as_it_was_written_streams_at_their_own_rates(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    streams = {
        "body_rate": Stream(np.arange(40) * 0.005, rng.normal(size=(40, 3))),
        "position": Stream(np.arange(20) * 0.01 + 0.001, rng.normal(size=(20, 3))),
        "command": Stream(np.arange(5) * 0.05, rng.normal(size=(5, 4))),
    }
    write_csv(Record(tmp_path / "a.csv", streams), tmp_path / "a.csv")
    found = read_csv(tmp_path / "a.csv")
    assert set(found.streams) == set(streams)
    for name, stream in streams.items():
        assert np.allclose(found.streams[name].time, stream.time, atol=1e-6)
        assert np.allclose(found.streams[name].values, stream.values, rtol=1e-7)


def test_columns_of_other_names_and_units_are_mapped(tmp_path: Path) -> None:
    path = tmp_path / "b.csv"
    path.write_text("stamp,gx,gy,gz,acc_z,ay,ax,spare\n1.0,180,0,0,1,0,0,x\n1.1,0,90,0,1.5,0,0,\n")
    degree = "0.017453292519943295"
    columns = column_map(["t=stamp", f"wx=gx*{degree}", f"wy=gy*{degree}", "wz=gz", "az=acc_z*9.81"])
    found = read_csv(path, columns)
    assert np.allclose(found.streams["body_rate"].values, [[math.pi, 0, 0], [0, math.pi / 2, 0]])
    assert np.allclose(found.streams["specific_force"].values, [[0, 0, 9.81], [0, 0, 14.715]])


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "has no column 't'"),
        ("t,wx,wy\n0,1,2\n", "has the column wx but not wz; accepted: wx, wy, wz"),
        ("t,a,b\n0,1,2\n", "knows none of the columns t, a, b"),
        ("t,wx,wy,wz\n0,1,2,3\n", "has 1 lines of numbers"),
        ("t,wx,wy,wz\n0,1,2,3\n0,1,2,3\n", "line 3: t does not rise"),
        ("t,wx,wy,wz\n0,1,2,3\n1,1,2\n2,1,2,3\n", "line 3 has 3 entries; accepted: 4"),
        ("t,wx,wy,wz\n0,1,2,3\n1,1,2,fast\n", "line 3: wz is 'fast'"),
        ("t,wx,wy,wz\n0,1,2,3\n1,1,2,inf\n", "line 3: wz is 'inf'; accepted: a finite number"),
        ("t,t,wx,wy,wz\n0,0,1,2,3\n", "has two columns 't'"),
    ],
)
def test_a_wrong_csv_file_is_refused_with_its_line(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "c.csv").write_text(text)
    with pytest.raises(ValueError, match=told):
        read_csv(tmp_path / "c.csv")


def test_a_last_line_that_breaks_off_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "d.csv").write_text("t,wx,wy,wz\n0,1,2,3\n1,1,2,3\n2,1,2")
    found = read_csv(tmp_path / "d.csv")
    assert len(found.streams["body_rate"].time) == 2
    assert found.notes == ("line 4, the last, breaks off and is left out",)


def test_a_long_file_is_read_as_far_as_memory_shall_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Memory grows with the lines that are kept, not with the file."""
    monkeypatch.setattr("e2efly.logs.csv_file.LINES", 1000)
    peaks = []
    for lines in (2_000, 40_000):
        path = tmp_path / f"{lines}.csv"
        path.write_text("t,wx,wy,wz\n" + "".join(f"{0.001 * i:.3f},1,2,3\n" for i in range(lines)))
        tracemalloc.start()
        found = read_csv(path)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert len(found.streams["body_rate"].time) == 1000
        assert found.notes[0].startswith("the first 1000 lines are read")
    assert peaks[1] < 1.2 * peaks[0]


def test_a_part_of_a_log_is_cut_out_by_times_after_its_beginning(tmp_path: Path) -> None:
    crazyflie(tmp_path / "log07", samples=2000)
    (found,) = read_part(tmp_path / "log07:0.5-1.25")
    time = found.streams["body_rate"].time
    assert np.isclose(time[0], 0.501) and np.isclose(time[-1], 1.251)
    assert found.path == tmp_path / "log07" and found.notes == ("used from 0.5 to 1.25 s, as asked",)
    with pytest.raises(ValueError, match=r"log07:3-4: is from 3 to 4 s, of a log of 2\.0 s"):
        read_part(tmp_path / "log07:3-4")


@pytest.mark.parametrize(
    ("entry", "told"),
    [("wx", "accepted: OURS=THEIRS"), ("wu=a", "unknown column 'wu'"), ("wx=a*b", "accepted: OURS=THEIRS or")],
)
def test_a_wrong_map_of_columns_is_refused(entry: str, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        column_map([entry])


@pytest.fixture(scope="module")
def mcap(tmp_path_factory: pytest.TempPathFactory) -> Path:
    start, path = time.monotonic(), tmp_path_factory.mktemp("log") / "flight.mcap"
    with Telemetry(path) as telemetry:
        fly(telemetry, start)
        telemetry.record("battery", start + 0.1, {"voltage": 15.4, "current": 8.0, "cells": 4})
    return path


def test_our_own_log(mcap: Path) -> None:
    (found,) = read_flights(mcap)
    streams = found.streams
    assert np.allclose(streams["body_rate"].values[3], [1, 2, 6])
    assert np.allclose(streams["command"].values[0], [12, 0, -1, 0.5])
    assert np.allclose(streams["motor"].values[0], [0.1, 0.2, 0.3, 0.4])
    assert np.allclose(streams["voltage"].values[:, 0], [15.5, 15.4])
    assert np.allclose(streams["position"].time, streams["body_rate"].time - 0.004, atol=1e-6)


@pytest.mark.parametrize(("name", "version"), [("flight.bag", 1), ("flight", 2)])
def test_a_bag_of_ros(tmp_path: Path, mcap: Path, name: str, version: int) -> None:
    """The twist of an odometry is in the body's frame there, and comes back in the world's."""
    export_bag(read_log(mcap), tmp_path / name, version)
    (found,) = read_flights(tmp_path / name)
    assert np.allclose(found.streams["velocity"].values, [4.0, 0.0, 0.5])
    assert np.allclose(found.streams["quaternion"].values, [HALF, 0, 0, HALF])
    assert np.allclose(found.streams["body_rate"].values[3], [1, 2, 6])
    assert np.allclose(np.diff(found.streams["position"].time), 0.01, atol=1e-6)


def test_a_bag_without_the_topics_is_refused(tmp_path: Path) -> None:
    start = time.monotonic()
    with Telemetry(tmp_path / "rc.mcap") as telemetry:
        for i in range(3):
            telemetry.record("rc", start + 0.01 * i, {"channels": [1500, 1000, 2000, 1750]})
    export_bag(read_log(tmp_path / "rc.mcap"), tmp_path / "rc.bag", 1)
    with pytest.raises(ValueError, match=r"has the topics /rc .*; accepted: one of nav_msgs/msg/Odometry"):
        read_flights(tmp_path / "rc.bag")


def test_sessions_of_a_blackbox() -> None:
    path = sorted(BLACKBOX.glob("*.b[bf]l"))[0]
    found = read_flights(path)
    assert found and all(record.has("body_rate", "motor", "command") for record in found)
    assert all(record.streams["body_rate"].rate > 100 for record in found)


def test_a_crazyflie_s_log(tmp_path: Path) -> None:
    (found,) = read_flights(crazyflie(tmp_path / "log00"))
    assert np.allclose(found.streams["body_rate"].values, [math.pi, 0, math.pi / 2])
    assert np.allclose(found.streams["specific_force"].values, [0, 0.981, 9.81])
    assert np.allclose(found.streams["body_rate"].time, np.arange(1, 6) * 1e-3)
    # its motors: front right, rear right, rear left, front left
    assert np.allclose(found.streams["motor"].values * 65535 / 655, [2, 1, 3, 4])


def test_a_log_that_breaks_off_gives_what_is_whole(tmp_path: Path) -> None:
    path = crazyflie(tmp_path / "log01")
    path.write_bytes(path.read_bytes()[:-7])
    assert len(read_flights(path)[0].streams["body_rate"].time) == 4
    path.write_bytes(path.read_bytes()[:40])
    with pytest.raises(ValueError, match="breaks off in its header"):
        read_flights(path)


def test_a_px4_log(tmp_path: Path) -> None:
    (found,) = read_flights(ulog(tmp_path / "a.ulg"))
    assert np.allclose(found.streams["body_rate"].values, [1, -2, -3])
    # heading east is facing +x of ENU
    attitude = found.streams["quaternion"].values[0]
    assert np.allclose(np.abs(attitude), [1, 0, 0, 0], atol=1e-6)


@pytest.mark.parametrize(
    ("name", "make", "told"),
    [
        ("gone.csv", None, "does not exist; accepted: our .mcap"),
        ("empty.csv", lambda p: p.write_bytes(b""), "is empty"),
        ("a.mcap", lambda p: p.write_bytes(b"abc"), "of no kind that is known here"),
        ("photo.csv", lambda p: p.write_bytes(b"\xff\xd8\xff\0,"), "of no kind that is known here"),
        ("a.txt", lambda p: p.write_bytes(b"ULog\x01\x12\x35"), "has nothing that is used here"),
        ("a", lambda p: p.write_bytes(b"H Product:Blackbox\n"), "no blackbox log that can be read"),
        (
            "a.b",
            lambda p: p.write_bytes(MAGIC),
            "has the topics none; a.b: the end of the file is missing",
        ),
        ("a.db3", lambda p: p.write_bytes(SQLITE + bytes(84)), "has the topics none; a.db3: the file is damaged"),
        ("a.bag", lambda p: p.write_bytes(ROS1 + bytes(9)), "has the topics none"),
        ("a.x", lambda p: p.mkdir(), "is a folder without files of a bag"),
    ],
)
def test_what_is_no_log_is_refused_by_name(tmp_path: Path, name: str, make: Callable | None, told: str) -> None:
    if make:
        make(tmp_path / name)
    with pytest.raises(ValueError, match=told):
        read_flights(tmp_path / name)


def test_the_documentation_has_all_columns() -> None:
    page = Path(__file__).parents[2] / "docs" / "identification.md"
    rows = ["| stream | columns of a CSV file | unit | what |", "| --- | --- | --- | --- |", "| | `t` | s | time |"]
    for name, kind in KINDS.items():
        columns = " ".join(f"`{column}`" for column in kind.columns)
        rows.append(f"| {name} | {columns} | {kind.unit} | {kind.what} |")
    assert "\n".join(rows) in page.read_text(encoding="utf-8")
