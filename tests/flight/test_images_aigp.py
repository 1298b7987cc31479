"""The camera stream of the AI Grand Prix: a sender of ours that speaks it as it is described, and the image source."""

import dataclasses
import socket
import threading
import time
from collections.abc import Iterator
from itertools import count

import cv2
import numpy as np
import pytest

import e2efly
from e2efly.flight.scripts.capture_aigp import FOV, HEADER, UNDER_WAY, JpegParts
from e2efly.flight.sight.image_source import Frame
from e2efly.flight.sight.sources import open_image
from tests.waiting import until

COLOURS = dataclasses.replace(
    e2efly.load_policy("avoid").contract.images[0], sees="rgb", encoding="none", height=36, width=64,
    fov_rad=(FOV[0], FOV[1]), pool=(36, 64), rate_hz=30.0,
)  # fmt: skip
SHOWN = np.array([220, 30, 120])


def datagrams(number: int, content: bytes, stamp_ns: int, size: int = 1400) -> list[bytes]:
    parts = [content[i : i + size] for i in range(0, len(content), size)]
    return [
        HEADER.pack(number, i, len(parts), len(content), len(part), stamp_ns) + part for i, part in enumerate(parts)
    ]


def jpeg() -> bytes:
    noise = np.random.default_rng(0).integers(0, 20, (360, 640, 3))
    image = (np.clip(SHOWN[::-1] + noise - 10, 0, 255)).astype(np.uint8)
    return cv2.imencode(".jpg", image)[1].tobytes()


def test_parts_come_in_any_order_and_what_is_lost_or_no_part_does_not_matter() -> None:
    parts, content = JpegParts(), bytes(range(256)) * 40
    sent = datagrams(7, content, 1_500_000_000)
    assert [parts.take(data) for data in (*reversed(sent[1:]), b"short", b"\xff" * 80)] == [None] * (len(sent) + 1)
    assert parts.take(sent[0]) == (content, 1.5)
    older_and_again = (*datagrams(6, content, 1), *sent)
    assert [parts.take(data) for data in older_and_again] == [None] * 2 * len(sent)
    for lost in range(8, 8 + UNDER_WAY + 2):
        parts.take(datagrams(lost, content, 2)[0])
    late = datagrams(9, content, 2)  # its first part was given up
    assert all(parts.take(data) is None for data in late[1:])
    parts.take(datagrams(500, b"x", 3)[0])
    with pytest.raises(ValueError, match="begin anew"):
        parts.take(datagrams(0, b"x", 0)[0])


@pytest.fixture
def port() -> Iterator[int]:
    """A simulator's stream of 30 images a second, its clock 1000 s behind."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        to = probe.getsockname()[1]
    ended, content = threading.Event(), jpeg()

    def send() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
            for number in count():
                stamp = round((time.monotonic() + 1000) * 1e9)
                for data in datagrams(number, content, stamp):
                    line.sendto(data, ("127.0.0.1", to))
                if ended.wait(1 / 30):
                    return

    thread = threading.Thread(target=send)
    thread.start()
    yield to
    ended.set()
    thread.join()


def test_images_come_in_their_colours_with_times_of_this_machine(port: int) -> None:
    source = open_image(f"aigp:127.0.0.1:{port}", COLOURS)
    frames: list[Frame] = []
    until(lambda: len(frames) > 5 or bool(frames.extend(source.read(time.monotonic()))))
    now = time.monotonic()
    assert source.problem is None and "360 rows, 640 columns" in source.describe()
    source.close()
    assert frames[-1].image.shape == (36, 64, 3)
    np.testing.assert_allclose(frames[-1].image.mean((0, 1)), SHOWN / 255, atol=0.02)
    assert now - 1.0 < frames[-1].time <= now


def test_what_does_not_fit_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match="image source is aigp:5600; accepted: aigp:HOST:PORT"):
        open_image("aigp:5600", COLOURS)
    with pytest.raises(ValueError, match="gives colours; accepted: a policy that sees rgb, not depth"):
        open_image("aigp:0.0.0.0:5600", dataclasses.replace(COLOURS, sees="depth"))
