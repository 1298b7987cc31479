"""Images of another process: whole, in order, cut to the policy's camera, and refused by name where they do not fit."""

import dataclasses
import math
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import e2efly
from e2efly.flight.sight.fit import fitted
from e2efly.flight.sight.shared import SharedCamera, SharedImages, place
from e2efly.flight.sight.sources import open_cameras
from e2efly.policy.contract import Contract

CONTRACT: Contract = e2efly.load_policy("avoid").contract
CAMERA = CONTRACT.images[0]
NAME = "e2efly_test"
PUBLISHER = """
import sys, time
import numpy as np
from e2efly.flight.sight.shared import SharedImages
images = SharedImages(sys.argv[1], (480, 848), "uint16", (1.6, 1.1))
print("ready", flush=True)
count = 0
while True:
    count += 1
    images.publish(time.monotonic(), np.full((480, 848), 1000 + count % 5000, np.uint16))
"""


@pytest.fixture(autouse=True)
def _gone() -> Iterator[None]:
    place(NAME).unlink(missing_ok=True)
    yield
    place(NAME).unlink(missing_ok=True)


def test_what_another_process_publishes_arrives_whole_and_in_order() -> None:
    """It writes as fast as it can; no image is half of one and half of the next."""
    with subprocess.Popen([sys.executable, "-c", PUBLISHER, NAME], stdout=subprocess.PIPE) as publisher:
        assert publisher.stdout.readline() == b"ready\n"
        camera, times, ages = SharedCamera(NAME, CAMERA), [], []
        end = time.monotonic() + 1.0
        while time.monotonic() < end:
            for frame in camera.read(time.monotonic()):
                assert np.ptp(frame.image) == 0
                times.append(frame.time)
                ages.append(time.monotonic() - frame.time)
        assert len(times) > 10
        assert np.all(np.diff(times) > 0)
        assert np.median(ages) < 0.1
        assert camera.problem is None or "faster" in camera.problem
        publisher.kill()
    assert len(camera.read(time.monotonic())) <= 1
    assert camera.read(time.monotonic()) == []  # what a dead publisher has left is never repeated
    again = SharedImages(NAME, (480, 848), "uint16", (1.6, 1.1))  # it is started anew, and the bridge goes on
    again.publish(time.monotonic(), np.full((480, 848), 2500, np.uint16))
    (frame,) = camera.read(time.monotonic())
    np.testing.assert_allclose(frame.image, 2.5)
    SharedImages(NAME, (48, 64)).publish(time.monotonic(), np.ones((48, 64), np.float32))  # or with another camera
    assert camera.read(time.monotonic()) == []
    camera.close()


def test_an_image_that_came_while_the_loop_was_held_up_is_for_the_next_step() -> None:
    images, camera = SharedImages(NAME, CAMERA.shape), SharedCamera(NAME, CAMERA)
    begun = time.monotonic()
    time.sleep(0.02)
    exposed = time.monotonic()
    images.publish(exposed, np.ones(CAMERA.shape, np.float32))
    assert camera.read(begun) == []
    assert [frame.time for frame in camera.read(time.monotonic())] == [exposed]
    images.publish(exposed + 60.0, np.ones(CAMERA.shape, np.float32))  # a clock that is ahead is not hidden
    assert [frame.time for frame in camera.read(time.monotonic())] == [exposed + 60.0]
    camera.close()


def test_a_wider_camera_is_cut_to_what_the_policy_sees() -> None:
    """A picture whose value is the direction that a pixel looks in."""
    height, width, fov = 360, 640, (1.7, 1.2)
    across, down = (math.tan(angle / 2) for angle in fov)
    x = across * (2 * (np.arange(width) + 0.5) / width - 1)
    y = down * (2 * (np.arange(height) + 0.5) / height - 1)
    for picture, axis in ((np.tile(x, (height, 1)), 0), (np.tile(y[:, None], (1, width)), 1)):
        found = fitted(5 + picture.astype(np.float32), fov, dataclasses.replace(CAMERA, pool=(1, 1)), "it")
        assert found.shape == CAMERA.shape
        count = CAMERA.width if axis == 0 else CAMERA.height
        half = math.tan(CAMERA.fov_rad[axis] / 2)
        edge = half * (2 * np.arange(count) / count - 1)  # the nearest value of a cell is at its first edge
        row = found[0] if axis == 0 else found[:, 0]
        np.testing.assert_allclose(row - 5, edge, atol=2 * half / count / 4)


