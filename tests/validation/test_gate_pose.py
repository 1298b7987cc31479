"""Poses from gates on plants: the rendered camera, and whole races by it."""

import dataclasses
import math

import numpy as np
import pytest

from e2efly import validate
from e2efly.courses.gates import Gates
from e2efly.courses.tracks import load_track
from e2efly.simulation.scenes import camera
from e2efly.simulation.scenes.course import frames
from e2efly.simulation.scenes.scene import Scene
from e2efly.validation.gate_pose import RACER, GateCamera, GateEyes
from e2efly.validation.plant import RigidState

TRACK = load_track("four_gates")
EXACT = dataclasses.replace(RACER, angle_spread=0.0, latency=(0.05, 0.05))
FACING = RigidState(
    TRACK.start, np.zeros(3), np.array([math.cos(math.pi / 8), 0, 0, math.sin(math.pi / 8)]), np.zeros(3)
)


def eyes(readout: float) -> GateEyes:
    return GateEyes.of(GateCamera(EXACT, readout=readout, survey=0.0, lost=0.0), TRACK, 0)


def image_of(state: RigidState, readout: float) -> np.ndarray:
    one = eyes(readout)
    one._past.append((0.0, state))
    return one._image(0.0)


def test_a_vehicle_that_stands_is_seen_as_by_a_camera_without_a_rolling_shutter() -> None:
    whole = camera.look(
        EXACT, Scene.of({"gate": frames(Gates.of(TRACK), 1)}, 1), camera.mount(EXACT, 1),
        FACING.position[None].astype(np.float32), FACING.quaternion[None].astype(np.float32),
    )  # fmt: skip
    assert image_of(FACING, 0.016).sum() > 100
    assert np.mean(image_of(FACING, 0.016) != np.asarray(whole)[0]) < 2e-5  # rounding at edges


def test_a_rolling_shutter_shears_what_a_turning_vehicle_sees() -> None:
    """At 3 rad/s the lower end of a gate is seen later than the upper one, and thus further to the right."""
    turning = dataclasses.replace(FACING, body_rate=np.array([0.0, 0.0, 3.0]))
    sheared, upright = image_of(turning, 0.016), image_of(turning, 0.0)
    rows = [r for r in range(290, 360) if sheared[r].any() and upright[r].any()]
    moved = [np.flatnonzero(sheared[r])[-1] - np.flatnonzero(upright[r])[-1] for r in rows]
    expected = [3.0 * 0.016 * (r / 360 - 0.5) * 320 for r in rows]  # radians to pixels
    assert np.ptp(rows) > 60
    assert np.corrcoef(moved, expected)[0, 1] > 0.7
    np.testing.assert_allclose(np.mean(moved), np.mean(expected), atol=1.2)


def test_images_come_as_old_as_they_are_and_are_stamped_with_what_is_believed() -> None:
    one, came = eyes(0.0), []
    for k in range(100):
        came += [(0.004 * k, stamp) for stamp, _ in one.see(0.004 * k, FACING)]
    assert len(came) == pytest.approx(0.35 * 30, abs=1)
    first, stamp = came[0]
    assert first == pytest.approx(0.052, abs=0.003)
    assert stamp == pytest.approx(0.0, abs=0.003)


def test_a_race_is_flown_by_gates_alone_on_another_physics() -> None:
    found = validate("race", "mujoco", 3, pose="gates")
    (race,) = found.criteria.values()
    assert race.flown.success.all()
    assert race.pose_error is not None
    rms, largest = race.pose_error
    assert 0.01 < rms < 0.12
    assert largest < 0.5
    assert any("the gates told where the vehicle was to" in note for note in found.notes())
    assert found.as_json()["criteria"]["race"]["mujoco"]["pose_error_m"] == {"rms": rms, "largest": largest}


def test_a_task_without_gates_is_refused() -> None:
    with pytest.raises(ValueError, match="--pose is 'gates' and the task HoverGoal; accepted: a task whose gates"):
        validate("hover", "simulator", 1, pose="gates")
