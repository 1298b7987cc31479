"""What a stranger's log may cost: memory and time are bounded by the size of the file, whatever it says."""

import bz2
import contextlib
import re
import sqlite3
import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import lz4.frame
import pytest
import zstandard

from e2efly.logs.bag_storage import ROS1
from e2efly.logs.blackbox import SESSIONS, read_blackbox
from e2efly.logs.expand import BASE, RATIO, Expander
from e2efly.logs.flight_log import read_log
from e2efly.logs.mcap_records import MAGIC
from e2efly.logs.readers import read_flights
from tests.logs.log_samples import BLACKBOX, bag, only, table, telemetry, ulog

ZEROS = bytes(BASE + (4 << 20))
SQUEEZED: dict[str, Callable[[bytes], bytes]] = {
    "zstd": zstandard.compress,
    "lz4": lz4.frame.compress,
    "bz2": bz2.compress,
}


@pytest.fixture(autouse=True)
def _in_time() -> Iterator[None]:
    start = time.perf_counter()
    yield
    assert time.perf_counter() - start < 5


@pytest.mark.parametrize("kind", SQUEEZED)
def test_no_more_is_expanded_than_a_file_of_this_size_may_hold(kind: str) -> None:
    small = SQUEEZED[kind](b"abc" * 1000)
    assert Expander(len(small))(kind, small) == b"abc" * 1000
    bomb = SQUEEZED[kind](ZEROS)
    with pytest.raises(ValueError, match=rf"expands to more than \d+ bytes; accepted: .* {RATIO} times its size"):
        Expander(100)(kind, bomb)
    expand = Expander(100)
    for _ in range(5):
        expand(kind, SQUEEZED[kind](bytes(3 << 20)))
    with pytest.raises(ValueError, match="expands to more than"):  # together, as well
        expand(kind, SQUEEZED[kind](bytes(3 << 20)))
    with pytest.raises(ValueError, match=f"{kind} cannot decompress"):
        Expander(100)(kind, b"no such data at all")


def chunk(data: bytes, size: int) -> bytes:
    content = struct.pack("<QQQI", 0, 0, size, 0) + struct.pack("<I", 4) + b"zstd" + struct.pack("<Q", len(data)) + data
    return struct.pack("<BQ", 6, len(content)) + content


@pytest.mark.parametrize("count", [1, 30])
def test_chunks_of_zeros_end_a_log(tmp_path: Path, count: int) -> None:
    """The first is a flight log, whose first messages are read; the other is a bag."""
    path, bombs = telemetry(tmp_path / "a.mcap"), chunk(zstandard.compress(ZEROS), len(ZEROS)) * count
    data = path.read_bytes()
    cut = data.index(struct.pack("<BQ", 15, 4))  # the end of the data
    path.write_bytes(data[:cut] + bombs + data[cut:])
    log = read_log(path)
    assert len(log["imu"]) == 25 and "damaged from here on" in log.cut_off
    (tmp_path / "b.mcap").write_bytes(MAGIC + bombs)
    with pytest.raises(ValueError, match="has the topics none"):
        read_flights(tmp_path / "b.mcap")


@pytest.mark.parametrize("kind", ["lz4", "bz2"])
def test_chunks_of_zeros_end_a_bag_of_ros_1(tmp_path: Path, kind: str) -> None:
    def record(content: bytes, **fields: bytes) -> bytes:
        head = b"".join(
            struct.pack("<I", len(name) + 1 + len(value)) + name.encode() + b"=" + value
            for name, value in fields.items()
        )
        return struct.pack("<I", len(head)) + head + struct.pack("<I", len(content)) + content

    bombs = record(SQUEEZED[kind](ZEROS), op=b"\5", compression=kind.encode()) * 5
    whole = bag(tmp_path / "a.bag").read_bytes()
    (tmp_path / "b.bag").write_bytes(ROS1 + bombs)
    with pytest.raises(ValueError, match="has the topics none"):
        read_flights(tmp_path / "b.bag")
    (tmp_path / "c.bag").write_bytes(whole + bombs)
    (found,) = read_flights(tmp_path / "c.bag")
    assert found.has("body_rate") and any("damaged from here on" in note for note in found.notes)


