"""Images that a node gives to other computers: over TCP, with the reader's clock."""

import signal
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from e2efly.flight.scripts.image_stream import IMAGE, MESSAGE, PING, PING_MAGIC, Clocks, image, unpacked
from e2efly.flight.sight.image_source import Frame, ImageSource
from e2efly.flight.sight.outputs import Output, give, outputs
from e2efly.flight.sight.shared import SharedImages, place
from e2efly.flight.sight.sources import open_image
from e2efly.policy.loader import load_policy
from e2efly.policy.zoo import policy_file
from tests.waiting import free_port, until

CONTRACT = load_policy(policy_file("avoid")).contract
CAMERA = CONTRACT.images[0]
NAME = "e2efly-test-give"


@pytest.fixture
def images() -> Iterator[SharedImages]:
    place(NAME).unlink(missing_ok=True)
    shared = SharedImages(NAME, CAMERA.shape)
    yield shared
    shared.close()
    place(NAME).unlink(missing_ok=True)


def depth(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.3, 9.9, CAMERA.shape).astype(np.float32)


@contextmanager
def publishing(images: SharedImages) -> Iterator[None]:
    """Images all the while."""
    stop = threading.Event()

    def publish() -> None:
        while not stop.wait(0.05):
            images.publish(time.monotonic(), depth(0))

    publisher = threading.Thread(target=publish)
    publisher.start()
    try:
        yield
    finally:
        stop.set()
        publisher.join()


def wait_for_problem(source: ImageSource, said: str) -> None:
    """Until the source tells a problem with these words."""

    def told() -> bool:
        source.read(0.0)
        return source.problem is not None and said in source.problem

    until(told, said=lambda: source.problem)


def received(source: object, images: SharedImages, seed: int) -> tuple[Frame, float, np.ndarray]:
    """An image that was published and came through."""
    end = time.monotonic() + 10
    source.read(0.0)  # pyright: ignore
    while time.monotonic() < end:
        at, shown = time.monotonic(), depth(seed)
        images.publish(at, shown)
        time.sleep(0.1)
        frames = source.read(0.0)  # pyright: ignore
        if frames and abs(frames[-1].time - at) < 0.05:
            return frames[-1], at, shown
        seed += 1
    raise AssertionError(source.problem)  # pyright: ignore


@pytest.mark.parametrize("exact", [False, True])
def test_images_come_over_tcp_with_the_time_of_their_exposure(images: SharedImages, exact: bool) -> None:
    port = free_port()
    giver = give(CAMERA, NAME, Output("tcp", str(port), exact), "127.0.0.1")
    try:
        with publishing(images):  # a source opens with its first image
            source = open_image(f"hil:127.0.0.1:{port}", CAMERA)
        frame, at, shown = received(source, images, 1)
        assert abs(frame.time - at) < 0.005  # the same clock on both sides
        if exact:
            np.testing.assert_array_equal(frame.image, shown)
        else:
            np.testing.assert_allclose(frame.image, shown, atol=0.51e-3)
            assert np.any(frame.image != shown)
        assert "clocks agree within" in source.describe()
        source.close()
    finally:
        giver.close()


def test_a_node_that_dies_is_looked_for_until_it_is_back(images: SharedImages) -> None:
    port = free_port()
    giver = give(CAMERA, NAME, Output("tcp", str(port), True), "127.0.0.1")
    with publishing(images):
        source = open_image(f"hil:127.0.0.1:{port}", CAMERA)
    try:
        for seed in (1, 100):  # it dies twice
            before, _, _ = received(source, images, seed)
            assert source.problem is None
            giver.process.kill()
            giver.process.wait()
            wait_for_problem(source, "")
            assert source.problem == f"hil:127.0.0.1:{port}: connection lost, trying again"
            images.publish(time.monotonic(), depth(50))
            time.sleep(0.5)
            assert source.read(0.0) == []  # what nobody gives is not there, and nothing is repeated
            giver.close()
            giver = give(CAMERA, NAME, Output("tcp", str(port), True), "127.0.0.1")
            frame, at, shown = received(source, images, seed + 200)
            np.testing.assert_array_equal(frame.image, shown)
            assert abs(frame.time - at) < 0.005  # by clocks that were measured anew
            assert frame.time > before.time
            assert source.problem is None
    finally:
        source.close()
        giver.close()


@pytest.mark.whole
def test_a_node_that_is_silent_is_lost_and_one_with_other_images_is_named(images: SharedImages) -> None:
    port = free_port()
    giver = give(CAMERA, NAME, Output("tcp", str(port), True), "127.0.0.1")
    try:
        with publishing(images):
            source = open_image(f"hil:127.0.0.1:{port}", CAMERA)
        giver.process.send_signal(signal.SIGSTOP)  # a cable that is pulled: nothing comes, and no end either
        wait_for_problem(source, "connection lost, trying again")
        giver.process.kill()
        giver.close()
        giver = give(CAMERA, NAME, Output("tcp", str(port)), "127.0.0.1")  # uint16 now
        with publishing(images):
            wait_for_problem(source, "its images have become")
        source.close()
    finally:
        giver.process.kill()
        giver.close()


