"""What a vehicle on a plant sees is what the environment shows at the same pose, and policies fly by it."""

import dataclasses
from functools import partial
from typing import Any

import jax
import numpy as np
import pytest

import e2efly
from e2efly.config import CameraConfig, ForestConfig
from e2efly.environment import Env
from e2efly.environment.stress_rows import ALL, ROWS
from e2efly.simulation.scenes.scene import Scene
from e2efly.tasks.avoid_together import AvoidTogetherConfig
from e2efly.validation.candidate import candidate
from e2efly.validation.evaluation import SEED
from e2efly.validation.plant import RigidState
from e2efly.validation.plant_sight import PlantWatch, Sight
from e2efly.validation.plant_stress import stress
from e2efly.validation.starts import Starts, draw_starts
from e2efly.validation.stress import draws
from e2efly.vehicles.loading import load_vehicle

STEPS = 12


def flown(env: Env, actions: np.ndarray) -> tuple[list[RigidState], list[list[np.ndarray]], Any]:
    """States of one vehicle, and what the environment showed it at each."""
    state, _ = jax.jit(Env.reset, static_argnums=2)(env, jax.random.key(3), 1)
    step = jax.jit(partial(Env.step, restart=False))
    first, states, shown = state, [], []
    for action in actions:
        v = state.vehicle
        rows = [np.asarray(x, np.float64)[0] for x in (v.position, v.velocity, v.quaternion, v.body_rate)]
        states.append(RigidState(*rows))
        shown.append([np.asarray(image)[0] for image in state.images])
        state, _ = step(env, state, action[None])
    return states, shown, first


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(
    ("task", "camera"),
    [
        ("land_visual", {}),
        ("avoid", {"latency": (0.05, 0.05)}),
        ("race_clutter", {"rate": 15.0, "latency": (0.0, 0.06), "fov_spread": 0.05, "angle_spread": 0.1}),
    ],
)
def test_images_are_those_of_the_environment_at_the_same_pose(task: str, camera: dict[str, Any]) -> None:
    """To rounding: the age of the images, their rate and how the camera sits included."""
    config = candidate(task)
    cameras = tuple(dataclasses.replace(c, **camera) for c in config.env.cameras)
    env = Env.of(config.task, e2efly.preset(task).reward, dataclasses.replace(config.env, cameras=cameras))
    rng = np.random.default_rng(0)
    states, shown, first = flown(env, np.clip(np.asarray(env.hover) + 0.2 * rng.standard_normal((STEPS, 4)), -1, 1))
    starts = Starts((states[0],), (), first.memory, first.eyes)
    (sight,) = starts.sights(env, 0)
    assert sight is not None
    watch = sight.begin()
    for k in range(STEPS):
        for ours, theirs in zip(watch.images(k, states[: k + 1]), shown[k], strict=True):
            np.testing.assert_allclose(ours, theirs, rtol=1e-5, atol=1e-5, err_msg=f"step {k}")
    assert any((a[0] != b[0]).any() for a, b in zip(shown, shown[2:], strict=False))  # it did see something move


