"""Cameras and LiDARs on vehicles: the directions of their rays.

Camera frame: x right, y down, z ahead. Body frame: x ahead, z up.
"""

import math
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.config import CameraConfig, check_fields
from e2efly.config.names import unknown
from e2efly.control.vectors import rotate
from e2efly.courses.solids import CLASSES
from e2efly.simulation.physics.rotation import from_euler, to_matrix
from e2efly.simulation.scenes import cast as solids
from e2efly.simulation.scenes.cast import Light, Pattern, usual_light
from e2efly.simulation.scenes.meshes import mesh_cast as meshes
from e2efly.simulation.scenes.meshes.mesh_scene import MeshScene
from e2efly.simulation.scenes.scene import Scene

PRESETS: dict[str, CameraConfig] = {
    "d435i": CameraConfig(fov=(math.radians(87), math.radians(58)), reach=(0.28, 10.0)),
    "fpv": CameraConfig("rgb", fov=(math.radians(120), math.radians(90)), pitch=-math.radians(30)),
    "down": CameraConfig("mask", fov=(math.radians(90), math.radians(90)), pitch=math.pi / 2),
    "lidar": CameraConfig(
        "range", width=360, height=16, projection="spherical", fov=(2 * math.pi, math.radians(30)), reach=(0.3, 50.0)
    ),
}
"""Cameras by name: Intel RealSense D435i depth, an FPV camera tilted up by 30 degrees, a camera that looks straight
down, and a LiDAR with 16 rings."""
_AHEAD = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]], np.float32)
"""Rotation from camera frame to body frame for a camera that looks straight ahead."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Mount:
    """The mounting and field of view of each vehicle's camera; leaves."""

    matrix: Float[Array, "n 3 3"]
    """Map from the pattern's frame to the body. It also sets a pinhole's field of view."""
    offset: Float[Array, "n 3"]
    """Position in the body frame, m."""


def pattern(config: CameraConfig) -> Pattern:
    """Directions of a camera's rays.

    For a pinhole they are in units of half its field of view, and depth is along the optical axis.
    """
    rows, columns = ((np.arange(k) + 0.5) / k * 2 - 1 for k in (config.height, config.width))
    if config.projection == "pinhole":
        x, y = np.meshgrid(columns, rows)
        return Pattern.of(np.stack([x, y, np.ones_like(x)], axis=-1), flat=True)
    across, up = np.meshgrid(columns * config.fov[0] / 2, -rows * config.fov[1] / 2)
    directions = np.stack([np.sin(across) * np.cos(up), -np.sin(up), np.cos(across) * np.cos(up)], axis=-1)
    return Pattern.of(directions, flat=False)


def mount(config: CameraConfig, n: int, key: PRNGKeyArray | None = None) -> Mount:
    """The cameras of n vehicles. They vary if the configuration has spreads and a key is given."""
    u = jnp.zeros((n, 8)) if key is None else jax.random.uniform(key, (n, 8), minval=-1.0, maxval=1.0)
    factor = 1 + config.fov_spread * u[:, 3:5]
    return mounted(config, config.angle_spread * u[:, :3], factor, config.position_spread * u[:, 5:8])


def mounted(
    config: CameraConfig, angles: Float[Array, "n 3"], factor: Float[Array, "n k"], offset: Float[Array, "n 3"]
) -> Mount:
    """The cameras of n vehicles, each mounted individually.

    Angles are roll, pitch and yaw, rad, in addition to the configuration's pitch. Offsets from its position are in the
    body frame, m. A factor acts on a pinhole's field of view, for each axis or for both (k is 2 or 1).
    """
    turned = to_matrix(from_euler(angles[:, 0], angles[:, 1] + config.pitch, angles[:, 2])) @ _AHEAD
    if config.projection == "pinhole":
        half = jnp.asarray(config.fov) / 2 * factor
        turned = turned * jnp.concatenate([jnp.tan(half), jnp.ones((len(half), 1))], axis=1)[:, None]
    return Mount(turned, jnp.asarray(config.position) + offset)


def pose(
    mount: Mount, position: Float[Array, "n 3"], quaternion: Float[Array, "n 4"]
) -> tuple[Float[Array, "n 3"], Float[Array, "n 3 3"]]:
    """Positions of the vehicles' cameras, and the map from the pattern's frame to the world, as `cast` takes them."""
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
        scene: n worlds, standing still (`Scene.at`), or the one world of triangles in which all of them are.
        mount: how each camera is mounted.
        position: positions of the vehicles, world, m.
        quaternion: attitudes of the vehicles, body to world.
        light: light for colours. If left out: `usual_light`.

    Returns:
        Images of the kind `config.sees`: (n, h, w); colours and normals (n, h, w, 3). Depth and range are in m: 0 if
        something is nearer than the camera's reach, the farthest value if nothing is within reach. A mask is 1 where
        the class is visible, otherwise 0.
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
    """Length of one unit of depth along each ray, m."""
    directions = jnp.einsum("nij,tjr->nitr", mount.matrix, rays.tiles)
    return rays.image(jnp.linalg.norm(directions, axis=1))


def check(config: CameraConfig) -> None:
    """Check the configuration of a camera.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    check_fields("camera", config)
    most = math.pi if config.projection == "pinhole" else 2 * math.pi + 1e-6
    if max(config.fov) >= most:
        raise ValueError(f"camera.fov is {config.fov}; accepted: angles below {most:.4g} rad")
    if config.sees == "mask" and config.of not in CLASSES:
        raise ValueError(f"camera.of: {unknown('class', config.of, CLASSES)}")
    near, far = config.reach
    if near == far:
        raise ValueError(f"camera.reach is {config.reach}; accepted: two rising numbers of metres")
