"""Worlds by name, for viewing: their objects, and the route of a flight through them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.config import ClutterConfig, ForestConfig
from e2efly.config.names import unknown
from e2efly.config.tables import read_table
from e2efly.control import Quat
from e2efly.courses.tracks import RaceTrack, load_track, track_names
from e2efly.simulation.scenes import generate
from e2efly.simulation.scenes.file import load_scene
from e2efly.simulation.scenes.meshes import distance
from e2efly.simulation.scenes.meshes.distance import DistanceGrid
from e2efly.simulation.scenes.meshes.load import FORMATS, load_mesh_scene, mesh_scene_names
from e2efly.simulation.scenes.meshes.mesh_scene import MeshScene
from e2efly.simulation.scenes.scene import Scene, Solids, clearance, join

BAR, DEPTH = 0.1, 0.05
"""Width and half depth of a track's gates, m."""
GENERATED = ("forest", "clutter", "room", "corridor")
"""Random worlds. Room and corridor contain clutter."""
_VALUES = 400_000
"""Approximate number of values in a grid of distances."""
_TIMES = np.linspace(0.0, 12.0, 7)
"""Times at which the positions of moving solids are evaluated, s."""


@dataclass(frozen=True)
class ScenePlace:
    """One world and a route through it."""

    scene: Scene | MeshScene
    """One world."""
    route: Float[np.ndarray, "k 3"]
    """Corners of a route through it, world, m."""
    straight: Bool[np.ndarray, " k-1"]
    """Whether a flight follows the straight line to the next corner, because it passes a gate."""
    grid: DistanceGrid | None = None
    """Distance grid, for a world of triangles."""

    def clearance(self, points: Float[Array, "n 3"]) -> Float[Array, " n"]:
        """Signed distance of points to the nearest solid over all times, m."""
        scene = self.scene
        if isinstance(scene, MeshScene):
            low, high = scene.bounds
            assert self.grid is not None
            aside = jnp.minimum(points[:, :2] - low[:2], high[:2] - points[:, :2]).min(axis=1)
            return jnp.minimum(distance.clearance(self.grid, points), aside)

        def of(point: Array, time: Array) -> Array:
            return clearance(scene, point[None], time[None])[0]

        return jnp.min(jax.vmap(jax.vmap(of, (0, None)), (None, 0))(points, jnp.asarray(_times(scene))), axis=0)


def _times(scene: Scene) -> np.ndarray:
    """Times at which to evaluate the positions of the solids, s. Only one time if none of them moves."""
    moves = any(bool(np.any(np.asarray(s.rate) != 0)) for s in scene.solids.values())
    return _TIMES if moves else _TIMES[:1]


def place_names() -> list[str]:
    """Every world that has a name."""
    return [*GENERATED, *track_names(), *mesh_scene_names()]


def find_place(
    name: str, key: PRNGKeyArray, unit: float = 1.0, up: Literal["y", "z"] | None = None, materials: bool = True
) -> ScenePlace:
    """A place by its name, or by the path of a file: a scene's or a track's .toml, or a mesh.

    Args:
        name: a name of `place_names`, or a path.
        key: random key for a random world.
        unit: length of the unit of a mesh's file, m.
        up: axis of a mesh's file that points up. None: the axis that its format defines.
        materials: whether a mesh's colours, materials and textures are used.

    Raises:
        ValueError: for an unknown name or a damaged file, naming what is wrong and what is accepted.
    """
    mesh = name in mesh_scene_names() or name.lower().endswith(FORMATS)
    if not mesh and (unit, up, materials) != (1.0, None, True):
        raise ValueError(
            f"scene {name} has no unit, axis and materials of its own; accepted: --scene-unit, --scene-up and "
            f"--no-scene-materials for {', '.join(FORMATS)}"
        )
    if name.endswith(".toml"):
        return _of_track(load_track(name)) if _has_gates(Path(name)) else _of_scene(load_scene(Path(name)))
    if mesh:
        return _of_mesh(load_mesh_scene(name, up, unit, materials))
    if name in track_names():
        return _of_track(load_track(name))
    if name not in GENERATED:
        raise ValueError(unknown("scene", name, place_names()) + f", or the path of a .toml, {', '.join(FORMATS)} file")
    if name == "forest":
        config = ForestConfig()
        route = np.array([[0.0, 0.0, 2.0], [config.length, 0.0, 2.0]])
        start, goal = (jnp.asarray(point)[None] for point in route)
        forest = jax.jit(lambda key: generate.forest(key, 1, config, start, goal))  # as one program, kept on disk
        return _place({"cylinder": forest(key)}, route)
    if name == "clutter":
        route = np.array([[0, 0, 1.5], [7, 2, 2], [14, -2, 1.5], [21, 0, 2]], float)
        return _place(_clutter(key, ClutterConfig(obstacles=28, room=32, moving=0.3), route), route)
    if name == "room":
        route = np.array([[-4, -3, 1.2], [3.8, -3, 1.6], [3.8, 3, 1.2], [-4, 3, 1.6]], float)
        solids = _clutter(key, ClutterConfig(obstacles=20, room=20, sideways=0.9), route)
        walls = generate.room(1, 12.0, 9.0, 3.5)
    else:
        route = np.array([[1, 0, 1.5], [24, 0, 1.5]], float)
        solids = _clutter(key, ClutterConfig(obstacles=14, room=20, sideways=1.3), route)
        walls = generate.corridor(1, 25.0, 4.0, 3.0)
    return _place({**solids, "box": join(solids["box"], walls)}, route)


