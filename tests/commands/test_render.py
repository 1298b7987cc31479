"""`e2efly render`: its files, its flight, its errors."""

import math
import shutil
import typing
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from PIL import Image

from e2efly.commands.cli import run
from e2efly.commands.render import Render
from e2efly.environment import random_key
from e2efly.simulation.scenes.camera import PRESETS
from e2efly.viewing import video
from e2efly.viewing.image_plots import look_around, sized
from e2efly.viewing.places import find_place
from e2efly.viewing.tour import Tour, attitudes, plan

SCENE = """
[[solids]]
kind = "box"
centre = [3.0, 0.0, 1.0]
size = [0.3, 0.8, 1.0]
"""
FILES = ("rgb", "depth", "range", "label", "instance", "normal", "lidar", "sheet")


@pytest.mark.whole
def test_it_writes_pictures_and_a_video(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "one.toml").write_text(SCENE)
    (tmp_path / "way.csv").write_text("t,x,y,z\n0,0,0,1\n0.2,0.2,0.1,1\n0.4,0.5,0.1,1\n")
    size = ["--width", "32", "--height", "16", "--seed", "1", "--position", "0", "0", "1", "--yaw", "0"]
    flight = ["--flight", str(tmp_path / "way.csv"), "--out", str(tmp_path / "out")]
    assert run(["render", str(tmp_path / "one.toml"), *size, *flight]) == 0
    for name in FILES:
        with Image.open(tmp_path / "out" / f"{name}.png") as picture:
            assert picture.width == 1200
    with Image.open(tmp_path / "out" / "flight.gif") as film:
        assert film.n_frames == 8
        assert film.size[0] >= 3 * 256
    assert str(tmp_path / "out" / "flight.gif") in capsys.readouterr().out.replace("\n", "")


def test_what_help_says_of_cameras_is_what_there_is() -> None:
    assert set(typing.get_args(typing.get_type_hints(Render)["camera"])) == set(PRESETS)


def test_pixels_are_square_unless_asked_otherwise() -> None:
    camera = sized(PRESETS["d435i"], 640, None, None)
    assert camera.width == 640
    assert camera.height == pytest.approx(640 * math.tan(math.radians(29)) / math.tan(math.radians(43.5)), abs=8)
    assert (sized(PRESETS["fpv"], 640, 80, 48).width, sized(PRESETS["fpv"], 640, 80, 48).height) == (80, 48)
    assert sized(PRESETS["lidar"], 640, None, None) == PRESETS["lidar"]


def test_a_flight_goes_around_what_stands_in_its_way(tmp_path: Path) -> None:
    (tmp_path / "one.toml").write_text(SCENE)
    place = find_place(str(tmp_path / "one.toml"), random_key(0))
    tour = plan(place.clearance, np.array([[0.0, 0.0, 1.2], [6.0, 0.0, 1.2]]), np.zeros(1, bool), 0.05)
    gap = np.asarray(place.clearance(jnp.asarray(tour.position, jnp.float32)))
    assert gap.min() > 0.4
    np.testing.assert_allclose(tour.position[[0, -1]], [[0, 0, 1.2], [6, 0, 1.2]], atol=0.1)
    assert np.linalg.norm(np.diff(tour.position, axis=0), axis=1).max() < 6.0 * 0.05


def test_a_race_s_flight_passes_its_gates_in_order() -> None:
    place = find_place("s_shaped", random_key(0))
    tour = plan(place.clearance, place.route, place.straight, 0.05)
    gates = np.asarray(place.scene.solids["gate"].centre[0])
    nearest = np.linalg.norm(tour.position[:, None] - gates, axis=2)
    assert nearest.min(axis=0).max() < 0.2
    assert list(nearest.argmin(axis=0)) == sorted(nearest.argmin(axis=0))


def test_a_vehicle_leans_into_its_acceleration_and_looks_along_its_way() -> None:
    angle = np.linspace(0, 2, 201)
    circle = 4.0 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])  # in 2 s: 1 rad/s, 4 m/s, 4 m/s^2
    tour = Tour.of(circle, 0.01)
    w, x, y, z = tour.quaternion[100]
    up = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    wanted = np.array([-4 * np.cos(angle[100]), -4 * np.sin(angle[100]), 9.81])
    np.testing.assert_allclose(up, wanted / np.linalg.norm(wanted), atol=3e-3)  # it is smoothed over 0.1 s
    heading = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    assert heading == pytest.approx(angle[100] + np.pi / 2, abs=1e-3)
    still = attitudes(np.zeros((20, 3)), 0.05)
    np.testing.assert_allclose(still, np.tile([1.0, 0, 0, 0], (20, 1)), atol=1e-9)


def test_ffmpeg_gets_every_frame(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text(f'#!/bin/sh\nfor last; do true; done\n{shutil.which("cat")} > "$last"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    film = [np.full((10, 12, 3), 50 * i, np.uint8) for i in range(5)]
    gif, mp4 = video.write_video(film, tmp_path / "flight", 0.05)
    assert mp4.read_bytes() == b"".join(frame.tobytes() for frame in film)
    with Image.open(gif) as pages:
        assert pages.n_frames == 5
        assert pages.info["duration"] == 50
    program.write_text("#!/bin/sh\necho no codec >&2\nexit 1\n")
    with pytest.raises(OSError, match="no codec"):
        video.write_video(film, tmp_path / "flight", 0.05)


@pytest.mark.whole
def test_a_world_of_triangles_is_a_place_with_a_way_through_it() -> None:
    place = find_place("garage", random_key(0))
    tour = plan(place.clearance, place.route, place.straight, 0.05)
    assert np.asarray(place.clearance(jnp.asarray(tour.position, jnp.float32))).min() > 0.25
    seen = look_around(sized(PRESETS["d435i"], 32, None, 16), place.scene, 0.0, tour.position[9], tour.quaternion[9])
    assert seen.images["depth"].shape == (16, 32)
    assert 0.3 < seen.images["depth"].max() <= 10.0
