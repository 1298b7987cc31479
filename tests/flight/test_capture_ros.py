"""Messages of ROS as values: what can be told without ROS. The topics themselves are in test_images_ros1.py and 2."""

import math
import time
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from e2efly.flight.child import SCRIPTS
from e2efly.flight.scripts.capture import OTHER_CLOCK_S, Stamps
from e2efly.flight.scripts.capture_ros import BrokenImage, Receiver, beside, field_of_view, values_of

RNG = np.random.default_rng(0)


class Heard:
    def __init__(self) -> None:
        self.lines: list[tuple[str, ...]] = []
        self.speech, self.sees, self.fov, self.put = self, "depth", None, []

    def say(self, *words: str) -> None:
        self.lines.append(words)

    def fail(self, why: str) -> None:
        self.lines.append(("failed", why))


def message(encoding: str, values: np.ndarray, padding: int = 0, big: bool = False, **changes: Any) -> SimpleNamespace:
    rows = values.reshape(values.shape[0], -1).astype(values.dtype.newbyteorder(">" if big else "<"))
    data = b"".join(row.tobytes() + b"\xff" * padding for row in rows)
    step = rows.shape[1] * values.dtype.itemsize + padding
    header = SimpleNamespace(stamp=SimpleNamespace(secs=0, nsecs=0))
    made = SimpleNamespace(
        encoding=encoding, height=values.shape[0], width=values.shape[1], step=step, data=data, is_bigendian=int(big),
        header=header,
    )  # fmt: skip
    vars(made).update(changes)
    return made


@pytest.mark.parametrize("padding", [0, 3])
@pytest.mark.parametrize("big", [False, True])
def test_values_are_the_same_however_they_are_sent(padding: int, big: bool) -> None:
    metres = RNG.uniform(0, 10, (4, 5)).astype(np.float32)
    millimetres, colours = RNG.integers(0, 9999, (4, 5)).astype(np.uint16), RNG.integers(0, 255, (4, 5, 3), np.uint8)
    grey = RNG.integers(0, 255, (4, 5), np.uint8)
    for encoding, sees, sent, wanted in (
        ("32FC1", "depth", metres, metres), ("16UC1", "range", millimetres, millimetres),
        ("rgb8", "rgb", colours, colours), ("bgr8", "rgb", colours[..., ::-1], colours),
        ("mono8", "mask", grey, grey),
    ):  # fmt: skip
        values, shape, kind = values_of(message(encoding, sent, padding, big), sees)
        np.testing.assert_array_equal(np.frombuffer(values, np.dtype(kind).newbyteorder("<")).reshape(shape), wanted)


def test_what_is_no_image_of_the_policy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    grey = np.zeros((4, 6), np.uint8)
    for encoding, sees, said in (
        ("mono8", "depth", "encoding is 'mono8'; accepted: 32FC1, 16UC1 for a policy that sees depth"),
        ("rgba8", "rgb", "encoding is 'rgba8'; accepted: rgb8, bgr8 for a policy that sees rgb"),
        ("rgb8", "normal", "encoding is 'rgb8'; accepted: none for a policy that sees normal"),
    ):
        with pytest.raises(ValueError, match=said):
            values_of(message(encoding, grey), sees)
    for changes in ({"data": b"123"}, {"step": 5}, {"height": 5}):
        with pytest.raises(BrokenImage, match=r"an image of \d rows of \d bytes, 6 pixels in each, has \d+ bytes"):
            values_of(message("mono8", grey, **changes), "mask")
    heard = Heard()
    monkeypatch.syspath_prepend(SCRIPTS)
    receiver = Receiver(heard, "/front/image_raw", "it")
    receiver.image(message("16UC1", np.zeros((4, 6), np.uint16), data=b""))
    receiver.image(message("16UC1", np.zeros((4, 6), np.uint16)))  # whole, but where it looks is not known
    receiver.camera(SimpleNamespace(K=[0.0] * 9, P=[0.0] * 12, width=6, height=4))
    assert [line[0] for line in heard.lines] == ["problem", "problem", "waiting", "failed"]
    assert "stamps of /front/image_raw are zero: the times of arrival are taken" in heard.lines[0][1]
    assert heard.lines[1][1] == "/front/image_raw: an image of 4 rows of 12 bytes, 6 pixels in each, has 0 bytes"
    assert heard.lines[2][1].startswith("no CameraInfo came on /front/camera_info; publish it, or give ?fov=")
    assert heard.lines[3][1].startswith("/front/camera_info: CameraInfo has the focal lengths 0 and 0 and the size 6 x")


def test_the_field_of_view_is_that_of_a_pinhole() -> None:
    """The direction of the outermost edges, by projecting them back."""
    info = SimpleNamespace(
        k=[50.0, 0, 48, 0, 60.0, 24, 0, 0, 1], p=[40.0, 0, 48, 0, 0, 30.0, 24, 0, 0, 0, 1, 0], width=96, height=48
    )
    for rectified, focal in ((False, (50, 60)), (True, (40, 30))):
        across, down = field_of_view(info, rectified)
        assert focal[0] * math.tan(across / 2) == pytest.approx(48)
        assert focal[1] * math.tan(down / 2) == pytest.approx(24)
    assert beside("/camera/depth/image_rect_raw") == "/camera/depth/camera_info"
    assert beside("/image") == "/camera_info"


def test_a_stamp_is_when_it_was_exposed_and_a_jump_is_not_hidden() -> None:
    heard = Heard()
    stamps = Stamps(heard, "/front")
    assert time.monotonic() - stamps.moment(time.time() - 0.3) == pytest.approx(0.3, abs=0.05)
    assert time.monotonic() - stamps.moment(time.time() - 50.0) == pytest.approx(50.0, abs=0.05)
    assert heard.lines == []
    for stamp in (0.0, time.time() - 2 * OTHER_CLOCK_S, time.time() + 2 * OTHER_CLOCK_S):
        other = Stamps(heard, "/front")
        assert time.monotonic() - other.moment(stamp) == pytest.approx(0.0, abs=0.05)
        assert time.monotonic() - other.moment(time.time() - 1.0) == pytest.approx(0.0, abs=0.05)
    assert len(heard.lines) == 3
