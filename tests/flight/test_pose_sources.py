"""Poses over real sockets, as JSON, and from a plant in the same process."""

import json
import re
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from e2efly.flight.lines import LONGEST, Lines
from e2efly.flight.pose.json_source import parse_pose
from e2efly.flight.pose.pose_source import LARGEST_BATCH, PlantSource, PoseSource
from e2efly.flight.pose.relay import RelaySource
from e2efly.flight.pose.sources import open_source
from e2efly.flight.pose.sources.tcp import TcpSource
from e2efly.flight.pose.sources.udp import DRAIN, UdpSource
from e2efly.policy.odometry import Sample
from tests.waiting import until

POSE = {"position": [1, 2.5, -3], "quaternion": [0.5, 0.5, -0.5, 0.5]}
FULL = {**POSE, "velocity": [0, 1, 2], "body_rate": [3, 4, 5], "stamp": 12.25, "frame": "map"}


def encode(**changes: object) -> bytes:
    return json.dumps({**POSE, **changes}).encode()


def gather(source: PoseSource, count: int) -> list[Sample]:
    """Read until `count` samples have come."""
    samples: list[Sample] = []
    until(lambda: samples.extend(source.read(time.monotonic())) or len(samples) >= count, said=lambda: source.problem)
    return samples


# Messages


def test_a_full_message() -> None:
    sample = parse_pose(json.dumps(FULL).encode(), 7.0)
    assert (sample.received, sample.stamp, sample.frame) == (7.0, 12.25, "map")
    for name, value in FULL.items():
        if isinstance(value, list):
            np.testing.assert_array_equal(getattr(sample, name), value)
            assert getattr(sample, name).dtype == np.float64


def test_a_short_message_says_nothing_of_the_rest() -> None:
    sample = parse_pose(encode(), 7.0)
    assert (sample.stamp, sample.velocity, sample.body_rate, sample.frame) == (None, None, None, "")


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (b"", "pose: not JSON"),
        (b"\xff", "pose: not JSON"),
        (b"[" * 4000, "pose: not JSON"),
        (b"[1, 2]", "pose: [1, 2]; accepted: an object with position, quaternion, velocity"),
        (b"{}", "pose: missing key 'position', 'quaternion'"),
        (encode(postion=[1, 2, 3]), "pose: unknown key 'postion'; did you mean 'position'?"),
        (encode(position=[1, 2]), "pose: position is [1, 2]; accepted: a list of 3 finite numbers"),
        (encode(position=[1, 2, True]), "pose: position is True; accepted: a list of 3 finite numbers"),
        (encode(position="here"), "pose: position is 'here'"),
        (encode(quaternion=[1, 0, 0]), "pose: quaternion is [1, 0, 0]; accepted: a list of 4 finite numbers"),
        (encode(velocity=None), "pose: velocity is None; accepted: a list of 3 finite numbers"),
        (encode(position=[float("nan"), 0, 0]), "NaN is no number; accepted: finite numbers"),
        (encode(position=[float("inf"), 0, 0]), "Infinity is no number"),
        (b'{"position": [1e999, 0, 0], "quaternion": [1, 0, 0, 0]}', "pose: position is inf"),
        (encode(position=[10**400, 0, 0]), "pose: position is 1000"),
        (encode(stamp="now"), "pose: stamp is 'now'; accepted: a finite number of seconds"),
        (encode(frame=3), "pose: frame is 3; accepted: a text"),
        (
            b'{"position": [0, 0, 0], "position": [1, 1, 1], "quaternion": [1, 0, 0, 0]}',
            "key 'position' is there twice",
        ),
        (encode(frame="x" * LONGEST), f"accepted: at most {LONGEST}"),
    ],
)
def test_a_malformed_message_is_refused_by_name(message: bytes, text: str) -> None:
    with pytest.raises(ValueError, match=re.escape(text)):
        parse_pose(message, 0.0)


@given(
    st.binary(max_size=200) | st.builds(lambda i, b: encode()[:i] + b + encode()[i:], st.integers(0, 60), st.binary())
)
@settings(max_examples=300, deadline=None)
def test_no_bytes_raise_anything_but_a_value_error(message: bytes) -> None:
    try:
        sample = parse_pose(message, 0.0)
    except ValueError as error:
        assert str(error).startswith("pose: ")
    else:
        assert sample.position.shape == (3,)


@given(st.lists(st.binary(max_size=20), max_size=20), st.lists(st.integers(1, 40), max_size=20))
@settings(max_examples=100, deadline=None)
def test_lines_are_the_same_however_the_stream_is_cut(lines: list[bytes], cuts: list[int]) -> None:
    lines = [line.replace(b"\n", b"") for line in lines]
    stream, out, cutter = b"".join(line + b"\n" for line in lines), [], Lines()
    for cut in [*cuts, len(stream) + 1]:
        got, overlong, dropped = cutter.feed(stream[:cut])
        assert (overlong, dropped) == (0, 0)
        out, stream = out + got, stream[cut:]
    assert out == [line for line in lines if line.strip()]


