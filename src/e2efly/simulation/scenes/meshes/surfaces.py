"""Surfaces and textures made in code, for `e2efly.simulation.scenes.meshes.procedural`."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt8

TEXELS = 64
"""Width and height of a texture, in texels."""


@dataclass(frozen=True)
class Surface:
    """Triangles with coordinates in a texture that repeats every metre."""

    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]
    uv: Float[np.ndarray, "v 2"]

    def turned(self, yaw: float, offset: Any) -> "Surface":
        """Rotated about z, rad, then moved, m."""
        c, s = np.cos(yaw), np.sin(yaw)
        matrix = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return Surface(self.vertices @ matrix.T + offset, self.faces, self.uv)


def join(*surfaces: Surface) -> Surface:
    """Several surfaces as one."""
    before = np.cumsum([0] + [len(s.vertices) for s in surfaces[:-1]])
    return Surface(
        np.concatenate([s.vertices for s in surfaces]),
        np.concatenate([s.faces + first for s, first in zip(surfaces, before, strict=True)]),
        np.concatenate([s.uv for s in surfaces]),
    )


def sheet(points: Float[np.ndarray, "a b 3"], uv: Float[np.ndarray, "a b 2"]) -> Surface:
    """A grid of points. Its front is the side from which the first axis turns counter-clockwise to the second."""
    a, b, _ = points.shape
    i = (np.arange(a - 1)[:, None] * b + np.arange(b - 1)).ravel()
    faces = np.concatenate([np.stack([i, i + b, i + b + 1], axis=1), np.stack([i, i + b + 1, i + 1], axis=1)])
    return Surface(points.reshape(-1, 3), faces, uv.reshape(-1, 2))


def box(low: Any, high: Any) -> Surface:
    """An upright box between two corners, m."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    sides = []
    for axis in range(3):
        across, up = (axis + 1) % 3, (axis + 2) % 3
        for end in (low, high):
            points = np.empty((2, 2, 3))
            points[..., axis] = end[axis]
            points[..., across] = np.array([[low[across]], [high[across]]])
            points[..., up] = np.array([[low[up], high[up]]])
            # on upright sides the texture's v is along z
            uv = points[..., [across, up] if up == 2 or axis == 2 else [up, across]]
            swap = end is low
            sides.append(sheet(points.swapaxes(0, 1) if swap else points, uv.swapaxes(0, 1) if swap else uv))
    return join(*sides)


def turned_profile(radius: Any, height: Any, segments: int) -> Surface:
    """A body of revolution about z, from a profile (radius, height) from bottom to top, m."""
    radius, height = np.asarray(radius, float), np.asarray(height, float)
    angle = np.linspace(0.0, 2 * np.pi, segments + 1)
    points = np.stack(
        [np.outer(np.cos(angle), radius), np.outer(np.sin(angle), radius), np.tile(height, (segments + 1, 1))], axis=-1
    )
    around = np.outer(angle, np.full(len(radius), radius.max()))
    along = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(radius), np.diff(height)))])
    return sheet(points, np.stack([around, np.broadcast_to(along, around.shape)], axis=-1))


def cylinder(radius: float, low: float, high: float, segments: int = 16) -> Surface:
    """An upright closed cylinder about z, m."""
    side = turned_profile([radius, radius], [low, high], segments)
    angle = np.linspace(0.0, 2 * np.pi, segments, endpoint=False)
    rim = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    i = np.arange(1, segments - 1)
    fan = np.stack([np.zeros_like(i), i, i + 1], axis=1)
    ends = [
        Surface(np.column_stack([rim, np.full(segments, z)]), fan[:, ::way], rim) for z, way in ((low, -1), (high, 1))
    ]
    return join(side, *ends)


def noise(rng: np.random.Generator, roughness: float, size: int = TEXELS) -> Float[np.ndarray, "size size"]:
    """Random values that repeat at the borders, with mean 0 and deviation 1.

    The spectrum falls with the frequency to the power of `-roughness`.
    """
    k = np.fft.fftfreq(size) * size
    amplitude = np.maximum(np.hypot(k[:, None], k[None]), 1.0) ** -roughness
    amplitude[0, 0] = 0.0
    wave = np.fft.ifft2(amplitude * np.fft.fft2(rng.standard_normal((size, size)))).real
    return wave / wave.std()


def speckled(rng: np.random.Generator, colour: Any, contrast: float) -> UInt8[np.ndarray, "h w 3"]:
    """One colour, RGB in [0, 1], with random variations of brightness."""
    return _image(np.asarray(colour) * (1 + contrast * noise(rng, 0.8)[..., None]))


def striped(rng: np.random.Generator, colour: Any, lines: int) -> UInt8[np.ndarray, "h w 3"]:
    """Vertical joints, `lines` per metre."""
    image = np.asarray(colour) * (1 + 0.06 * noise(rng, 0.8)[..., None])
    image[:, np.arange(TEXELS) * lines % TEXELS < 2 * lines] *= 0.6
    return _image(image)


def _image(values: np.ndarray) -> UInt8[np.ndarray, "h w 3"]:
    return np.rint(255 * np.clip(values, 0.0, 1.0)).astype(np.uint8)
