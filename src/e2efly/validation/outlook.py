"""A world of the training environment, rendered from any pose by the environment's own program. Imports JAX.

The images are bit for bit those of `Env.look`, because they come from the same function, compiled as it is. Everything
that does not change between images stays on the device. So an image costs one call, whatever the world contains.
"""

import dataclasses
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from e2efly.environment import UNSEEN, Env, random_key
from e2efly.environment.env_state import EnvState
from e2efly.simulation.scenes.meshes.mesh_scene import MeshScene
from e2efly.simulation.scenes.scene import Scene
from e2efly.simulation.sensors.eyes import Eye
from e2efly.validation.plant import RigidState


@dataclass(frozen=True)
class Outlook:
    """One world of an environment, and its cameras with images without latency."""

    env: Env
    """The environment, with its numbers on the device."""
    state: EnvState
    """The state of one vehicle. Its pose does not matter."""
    world: Scene | MeshScene | None = None
    """The world that is rendered in place of the task's world."""

    @staticmethod
    def of(env: Env, memory: Any, eyes: tuple[Eye, ...], seed: int) -> "Outlook":
        """The world of an episode, from the task's state and the mounted cameras at its start, leaves (1, ...)."""
        shapes = jax.eval_shape(lambda key: env.reset(key, 1)[0], jax.random.key(0))
        blank = dataclasses.replace(shapes, key=None, memory=None, eyes=None)
        zeros = jax.tree.map(lambda x: jnp.zeros(x.shape, x.dtype), blank)
        young = tuple(dataclasses.replace(eye, latency=jnp.zeros_like(eye.latency)) for eye in eyes)
        state = dataclasses.replace(zeros, key=random_key(seed, UNSEEN, 0), memory=memory, eyes=young)
        return Outlook(*jax.device_put((env, state)))

    def seeing(self, world: Scene | MeshScene) -> "Outlook":
        """The same cameras in another world."""
        return dataclasses.replace(self, world=jax.device_put(world))

    def images(self, state: RigidState, time: float, count: int, which: tuple[int, ...]) -> list[np.ndarray]:
        """The cameras' images without latency, from a state in this world at a time of the world, s.

        `count` is the number of images so far, because each image has other noise. `which` are numbers of the cameras.

        Returns:
            One image for each camera: (h, w), or (h, w, 3) for colours.
        """
        place, turn = (np.asarray(part, np.float32)[None] for part in (state.position, state.quaternion))
        vehicle, past = dataclasses.replace(self.state.vehicle, position=place, quaternion=turn), self.state.past
        if past is not None:  # it has been in this state for long
            vehicle = jax.tree.map(np.asarray, vehicle)
            past = jax.tree.map(lambda old, x: np.broadcast_to(x[:, None], old.shape), past, vehicle)
        world = np.full(1, time, np.float32)
        there = dataclasses.replace(self.state, vehicle=vehicle, past=past, time=world, tick=np.int32(count))
        seen = _look(self.env, there, _RENEWED, self.world, which)
        return [np.asarray(image)[0] for image in seen]


_RENEWED = np.ones(1, bool)


@partial(jax.jit, static_argnames="which")
def _look(
    env: Env, state: EnvState, renewed: np.ndarray, world: Scene | MeshScene | None, which: tuple[int, ...]
) -> list[Array]:
    images = env.look(state, jnp.asarray(renewed), world).images
    return [images[i] for i in which]
