"""What the tests of the image topics of ROS 1 and of ROS 2 share: a publisher's script, and what must come of it."""

import dataclasses
import time
from contextlib import closing

import numpy as np
import pytest

import e2efly
from e2efly.flight import child
from e2efly.flight.sight.image_source import Frame, ImageSource
from e2efly.flight.sight.sources import open_image
from tests.waiting import until

WIDTH, HEIGHT, FOCAL = 96, 48, 40.0
DEPTH = dataclasses.replace(
    e2efly.load_policy("avoid").contract.images[0],
    height=12, width=32, pool=(12, 32), reach_m=(0.3, 10.0),
    fov_rad=(2 * np.arctan(WIDTH / 2 / FOCAL), 2 * np.arctan(HEIGHT / 2 / FOCAL)),
)  # fmt: skip
"""A policy's camera with the field of view of what is published, 3 x 4 pixels in each cell."""
COLOURS = dataclasses.replace(DEPTH, sees="rgb", encoding="none")
MASK = dataclasses.replace(DEPTH, sees="mask", of="pad", encoding="none")
CAMERAS = {"depth": DEPTH, "rgb": COLOURS, "mask": MASK}
PUBLISHED = """
import array, struct
W, H, F = 96, 48, 40.0
def rows(kind, big):
    "Depth: m by column; colours: red, left, and blue; a mask whose left half is set. Each row ends in padding."
    order = ">" if big else "<"
    made = []
    for y in range(H):
        if kind == "32FC1":
            values = [1 + 0.05 * x for x in range(W)]
            values[0:3] = [float("nan")] * 3
            values[3:6] = [float("inf")] * 3
            row = struct.pack(f"{order}{W}f", *values)
        elif kind == "16UC1":
            row = struct.pack(f"{order}{W}H", *[0 if x < 3 else 1000 + 50 * x for x in range(W)])
        elif kind == "mono8":
            row = bytes([255] * (W // 2) + [0] * (W // 2))
        else:
            red, blue = (200, 30, 60), (10, 40, 250)
            colours = [red] * (W // 2) + [blue] * (W // 2)
            row = b"".join(bytes(c[::-1] if kind == "bgr8" else c) for c in colours)
        made.append(row)
    return made
KINDS = {
    "/depth/image_raw": ("32FC1", False, 0), "/big/image_raw": ("32FC1", True, 5), "/mm/image_raw": ("16UC1", False, 6),
    "/bigmm/image_raw": ("16UC1", True, 0), "/rgb/image_raw": ("rgb8", False, 7), "/bgr/image_raw": ("bgr8", False, 0),
    "/mono/image_raw": ("mono8", False, 1), "/odd/image_raw": ("bayer_rggb8", False, 0),
    "/late/image_raw": ("16UC1", False, 0), "/unknown/image_raw": ("16UC1", False, 0),
    "/zero/image_raw": ("16UC1", False, 0),
}
def fill(topic, image, info, now):
    "The fields of both ROS; `now`: the wall clock, s, of which the stamp tells that it was 20 ms ago."
    kind, big, padding = KINDS[topic]
    made = rows(kind, big)
    image.encoding, image.is_bigendian, image.width, image.height = kind, int(big), W, H
    image.step = len(made[0]) + padding
    image.data = b"".join(row + bytes(padding) for row in made)
    stamp = {"/late/image_raw": 100.0, "/zero/image_raw": 0.0}.get(topic, now - 0.02)
    matrix = [F, 0, W / 2, 0, F, H / 2, 0, 0, 1]
    matrix = [0.0] * 9 if topic.startswith("/unknown") else matrix
    info.width, info.height = W, H
    return stamp, matrix
"""


def first(source: ImageSource) -> Frame:
    source.read(time.monotonic())
    frames: list[Frame] = []
    until(lambda: frames.extend(source.read(time.monotonic())) or frames, said=lambda: source.problem)
    return frames[0]


CELL = 1 + 0.15 * np.arange(32)
"""m: the nearest of the three columns of a cell."""


def check_topic(ros: str, topic: str, sees: str) -> None:
    """A topic is read in metres, colours or classes, with its field of view and its time."""
    with closing(open_image(f"{ros}:{topic}/image_raw", CAMERAS[sees])) as source:
        frame = first(source)
        assert 0.02 <= time.monotonic() - frame.time < 2.0
    assert frame.image.shape == CAMERAS[sees].shape
    if sees == "depth":
        wanted = CELL.copy()
        wanted[0] = 0.0  # a hole
        if topic in ("/depth", "/big"):
            wanted[1] = 10.0  # no echo: as far as the policy sees
        np.testing.assert_allclose(frame.image, np.tile(wanted, (12, 1)), atol=1e-5)
    elif sees == "mask":
        np.testing.assert_array_equal(frame.image, np.tile(np.arange(32) < 16, (12, 1)))
    else:
        np.testing.assert_allclose(255 * frame.image[:, :16], np.tile([200, 30, 60], (12, 16, 1)), atol=0.01)
        np.testing.assert_allclose(255 * frame.image[:, 16:], np.tile([10, 40, 250], (12, 16, 1)), atol=0.01)


TOPICS = [
    ("/depth", "depth"), ("/big", "depth"), ("/mm", "depth"), ("/bigmm", "depth"), ("/rgb", "rgb"), ("/bgr", "rgb"),
    ("/mono", "mask"),
]  # fmt: skip


def check_refusals(ros: str) -> None:
    """What is no image of the policy is refused by name, before a flight."""
    for text, sees, said in (
        ("/odd/image_raw", "rgb", "encoding is 'bayer_rggb8'; accepted: rgb8, bgr8 for a policy that sees rgb"),
        ("/unknown/image_raw", "depth", r"/unknown/camera_info: CameraInfo has the focal lengths 0 and 0 and the size"),
        ("/text", "depth", "/text is '.*String'; accepted: sensor_msgs/.*Image"),
        ("image_raw", "depth", "topic is 'image_raw'; accepted: a name from the root"),
    ):
        with pytest.raises(ValueError, match=said) as refused:
            open_image(f"{ros}:{text}", CAMERAS[sees])
        assert "install" not in str(refused.value)
    known = open_image(f"{ros}:/unknown/image_raw?fov=policy", DEPTH)  # the user says what the topic does not
    first(known)
    known.close()


def check_silence(ros: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A topic on which nothing comes is named."""
    monkeypatch.setattr(child, "OPENING", 4.0)
    with pytest.raises(ValueError, match="no answer within 4 s: no image came on /none/image_raw"):
        open_image(f"{ros}:/none/image_raw", DEPTH)


def check_stamps(ros: str) -> None:
    """Stamps of another clock, or none, are said; the times of arrival are taken."""
    for topic, said in (("/late", "s from this computer's clock"), ("/zero", "are zero")):
        source = open_image(f"{ros}:{topic}/image_raw", DEPTH)
        frame = first(source)
        assert 0 <= time.monotonic() - frame.time < 2.0
        assert said in source.problem
        assert source.problem.endswith("the times of arrival are taken")
        source.close()