def test_a_cell_is_its_nearest_valid_depth_and_a_hole_where_it_has_none() -> None:
    height, width = 2 * CAMERA.height, 3 * CAMERA.width
    raw = np.full((height, width), 7.0, np.float32)
    raw[0, 0], raw[1, 2] = 3.0, 0.0  # a hole beside something near
    raw[0:2, 3:6] = 0.0
    raw[0:2, 6:9] = 0.1  # nearer than the camera measures
    raw[0:2, 9:12] = 50.0
    found = fitted(raw, (0.0, 0.0), CAMERA, "it")
    np.testing.assert_allclose(found[0, :5], [3.0, 0.0, 0.0, CAMERA.reach_m[1], 7.0])
    mask = dataclasses.replace(CAMERA, sees="mask", of="pad", encoding="none")
    shown = np.zeros((height, width), np.float32)
    shown[0:2, 0:2] = 1.0
    shown[0, 3] = 1.0
    np.testing.assert_array_equal(fitted(shown, (0.0, 0.0), mask, "it")[0, :3], [1.0, 0.0, 0.0])


def test_what_does_not_fit_is_named(tmp_path: Path) -> None:
    def refused(texts: list[str], said: str) -> None:
        with pytest.raises(ValueError, match=said):
            open_cameras(texts, CONTRACT)

    refused([], "image 'image_0': there is no camera.*tilted 20 degrees up.*32 x 12 pix.*accepted: --image image_0=URI")
    refused(["front=shm:x"], "--image is 'front=shm:x'; accepted: NAME=URI, NAME one of image_0")
    refused(["image_0"], "--image is 'image_0'; accepted")
    refused(["image_0=shm:x", "image_0=shm:y"], "image_0 is 'shm:x' and 'shm:y'; accepted: one URI for each image")
    refused(["image_0=webcam:0"], "--image image_0 is 'webcam:0'; accepted: .*realsense:.*; shm:NAME; or path/to/file")
    refused([f"image_0=shm:{NAME}"], "No such file or directory; accepted: images that a running program publishes")
    refused(["image_0=shm:../x"], "name of shared images is '../x'; accepted: letters")
    place(NAME).write_bytes(b"short")
    refused([f"image_0=shm:{NAME}"], "has 5 bytes; accepted: a header of 40")
    place(NAME).write_bytes(bytes(100))
    refused([f"image_0=shm:{NAME}"], "begins with b'.*; accepted: b'E2EIMG01'")
    for shape, fov, said in (
        ((6, 16), (0.0, 0.0), "has 6 rows and 16 columns; accepted: so many that each of the policy's 12 rows"),
        ((480, 848, 3), (0.0, 0.0), r"has images of shape \(480, 848, 3\); accepted: \(12, 32\) or larger"),
        ((480, 848), (1.0, 0.7), "sees 1.000 rad across; accepted: 1.518 rad or more"),
    ):
        SharedImages(NAME, shape, "float32", fov).close()
        refused([f"image_0=shm:{NAME}"], said)
    own = tmp_path / "own.py"
    own.write_text("class Broken:\n    def __init__(self, where, image): pass\n")
    refused([f"image_0={own}:Broken"], "own.py:Broken has no problem, read, close, describe; accepted: all of")
    with pytest.raises(ValueError, match="accepted: none, as the policy sees nothing"):
        open_cameras(["image_0=shm:x"], e2efly.load_policy("hover").contract)
    images = SharedImages(NAME, CAMERA.shape)
    with pytest.raises(
        ValueError, match=r"image has shape \(3, 3\) and type float64; accepted: \(12, 32\) and float32"
    ):
        images.publish(0.0, np.zeros((3, 3)))
    for shape, dtype, said in (
        ((3,), "float32", "shape is"),
        ((3, 3), "int64", "dtype is"),
        ((3, 3, 4), "uint8", "4 ch"),
    ):
        with pytest.raises(ValueError, match=said):
            SharedImages(NAME, shape, dtype)
