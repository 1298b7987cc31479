"""What the rows of the stress change about cameras: mounting, field of view, noise, and the timing of images."""

import dataclasses
import math
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from e2efly.config import CameraConfig, ImageNoiseConfig
from e2efly.simulation.scenes.camera import mounted
from e2efly.simulation.sensors.eyes import Eye, steps_between

DEPTH = "depth"
"""The kind of image to which the noise of a D435i applies."""


@dataclass(frozen=True)
class CameraRow:
    """One way in which real cameras differ from those of a policy's contract."""

    turn: float = 0.0
    """Rotation of the mounting about a random axis, rad."""
    offset: float = 0.0
    """Offset of the mounting in a random direction, m."""
    fov: float = 0.0
    """Relative change of the field of view, for both axes."""
    latency: float = 0.0
    """Time added to the age of the images, s."""
    every: int = 1
    """Only every Nth image arrives."""
    noise: bool = False
    """Whether depth has the noise of a D435i."""

    @property
    def there(self) -> bool:
        """Whether it changes anything."""
        return self != CameraRow()

    def fits(self, cameras: tuple[CameraConfig, ...]) -> bool:
        """Whether it applies to a policy with these cameras."""
        if self.noise:
            return any(camera.sees == DEPTH for camera in cameras)
        return bool(cameras) or not self.there


CAMERAS: dict[str, CameraRow] = {
    "camera 3 degrees and 1 cm off": CameraRow(turn=math.radians(3), offset=0.01),
    "field of view x0.97": CameraRow(fov=-0.03),
    "field of view x1.03": CameraRow(fov=0.03),
    "images 40 ms older": CameraRow(latency=0.04),
    "images half as often": CameraRow(every=2),
    "noise of a D435i": CameraRow(noise=True),
}
"""The rows by name."""


@dataclass(frozen=True)
class CameraDraw:
    """How the cameras of n vehicles differ."""

    angles: np.ndarray
    """(n, 3) roll, pitch and yaw of the mounting, rad."""
    offset: np.ndarray
    """(n, 3) offset of the mounting, body frame, m."""
    fov: np.ndarray
    """(n, 1) factor on the field of view."""
    latency: np.ndarray
    """(n,) time added to the age of the images, s."""
    every: np.ndarray
    """(n,) only every Nth image arrives."""
    noisy: np.ndarray
    """(n,), 1: depth has the noise of a D435i, 0: it is clean."""

    @staticmethod
    def of(row: CameraRow | None, rng: np.random.Generator, n: int) -> "CameraDraw":
        """Draw n episodes of a row; None: of all rows at once, every strength between their extremes."""
        rows = tuple(CAMERAS.values())

        def strength(name: str) -> np.ndarray:
            if row is not None:
                return np.full(n, float(getattr(row, name)))
            values = [float(getattr(r, name)) for r in (*rows, CameraRow())]
            return rng.uniform(min(values), max(values), n)

        axis, way = (x / np.linalg.norm(x, axis=1, keepdims=True) for x in rng.standard_normal((2, n, 3)))
        return CameraDraw(
            angles=strength("turn")[:, None] * axis,
            offset=strength("offset")[:, None] * way,
            fov=1 + strength("fov")[:, None],
            latency=strength("latency"),
            every=np.round(strength("every")),
            noisy=np.round(strength("noise")),
        )

    def eyes(self, cameras: tuple[CameraConfig, ...], eyes: tuple[Eye, ...], period: float) -> tuple[Eye, ...]:
        """The eyes of n vehicles with the changes of a row. Only the light is otherwise random."""
        return tuple(self._eye(camera, eye, period) for camera, eye in zip(cameras, eyes, strict=True))

    def _eye(self, camera: CameraConfig, eye: Eye, period: float) -> Eye:
        return dataclasses.replace(
            eye,
            mount=mounted(camera, *(jnp.asarray(x) for x in (self.angles, self.fov, self.offset))),
            latency=camera.latency[0] + self.latency,
            noisy=self.noisy > 0 if camera.sees == DEPTH else eye.noisy,
            every=steps_between(camera, period) * self.every,
        )


_FIELDS = [field.name for field in dataclasses.fields(CameraDraw)]
jax.tree_util.register_dataclass(CameraDraw, data_fields=_FIELDS, meta_fields=[])


def with_noise(cameras: tuple[CameraConfig, ...]) -> tuple[CameraConfig, ...]:
    """The cameras with the noise of a D435i in place of their own noise, if they see depth."""
    noise = ImageNoiseConfig(d435i=True)
    return tuple(dataclasses.replace(c, noise=noise) if c.sees == DEPTH else c for c in cameras)