def test_an_overlong_line_is_dropped_once_and_the_next_is_whole() -> None:
    cutter, dropped = Lines(), 0
    for _ in range(10):
        lines, overlong, _ = cutter.feed(b"x" * LONGEST)
        assert lines == []
        dropped += overlong
    lines, overlong, _ = cutter.feed(b"xxx\ngood\n")
    assert (lines, dropped + overlong) == ([b"good"], 1)


# UDP


@pytest.fixture
def udp() -> Iterator[tuple[UdpSource, Callable[[bytes], object]]]:
    source = UdpSource("127.0.0.1", 0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        yield source, lambda message: sender.sendto(message, source.address)
    source.close()
    source.close()


def test_datagrams_come_in_order_and_bad_ones_are_counted(udp: tuple) -> None:
    source, send = udp
    assert source.read(time.monotonic()) == []
    assert (source.refused, source.problem) == (0, None)
    for message in (encode(stamp=1), b"nonsense", encode(stamp=2), encode(color=1), b"x" * 5000, encode(stamp=3)):
        send(message)
    samples = gather(source, 3)
    assert [sample.stamp for sample in samples] == [1, 2, 3]
    assert source.refused == 3
    assert "unknown key 'color'" in source.problem  # the last one that was parsed


def test_a_datagram_is_dated_by_its_arrival_not_by_its_reading(udp: tuple) -> None:
    source, send = udp

    def is_dated() -> bool:
        """A kernel begins in its own time after it is asked. Until then it dates the reading."""
        send(encode())
        time.sleep(0.02)
        return time.monotonic() - gather(source, 1)[0].received > 0.015

    until(is_dated)
    before = time.monotonic()
    send(encode())
    sent = time.monotonic()
    time.sleep(0.2)
    (sample,) = gather(source, 1)
    assert before - 0.01 < sample.received < sent + 0.1


def test_of_a_flood_the_newest_are_kept(udp: tuple) -> None:
    source, send = udp
    for k in range(2 * LARGEST_BATCH):
        send(encode(stamp=k))
    samples = source.read(time.monotonic())
    assert [sample.stamp for sample in samples] == list(range(LARGEST_BATCH, 2 * LARGEST_BATCH))
    assert source.refused == LARGEST_BATCH
    assert "the oldest were dropped" in source.problem


@pytest.mark.parametrize("message", [encode(), encode(colour=1), b"x" * 4000])
def test_the_work_of_a_read_is_bounded_whatever_comes(
    udp: tuple, message: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    source, _ = udp
    source.close()
    taken, parsed = count_endless(source, message, monkeypatch)
    assert taken == DRAIN
    assert parsed == LARGEST_BATCH <= 20  # some 0.1 ms each, of the 10 ms of a control step
    assert source.refused >= DRAIN - LARGEST_BATCH


def count_endless(source: UdpSource, message: bytes, monkeypatch: pytest.MonkeyPatch) -> tuple[int, int]:
    """Datagrams that one read takes of a socket that never runs dry, and those that it parses."""
    counts = {"taken": 0, "parsed": 0}

    class Endless:
        def recvmsg(self, *_: int) -> tuple:
            counts["taken"] += 1
            return message, [], 0, None

    def parse(content: bytes, received: float) -> Sample:
        counts["parsed"] += 1
        return parse_pose(content, received)

    monkeypatch.setattr(source, "_socket", Endless())
    monkeypatch.setattr(source._inbox, "_parse", parse)
    source.read(0.0)
    return counts["taken"], counts["parsed"]


def test_in_a_flood_that_goes_on_the_newest_pose_is_as_new_as_the_read(udp: tuple) -> None:
    """The kernel keeps the oldest datagrams: its buffer must be small enough to be emptied by one read."""
    source, send = udp
    for k in range(2000):
        send(encode(stamp=k))
    source.read(time.monotonic())
    send(encode(stamp=2000))
    assert [sample.stamp for sample in source.read(time.monotonic())] == [2000]


@pytest.mark.parametrize("key", [r"\ud800", r"\u001b[2K\rPOLICY: all is well", r"\u202e"])
@pytest.mark.parametrize("form", ['{"%s": 1}', '{"%s": 1, "%s": 2}', '{"frame": {"%s": 1}}'])
def test_keys_from_outside_are_shown_by_their_escapes(key: str, form: str) -> None:
    with pytest.raises(ValueError, match="pose: ") as caught:
        parse_pose(form.replace("%s", key).encode(), 0.0)
    assert str(caught.value).isprintable()


def test_reading_a_closed_source_gives_nothing(udp: tuple) -> None:
    source, _ = udp
    source.close()
    assert source.read(time.monotonic()) == []
    assert source.problem is not None


def test_it_binds_the_loopback_unless_a_host_is_given() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
        with pytest.raises(ValueError, match=f"udp:127.0.0.1:{port} cannot be bound: Address already in use"):
            open_source(f"udp:{port}")
    for text, host in ((f"udp:{port}", "127.0.0.1"), (f"udp:0.0.0.0:{port}", "0.0.0.0")):
        source = open_source(text)
        assert source.describe() == f"udp:{host}:{port}"
        source.close()


# TCP


@pytest.fixture
def server() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.settimeout(10)
        yield listener


def test_lines_over_tcp_and_a_new_link_after_each_loss(server: socket.socket) -> None:
    source = open_source(f"tcp:127.0.0.1:{server.getsockname()[1]}")
    assert "not connected yet" in source.problem
    for turn in range(2):
        until(lambda: source.read(time.monotonic()) == [] and accepted(server), said=lambda: source.problem)
        link = links.pop()
        message = encode(stamp=turn)
        link.sendall(message[:10])
        until(lambda: source.read(time.monotonic()) == [], said=lambda: source.problem)
        link.sendall(message[10:] + b"\nnonsense\n")
        (sample,) = gather(source, 1)
        assert sample.stamp == turn
        assert source.refused == turn + 1
        assert "not JSON" in source.problem
        link.sendall(message[:10])  # half a line is forgotten with its link
        link.close()
        until(
            lambda: source.read(time.monotonic()) == [] and "closed the link" in str(source.problem),
            said=lambda: source.problem,
        )
    source.close()
    assert source.read(time.monotonic()) == []


links: list[socket.socket] = []


def accepted(server: socket.socket) -> bool:
    server.settimeout(0.02)
    try:
        links.append(server.accept()[0])
    except TimeoutError:
        return False
    return True


def connected(server: socket.socket) -> tuple[PoseSource, socket.socket]:
    source = open_source(f"tcp:127.0.0.1:{server.getsockname()[1]}")
    source.read(time.monotonic())
    return source, server.accept()[0]


def test_of_lines_without_stamps_read_at_once_the_newest_counts(server: socket.socket) -> None:
    source, link = connected(server)
    link.sendall(b"".join(encode(position=[k, 0, 0]) + b"\n" for k in range(3)))
    time.sleep(0.05)
    assert [sample.position[0] for sample in gather(source, 1)] == [2]
    link.sendall(b"".join(encode(stamp=k) + b"\n" for k in range(3)))
    assert [sample.stamp for sample in gather(source, 3)] == [0, 1, 2]
    link.close()
    source.close()


def test_of_many_lines_the_newest_are_cut_out_and_the_others_counted() -> None:
    cutter = Lines()
    assert cutter.feed(b"half", 3) == ([], 0, 0)
    assert cutter.feed(b" a line\n" + b"".join(b"%d\n" % k for k in range(9)) + b"re", 3) == ([b"6", b"7", b"8"], 0, 7)
    assert cutter.feed(b"st\n", 3) == ([b"rest"], 0, 0)
    assert cutter.feed(b"x" * 5000, 3) == ([], 1, 0)
    assert cutter.feed(b"x\n1\n2\n3\n4\n", 3) == ([b"2", b"3", b"4"], 0, 2)
    assert cutter.feed(b"5\n", 3) == ([b"5"], 0, 0)


def test_of_a_flood_over_tcp_the_newest_lines_are_kept(server: socket.socket) -> None:
    source, link = connected(server)
    link.sendall(b"".join(encode(stamp=k) + b"\n" for k in range(500)))
    time.sleep(0.05)
    samples = gather(source, 1)
    assert [sample.stamp for sample in samples] == list(range(500 - LARGEST_BATCH, 500))
    assert source.refused == 500 - LARGEST_BATCH
    link.close()
    source.close()


def test_a_server_that_is_not_there_is_tried_again_in_time(server: socket.socket) -> None:
    port = server.getsockname()[1]
    server.close()
    source = TcpSource("127.0.0.1", port)
    source.read(100.0)
    until(lambda: source.read(100.1) == [] and "refused" in str(source.problem), said=lambda: source.problem)
    with socket.create_server(("127.0.0.1", port)) as listener:
        listener.settimeout(0.05)
        source.read(100.2)  # too early
        with pytest.raises(TimeoutError):
            listener.accept()
        source.read(100.6)
        listener.settimeout(10)
        link, _ = listener.accept()
        link.sendall(encode() + b"\n")
        (sample,) = gather(source, 1)
        assert source.problem is None
        source.read(sample.received + 1.9)
        assert source.problem is None
        source.read(sample.received + 2.1)
        assert "silent for 2 s" in str(source.problem)
        link.close()
    source.close()


def test_a_host_without_an_address_is_refused() -> None:
    with pytest.raises(ValueError, match=r"tcp:no\.such\.host\.invalid:5000: 'no\.such\.host\.invalid' has no address"):
        open_source("tcp:no.such.host.invalid:5000")


# Relays


def test_what_a_relay_says_is_shown_by_its_escapes(tmp_path: Path) -> None:
    relay = tmp_path / "relay"
    relay.write_text("#!/bin/sh\nprintf 'ready \\033[1mfake\\nproblem \\033[2K\\rall is well\\n'\ncat\n")
    relay.chmod(0o755)
    source = RelaySource("mocap", str(relay))
    until(lambda: source.read(time.monotonic()) == [] and source.problem is not None, said=lambda: source.problem)
    source.close()
    assert source.describe() == r"mocap (\x1b[1mfake)"
    assert source.problem is not None and source.problem.isprintable()


# Plant


def test_a_plant_is_read_and_its_exceptions_do_not_escape() -> None:
    def state(now: float) -> list[Sample]:
        if now > 5:
            raise ZeroDivisionError("far off")
        return [parse_pose(encode(), now)]

    source = PlantSource(state, "mujoco")
    assert [sample.received for sample in source.read(4.0)] == [4.0]
    assert source.read(6.0) == []
    assert (source.refused, source.problem) == (1, "mujoco: ZeroDivisionError: far off")
    assert source.describe() == "mujoco"
    source.close()


# Opening


@pytest.mark.parametrize(
    ("text", "accepted"),
    [
        ("", "imu; mocap:.*; ros1:/topic; ros2:/topic; gates:.*; tcp:HOST:PORT; udp:PORT .*; or path/to/file.py:Name"),
        ("serial:9870", "mocap:.*udp:PORT"),
        ("udp:", "udp:PORT or udp:HOST:PORT"),
        ("udp:0", "udp:PORT"),
        ("udp:127.0.0.1:70000", "udp:PORT"),
        ("tcp:5000", "tcp:HOST:PORT"),
        ("tcp:host:http", "tcp:HOST:PORT"),
        ("mocap:vrpn:10.0.0.1", "mocap:TYPE:HOST:RIGID_BODY"),
        ("ros1:", "ros1:/topic"),
    ],
)
def test_a_source_that_makes_no_sense_is_refused(text: str, accepted: str) -> None:
    with pytest.raises(ValueError, match=f"pose source is {text!r}; accepted: .*{accepted}"):
        open_source(text)


def test_sources_leave_no_thread_and_import_nothing_heavy() -> None:
    code = (
        "import sys, threading, time\n"
        "from e2efly.flight.pose.sources import open_source\n"
        "import e2efly.flight.pose.tracking\n"
        "open_source('tcp:127.0.0.1:9').read(time.monotonic())\n"
        "assert threading.active_count() == 1\n"
        "print(sorted(set(sys.modules) & {'jax', 'scipy', 'rospy', 'rclpy', 'motioncapture', 'serial', 'mcap'}))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("[]\n", "")


# A source of one's own

OWN = """
import e2efly
from e2efly.policy.odometry import Sample


@e2efly.register_pose_source("beacon", "beacon:HEIGHT")
class Beacon:
    refused, problem = 0, None

    def __init__(self, where):
        self.height = float(where)

    def read(self, now):
        return [Sample(now, (0.0, 0.0, self.height), (1.0, 0.0, 0.0, 0.0))]

    def close(self):
        pass

    def describe(self):
        return "beacon"


class Mute:
    def __init__(self, where):
        pass
"""


def test_a_source_of_ones_own_is_opened_by_reference_and_by_name(tmp_path: Path) -> None:
    file = tmp_path / "beacon.py"
    file.write_text(OWN)
    source = open_source(f"{file}:Beacon:1.5")
    assert source.read(3.0)[0].position == (0.0, 0.0, 1.5)
    assert open_source("beacon:2").read(0.0)[0].position == (0.0, 0.0, 2.0)  # registered by now
    with pytest.raises(ValueError, match=r"beacon.py:Mute has no refused, problem, read, close, describe; accepted"):
        open_source(f"{file}:Mute")
    with pytest.raises(ValueError, match=r"unknown name in .*beacon.py 'Beakon'; did you mean 'Beacon'"):
        open_source(f"{file}:Beakon")
    with pytest.raises(ValueError, match=r"there is no file .*nowhere.py"):
        open_source("nowhere.py:Beacon:1")
    (tmp_path / "twice.py").write_text(OWN)
    with pytest.raises(ValueError, match=r"pose source 'beacon' of .*twice.py:Beacon is also the name of .*beacon.py"):
        open_source(f"{tmp_path}/twice.py:Beacon:1")
