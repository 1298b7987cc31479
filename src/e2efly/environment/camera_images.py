"""The images of the vehicles' cameras after a control step."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from e2efly.config import CameraConfig
from e2efly.environment.env_state import IMAGES, EnvState, where
from e2efly.simulation.scenes.meshes.mesh_scene import MeshScene
from e2efly.simulation.scenes.scene import Scene
from e2efly.simulation.sensors import latency
from e2efly.simulation.sensors.eyes import Eye, see, steps_between


def newest(
    cameras: tuple[CameraConfig, ...], scene: Scene | MeshScene, state: EnvState, renewed: Bool[Array, " n"],
    period: float,
) -> tuple[Float[Array, "n *image"], ...]:  # fmt: skip
    """The newest image of each camera, without gradient.

    Cameras whose next image is due render a new image, and so do the cameras of vehicles whose episode is new. The
    other images stay.

    Args:
        cameras: the cameras of every vehicle.
        scene: what they look at.
        state: the state of the vehicles, with the images so far.
        renewed: which vehicles have a new episode.
        period: the duration of a control step, s.
    """
    still, images = jax.lax.stop_gradient(state), []
    for index, (camera, eye, old) in enumerate(zip(cameras, still.eyes, still.images, strict=True)):
        every = steps_between(camera, period)
        due = state.tick % (every if eye.every is None else eye.every) == 0

        def new(_: None, index: int = index, camera: CameraConfig = camera, eye: Eye = eye) -> Array:
            then, seen = still.time, still.vehicle
            if still.past is not None:
                then = jnp.maximum(then - eye.latency, 0.0)
                seen = latency.delayed_state(still.past, eye.latency, period)
            return see(camera, eye, scene.at(then), seen, jax.random.fold_in(still.key_of(IMAGES), index))

        if every == 1 and eye.every is None:
            images.append(new(None))
            continue
        fresh = jax.lax.cond(jnp.any(due | renewed), new, lambda _, old=old: old, None)
        images.append(where(due | renewed, fresh, old))
    return tuple(images)
