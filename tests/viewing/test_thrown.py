"""What is thrown, in plots, films and pages: drawn moving, from its throw until it is under the ground."""

import base64
import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from matplotlib.figure import Figure

from e2efly.simulation.scenes.faces import FacesBody, bodies
from e2efly.simulation.scenes.scene import Scene, Solids
from e2efly.vehicles.loading import load_vehicle
from e2efly.viewing.watch.film import _moving, _standing
from e2efly.viewing.watch.stage import Stage
from e2efly.viewing.web.exported import UNDER, _solid
from e2efly.viewing.worlds import draw_plan

PLACE, SPEED, SINCE = np.array([4.0, 1.0, 2.0]), np.array([-8.0, 0.0, 2.0]), 1.0


@pytest.fixture
def ball() -> FacesBody:
    """A ball that is thrown from `PLACE` at `SINCE`. It lands 0.87 s later."""
    fall = np.array([0.0, 0.0, -9.81])
    centre = PLACE - SINCE * SPEED + SINCE**2 / 2 * fall
    solids = dataclasses.replace(
        Solids.of("sphere", centre[None, None], [0.1]),
        velocity=jnp.asarray((SPEED - SINCE * fall)[None, None]),
        acceleration=jnp.asarray(fall[None, None]),
        since=jnp.full((1, 1), SINCE),
    )
    (body,) = bodies(Scene.of({"sphere": solids}, 1))
    return body


def where(time: float) -> np.ndarray:
    t = time - SINCE
    return PLACE + t * SPEED + t**2 / 2 * np.array([0.0, 0.0, -9.81])


def test_a_film_shows_it_only_while_it_flies(ball: FacesBody) -> None:
    stage = Stage(load_vehicle("vis_r"), [ball])
    assert not len(_standing(stage).triangles)
    for time, there in ((0.5, False), (1.3, True), (1.9, False)):
        triangles = _moving(stage, time, np.zeros(3)).triangles
        assert bool(len(triangles)) == there
        if there:
            middle = (triangles.reshape(-1, 3).min(0) + triangles.reshape(-1, 3).max(0)) / 2
            np.testing.assert_allclose(middle, where(time), atol=0.01)


def test_a_page_moves_it_along_a_path_of_one_episode(ball: FacesBody) -> None:
    seen = _solid(ball, 7.5)
    corners = np.frombuffer(base64.b64decode(seen["quads"]), np.float32).reshape(-1, 3)
    path = np.array(seen["path"])
    assert seen["rate"] == pytest.approx(2 * np.pi / 7.5)
    for time, there in ((0.0, False), (0.5, False), (1.3, True), (1.6, True), (3.0, False)):
        turn = seen["rate"] * time / (2 * np.pi) * (len(path) - 1)  # as web/src/view/course.js does
        first = int(turn)
        moved = path[first] + (turn - first) * (path[min(first + 1, len(path) - 1)] - path[first]) - path[0]
        middle = (corners.min(0) + corners.max(0)) / 2 + moved
        if there:
            np.testing.assert_allclose(middle, where(time), atol=0.02)
        else:
            assert middle[2] < -UNDER / 2


def test_a_plan_shows_its_way(ball: FacesBody) -> None:
    ax = Figure().add_subplot()
    draw_plan(ax, [ball])
    (way,) = ax.collections[1].get_segments()
    np.testing.assert_allclose(way[0], PLACE[:2], atol=0.02)
    np.testing.assert_allclose(way[-1], where(ball.until)[:2], atol=0.02)
    assert ball.until == pytest.approx(SINCE + (2 + np.sqrt(4 + 2 * 9.81 * 2)) / 9.81, abs=1e-3)
