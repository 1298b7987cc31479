"""Recorded flights in the viewer, and films."""

import json
import socket
import time
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import label

from e2efly.commands.cli import run
from e2efly.flight.pose.sources import open_source
from e2efly.simulation.scenes.faces import box
from e2efly.validation.processes import free_port
from e2efly.vehicles.loading import load_vehicle
from e2efly.viewing.watch.film import Soup, beside, film, picture, snapshot
from e2efly.viewing.watch.poses import Poses
from e2efly.viewing.watch.recorded import PERIOD, Recording, read_flight
from e2efly.viewing.watch.stage import Stage, StageFrame
from e2efly.viewing.watch.triangles import SKY, mesh_of


def log(path: Path, seconds: float = 2.0, speed: float = 1.0) -> Path:
    """A level flight along x at a height of 1 m, at 100 Hz."""
    t = np.arange(0.0, seconds, 0.01)
    columns = [t, speed * t, 0 * t, 0 * t + 1, 0 * t + 1, 0 * t, 0 * t, 0 * t, 0 * t + 0.2, 0 * t, 0 * t]
    np.savetxt(path, np.stack(columns, 1), "%.6f", ",", header="t,px,py,pz,qw,qx,qy,qz,wx,wy,wz", comments="")
    return path


def test_a_log_is_flown_at_its_own_pace(tmp_path: Path) -> None:
    flight = read_flight(log(tmp_path / "a.csv", speed=2.0), load_vehicle("vis_r"))
    source = Recording([flight], load_vehicle("vis_r"))
    frames = [source.step(0) for _ in range(source.length)]
    assert np.isclose(frames[30].position[0, 0] - frames[0].position[0, 0], 2.0 * 30 * PERIOD, atol=1e-3)
    assert np.allclose(frames[30].velocity[0], [2.0, 0, 0], atol=1e-2)
    assert np.isclose(frames[30].series["roll rate (rad/s)"][1], 0.2)
    assert [frame.fresh for frame in frames[:2]] == [True, False]
    assert source.step(0).fresh  # over and over


def test_a_shorter_flight_waits_where_it_ended(tmp_path: Path) -> None:
    vehicle = load_vehicle("vis_r")
    flights = [read_flight(log(tmp_path / f"{i}.csv", seconds), vehicle) for i, seconds in enumerate((2.0, 1.0))]
    source = Recording(flights, vehicle)
    last = [source.step(0) for _ in range(source.length)][-1]
    assert last.position[0, 0] > 1.9
    assert np.isclose(last.position[1, 0], flights[1].position[-1, 0])


def test_a_log_without_poses_is_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "rates.csv"
    t = np.arange(0.0, 1.0, 0.01)
    np.savetxt(path, np.stack([t, t, t, t], 1), "%.6f", ",", header="t,wx,wy,wz", comments="")
    with pytest.raises(ValueError, match=r"rates.csv: has no poses \(body_rate\); accepted: a log with position"):
        read_flight(path, load_vehicle("vis_r"))


def test_a_picture_shows_what_stands_before_the_eye() -> None:
    red = Soup.of([mesh_of(box([0.5, 0.5, 0.5]) + np.array([5.0, 0, 1.0]), (1.0, 0.0, 0.0))])
    seen = picture(red, np.array([0.0, 0.0, 1.0]), np.array([5.0, 0.0, 1.0]), True, (90, 160))
    red_there = (seen[..., 0] > 2.0 * seen[..., 1]) & (seen[..., 0] > 80)
    rows, columns = np.nonzero(red_there)
    assert abs(rows.mean() - 44.5) < 2
    assert abs(columns.mean() - 79.5) < 2
    assert seen[5].mean() != pytest.approx(seen[85].mean(), abs=3)  # sky and ground


def test_lines_on_the_ground_make_no_pattern_far_away() -> None:
    seen = picture(Soup.of([]), np.array([0.1, 0.2, 1.0]), np.array([5.0, 1.3, 1.0]), True).astype(float)
    away = seen[190:205].std(axis=(0, 1)).max()  # just under the horizon: lines are narrower than pixels
    assert away < 2.5
    assert seen[300:].std(axis=(0, 1)).max() > 2 * away  # lines close by are to be seen