def _clutter(key: PRNGKeyArray, config: ClutterConfig, route: np.ndarray) -> dict[str, Solids]:
    path = jnp.asarray(route, jnp.float32)[None]
    return jax.jit(lambda key: generate.clutter(key, 1, config, path, path[:, [0, -1]], 0.3))(key)


def _place(solids: dict[str, Solids], route: np.ndarray) -> ScenePlace:
    return ScenePlace(Scene.of(solids, 1), route, np.zeros(len(route) - 1, bool))


def _has_gates(path: Path) -> bool:
    """Whether a file is a track. Errors in the file are reported by its loader."""
    try:
        return "gates" in read_table(path)
    except ValueError:
        return False


def _of_track(track: RaceTrack) -> ScenePlace:
    size = np.column_stack([track.opening / 2, np.full((len(track.yaw), 2), [BAR, DEPTH])])
    gates = Solids.of("gate", track.position[None], size[None], yaw=track.yaw[None])
    route, straight = _through(track.position, track.yaw, closed=track.closed)
    return ScenePlace(Scene.of({"gate": gates}, 1), np.vstack([track.start, route]), np.append(False, straight))


def _through(position: np.ndarray, yaw: np.ndarray, closed: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Corners before and behind each gate. On a closed track, the first gate is repeated at the end."""
    ahead = 0.6 * np.column_stack([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)])
    pairs = np.stack([position - ahead, position + ahead], axis=1)
    pairs = np.concatenate([pairs, pairs[:1]]) if closed else pairs
    return pairs.reshape(-1, 3), np.arange(2 * len(pairs) - 1) % 2 == 0


def _of_scene(scene: Scene) -> ScenePlace:
    """A place with a route through the gates of a scene in order. Without gates, along its longer side."""
    there = {kind: np.asarray(s.active[0]) for kind, s in scene.solids.items()}
    if "gate" in scene.kinds and there["gate"].any():
        s = scene.solids["gate"]
        yaw = Quat.of(np.asarray(s.quaternion[0][there["gate"]], float)).yaw()
        route, straight = _through(np.asarray(s.centre[0][there["gate"]], float), yaw)
        ends = route[0] + (route[0] - route[1]), route[-1] + (route[-1] - route[-2])
        return ScenePlace(scene, np.vstack([ends[0], route, ends[1]]), np.concatenate([[False], straight, [False]]))
    centres = [np.asarray(s.centre[0], float)[there[kind]] for kind, s in scene.solids.items()]
    points = np.concatenate([*centres, np.zeros((0, 3))])
    low, high = (points.min(axis=0), points.max(axis=0)) if len(points) else (np.zeros(3), np.zeros(3))
    ground = max(float(scene.ground[0]), low[2] - 3.0)
    middle, half = (low + high) / 2, (high - low) / 2
    axis = int(half[1] > half[0])
    way = np.zeros(3)
    way[axis] = half[axis] + 3.0
    middle[2] = max(middle[2], ground + 1.2)
    return ScenePlace(scene, np.stack([middle - way, middle + way]), np.zeros(1, bool))


def _of_mesh(scene: MeshScene) -> ScenePlace:
    """A place with a route along the longer side of a mesh, between positions with free space around them, as low as
    possible.
    """
    low, high = scene.bounds
    grid = DistanceGrid.of(scene, max(0.2, float(np.prod(high - low + 2.0) / _VALUES) ** (1 / 3)))
    middle, half = (low + high) / 2, (high - low) / 2
    way = np.zeros(3)
    way[int(half[1] > half[0])] = 0.8 * max(half[0], half[1])
    ends = []
    for end in (middle - way, middle + way):
        height = np.arange(low[2], high[2] + 2.0, 0.2)
        gap = np.asarray(distance.clearance(grid, jnp.asarray([[*end[:2], z] for z in height], jnp.float32)))
        free = np.flatnonzero(gap > 1.0)
        ends.append([*end[:2], height[free[0] if len(free) else int(gap.argmax())]])
    return ScenePlace(scene, np.array(ends), np.zeros(1, bool), grid)
