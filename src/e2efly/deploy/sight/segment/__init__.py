"""Who finds what a mask is of in the colours of a camera: pure functions of an image, and how they are written."""

import importlib
from collections.abc import Callable
from types import ModuleType
from typing import Protocol

import numpy as np

from e2efly.registry import Registry
from e2efly.vehicles.names import unknown


class Segmenter(Protocol):
    """Makes a mask of colours. Two calls with the same colours give the same mask."""

    def __call__(self, colours: np.ndarray) -> np.ndarray:
        """The mask, uint8 (h, w), 1 where the object is seen, else 0, of colours, uint8 (h, w, 3), red first."""
        ...

    def describe(self) -> str:
        """What it looks for, for people and logs."""
        ...


Opener = Callable[[str], Segmenter]
"""Opens a segmenter, given the text behind its name; raises ValueError with what is accepted."""
SEGMENTERS: Registry[Opener] = Registry("segmenter")
"""The kinds of segmenters; each registers itself when its module is imported, as `chosen` does."""


def opencv() -> ModuleType:
    """The package `cv2`.

    Raises:
        ValueError: where it is not installed.
    """
    try:
        import cv2
    except ImportError as error:
        raise ValueError(f"OpenCV is not installed ({error}); accepted: pip install 'e2efly[video]'") from None
    return cv2


def chosen(text: str) -> Segmenter:
    """The segmenter that NAME[:...] is.

    Raises:
        ValueError: for an unknown name, with all there are; what is wrong with the text behind it.
    """
    for kind in ("apriltag", "colour", "network"):  # each registers itself
        importlib.import_module(f"{__name__}.{kind}")
    name, _, rest = text.partition(":")
    if name not in SEGMENTERS:
        raise ValueError(unknown("segmenter", name, SEGMENTERS))
    return SEGMENTERS[name](rest)