def test_cameras_see_the_others_as_in_the_environment_and_never_their_own_vehicle() -> None:
    """Where the others were when the camera looked. They are the only things in this world."""
    forest = ForestConfig(density=0.0)
    config = dataclasses.replace(e2efly.preset("avoid_together"), task=AvoidTogetherConfig(agents=3, forest=forest))
    clear = {"latency": (0.05, 0.05), "fov": (2.6, 2.0), "noise_share": 0.0}
    cameras = tuple(dataclasses.replace(c, **clear) for c in config.env.cameras)
    env = Env.of(config.task, config.reward, dataclasses.replace(config.env, cameras=cameras))
    first, _ = jax.jit(Env.reset, static_argnums=2)(env, jax.random.key(3), 3)
    step, state, seen = jax.jit(partial(Env.step, restart=False)), first, []
    history: list[list[RigidState]] = [[] for _ in range(3)]
    rng, tilt = np.random.default_rng(0), np.array([[0.1, 0, 0.1, 0], [0.0, 0, -0.1, 0], [-0.2, 0, 0.0, 0]])
    watches = [sight.begin() for sight in Starts(((),) * 3, (), first.memory, first.eyes).sights(env, 0) if sight]
    for k in range(STEPS):
        v = state.vehicle
        rows = [np.asarray(x, np.float64) for x in (v.position, v.velocity, v.quaternion, v.body_rate)]
        for i in range(3):
            history[i].append(RigidState(*(x[i] for x in rows)))
        now = [one[-1] for one in history]
        for i, watch in enumerate(watches):
            (ours,) = watch.images(k, history[i], now[:i] + now[i + 1 :])
            np.testing.assert_allclose(ours, np.asarray(state.images[0])[i], rtol=1e-4, atol=1e-4, err_msg=f"step {k}")
            gone = [dataclasses.replace(one, position=one.position + 1e3) for one in now[1:]]
            (empty,) = watch.sight.begin().images(0, [history[i][-1]], gone)
            seen.append(int((empty != ours).sum()) if k == 0 else 0)
        with_noise = np.asarray(env.hover) + tilt + 0.1 * rng.standard_normal((3, 4))
        state, _ = step(env, state, np.clip(with_noise, -1, 1).astype(np.float32))
    assert sum(seen) > 0  # at the start two stand beside each other
    with pytest.raises(ValueError, match=r"1 other vehicles; accepted: 2, as in the scene"):
        watches[0].images(STEPS, history[0], now[:1])


@pytest.mark.whole
@pytest.mark.parametrize("plant", ["simulator", "mujoco"])
def test_a_policy_flies_by_what_the_plant_sees(plant: str) -> None:
    found = e2efly.validate("land_visual", plant, 8)
    assert found.criteria["land_visual"].flown.success.all()


@pytest.mark.whole
def test_a_policy_that_is_shown_nothing_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(self: PlantWatch, k: int, states: Any, rest: Any) -> list[np.ndarray]:
        del k, states, rest
        return [np.full((c.height, c.width), 0.0, np.float32) for c in self.sight.cameras]

    monkeypatch.setattr(PlantWatch, "images", nothing)
    found = e2efly.validate("land_visual", "simulator", 4)
    assert not found.criteria["land_visual"].flown.success.any()


@pytest.mark.whole
def test_rows_of_cameras_change_what_the_plant_sees() -> None:
    found = candidate("avoid")
    suite = found.task.criteria()["avoid_5"]
    env = found.environment(suite)
    starts, vehicle = draw_starts(env, 3, SEED), load_vehicle("vis_r")

    def seen(row: str, at: int = 0) -> np.ndarray:
        sight = starts.sights(env, 0, draws(ROWS[row], vehicle, vehicle.latency, SEED, 3).camera)[at]
        assert sight is not None
        moved = dataclasses.replace(starts.states[at], position=starts.states[at].position + np.array([2.0, 0, 0]))
        watch = sight.begin()
        watch.images(0, [starts.states[at]])
        return watch.images(1, [starts.states[at], moved])[0].copy()

    nominal = seen("nominal")
    for row in ("camera 3 degrees and 1 cm off", "field of view x0.97", "images 40 ms older", "images half as often"):
        assert (seen(row) != nominal).mean() > 0.1, row
    noisy = seen("noise of a D435i")
    assert (noisy != nominal).mean() > 0.1
    near = (nominal < 5) & (noisy > 0)  # far things become holes
    assert near.mean() > 0.05 and np.median(np.abs(noisy - nominal)[near]) < 0.2
    report = stress("avoid", "simulator", 1, rows=("images 40 ms older", "nominal"))
    assert set(report.flown) == {"images 40 ms older", "nominal"}
    assert ALL not in report.left_out


def test_a_sight_is_small_and_travels() -> None:
    """A flight is handed to another process with the world that it sees."""
    import pickle

    found = candidate("race_clutter")
    env = found.environment(next(iter(found.task.criteria().values())))
    sight = draw_starts(env, 2, SEED).sights(env, SEED)[1]
    assert isinstance(sight, Sight)
    packed = pickle.dumps(sight)
    assert len(packed) < 50_000
    again = pickle.loads(packed)
    assert isinstance(again.scene, Scene)
    assert isinstance(again.cameras[0], CameraConfig)
    assert all(isinstance(leaf, np.ndarray) for leaf in jax.tree.leaves((again.scene, again.eyes)))
