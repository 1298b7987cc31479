"""What a vehicle on a plant sees: the world of its task, rendered at the plant's true pose. Imports JAX.

Rate, age, mounting and noise of the images are those of the training environment. Its cameras draw them.
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PRNGKeyArray

from e2efly.config import CameraConfig
from e2efly.simulation.physics import State
from e2efly.simulation.scenes.scene import VEHICLE, Scene
from e2efly.simulation.sensors.eyes import Eye, see, steps_between
from e2efly.simulation.sensors.latency import delayed_state, frames
from e2efly.validation.plant import RigidState, Shutter


@dataclass(frozen=True)
class Sight:
    """The cameras of one flight and the world that they look at.

    All numbers are NumPy numbers, to be passed to processes.
    """

    cameras: tuple[CameraConfig, ...]
    """In the order of the contract's images."""
    eyes: tuple[Eye, ...]
    """How each camera is mounted on this vehicle: leaves (1, ...)."""
    scene: Scene
    """One world. It moves with the time since the start."""
    period: float
    """Control period, s."""
    oldest: float
    """Largest age of an image over all flights, s. It sets shapes."""
    seed: int
    """Seed of the noise."""

    def begin(self, taken: Mapping[int, Callable[[float], np.ndarray]] | None = None) -> "PlantWatch":
        """The watch for a flight that begins. Without `taken`, all images are rendered.

        For the plant's own cameras, `taken` has functions by their number, from the time since the start, s, to the
        newest image.
        """
        return PlantWatch(self, taken or {})

    def shutter(self, i: int) -> Shutter:
        """The exposure times of camera `i`."""
        return Shutter(self.period * self.steps_between(i), float(self.eyes[i].latency[0]))

    def steps_between(self, i: int) -> int:
        """Control steps from one image of camera `i` to the next."""
        every = self.eyes[i].every
        return steps_between(self.cameras[i], self.period) if every is None else int(every[0])


@dataclass
class PlantWatch:
    """The images of a flight, from control step to control step."""

    sight: Sight
    """The cameras and the world."""
    taken: Mapping[int, Callable[[float], np.ndarray]] = field(default_factory=dict)
    """Functions that give the newest image of each of the plant's own cameras."""
    shown: list[np.ndarray] = field(default_factory=list)
    """The last image of each camera."""

    def images(self, k: int, states: Sequence[RigidState], rest: Sequence[RigidState] = ()) -> list[np.ndarray]:
        """The policy's images in control step `k`: for each camera the newest image, (h, w) or (h, w, 3).

        Steps must be requested in order. `states` are those of the vehicle until now, one per control step. `rest` are
        the other vehicles of its world now.
        """
        sight = self.sight
        for i, (camera, eye) in enumerate(zip(sight.cameras, sight.eyes, strict=True)):
            if k % sight.steps_between(i) and self.shown:
                continue
            if i in self.taken:
                self.shown[i : i + 1] = [self.taken[i](k * sight.period)]
                continue
            newest = [states[max(len(states) - 1 - age, 0)] for age in range(frames(sight.oldest, sight.period) + 1)]
            key = jax.random.fold_in(jax.random.fold_in(jax.random.key(sight.seed), k), i)
            scene = with_others(sight.scene, rest, k * sight.period)
            image = rendered(camera, eye, scene, newest, k * sight.period, sight.period, key)
            self.shown[i : i + 1] = [image]
        return self.shown


def with_others(scene: Scene, rest: Sequence[RigidState], now: float) -> Scene:
    """One world, whose solids of the class vehicle are these others at `now`, s.

    They have flown straight on until then, as in the environment (`company.spheres`): a camera sees each where it was
    when the camera looked.

    Raises:
        ValueError: for another number of others than there are such solids.
    """
    others = {kind: np.flatnonzero(np.asarray(solids.label)[0] == VEHICLE) for kind, solids in scene.solids.items()}
    if sum(map(len, others.values())) != len(rest):
        raise ValueError(f"{len(rest)} other vehicles; accepted: {sum(map(len, others.values()))}, as in the scene")
    found, left = dict(scene.solids), list(rest)
    for kind, columns in others.items():
        if len(columns):
            here, left = left[: len(columns)], left[len(columns) :]
            solids, velocity = found[kind], np.stack([other.velocity for other in here])
            begun = np.stack([other.position for other in here]) - now * velocity
            places, motion = np.array(solids.centre), np.array(solids.velocity)
            places[0, columns], motion[0, columns] = begun, velocity
            found[kind] = dataclasses.replace(solids, centre=places, velocity=motion)
    return dataclasses.replace(scene, solids=found)


def rendered(
    camera: CameraConfig,
    eye: Eye,
    scene: Scene,
    states: Sequence[RigidState],
    now: float,
    period: float,
    key: PRNGKeyArray,
) -> np.ndarray:
    """A camera's image as the environment renders it, from the pose and the world of a latency ago.

    The states of the vehicle are a period apart, s, newest first, back to the eye's latency ago. The newest is of time
    `now`, s.
    """

    def column(name: str) -> Array:
        return jnp.asarray([[getattr(state, name) for state in states]], jnp.float32)

    rotors = jnp.zeros((1, len(states), 4), jnp.float32)  # no camera depends on the rotor speeds
    past = State(column("position"), column("velocity"), column("quaternion"), column("body_rate"), rotors)
    return np.asarray(_see(camera, eye, scene, past, now, period, key))[0]


@jax.jit
def _see(
    camera: CameraConfig, eye: Eye, scene: Scene, past: State, now: float, period: float, key: PRNGKeyArray
) -> Array:
    then = jnp.maximum(now - eye.latency, 0.0)
    return see(camera, eye, scene.at(then), delayed_state(past, eye.latency, period), key)
