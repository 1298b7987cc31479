"""Cameras on a batch of vehicles: their images of worlds and poses as they were a latency ago."""

import dataclasses
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.config import CameraConfig
from e2efly.simulation.physics import State
from e2efly.simulation.scenes import camera
from e2efly.simulation.scenes.camera import Mount
from e2efly.simulation.scenes.cast import Light, usual_light
from e2efly.simulation.scenes.meshes.mesh_scene import MeshScene
from e2efly.simulation.scenes.scene import Scene
from e2efly.simulation.sensors.image_noise import add_image_noise, chosen

TINTS = 8
"""Number of random tints in a world."""
_STATIC = ("sees", "of", "width", "height", "projection", "fov", "reach", "encoding", "rate")
jax.tree_util.register_dataclass(
    CameraConfig,
    data_fields=[f.name for f in dataclasses.fields(CameraConfig) if f.name not in _STATIC],
    meta_fields=list(_STATIC),
)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Eye:
    """One camera on each of n vehicles, as it is during an episode."""

    mount: Mount
    latency: Float[Array, " n"]
    """Age of the camera's images, s."""
    noisy: Bool[Array, " n"]
    """Whether the camera's images are noisy."""
    light: Light | None
    """Light of the world, for a camera that sees colours."""
    tints: Float[Array, "n 8 3"] | None
    """Offsets that are added to the colours of the solids, in turn, for a camera that sees colours."""
    every: Float[Array, " n"] | None = None
    """Control steps from one image to the next, for each vehicle. None: `steps_between`, for all vehicles."""

    @staticmethod
    def of(config: CameraConfig, key: PRNGKeyArray, n: int) -> "Eye":
        """Draw the mounting, the latency and the light of each camera."""
        mount_key, latency_key, light_key, tint_key, noise_key = jax.random.split(key, 5)
        low, high = config.latency
        latency = low + (high - low) * jax.random.uniform(latency_key, (n,))
        mount = camera.mount(config, n, mount_key)
        noisy = jax.random.uniform(noise_key, (n,)) < config.noise_share
        if config.sees != "rgb":
            return Eye(mount, latency, noisy, None, None)
        tints = config.colour_spread * jax.random.uniform(tint_key, (n, TINTS, 3), minval=-1.0, maxval=1.0)
        return Eye(mount, latency, noisy, _light(config, light_key, n), tints)


def _light(config: CameraConfig, key: PRNGKeyArray, n: int) -> Light:
    usual, u = usual_light(n), jax.random.uniform(key, (n, 4), minval=-1.0, maxval=1.0)
    sun = jnp.maximum(usual.sun + config.light_spread * u[:, :3], jnp.array([-jnp.inf, -jnp.inf, 0.2]))
    strength = jnp.clip(usual.strength * (1 + config.light_spread * u[:, 3]), 0.0, 1.0)
    return Light(sun / jnp.linalg.norm(sun, axis=-1, keepdims=True), strength, jnp.asarray(usual.checker))


def _tinted(scene: Scene, tints: Float[Array, "n t 3"]) -> Scene:
    """The scene with a tint on each solid."""
    solids = {}
    for first, kind in enumerate(scene.kinds):
        old = scene.solids[kind]
        turn = (first + np.arange(old.colour.shape[1])) % TINTS
        solids[kind] = dataclasses.replace(old, colour=jnp.clip(old.colour + tints[:, turn], 0.0, 1.0))
    return dataclasses.replace(scene, solids=solids)


def steps_between(config: CameraConfig, period: float) -> int:
    """Control steps from one image of a camera to the next."""
    return 1 if config.rate is None else round(1 / (config.rate * period))


def steady(config: CameraConfig) -> CameraConfig:
    """The nominal camera: exact mounting, its own field of view, and the smallest latency. Its noise stays."""
    youngest = config.latency[0]
    return dataclasses.replace(
        config, angle_spread=0.0, position_spread=0.0, fov_spread=0.0, latency=(youngest, youngest)
    )


def image_shape(config: CameraConfig) -> tuple[int, ...]:
    """(h, w), or (h, w, 3) for colours and normals."""
    return (config.height, config.width, *((3,) if config.sees in ("rgb", "normal") else ()))


def see(config: CameraConfig, eye: Eye, scene: Scene | MeshScene, state: State, key: PRNGKeyArray) -> Array:
    """The images of n vehicles.

    The worlds stand still, or all vehicles are in the one world of triangles, whose colours are those of its file.

    Returns:
        Depth and range in m (0: a hole) or a mask of 0 and 1, of shape (n, h, w). Colours in [0, 1] and normals, (n, h,
        w, 3).
    """
    position, quaternion = (x.astype(jnp.float32) for x in (state.position, state.quaternion))
    if eye.tints is not None and isinstance(scene, Scene):
        scene = _tinted(scene, eye.tints)
    image = camera.look(config, scene, eye.mount, position, quaternion, eye.light)
    if not chosen(config.noise):
        return image
    each = eye.noisy.reshape(-1, *[1] * (image.ndim - 1))
    return jnp.where(each, add_image_noise(config.noise, key, image, config), image)