def test_a_reader_that_stalls_is_dropped_and_the_others_see_on(images: SharedImages) -> None:
    port = free_port()
    giver = give(CAMERA, NAME, Output("tcp", str(port), True), "127.0.0.1")
    try:
        stalled = socket.socket()
        stalled.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        stalled.connect(("127.0.0.1", port))
        good = socket.create_connection(("127.0.0.1", port), 5)
        intruder = socket.create_connection(("127.0.0.1", port), 5)
        intruder.sendall(b"GET / HTTP/1.1\r\n\r\n")
        numbers, got, header, end = list[int](), b"", 40, time.monotonic() + 8
        good.settimeout(0.01)
        while time.monotonic() < end and len(numbers) < 300:
            images.publish(time.monotonic(), depth(len(numbers)))
            try:
                got += good.recv(1 << 16)
            except TimeoutError:
                continue
            if header and len(got) >= header:
                assert got[:8] == b"E2EHIL01"
                got, header = got[header:], 0
            while not header and len(got) >= MESSAGE.size:
                kind, length, number, _ = MESSAGE.unpack_from(got)
                if len(got) < MESSAGE.size + length:
                    break
                assert kind == IMAGE and len(unpacked(got[MESSAGE.size : MESSAGE.size + length], 32 * 12 * 4)) == 1536
                got = got[MESSAGE.size + length :]
                numbers.append(number)
        assert len(numbers) >= 50 and np.all(np.diff(numbers) > 0)
        intruder.settimeout(5)
        rest = bytearray()
        while data := intruder.recv(1 << 16):  # it may get a few images, and is dropped
            rest += data
        for connection in (stalled, good, intruder):
            connection.close()
    finally:
        giver.close()


def test_the_clock_of_the_least_round_trip_counts() -> None:
    clocks = Clocks()
    for sent, theirs, back in ((0.0, 100.9, 1.0), (2.0, 102.01, 2.02), (3.0, 103.5, 3.6)):
        magic, number = PING.unpack(clocks.ping(sent))
        assert magic == PING_MAGIC
        clocks.answered(number, theirs, back)
    assert clocks.best.ahead == pytest.approx(100.0)
    assert clocks.best.doubt == pytest.approx(0.01)
    clocks.answered(77, 0.0, 3.7)  # nobody asked
    assert clocks.best.ahead == pytest.approx(100.0)


def test_an_image_that_is_too_long_or_broken_is_refused() -> None:
    message = image(3, 1.5, bytes(1000))
    kind, length, number, moment = MESSAGE.unpack_from(message)
    assert (kind, length, number, moment) == (IMAGE, len(message) - MESSAGE.size, 3, 1.5)
    content = message[MESSAGE.size :]
    assert unpacked(content, 1000) == bytes(1000)
    for wrong, size in ((content, 999), (content, 1001), (content[:-3], 1000), (b"nonsense", 1000)):
        with pytest.raises(ValueError, match="an image"):
            unpacked(wrong, size)


def test_a_server_that_is_none_is_named() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        server.settimeout(10)

        def answer() -> None:
            connection, _ = server.accept()
            connection.sendall(b"HTTP/1.1 400 Bad Request\r\n" + bytes(100))
            time.sleep(1)
            connection.close()

        thread = threading.Thread(target=answer)
        thread.start()
        with pytest.raises(ValueError, match=r"begins with b'HTTP/1.1'; accepted: b'E2EHIL01'"):
            open_image(f"hil:127.0.0.1:{port}", CAMERA)
        thread.join()
    with pytest.raises(ValueError, match="accepted: where e2efly hil serves tcp"):
        open_image(f"hil:127.0.0.1:{port}", CAMERA)
    with pytest.raises(ValueError, match="accepted: hil:HOST:PORT"):
        open_image("hil:9000", CAMERA)


def test_outputs_that_cannot_be_are_named(images: SharedImages) -> None:
    assert [output.kind for output in outputs(("image_0=shm:a", "image_0=tcp:9000:exact"), CONTRACT)["image_0"]] == [
        "shm",
        "tcp",
    ]
    for texts, said in (
        (("image_0=pigeon:x",), "image_0=pigeon:x; accepted: shm:NAME, tcp:PORT"),
        (("image_0=tcp:70000",), "tcp:70000; accepted"),
        (("image_0=ros1:topic",), "ros1:topic; accepted"),
        (("image_0=ros2:/a", "image_0=ros2:/a"), "accepted: not ros2:/a again, which image_0=ros2:/a has"),
        (("image_0=ros2:/a", "image_0=ros2:/b"), "not ros2:/camera_info again, which image_0=ros2:/a has"),
        (("image_0=tcp:9000", "image_0=tcp:9000:exact"), "not tcp:9000 again"),
        ((), "lacks image_0"),
    ):
        with pytest.raises(ValueError, match=said):
            outputs(texts, CONTRACT)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        with pytest.raises(ValueError, match=f"image_0=tcp:{port}: .*Address already in use"):
            give(CAMERA, NAME, Output("tcp", port), "127.0.0.1")
