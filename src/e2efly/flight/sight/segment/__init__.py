"""Segmenters, which find the object of a mask in a camera's colours: pure functions of an image, and their names."""

import importlib
from collections.abc import Callable
from types import ModuleType
from typing import Protocol

import numpy as np

from e2efly.config.names import unknown
from e2efly.config.registry import Registry


class Segmenter(Protocol):
    """Makes a mask from colours. Two calls with the same colours give the same mask."""

    def __call__(self, colours: np.ndarray) -> np.ndarray:
        """The mask, uint8 (h, w), 1 where the object is seen, 0 elsewhere, for colours, uint8 (h, w, 3), red first."""
        ...

    def describe(self) -> str:
        """What it looks for, for people and logs."""
        ...


Opener = Callable[[str], Segmenter]
"""Opens a segmenter, given the text after its name. Raises ValueError that says what is accepted."""
SEGMENTERS: Registry[Opener] = Registry("segmenter")
"""The kinds of segmenters. Each registers itself when its module is imported. `chosen` imports the modules."""


def opencv() -> ModuleType:
    """The package `cv2`.

    Raises:
        ValueError: if it is not installed.
    """
    try:
        import cv2
    except ImportError as error:
        raise ValueError(f"OpenCV is not installed ({error}); accepted: pip install 'e2efly[video]'") from None
    return cv2


def chosen(text: str) -> Segmenter:
    """The segmenter that the text NAME[:...] selects.

    Raises:
        ValueError: for an unknown name, with all known names, or with what is wrong with the text after the name.
    """
    for kind in ("apriltag", "colour", "network"):  # each registers itself
        importlib.import_module(f"{__name__}.{kind}")
    name, _, rest = text.partition(":")
    if name not in SEGMENTERS:
        raise ValueError(unknown("segmenter", name, SEGMENTERS))
    return SEGMENTERS[name](rest)