def test_a_database_that_computes_without_end_is_refused(tmp_path: Path) -> None:
    file = only(bag(tmp_path / "b"), ".db3")
    endless = "WITH RECURSIVE x(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM x)"
    with contextlib.closing(sqlite3.connect(file, isolation_level=None)) as base:
        base.execute("DROP TABLE messages")
        base.execute(f"CREATE VIEW messages AS {endless} SELECT n AS topic_id, 'a' AS data FROM x")
    with pytest.raises(ValueError, match="has no table messages: no file that ros2 bag record wrote"):
        read_flights(file)


HEADER = b"".join(line + b"\n" for line in BLACKBOX.read_bytes().split(b"\n") if line.startswith(b"H "))


def test_empty_sessions_of_a_blackbox_are_counted_out(tmp_path: Path) -> None:
    path = tmp_path / "a.bbl"
    path.write_bytes(HEADER * 3000)
    with pytest.raises(ValueError, match=rf"a.bbl: .*only the first {SESSIONS} of 3000 sessions are read") as told:
        read_blackbox(path)
    assert len(str(told.value)) < 1000
    path.write_bytes(BLACKBOX.read_bytes() + HEADER * 2)
    (found,) = read_flights(path)
    assert "left out: session 2: ValueError: no frames" in found.notes


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (rb"P interval:[^\n]*", b"P interval:0/1", "P interval is 0/1; accepted: a share of up to 1"),
        (rb"P interval:[^\n]*", b"P interval:1/99999999", "P interval is 1/99999999"),
        (rb"(Field S \w+):[^\n]*", b"\\1:" + b"1," * 300 + b"1", "frames of 301 fields; accepted: up to 256"),
    ],
)
def test_a_header_that_would_never_end_is_refused(tmp_path: Path, old: bytes, new: bytes, told: str) -> None:
    (tmp_path / "a.bbl").write_bytes(re.sub(old, new, BLACKBOX.read_bytes()))
    with pytest.raises(ValueError, match=told):
        read_blackbox(tmp_path / "a.bbl")


def test_a_session_of_damage_ends(tmp_path: Path) -> None:
    whole = BLACKBOX.read_bytes()
    (tmp_path / "a.bbl").write_bytes(whole[:20_000] + b"I" * 60 + bytes(range(256)) * 4000)
    (found,) = read_blackbox(tmp_path / "a.bbl")
    assert len(found.time) > 500


@pytest.mark.parametrize(
    "formats",
    [
        {"vehicle_attitude": "uint64_t timestamp;float[1000000000] q;"},
        {"vehicle_attitude": "a[9] x;"} | {a: f"{b}[99] x;{b} y;" for a, b in zip("abcdefgh", "bcdefghi", strict=True)},
        {"vehicle_attitude": "vehicle_attitude x;"},
    ],
)
def test_formats_of_px4_that_grow_without_end_are_refused(tmp_path: Path, formats: dict[str, str]) -> None:
    with pytest.raises(ValueError, match=r"a\.ulg: .*format"):
        read_flights(
            ulog(tmp_path / "a.ulg", {"vehicle_angular_velocity": "uint64_t timestamp;float[3] xyz;", **formats})
        )


def test_a_wrong_time_stamp_makes_no_endless_flight(tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv")
    path.write_text(path.read_text(encoding="utf-8-sig") + "1e14,1,1,1,0,0,9,0,0,1,1,0,0,0,x\n", encoding="utf-8-sig")
    with pytest.raises(
        ValueError, match=r"a\.csv: lasts 1e\+11 s from its first time to its last; accepted: up to 10800"
    ):
        read_flights(path)


def test_a_line_without_end_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,wx,wy,wz\n0,1,2,3\n" + "1" * 200_000)
    with pytest.raises(ValueError, match=r"a\.csv: line 3 is longer than 100000 characters"):
        read_flights(tmp_path / "a.csv")
