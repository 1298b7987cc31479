"""The world that a whole flight sees, and cameras in it: what a policy by sight needs beside the rig."""

import dataclasses
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from e2efly.config import CameraConfig
from e2efly.courses.origin import Origin
from e2efly.deploy.sight.source import Frame
from e2efly.env import Env
from e2efly.goal import Course
from e2efly.scenes.scene import Scene, gaps
from e2efly.sensors.eyes import Eye
from e2efly.validation.plant import RigidState
from e2efly.validation.sight import rendered
from e2efly.validation.starts import draw_starts

LANDING = ("pad",)
"""Solids that a flight may touch."""


@dataclass(frozen=True)
class Scenery:
    """One world of a task, with the cameras of its policy."""

    cameras: tuple[CameraConfig, ...]
    """In the order of the contract's images."""
    eyes: tuple[Eye, ...]
    """How each sits on the vehicle: leaves (1, ...)."""
    scene: Scene
    """One world."""
    course: Course
    """What the task drew to be flown in it."""

    @staticmethod
    def draw(env: Env, seed: int) -> "Scenery | None":
        """A world of the training's environment; None where its policies see nothing."""
        starts = draw_starts(env, 1, seed)
        (sight,) = starts.sights(env, seed)
        return None if sight is None else Scenery(sight.cameras, sight.eyes, sight.scene, starts.courses[0])

    def on(self, course: Course) -> Course:
        """A course of the same task, as its policy is to fly it in this world."""
        return dataclasses.replace(course, goal=self.course.goal, memory=self.course.memory)

    def sources(self, state: Callable[[], RigidState], origin: Origin) -> list["SceneCamera"]:
        """Its cameras on a vehicle.

        Args:
            state: the vehicle's true state now, in the room.
            origin: of the task's world in the room.
        """
        pairs = zip(self.cameras, self.eyes, strict=True)
        return [SceneCamera(camera, eye, self.scene, state, origin, i) for i, (camera, eye) in enumerate(pairs)]

    def nearest(self, position: Sequence[np.ndarray], time: Sequence[float], origin: Origin) -> float:
        """How near a path comes to what stands in this world and is not to be landed on, m; infinite: to nothing.

        Args:
            position: of the path, each (3,), in the room, m.
            time: of the same, s.
            origin: of the task's world in the room.
        """
        solids = {kind: solid for kind, solid in self.scene.solids.items() if kind not in LANDING}
        if not len(position) or not solids:
            return np.inf
        scene = dataclasses.replace(self.scene, solids=solids)
        points = np.asarray(origin.seen(np.stack(position)), np.float32)
        return float(_nearest(scene, points, np.asarray(time, np.float32)))


@jax.jit
def _nearest(scene: Scene, points: Array, times: Array) -> Array:
    """The smallest distance of any of the points (n, 3), each at its time, to a solid of one world, m."""
    return jnp.min(jax.vmap(lambda point, at: gaps(scene, point[None], at[None])[0, 1:])(points, times))


class SceneCamera:
    """A camera in a rendered world, as an image source: exposes at its rate, and delivers a latency later."""

    def __init__(
        self,
        camera: CameraConfig,
        eye: Eye,
        scene: Scene,
        state: Callable[[], RigidState],
        origin: Origin,
        seed: int = 0,
    ) -> None:
        """Mount it.

        Args:
            camera: the camera.
            eye: how it sits: leaves (1, ...); its latency is that of the images.
            scene: one world.
            state: the vehicle's true state now, in the room.
            origin: of the task's world in the room.
            seed: of the noise.
        """
        self.problem: str | None = None
        self._camera, self._scene = camera, scene
        self._eye = dataclasses.replace(eye, latency=0 * eye.latency)  # of what is rendered; it is delivered later
        self._state, self._origin = state, origin
        self._latency = float(eye.latency[0])
        self._period = 1 / camera.rate if camera.rate else 0.0
        self._next = -np.inf
        self._key, self._count = jax.random.key(seed), 0
        self._waiting: deque[Frame] = deque()

    def read(self, now: float) -> list[Frame]:
        """Expose where it is time to, and deliver what is old enough."""
        if now >= self._next - 1e-9:
            self._next = now + self._period if self._next == -np.inf else max(self._next + self._period, now)
            self._waiting.append(Frame(now, self._image(now)))
        ready = []
        while self._waiting and self._waiting[0].time + self._latency <= now + 1e-9:
            ready.append(self._waiting.popleft())
        return ready

    def close(self) -> None:
        """Nothing to let go of."""

    def describe(self) -> str:
        """What it shows."""
        return f"rendered {self._camera.sees}, {self._camera.height} rows, {self._camera.width} columns"

    def _image(self, now: float) -> np.ndarray:
        local = self._state().odometry(now).seen_from(self._origin)
        self._count += 1
        key = jax.random.fold_in(self._key, self._count)
        return rendered(self._camera, self._eye, self._scene, [RigidState.of(local)], now, 1.0, key)
