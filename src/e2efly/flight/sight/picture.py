"""What a policy's network receives, shown to people: as a picture in the terminal, and as a PNG."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.text import Text

from e2efly.flight.scripts.record import png
from e2efly.policy.images import Image

HOLE = (90, 0, 60)
"""Colour where depth has no value: red, green, blue, 0 to 255."""
COLUMNS = 64
"""The widest picture in the terminal, characters."""
PIXELS = 512
"""A PNG is enlarged by a whole number to about this width, pixels."""
GAP = 2
"""Gap between a picture and the pictures beside it, pixels."""


def colours(image: np.ndarray, camera: Image) -> np.ndarray:
    """An image as red, green and blue, (h, w, 3) uint8.

    Depth is bright near and dark far, over the camera's reach, and `HOLE` where it is 0. Normals are mapped from [-1,
    1] to [0, 1]. `Image.check` must accept the image.
    """
    low, high = camera.limits
    share = np.clip((image - low) / (high - low), 0.0, 1.0)
    if camera.sees in ("depth", "range"):
        grey = np.round(255 * (1.0 - share)).astype(np.uint8)
        return np.where((image > 0)[..., None], grey[..., None], np.array(HOLE, np.uint8))
    shown = np.round(255 * share).astype(np.uint8)
    return shown if shown.ndim == 3 else np.repeat(shown[..., None], 3, axis=2)


def sheet(shown: np.ndarray, others: Sequence[np.ndarray]) -> np.ndarray:
    """A picture with others of the same size to its right, in two rows, after a gap. All are (h, w, 3) uint8. The
    result is (h or 2 h, ..., 3) uint8, with the picture in the upper left. Without others, it is the picture alone.
    """
    if not len(others):
        return shown
    h, w, _ = shown.shape
    rows = 1 if len(others) == 1 else 2
    columns = -(-len(others) // rows)
    whole = np.full((rows * h, GAP + (columns + 1) * w, 3), 255, np.uint8)
    whole[:h, :w] = shown
    for i, other in enumerate(others):
        y, x = i // columns * h, GAP + (1 + i % columns) * w
        whole[y : y + h, x : x + w] = other
    return whole


def blocks(pixels: np.ndarray, columns: int = COLUMNS) -> Text:
    """A picture for the terminal: each character is two pixels, one above the other. `pixels` is (h, w, 3) uint8. A
    picture wider than `columns` characters is reduced to every second, third, ... pixel.
    """
    step = -(-pixels.shape[1] // columns)
    small = pixels[::step, ::step].astype(int)
    text = Text()
    for y in range(0, small.shape[0], 2):
        for x in range(small.shape[1]):
            upper = "rgb({},{},{})".format(*small[y, x])
            under = " on rgb({},{},{})".format(*small[y + 1, x]) if y + 1 < small.shape[0] else ""
            text.append("\u2580", upper + under)
        text.append("\n" if y + 2 < small.shape[0] else "")
    return text


def write_png(path: Path, pixels: np.ndarray) -> None:
    """Write a picture, enlarged. The folder of the file is created. `pixels` is (h, w, 3) uint8.

    Raises:
        OSError: if it cannot be written.
    """
    times = max(PIXELS // pixels.shape[1], 1)
    large = pixels.repeat(times, axis=0).repeat(times, axis=1)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(png(large.tobytes(), large.shape[0], large.shape[1], 3, 8))
