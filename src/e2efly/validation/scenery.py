"""The world that a whole flight sees, and cameras in it, which a policy with cameras needs beside the rig."""

import dataclasses
import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from e2efly.config import CameraConfig
from e2efly.courses.origin import Origin
from e2efly.environment import Env
from e2efly.flight.sight.image_source import Frame
from e2efly.policy.goal import Course
from e2efly.simulation.scenes.meshes.mesh_scene import MeshScene
from e2efly.simulation.scenes.meshes.near import Near
from e2efly.simulation.scenes.scene import Scene, gaps
from e2efly.simulation.sensors.eyes import Eye
from e2efly.validation.outlook import Outlook
from e2efly.validation.plant import RigidState
from e2efly.validation.starts import draw_starts

LANDING = ("pad",)
"""Solids that a flight may touch."""


@dataclass(frozen=True)
class Scenery:
    """One world of a task, with the cameras of its policy."""

    cameras: tuple[CameraConfig, ...]
    """In the order of the contract's images."""
    eyes: tuple[Eye, ...]
    """How each camera is mounted on the vehicle: leaves (1, ...)."""
    scene: Scene | MeshScene
    """One world."""
    course: Course
    """The course that the task drew in this world."""
    outlook: Outlook
    """The same world as the environment's own program renders it."""
    near: Near | None = None
    """Its triangles, if it has any."""

    @staticmethod
    def draw(env: Env, seed: int) -> "Scenery | None":
        """Draw a world of the training environment. None if its policies see nothing."""
        starts = draw_starts(env, 1, seed)
        (sight,) = starts.sights(env, seed)
        if sight is None:
            return None
        outlook = Outlook.of(env, starts.memory, starts.eyes, seed)
        return Scenery(sight.cameras, sight.eyes, sight.scene, starts.courses[0], outlook)

    def within(self, world: Scene | MeshScene) -> "Scenery":
        """The same cameras and course in another world."""
        near = Near.of(world) if isinstance(world, MeshScene) else None
        return dataclasses.replace(self, scene=world, outlook=self.outlook.seeing(world), near=near)

    def on(self, course: Course) -> Course:
        """A course of the same task, in the form in which its policy is to fly it in this world."""
        return dataclasses.replace(course, goal=self.course.goal, memory=self.course.memory)

    def sources(self, state: Callable[[], RigidState], origin: Origin) -> list["SceneCamera"]:
        """The cameras of this scenery on a vehicle whose true state in the room is `state()`."""
        return [SceneCamera(self, i, state, origin) for i in range(len(self.cameras))]

    def image(self, which: int, state: RigidState, time: float, count: int) -> np.ndarray:
        """A camera's image without latency, from a state in this world at a time of the world, s.

        It is bit for bit that of `Env.look`. `count` is the number of images so far, because each image has other
        noise.
        """
        return self.outlook.images(state, time, count, (which,))[0]

    def images(self, state: RigidState, time: float, count: int) -> list[np.ndarray]:
        """The same for all cameras, at the cost of one call."""
        return self.outlook.images(state, time, count, tuple(range(len(self.cameras))))

    def nearest(
        self, position: Sequence[np.ndarray], time: Sequence[float], origin: Origin, within: float = math.inf
    ) -> float:
        """Smallest distance of a path to the obstacles of this world, m.

        Solids to land on do not count. Infinite: there are no obstacles. In a world of triangles, a path that goes
        through a triangle has the distance 0. Positions, each (3,), are in the room, m, and times in s. Obstacles
        farther than `within`, m, may be ignored.
        """
        if self.near is not None:
            return self.near.distance(origin.seen(np.stack(position)), within) if len(position) else math.inf
        assert isinstance(self.scene, Scene)
        solids = {kind: solid for kind, solid in self.scene.solids.items() if kind not in LANDING}
        if not len(position) or not solids:
            return np.inf
        scene = dataclasses.replace(self.scene, solids=solids)
        points = np.asarray(origin.seen(np.stack(position)), np.float32)
        return float(_nearest(scene, points, np.asarray(time, np.float32)))


@jax.jit
def _nearest(scene: Scene, points: Array, times: Array) -> Array:
    """The smallest distance of the points (n, 3), each at its time, to a solid of one world, m."""
    return jnp.min(jax.vmap(lambda point, at: gaps(scene, point[None], at[None])[0, 1:])(points, times))


class SceneCamera:
    """A camera in a rendered world as an image source. It exposes at its rate, and delivers images a latency later."""

    def __init__(self, scenery: Scenery, which: int, state: Callable[[], RigidState], origin: Origin) -> None:
        """Mount one of the scenery's cameras on a vehicle whose true state in the room is `state()`."""
        self.problem: str | None = None
        self._scenery, self._which, self._state, self._origin = scenery, which, state, origin
        self._camera = scenery.cameras[which]
        self._latency = float(scenery.eyes[which].latency[0])
        self._period = 1 / self._camera.rate if self._camera.rate else 0.0
        self._next, self._count = -np.inf, 0
        self._waiting: deque[Frame] = deque()

    def read(self, now: float) -> list[Frame]:
        """Expose if an image is due, and deliver images that are old enough."""
        if now >= self._next - 1e-9:
            self._next = now + self._period if self._next == -np.inf else max(self._next + self._period, now)
            self._waiting.append(Frame(now, self._image(now)))
        ready = []
        while self._waiting and self._waiting[0].time + self._latency <= now + 1e-9:
            ready.append(self._waiting.popleft())
        return ready

    def close(self) -> None:
        """Nothing to release."""

    def describe(self) -> str:
        """A description of the camera, as text."""
        return f"rendered {self._camera.sees}, {self._camera.height} rows, {self._camera.width} columns"

    def _image(self, now: float) -> np.ndarray:
        local = self._state().odometry(now).seen_from(self._origin)
        self._count += 1
        return self._scenery.image(self._which, RigidState.of(local), now, self._count)
