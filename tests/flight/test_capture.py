"""Image sources whose driver is in a process of its own: OpenCV's reader of cameras and videos, and its process."""

import dataclasses
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
import pytest

import e2efly
from e2efly.flight.sight.captured import Captured
from e2efly.flight.sight.image_source import Frame
from e2efly.flight.sight.quality import SeenImages, see
from e2efly.flight.sight.shared import place
from e2efly.flight.sight.sources import open_image
from tests.waiting import running, until

DEPTH = e2efly.load_policy("avoid").contract.images[0]
COLOURS = dataclasses.replace(
    DEPTH, sees="rgb", encoding="none", height=24, width=32, fov_rad=(1.0, 0.8), pool=(24, 32), rate_hz=30.0
)
RATE = 20.0
SHOWN = ((220, 30, 30), (30, 200, 30), (30, 30, 210))
"""Red, green, blue, one after the other."""


def write_video(path: Path, seconds: float) -> str:
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), RATE, (128, 96))
    assert writer.isOpened()
    for k in range(round(seconds * RATE)):
        picture = np.full((96, 128, 3), 255 if k % 2 else 245, np.uint8)
        picture[:, :64] = SHOWN[k % 3][::-1]  # the left half; OpenCV writes BGR
        writer.write(picture)
    writer.release()
    return f"v4l2:{path}?fov=1.0x0.8"


def memories() -> list[Path]:
    return list(place("x").parent.glob(f"e2efly_capture-{os.getpid()}-*"))


def test_a_video_is_read_in_its_colours_at_its_rate_and_ends_like_an_unplugged_camera(tmp_path: Path) -> None:
    source = open_image(write_video(tmp_path / "video.mp4", 3.0), COLOURS)
    assert isinstance(source, Captured)
    assert source.describe().endswith(f"video.mp4, 96 rows, 128 columns (OpenCV {cv2.__version__})")
    frames: list[Frame] = []
    seen = SeenImages(COLOURS)
    until(lambda: bool(frames.extend(source.read(time.monotonic()))) or source.problem is not None)
    assert len(frames) > 10
    for frame in frames:
        assert frame.image.shape == (24, 32, 3)
        error = [np.abs(frame.image[:, :14].mean((0, 1)) - np.array(shown) / 255).max() for shown in SHOWN]
        assert min(error) < 0.03
        assert frame.image[:, 18:].min() > 0.9
    times = np.array([frame.time for frame in frames])
    np.testing.assert_allclose(np.diff(times) * RATE, np.round(np.diff(times) * RATE), atol=1e-3)
    assert times[-1] - times[0] < 3.0
    seen = see(seen, frames[-1:], frames[-1].time, trouble=source.problem)
    said = seen.problem(frames[-1].time + 1.0)
    assert said.startswith("image 'image_0': is 1000 ms old; accepted: at most")
    assert said.endswith("video.mp4: RuntimeError: " + str(tmp_path / "video.mp4") + " has ended)")
    source.close()
    source.close()
    assert memories() == []


def test_a_killed_process_is_named_and_leaves_nothing(tmp_path: Path) -> None:
    source = open_image(write_video(tmp_path / "video.mp4", 20.0), COLOURS)
    assert isinstance(source, Captured)
    until(lambda: bool(source.read(time.monotonic())))
    assert source.problem is None
    assert len(memories()) == 1
    os.kill(source._child.process.pid, signal.SIGKILL)
    until(lambda: source.read(time.monotonic()) == [] and source.problem is not None)
    until(lambda: "killed" in str(source.problem), 2.0)
    assert source.problem == f"v4l2:{tmp_path / 'video.mp4'}: its process has ended: killed by SIGKILL"
    assert source.read(time.monotonic()) == []
    source.close()
    assert source.read(time.monotonic()) == []
    assert memories() == []


def test_the_process_ends_with_the_bridge_however_that_ends(tmp_path: Path) -> None:
    program = (
        "import os, signal, sys, dataclasses; from tests.flight.test_capture import *\n"
        f"source = open_image({write_video(tmp_path / 'video.mp4', 20.0)!r}, COLOURS)\n"
        "print(source._child.process.pid, place(source._memory), flush=True)\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    root = Path(__file__).parents[2]
    done = subprocess.run([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True, cwd=root, timeout=60)
    pid, memory = done.stdout.split()
    until(lambda: not running(int(pid)))
    assert not Path(memory).exists()


def test_what_is_no_camera_of_the_policy_is_named(tmp_path: Path) -> None:
    video, broken = write_video(tmp_path / "video.mp4", 0.2), tmp_path / "broken.mp4"
    broken.write_bytes(b"no video")
    path = video.partition("?")[0]
    for text, image, said in (
        (video, DEPTH, "gives colours; accepted: a policy that sees rgb, not depth"),
        (path, COLOURS, r"video.mp4 has no field of view; accepted: v4l2:PATH\?fov=ACROSSxDOWN"),
        ("v4l2:", COLOURS, "has no path; accepted"),
        (f"{path}?fov=4x1", COLOURS, "option is 'fov=4x1'; accepted: fov=ACROSSxDOWN, each in rad, below pi"),
        (f"{path}?fov=nanx1", COLOURS, "option is 'fov=nanx1'"),
        (f"{path}?size=3", COLOURS, "option is 'size=3'; accepted: fov="),
        (f"{path}?fov=0.9x0.8", COLOURS, "sees 0.900 rad across; accepted: 1.000 rad or more"),
        (f"v4l2:{broken}?fov=policy", COLOURS, "broken.mp4 cannot be opened; accepted: a camera's /dev/videoN or the"),
        (f"v4l2:{tmp_path}/none.mp4?fov=policy", COLOURS, "none.mp4 cannot be opened; accepted"),
    ):
        with pytest.raises(ValueError, match=said):
            open_image(text, image)
    assert memories() == []
    narrow = math.radians(20)
    wide = open_image(f"{path}?fov=policy", dataclasses.replace(COLOURS, fov_rad=(narrow, narrow)))
    assert wide.read(time.monotonic())[0].image.shape == (24, 32, 3)
    wide.close()


def test_without_opencv_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from e2efly.flight.sight.sources import v4l2

    bare = tmp_path / "python"
    bare.write_text(f'#!/bin/sh\nexec {sys.executable} -S "$@"\n')
    bare.chmod(0o755)
    monkeypatch.delenv("PYTHONPATH", raising=False)
    monkeypatch.setattr(v4l2.sys, "executable", str(bare))
    with pytest.raises(ValueError, match=r"No module named 'cv2'; install the package OpenCV \(pip install \"e2efly"):
        open_image(write_video(tmp_path / "video.mp4", 0.2), COLOURS)
