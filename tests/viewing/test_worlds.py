"""Solids in plots: where they stand, what they cover, and that flights are drawn among them."""

import dataclasses
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.spatial import ConvexHull

from e2efly.config import CameraConfig
from e2efly.simulation.scenes.faces import bodies
from e2efly.simulation.scenes.generate import room
from e2efly.simulation.scenes.scene import Scene, Solids, distances
from e2efly.tasks.hover import HoverConfig
from e2efly.viewing import plots
from e2efly.viewing.seen import plot_seen
from e2efly.viewing.style import START, figure
from e2efly.viewing.worlds import draw_plan, plot_flights_in_worlds
from tests.viewing.test_plots import STEPS, check_png, flights

SIZES = {
    "box": [0.5, 0.3, 0.2], "sphere": [0.6], "cylinder": [0.4, 1.0], "capsule": [0.3, 0.5],
    "gate": [0.5, 0.4, 0.1, 0.05], "pad": [0.5, 0.1, 0],
}  # fmt: skip
AREA = {
    "box": 4 * 0.5 * 0.3, "sphere": np.pi * 0.36, "cylinder": np.pi * 0.16, "capsule": np.pi * 0.09,
    "gate": 4 * 0.6 * 0.05, "pad": np.pi * 0.25,
}  # fmt: skip


def figures(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """The figures of worlds that are drawn from now on."""
    drawn: list[Figure] = []

    @contextmanager
    def kept(*args: Any, **kwargs: Any) -> Iterator[Figure]:
        with figure(*args, **kwargs) as fig:
            drawn.append(fig)
            yield fig

    monkeypatch.setattr("e2efly.viewing.worlds.figure", kept)
    return drawn


def one(kind: str) -> Scene:
    place = jnp.array([[[2.0, 1.0, 1.5], [9.0, 9.0, 9.0]]])
    solids = Solids.of(kind, place, SIZES[kind], yaw=0.7, active=jnp.array([[True, False]]))
    return Scene.of({kind: solids}, 1)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("kind", list(SIZES))
def test_what_is_drawn_lies_on_the_solid_and_covers_its_area(kind: str) -> None:
    scene = one(kind)
    (body,) = bodies(scene)
    points = body.quads.reshape(-1, 3)
    corners = points[np.linalg.norm(points[:, :2] - [2.0, 1.0], axis=1) > 1e-6]  # not the middles of ends
    solids = jax.tree.map(lambda x: jnp.repeat(x, len(corners), axis=0), scene.solids[kind])
    away = distances(kind, solids, jnp.asarray(corners, jnp.float32), jnp.zeros(len(corners)))[:, 0]
    np.testing.assert_allclose(away, 0.0, atol=1e-5)
    assert ConvexHull(body.outline).volume == pytest.approx(AREA[kind], rel=0.03)
    np.testing.assert_allclose(body.outline.mean(axis=0), [2.0, 1.0], atol=0.02)


def test_what_moves_is_drawn_where_it_is_then_with_its_way() -> None:
    scene = one("sphere")
    solids = scene.solids["sphere"]
    moving = Solids(**{**vars(solids), "sine": solids.sine.at[..., 1].set(2.0), "rate": solids.rate + 0.5})
    (body,) = bodies(Scene.of({"sphere": moving}, 1), time=np.pi)
    np.testing.assert_allclose(body.quads.mean(axis=(0, 1)), [2.0, 3.0, 1.5], atol=0.05)
    assert body.path is not None
    np.testing.assert_allclose(np.ptp(body.path, axis=0), [0.0, 4.0, 0.0], atol=1e-6)
    assert bodies(scene)[0].path is None


def test_a_ceiling_hides_nothing_from_above() -> None:
    scene = Scene.of({"box": room(1, 6.0, 4.0, 3.0)}, 1)
    assert len(bodies(scene)) == 4
    assert len(bodies(scene, ceilings=True)) == 5
    ax = Figure().add_subplot()
    draw_plan(ax, bodies(scene))
    assert len(ax.collections[0].get_paths()) == 4


def test_flights_each_in_its_own_world(tmp_path: Path) -> None:
    flown = flights(4)
    flown.success[1] = False
    centre = jnp.asarray(np.random.default_rng(0).uniform(-2, 2, (4, 3, 3)))
    scene = Scene.of({"cylinder": Solids.of("cylinder", centre, [0.1, 1.0])}, 4)
    for count, name in ((3, "few"), (9, "all")):
        plot_flights_in_worlds(flown, scene, tmp_path / f"{name}.png", "avoid", count)
        check_png(tmp_path / f"{name}.png")
    plot_flights_in_worlds(flown, one("box"), tmp_path / "same.png", "one world")
    check_png(tmp_path / "same.png")


def test_flights_without_success_come_first_and_goals_are_numbered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flown = flights(4)
    flown.success[3] = False
    steps = np.arange(len(flown.time))[:, None, None]
    goals = np.where(steps < 5, [1.0, 0.0, 2.0], [0.0, 4.0, 2.0]) + np.zeros((1, 4, 1))
    flown = dataclasses.replace(flown, goal=goals, late=np.array([False, False, False, True]))
    drawn = figures(monkeypatch)
    plot_flights_in_worlds(flown, one("box"), tmp_path / "worlds.png", "race", 2)
    plans = [ax for ax in drawn[0].axes if ax.get_title(loc="left")]
    assert [ax.get_title(loc="left").split(",")[0] for ax in plans] == ["out of time", "success"]
    assert {text.get_text() for text in plans[0].texts} == {"1", "2"}


def test_vehicles_of_a_world_are_drawn_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    flown = dataclasses.replace(flights(6), agents=2)
    flown.success[2:4] = False
    drawn = figures(monkeypatch)
    plot_flights_in_worlds(flown, one("box"), tmp_path / "worlds.png", "avoid_together")
    plans = [ax for ax in drawn[0].axes if ax.get_title(loc="left")]
    assert [ax.get_title(loc="left").split(",")[0] for ax in plans] == ["no success", "success", "success"]
    starts = [[line.get_xydata()[0] for line in ax.lines if line.get_marker() == START["marker"]] for ax in plans]
    np.testing.assert_allclose(starts, flown.position[0, [2, 3, 0, 1, 4, 5], :2].reshape(3, 2, 2))


def test_what_the_cameras_saw(tmp_path: Path) -> None:
    flown = flights(3)
    rng = np.random.default_rng(0)
    images = rng.uniform(1, 5, (STEPS, 3, 8, 12)), (rng.uniform(size=(STEPS, 3, 8, 8)) < 0.3).astype(float)
    cameras = CameraConfig(width=12, height=8), CameraConfig(sees="mask", width=8, height=8)
    plot_seen(dataclasses.replace(flown, images=images), cameras, tmp_path / "seen.png", "avoid", count=2)
    check_png(tmp_path / "seen.png")


def test_flights_in_space_among_solids(tmp_path: Path) -> None:
    task = HoverConfig()
    plots.plot_flights(task, flights(), tmp_path / "bare.png", "hover")
    plots.plot_flights(task, flights(), tmp_path / "among.png", "hover", bodies(one("cylinder")))
    check_png(tmp_path / "among.png")
    assert (tmp_path / "bare.png").read_bytes() != (tmp_path / "among.png").read_bytes()
