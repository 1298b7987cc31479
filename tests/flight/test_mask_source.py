"""Masks as an image source: a process that opens another source and publishes what a segmenter makes of it."""

import dataclasses
import json
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import e2efly
from e2efly.flight.sight.fit import fitted
from e2efly.flight.sight.image_source import Frame
from e2efly.flight.sight.mask_source import capture, colours_for
from e2efly.flight.sight.quality import SeenImages, see
from e2efly.flight.sight.shared import SharedImages, place
from e2efly.flight.sight.sources import open_image
from tests.flight.test_segment import CORNERS, HIGH, WIDE, polygon, tag
from tests.waiting import until

PAD = e2efly.load_policy("land_visual").contract.images[0]
DEPTH = e2efly.load_policy("avoid").contract.images[0]
Shared = tuple[str, SharedImages, np.ndarray]
BLUE = "colour:210,50,20,250,100,100"


class Speech:
    def __init__(self) -> None:
        self.closing, self.said = threading.Event(), []

    def say(self, *words: str) -> None:
        self.said.append(words)


class Output:
    def __init__(self) -> None:
        self.speech, self.masks = Speech(), []

    def put(self, moment: float, values: bytes, shape: tuple[int, ...], kind: str, fov: Any, detail: str) -> None:
        assert (kind, fov) == ("uint8", (0.0, 0.0))
        self.masks.append((moment, np.frombuffer(values, np.uint8).reshape(shape), detail))


def asked(uri: str, segmenter: str = BLUE) -> str:
    return json.dumps({"segmenter": segmenter, "uri": uri, "image": dataclasses.asdict(PAD)})


def noisy(picture: np.ndarray, seed: int) -> np.ndarray:
    return np.maximum(picture, 2) - np.random.default_rng(seed).integers(0, 3, picture.shape).astype(np.uint8)


@pytest.fixture
def shared(request: pytest.FixtureRequest) -> Iterator[Shared]:
    """Colours of 30 rows and 40 columns that another program publishes, and where it shows blue."""
    name = f"mask-{request.node.name[:20].replace('[', '-')}"
    images = SharedImages(name, (30, 40, 3), "uint8")
    picture = np.full((30, 40, 3), 90, np.uint8)
    picture[8:20, 10:30] = (20, 40, 200)
    yield f"shm:{name}", images, picture
    images.close()
    place(name).unlink()


def run(uri: str, publish: Callable[[int], None], seconds: float = 10.0, enough: int = 3) -> Output:
    """The process's function in a thread of this one, while `publish(k)` is called again and again."""
    output, failed = Output(), []

    def work() -> None:
        try:
            capture(output, asked(uri))
        except ValueError as error:
            failed.append(error)

    worker = threading.Thread(target=work)
    worker.start()
    end, k = time.monotonic() + seconds, 0
    while len(output.masks) < enough and not output.speech.said and not failed and time.monotonic() < end:
        publish(k)
        k += 1
        time.sleep(0.02)
    output.speech.closing.set()
    worker.join(5)
    if failed:
        raise failed[0]
    return output


def test_masks_have_the_cameras_own_pixels_and_the_times_of_its_exposures(shared: Shared) -> None:
    uri, images, picture = shared
    times = []

    def publish(k: int) -> None:
        times.append(time.monotonic())
        images.publish(times[-1], noisy(picture, k))

    publish(0)
    output = run(uri, publish)
    assert len(output.masks) >= 3
    for moment, mask, detail in output.masks:
        assert moment in times
        assert np.array_equal(mask > 0, picture[..., 2] == 200)
        assert mask.max() == 255
        assert detail.startswith("colours from 210,50,20")


@pytest.mark.parametrize(("level", "said"), [(0, "shows nothing: black"), (200, "frozen: 3 equal images")])
def test_a_covered_or_frozen_camera_gives_no_mask(shared: Shared, level: int, said: str) -> None:
    uri, images, picture = shared
    still = picture.copy() if level else np.zeros_like(picture)

    def publish(k: int) -> None:
        images.publish(time.monotonic(), still)

    publish(0)
    output = run(uri, publish, enough=100)
    assert said in output.speech.said[0][1]
    assert len(output.masks) < 3


def test_colours_are_cut_to_the_policys_field_of_view_and_not_resampled() -> None:
    camera = colours_for(PAD)  # 90 degrees
    image = np.random.default_rng(0).random((40, 60, 3)).astype(np.float32)
    wide = 2 * np.arctan(1.5), 2 * np.arctan(1.0)
    assert np.array_equal(fitted(image, wide, camera, "it"), image[:, 10:50])
    assert np.array_equal(fitted(image, (0.0, 0.0), camera, "it"), image)
    grey = fitted(image[..., 0], (0.0, 0.0), camera, "it")
    assert np.array_equal(grey, np.repeat(image[..., :1], 3, axis=-1))
    with pytest.raises(ValueError, match=r"it sees 1.000 rad down; accepted: 1.571 rad or more"):
        fitted(image, (2.0, 1.0), camera, "it")


def test_a_tag_in_a_video_becomes_the_policys_mask(tmp_path: Path) -> None:
    path = tmp_path / "tag.mp4"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 10.0, (WIDE, HIGH))
    picture = tag(7)
    for k in range(40):
        writer.write(noisy(picture, k))
    writer.release()
    truth = fitted(polygon(CORNERS).astype(np.float32), (0.0, 0.0), PAD, "truth")
    source = open_image(f"mask:apriltag:36h11:7@v4l2:{path}?fov=policy", PAD)
    try:
        assert "480 rows, 640 columns (AprilTag 36h11, 7x1; v4l2:" in source.describe()
        frames: list[Frame] = []
        until(lambda: frames.extend(source.read(time.monotonic())) or frames, said=lambda: source.problem)
        seen = see(SeenImages(PAD), frames, time.monotonic())
        assert seen.fault is None
        assert seen.frame.image.shape == (16, 16)
        assert np.abs(seen.frame.image - truth).sum() <= 2  # cells at the rim that are half covered
        assert truth.sum() > 10
    finally:
        source.close()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("mask:apriltag:36h11", "lacks its URI; accepted: mask:apriltag:"),
        ("mask:@shm:x", "lacks SEGMENTER"),
        ("mask:apriltag:35h11@shm:x", "family of AprilTags is '35h11'"),
        (f"mask:{BLUE}@shm:no-such-images", "No such file or directory; accepted: images that a running program"),
        (f"mask:{BLUE}@v4l2:/dev/video99?fov=policy", "/dev/video99 cannot be opened"),
    ],
)
def test_what_is_wrong_with_a_source_is_named(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        open_image(text, PAD)


def test_a_policy_that_sees_depth_gets_no_mask() -> None:
    with pytest.raises(ValueError, match=r"image 'image_0' is depth; accepted with a source mask:...: a mask"):
        open_image(f"mask:{BLUE}@shm:x", DEPTH)
