"""Cameras and LiDARs on vehicles: where their rays go. Camera frame: x right, y down, z ahead; body: x ahead, z up."""

import math
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.config import CameraConfig
from e2efly.physics.rotation import from_euler, rotate, to_matrix
from e2efly.scenes import cast as solids
from e2efly.scenes.cast import Light, Pattern, usual_light
from e2efly.scenes.meshes import cast as meshes
from e2efly.scenes.meshes.scene import MeshScene
from e2efly.scenes.scene import Scene
from e2efly.solids import CLASSES
from e2efly.vehicles.names import unknown

PRESETS: dict[str, CameraConfig] = {
    "d435i": CameraConfig(fov=(math.radians(87), math.radians(58)), reach=(0.28, 10.0)),
    "fpv": CameraConfig("rgb", fov=(math.radians(120), math.radians(90)), pitch=-math.radians(30)),
    "down": CameraConfig("mask", fov=(math.radians(90), math.radians(90)), pitch=math.pi / 2),
    "lidar": CameraConfig(
        "range", width=360, height=16, projection="spherical", fov=(2 * math.pi, math.radians(30)), reach=(0.3, 50.0)
    ),
}
"""Cameras by name: Intel RealSense D435i depth, an FPV camera tilted up by 30 degrees, one that looks straight down, a
LiDAR of 16 rings."""
_AHEAD = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]], np.float32)
"""Camera frame to body frame of a camera that looks straight ahead."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Mount:
    """How the camera of each vehicle sits and what it takes in; leaves."""

    matrix: Float[Array, "n 3 3"]
    """Pattern's frame to body; it also sets a pinhole's field of view."""
    offset: Float[Array, "n 3"]
    """Body frame, m."""


def pattern(config: CameraConfig) -> Pattern:
    """Directions of a camera's rays: of a pinhole in units of half its field of view, depth along the optical axis."""
    rows, columns = ((np.arange(k) + 0.5) / k * 2 - 1 for k in (config.height, config.width))
    if config.projection == "pinhole":
        x, y = np.meshgrid(columns, rows)
        return Pattern.of(np.stack([x, y, np.ones_like(x)], axis=-1), flat=True)
    across, up = np.meshgrid(columns * config.fov[0] / 2, -rows * config.fov[1] / 2)
    directions = np.stack([np.sin(across) * np.cos(up), -np.sin(up), np.cos(across) * np.cos(up)], axis=-1)
    return Pattern.of(directions, flat=False)


def mount(config: CameraConfig, n: int, key: PRNGKeyArray | None = None) -> Mount:
    """The cameras of n vehicles: each a little different where the configuration says so and a key is given."""
    u = jnp.zeros((n, 8)) if key is None else jax.random.uniform(key, (n, 8), minval=-1.0, maxval=1.0)
    factor = 1 + config.fov_spread * u[:, 3:5]
    return mounted(config, config.angle_spread * u[:, :3], factor, config.position_spread * u[:, 5:8])


def mounted(
    config: CameraConfig, angles: Float[Array, "n 3"], factor: Float[Array, "n k"], offset: Float[Array, "n 3"]
) -> Mount:
    """The cameras of n vehicles, each mounted in its own way.

    Args:
        config: of all.
        angles: roll, pitch and yaw, beside the configuration's pitch, rad.
        factor: on a pinhole's field of view, of each axis or of both (k is 2 or 1).
        offset: beside the configuration's position, body frame, m.
    """
    turned = to_matrix(from_euler(angles[:, 0], angles[:, 1] + config.pitch, angles[:, 2])) @ _AHEAD
    if config.projection == "pinhole":
        half = jnp.asarray(config.fov) / 2 * factor
        turned = turned * jnp.concatenate([jnp.tan(half), jnp.ones((len(half), 1))], axis=1)[:, None]
    return Mount(turned, jnp.asarray(config.position) + offset)


def pose(
    mount: Mount, position: Float[Array, "n 3"], quaternion: Float[Array, "n 4"]
) -> tuple[Float[Array, "n 3"], Float[Array, "n 3 3"]]:
    """Where the cameras of vehicles are, and pattern's frame to world: what `cast` takes."""
    return position + rotate(quaternion, mount.offset), to_matrix(quaternion) @ mount.matrix


def look(
    config: CameraConfig,
    scene: Scene | MeshScene,
    mount: Mount,
    position: Float[Array, "n 3"],
    quaternion: Float[Array, "n 4"],
    light: Light | None = None,
) -> Array:
    """The images of the cameras of n vehicles.

    Args:
        config: the camera.
        scene: n worlds, standing still (`Scene.at`); or the one world of triangles that all of them are in.
        mount: how each camera sits.
        position: of the vehicles, world, m.
        quaternion: of the vehicles, body to world.
        light: for colours; `usual_light` when left out.

    Returns:
        What `config.sees`: (n, h, w), colours and normals (n, h, w, 3). Depth and range, m: 0 where something is nearer
        than they reach, the farthest where nothing is within reach. A mask: 1 where the class is seen, else 0.
    """
    rays = pattern(config)
    measures = config.sees in ("depth", "range")
    channel = {"range": "depth", "mask": "label"}.get(config.sees, config.sees)
    if channel == "rgb" and light is None:
        light = usual_light(position.shape[0])
    origin, matrix = pose(mount, position, quaternion)
    if isinstance(scene, MeshScene):
        image = meshes.cast(scene, origin, matrix, rays, (channel,), light)[channel]
    else:
        far = config.reach[1] if measures else math.inf
        image = solids.cast(scene, origin, matrix, rays, (channel,), light, far)[channel]
    if config.sees == "mask":
        return (image == CLASSES.index(config.of)).astype(jnp.float32)
    if not measures:
        return image
    if config.sees == "range":
        image = image * _lengths(rays, mount)
    near, far = config.reach
    return jnp.where(image < near, 0.0, jnp.minimum(image, far))


def _lengths(rays: Pattern, mount: Mount) -> Float[Array, "n h w"]:
    """Metres a unit of depth along each ray."""
    directions = jnp.einsum("nij,tjr->nitr", mount.matrix, rays.tiles)
    return rays.image(jnp.linalg.norm(directions, axis=1))


def check(config: CameraConfig) -> None:
    """Check a camera.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    if config.width < 1 or config.height < 1:
        raise ValueError(f"camera.width and height are {config.width} and {config.height}; accepted: 1 or more")
    most = math.pi if config.projection == "pinhole" else 2 * math.pi + 1e-6
    if not all(0 < angle < most for angle in config.fov):
        raise ValueError(f"camera.fov is {config.fov}; accepted: angles in (0, {most:.4g}) rad")
    if config.sees == "mask" and config.of not in CLASSES:
        raise ValueError(f"camera.of: {unknown('class', config.of, CLASSES)}")
    near, far = config.reach
    if not 0 <= near < far:
        raise ValueError(f"camera.reach is {config.reach}; accepted: two rising numbers of metres, not negative")
    if not 0 <= config.noise_share <= 1:
        raise ValueError(f"camera.noise_share is {config.noise_share}; accepted: 0 to 1")
