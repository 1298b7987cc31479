"""Scenes from files in place of a task's world: which ones can be flown in, and which are refused. Imports JAX."""

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np

from e2efly.config import CameraConfig
from e2efly.courses.origin import Origin
from e2efly.simulation.scenes.camera import look, mount
from e2efly.simulation.scenes.file import load_scene
from e2efly.simulation.scenes.mesh import parts
from e2efly.simulation.scenes.meshes.load import FORMATS, load_mesh_scene
from e2efly.simulation.scenes.meshes.mesh_scene import MeshScene
from e2efly.simulation.scenes.scene import Scene, join
from e2efly.simulation.scenes.shapes import FAR
from e2efly.validation.scenery import Scenery

LEAST, MOST = 0.5, 1000.0
"""Smallest and largest size of a scene of triangles, m: the longest side of the box about it."""
DEEP = 50.0
"""Distance below the start within which the ground is looked for, m."""
_STEP = 0.5
"""Distance between the points along the way at which the ground is looked for, m."""
_DOWN = CameraConfig(width=1, height=1, fov=(1e-3, 1e-3), pitch=math.pi / 2, reach=(0.0, DEEP))
"""One ray straight down."""

World = Scene | MeshScene
"""One world of solids, or of triangles."""


@dataclass(frozen=True)
class SceneFile:
    """What is shown in place of a task's world."""

    name: str
    """Path of a file, or name of a mesh scene of the package."""
    unit: float | None = None
    """See `load_world`."""
    up: Literal["y", "z"] | None = None
    """See `load_world`."""
    materials: bool = True
    """See `load_world`."""
    beside: bool = False
    """Whether the objects of the task's world are shown in addition."""

    def put(self, scenery: Scenery) -> Scenery:
        """Replace the world of a task's scenery by this scene.

        Raises:
            ValueError: naming the scene, what is wrong and what is accepted.
        """
        world = load_world(self.name, self.unit, self.up, self.materials)
        if self.beside:
            assert isinstance(scenery.scene, Scene)
            world = beside(world, scenery.scene)
        return scenery.within(world)

    @property
    def options(self) -> list[str]:
        """The options of `e2efly hil` that select this scene."""
        more = [("--scene-unit", self.unit), ("--scene-up", self.up)]
        given = [word for option, value in more if value is not None for word in (option, str(value))]
        plain = [] if self.materials else ["--no-scene-materials"]
        return ["--scene", self.name, *given, *plain, *(["--beside"] if self.beside else [])]


def load_world(
    name: str, unit: float | None = None, up: Literal["y", "z"] | None = None, materials: bool = True
) -> World:
    """Load a scene by the path of its file, or one of the package's mesh scenes by name.

    A file is a .toml as in docs/vision.md, or a mesh of one of `FORMATS`. For a mesh, the other arguments are those of
    `load_mesh_scene`.

    Raises:
        ValueError: naming the scene, what is wrong and what is accepted.
    """
    if name.endswith(".toml"):
        if unit is not None or up is not None or not materials:
            raise ValueError(
                f"scene {name}: is in m with z up and has no materials; accepted: a unit, an axis and the choice of "
                f"materials for {', '.join(FORMATS)}"
            )
        return load_scene(Path(name))
    try:
        scene = load_mesh_scene(name, up, 1.0 if unit is None else unit, materials)
    except ValueError as error:
        said = f"{error}, or of a .toml of solids" if "unknown mesh scene" in str(error) else str(error)
        raise ValueError(f"scene {said}") from None
    low, high = scene.bounds
    sides = high - low
    if not LEAST <= sides.max() <= MOST:
        size = " x ".join(f"{side:.4g}" for side in sides)
        raise ValueError(
            f"scene {name}: is {size} m large; accepted: a longest side of {LEAST:g} to {MOST:g} m (another unit of "
            "the file? 0.001 for mm)"
        )
    return scene


def beside(world: World, task: Scene) -> World:
    """Put the objects of a task's world, without its ground, into a scene.

    Raises:
        ValueError: if an object of the task's world moves and the scene is of triangles, which cannot move.
    """
    if isinstance(world, Scene):
        kinds = sorted({*world.kinds, *task.kinds})
        both = {kind: join(*(s.solids[kind] for s in (world, task) if kind in s.solids)) for kind in kinds}
        return dataclasses.replace(world, solids=both)
    for kind, solids in task.solids.items():
        if np.any(np.asarray(solids.moves)):
            raise ValueError(
                f"the task's world has a {kind} that moves; accepted: a scene of solids (.toml), or a task without"
            )
    things = parts(dataclasses.replace(task, ground=np.full_like(task.ground, -FAR)), 0)
    return world.beside(MeshScene.of(things)) if things else world


@dataclass(frozen=True)
class Ground:
    """The ground below a course."""

    depth: float
    """Distance of the ground below the start, m."""
    ends: float
    """Distance along the straight way to the first goal up to which there is ground, m. Infinite: all along."""


def ground_of(scenery: Scenery, name: str, radius: float) -> Ground:
    """Look for the ground straight below the start of a course and below the way to its first goal.

    The name is for the error text, and the radius is that of the vehicle, m.

    Raises:
        ValueError: if there is no ground below the start, or if something is nearer to the start than the radius.
    """
    course = scenery.course
    start = np.asarray(course.start, np.float64)
    goal = np.asarray(course.goal.goal(course.memory, np.zeros(1)), np.float64)[0]
    way = float(np.linalg.norm((goal - start)[:2]))
    along = np.linspace(0.0, 1.0, int(way / _STEP) + 2)
    points = start + along[:, None] * (goal - start)
    points[:, 2] = start[2]  # the goal may lie on the ground
    depth = _depths(scenery.scene, points)
    at = f"[{', '.join(f'{x:.2f}' for x in start)}] m, where its course begins"
    if depth[0] >= DEEP:
        raise ValueError(
            f"{name} has no ground under {at}; accepted: a scene with a floor there, at most {DEEP:g} m below (another "
            "axis up? another origin?)"
        )
    gap = scenery.nearest([start], [0.0], Origin(), radius)
    if gap < radius:
        raise ValueError(
            f"{name} has something {max(gap, 0.0):.2f} m from {at}; accepted: more than the radius of the vehicle, "
            f"{radius:g} m"
        )
    missing = np.flatnonzero(depth >= DEEP)
    return Ground(float(depth[0]), float(along[missing[0]] * way) if len(missing) else math.inf)


def _depths(world: World, points: np.ndarray) -> np.ndarray:
    """Depth of the first object straight below each of n points, m. `DEEP`: there is none."""
    n = len(points)
    if isinstance(world, Scene):
        ground = float(world.ground[0])
        if ground > -FAR:
            return np.where(points[:, 2] > ground, np.minimum(points[:, 2] - ground, DEEP), DEEP)
        world = jax.tree.map(lambda x: jnp.repeat(x, n, axis=0), world.at(jnp.zeros(1)))
    level = jnp.tile(jnp.asarray([1.0, 0.0, 0.0, 0.0]), (n, 1))
    return np.asarray(look(_DOWN, world, mount(_DOWN, n), jnp.asarray(points, jnp.float32), level))[:, 0, 0]
