"""Hardware in the loop: poses of a room in, images of a world out, by a process of its own."""

import json
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import jax
import numpy as np
import pytest

from e2efly.commands.cli import run
from e2efly.commands.hil import parse
from e2efly.courses.origin import Origin
from e2efly.flight.sight.shared import SharedCamera, place
from e2efly.policy.odometry import Odometry
from e2efly.validation.candidate import candidate
from e2efly.validation.plant import RigidState
from e2efly.validation.plant_sight import rendered
from e2efly.validation.processes import flags
from e2efly.validation.scenery import Scenery
from e2efly.validation.virtual_world import ahead
from tests.waiting import free_port

NAME = "e2efly_test_hil"
ORIGIN = Origin((1.0, -2.0, 0.5), 0.4)


@contextmanager
def running(command: list[str]) -> Iterator[subprocess.Popen[str]]:
    """A program that ends with the block, however that ends."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as node:
        try:
            yield node
        finally:
            node.kill()


@pytest.mark.whole
def test_images_are_those_of_the_environment_at_the_pose_and_stop_with_the_poses() -> None:
    found, port = candidate("avoid"), free_port(udp=True)
    scenery = Scenery.draw(found.environment(next(iter(found.task.criteria().values()))), 7)
    assert scenery is not None
    place(NAME).unlink(missing_ok=True)
    asked = f"-m e2efly hil avoid --pose udp:{port} --image image_0=shm:{NAME} --seed 7"
    command = [sys.executable, *asked.split(), *["--origin", "1", "-2", "0.5", "--origin-yaw", "0.4", "--rate", "60"]]
    camera_of = found.policy.contract.images[0]
    inside = ORIGIN.points(np.array([0.5, 0.2, 1.5]))  # of the world, seen in the room
    half = 0.2
    pose = {"position": inside.tolist(), "quaternion": [np.cos(half), 0, 0, np.sin(half)], "velocity": [0, 0, 0]}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender, running(command) as node:
        assert node.stdout is not None
        said = node.stdout.readline() + node.stdout.readline() + node.stdout.readline()
        assert "60 Hz, poses from" in said

        def send(seconds: float, still: bool) -> list[tuple[float, np.ndarray]]:
            """Poses for so long; the images that come."""
            frames, end, k = [], time.monotonic() + seconds, 0
            while (now := time.monotonic()) < end:
                shake = 0.0 if still else 1e-6 * (k % 2)
                moved = dict(pose, position=(inside + shake).tolist(), body_rate=[0, 0, 0], stamp=now)
                sender.sendto(json.dumps(moved).encode(), ("127.0.0.1", port))
                frames += [(frame.time, frame.image) for frame in camera.read(now)]
                k += 1
                time.sleep(0.01)
            return frames

        camera = SharedCamera(NAME, camera_of)
        frames = send(2.0, still=False)
        times = np.array([at for at, _ in frames])
        assert 5 <= len(times) <= 2.0 * 60 + 2  # how many, a busy machine decides
        assert np.all(np.diff(times) > 0)
        local = RigidState(np.array([0.5, 0.2, 1.5]), np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(3))
        young = replace(scenery.eyes[0], latency=0 * scenery.eyes[0].latency)
        wanted = rendered(scenery.cameras[0], young, scenery.scene, [local], 0.0, 1.0, jax.random.key(0))
        shown = np.median([image for _, image in frames], axis=0)
        np.testing.assert_allclose(shown, wanted, atol=1e-3)
        # without poses there is nothing to see, and nothing is repeated
        time.sleep(0.3)
        camera.read(0.0)
        time.sleep(0.3)
        assert camera.read(0.0) == []
    place(NAME).unlink(missing_ok=True)


def test_a_pose_is_told_ahead_and_never_far() -> None:
    flies = Odometry(1.0, np.zeros(3), np.array([2.0, 0, 0]), np.array([1.0, 0, 0, 0]), np.array([0, 0, 1.0]))
    soon, late = ahead(flies, 1.05), ahead(flies, 9.0)
    np.testing.assert_allclose(soon.position, [0.1, 0, 0])
    np.testing.assert_allclose(2 * np.arctan2(soon.quaternion[3], soon.quaternion[0]), 0.05, atol=1e-4)
    np.testing.assert_allclose(late.position, [0.2, 0, 0])


def test_the_world_is_laid_into_the_room_by_measured_points() -> None:
    rng = np.random.default_rng(0)
    world = np.array([[0.0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 1.0]])
    room = ORIGIN.points(world) + 0.002 * rng.standard_normal(world.shape)
    found = Origin.fitted(room, world)
    np.testing.assert_allclose(found.position, ORIGIN.position, atol=0.01)
    assert abs(found.yaw - ORIGIN.yaw) < 0.005
    for points, said in ((slice(0, 2), "three or more pairs"), ([0, 1, 1], "lie on a line seen from above")):
        with pytest.raises(ValueError, match=said):
            Origin.fitted(room[points], world[points])
    with pytest.raises(ValueError, match=r"points are .* cm off after the fit; accepted: at most 2 cm"):
        Origin.fitted(room, 1.05 * world)
    with pytest.raises(ValueError, match="points are not finite"):
        Origin.fitted(room * np.nan, world)


def test_what_cannot_be_rendered_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    points = tmp_path / "points.csv"
    points.write_text("1,2,3\n")
    for given, said in (
        (["hover"], "policy hover sees nothing; accepted: a policy with images"),
        (["avoid"], "--image lacks image_0; accepted: --image image_0=URI, with URI shm:NAME, tcp:PORT"),
        (["avoid", "--image", "front=shm:x"], "--image is 'front=shm:x'; accepted: NAME=URI, NAME one of image"),
        (["avoid", "--image", "image_0=shm:x", "--image", "image_0=shm:y"], "--image is image_0=shm:y; accepted: one"),
        (["avoid", "--image", "image_0=udp:x"], "--image is image_0=udp:x; accepted: shm:NAME, tcp:PORT"),
        (["avoid", "--rate", "0"], "--rate is 0.0; accepted: 1 to 240 Hz"),
        (["avoid", "--seconds", "0"], "--seconds is 0.0; accepted: more than 0"),
        (["avoid", "--points", str(points)], "has rows of 3 numbers; accepted: six numbers, room_x,room_y"),
        (["avoid", "--points", "none.csv"], "none.csv"),
    ):
        assert run(["hil", *given]) == 2
        error = " ".join(capsys.readouterr().err.split())
        assert said in error, (given, error)


def test_the_world_is_the_task_s_with_options_of_it() -> None:
    asked = parse(["race_clutter", "--task.speed", "4", "5", "--image", "image_0=shm:x"])
    assert asked.task == {"speed": (4.0, 5.0)}
    assert flags("task", candidate("race_clutter", task=asked.task).task, candidate("race_clutter").task) == [
        "--task.speed", "4", "5",
    ]  # fmt: skip
    with pytest.raises(ValueError, match=r"hil begins with --task\.speed; accepted: the policy first"):
        parse(["--task.speed", "4", "5", "race_clutter"])
