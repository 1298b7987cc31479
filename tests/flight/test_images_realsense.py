"""RealSense cameras: the real library, with a camera of software in place of one that is plugged in."""

import dataclasses
import time
from pathlib import Path

import numpy as np
import pytest

from e2efly.flight.sight import captured
from e2efly.flight.sight.sources import open_image
from tests.flight.ros_images import CELL, COLOURS, DEPTH, MASK, first
from tests.waiting import until


@pytest.fixture(autouse=True)
def library() -> None:
    try:
        import pyrealsense2  # noqa: F401
    except ImportError as error:
        pytest.fail(
            f'{error}: needs pip install "e2efly[realsense]" and apt-get install libusb-1.0-0; or '
            "E2EFLY_WITHOUT=realsense to go without these tests"
        )


@pytest.fixture
def camera(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    monkeypatch.setattr(captured, "SCRIPT", str(Path(__file__).with_name("software_camera.py")))
    monkeypatch.setenv("SOFTWARE_CAMERA", "0.001 global_time")
    return monkeypatch


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("kind", ["0.001 global_time", "0.0001 system_time", "0.001 hardware_clock"])
def test_depth_comes_in_metres_with_its_time_until_it_is_unplugged(camera: pytest.MonkeyPatch, kind: str) -> None:
    camera.setenv("SOFTWARE_CAMERA", kind)
    source = open_image("realsense:", DEPTH)
    assert source.describe().startswith("realsense:, 48 rows, 96 columns (Software camera")
    frame = first(source)
    age = time.monotonic() - frame.time
    wanted = CELL.copy()
    wanted[0] = 0.0
    np.testing.assert_allclose(frame.image, np.tile(wanted, (12, 1)), atol=1e-4)
    if "hardware" in kind:  # its clock began 500 s after this one; the 20 ms cannot be known
        assert 0 <= age < 1.0
        assert "camera's own clock" in str(source.problem)
    else:
        assert 0.02 <= age < 1.0
        assert source.problem is None
    until(lambda: source.read(time.monotonic()) is None or "unplugged" in str(source.problem))
    assert source.problem == "realsense:: RuntimeError: the camera is unplugged"
    source.close()


def test_colours_are_red_green_blue(camera: pytest.MonkeyPatch) -> None:
    source = open_image("realsense:042", COLOURS)
    image = first(source).image
    source.close()
    np.testing.assert_allclose(255 * image[:, :16], np.tile([200, 30, 60], (12, 16, 1)), atol=0.01)
    np.testing.assert_allclose(255 * image[:, 16:], np.tile([10, 40, 250], (12, 16, 1)), atol=0.01)


def test_what_is_no_camera_of_the_policy_is_named(camera: pytest.MonkeyPatch) -> None:
    wide = dataclasses.replace(DEPTH, fov_rad=(2.5, 2.0))
    for text, image, said in (
        ("realsense:7", DEPTH, "no camera is '7'; there are: 042; accepted: realsense:SERIAL"),
        ("realsense:", MASK, "it gives depth and colours; accepted: a policy that sees depth or rgb, not mask"),
        ("realsense:", wide, "sees 1.752 rad across; accepted: 2.500 rad or more"),
    ):
        with pytest.raises(ValueError, match=said):
            open_image(text, image)


def test_without_a_camera_it_says_so() -> None:
    with pytest.raises(ValueError, match="realsense:: RuntimeError: no camera is chosen; there are: none"):
        open_image("realsense:", DEPTH)