@pytest.mark.parametrize("name", ["vis_r", "crazyflie"])
def test_the_vehicle_is_large_and_its_goal_does_not_cover_it(name: str) -> None:
    here, level = np.array([[1.0, 2.0, 1.5]]), np.array([[1.0, 0.0, 0.0, 0.0]])
    stage = Stage(load_vehicle(name), ground=False)

    def seen(*goal: np.ndarray) -> np.ndarray:
        return snapshot(stage, StageFrame(0.0, here, level, np.zeros((1, 3)), np.zeros((1, 4)), *goal)).astype(int)

    alone, there = seen(), seen(here)
    vehicle = (alone != alone[0, 0]).any(axis=2)
    assert np.ptp(np.nonzero(vehicle)[1]) > 640 / 8
    assert (alone[vehicle] == there[vehicle]).all(axis=1).mean() > 0.95
    assert (alone != there).any()


def test_a_picture_shows_every_vehicle_of_a_world_wherever_they_are() -> None:
    here = np.array([[0, 0, 2.0], [-6.0, 1.0, 3.0], [4.0, 9.0, 2.0], [0.5, -3.0, 0.4]])
    level, still = np.tile([1.0, 0.0, 0.0, 0.0], (4, 1)), np.zeros((4, 3))

    def seen(together: int) -> int:
        frame = StageFrame(0.0, here, level, still, np.zeros((4, 4)), together=together)
        shot = snapshot(Stage(load_vehicle("vis_r"), ground=False), frame)
        return int(label((shot != shot[0, 0]).any(axis=2), np.ones((3, 3)))[1])

    assert seen(4) == 4
    assert seen(1) < 4  # a camera close to the first does not see who is behind it


def test_a_film_of_a_log_is_written(tmp_path: Path) -> None:
    out = tmp_path / "flight.webm"
    assert run(["watch", str(log(tmp_path / "a.csv", 0.5)), "--video", str(out)]) == 0
    import cv2

    reader = cv2.VideoCapture(str(out))
    count = 0
    while reader.read()[0]:
        count += 1
    assert 10 <= count <= 15


def test_ghosts_are_flown_with_the_first(tmp_path: Path) -> None:
    vehicle = load_vehicle("vis_r")
    flights = [read_flight(log(tmp_path / f"{i}.csv", speed=1.0 + i), vehicle) for i in range(2)]
    pictures = list(film(Recording(flights, vehicle), 0.3, 10.0, size=(45, 80)))
    assert len(pictures) == 3
    frame: StageFrame = Recording(flights, vehicle).step(0)
    assert frame.position.shape == (2, 3)


def test_a_pose_source_is_watched_until_it_is_lost() -> None:
    port = free_port()
    shown, source = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), open_source(f"udp:{port}")
    with shown:
        poses = Poses(source, load_vehicle("vis_r"))
        assert "no good pose" in poses.step(0).note
        for i in range(40):
            pose = {"stamp": 0.01 * i, "position": [0.02 * i, 0.0, 1.0 + 1e-6 * i], "quaternion": [1.0, 0.0, 0.0, 0.0]}
            shown.sendto(json.dumps(pose).encode(), ("127.0.0.1", port))
            time.sleep(0.01)
            frame = poses.step(0)
        assert np.allclose(frame.position[0], [0.78, 0.0, 1.0], atol=0.05)
        assert frame.rotor_speed.all()
        time.sleep(0.4)
        lost = poses.step(0)
    source.close()
    assert "no good pose" in lost.note
    assert not lost.rotor_speed.any()
    assert np.allclose(lost.position, frame.position)


def test_what_cameras_see_stands_beside_a_picture() -> None:
    seen = np.zeros((90, 160, 3), np.uint8)
    assert beside(seen, {}) is seen
    near, red = np.ones((4, 8), np.float32), np.zeros((8, 8, 3), np.float32)
    red[..., 0] = 1.0
    film = beside(seen, {"depth 0": near, "rgb 1": red})
    assert film.shape == (90, 240, 3)
    assert not film[:, :160].any()
    assert (film[22, 200] == 255).all()  # in the middle of the upper half
    assert (film[67, 200] == [255, 0, 0]).all()
    assert (film[1, 200] == np.rint(255 * np.array(SKY))).all()  # what is left over
