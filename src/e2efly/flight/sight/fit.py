"""Crops and resamples a camera image to the camera with which a policy was trained."""

import math

import numpy as np

from e2efly.policy.images import Image

NARROWER = 0.02
"""The share of the field of view by which a camera may see less than the policy's camera."""


def fitted(image: np.ndarray, fov: tuple[float, float], camera: Image, where: str) -> np.ndarray:
    """The image as the policy's camera would have taken it.

    Each value belongs to one cell of the policy's image. For depth, it is the nearest valid value of the cell, as in
    the camera's pooling in training, and 0 if the cell has only holes. For a mask, it says whether at least half of the
    cell shows the object. For colours, it is the mean. If the policy's camera has 0 rows and 0 columns, each pixel is
    taken as it is, and a grey image is converted to colours.

    Args:
        image: (h, w) or (h, w, 3): depth in m (0: a hole), a mask, or colours in [0, 1].
        fov: its horizontal and vertical field of view, rad, pinhole. Zeros: the field of view of the policy's camera.
        camera: the camera of the policy's contract.
        where: the name of the image's source, for errors.

    Raises:
        ValueError: naming what does not fit: colours instead of depth, a camera that sees less, or one with fewer
            pixels.
    """
    whole = camera.width == 0 and camera.height == 0
    if whole and camera.sees == "rgb" and image.ndim == 2:
        image = np.repeat(image[..., None], 3, axis=-1)
    if len(image.shape) != len(camera.shape):
        raise ValueError(f"{where} has images of shape {image.shape}; accepted: {camera.shape} or larger")
    if image.shape == camera.shape and (not any(fov) or np.allclose(fov, camera.fov_rad, atol=1e-3)):
        return _within(image, camera)
    shares = (1.0, 1.0)
    if any(fov):
        if camera.projection != "pinhole":
            raise ValueError(f"{where} is a pinhole camera; accepted: {camera.projection} images of {camera.shape}")
        shares = _share(camera.fov_rad[0], fov[0]), _share(camera.fov_rad[1], fov[1])
        for axis, share, has, wants in zip(("across", "down"), shares, fov, camera.fov_rad, strict=True):
            if share > 1 + NARROWER:
                raise ValueError(f"{where} sees {has:.3f} rad {axis}; accepted: {wants:.3f} rad or more")
    if whole:
        return _within(_middle(image, shares), camera)
    rows, columns = _edges(image.shape[0], camera.height, shares[1]), _edges(image.shape[1], camera.width, shares[0])
    if rows is None or columns is None:
        raise ValueError(
            f"{where} has {image.shape[0]} rows and {image.shape[1]} columns; accepted: so many that each of the "
            f"policy's {camera.height} rows and {camera.width} columns has one of its own"
        )
    if camera.sees in ("depth", "range"):
        filled = np.where(image > 0, image, np.inf)
        cells = _by_cell(np.minimum, filled, rows, columns)
        return _within(np.where(np.isfinite(cells), cells, 0.0), camera)
    sums = _by_cell(np.add, image, rows, columns)
    area = np.outer(np.diff(rows), np.diff(columns)).reshape(camera.height, camera.width, *[1] * (image.ndim - 2))
    mean = sums / area
    return (mean >= 0.5).astype(np.float32) if camera.sees == "mask" else mean.astype(np.float32)


def _share(wants: float, has: float) -> float:
    """The share of a pinhole image's width that a narrower image covers."""
    return math.tan(wants / 2) / math.tan(has / 2)


def _middle(image: np.ndarray, shares: tuple[float, float]) -> np.ndarray:
    """The middle part of an image, with these shares of its width and height."""
    across, down = (round(n * (1 - min(share, 1.0)) / 2) for n, share in zip(image.shape[1::-1], shares, strict=True))
    return image[down : image.shape[0] - down, across : image.shape[1] - across]


def _edges(pixels: int, cells: int, share: float) -> np.ndarray | None:
    """The first pixel of each cell, and the pixel after the last cell. None: there are too few pixels."""
    share = min(share, 1.0)
    edges = np.round(pixels / 2 + pixels / 2 * share * np.linspace(-1, 1, cells + 1)).astype(int)
    return edges if np.all(np.diff(edges) > 0) else None


def _by_cell(together: np.ufunc, image: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """One value for each cell. `rows` and `columns` hold the first pixel of each cell; their last entries are the end
    of the last cell.
    """
    inside = image[: rows[-1], : columns[-1]]
    return together.reduceat(together.reduceat(inside, rows[:-1], axis=0), columns[:-1], axis=1)


def _within(depth: np.ndarray, camera: Image) -> np.ndarray:
    """Depth as the policy's camera gives it: 0 if nearer than its reach, and at most its far limit."""
    if camera.sees not in ("depth", "range"):
        return depth.astype(np.float32)
    near, far = camera.reach_m
    return np.where(depth < near, 0.0, np.minimum(depth, far)).astype(np.float32)
