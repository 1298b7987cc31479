"""Masks of pads that have a distinct colour."""

import math
from dataclasses import dataclass

import numpy as np

from e2efly.flight.sight.segment import SEGMENTERS, opencv

MOST = (360.0, 100.0, 100.0)
"""Largest hue, degrees, saturation and value, percent."""
NAMES = ("hue", "saturation", "value")
FORM = "mask:colour:H,S,V,H,S,V"


@dataclass(frozen=True)
class Colour:
    """Finds the largest patch whose colours are within bounds, and fills its holes: markings are part of a pad."""

    low: tuple[float, float, float]
    """Smallest hue, degrees, saturation and value, percent (hexcone model: `colorsys.rgb_to_hsv`)."""
    high: tuple[float, float, float]
    """Largest hue, saturation and value. If the largest hue is below the smallest, the range passes through 360
    degrees: from 340 to 20 is red."""

    def __call__(self, colours: np.ndarray) -> np.ndarray:
        """The mask of the largest patch; see `Segmenter`."""
        cv2 = opencv()
        patches, _ = cv2.findContours(self.within(colours), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        mask = np.zeros(colours.shape[:2], np.uint8)
        if patches:
            cv2.drawContours(mask, [max(patches, key=cv2.contourArea)], -1, 1, cv2.FILLED)
        return mask

    def within(self, colours: np.ndarray) -> np.ndarray:
        """1 where a pixel's colour is within the bounds, 0 elsewhere: uint8 (h, w), for uint8 (h, w, 3), red first."""
        cv2 = opencv()
        hsv = cv2.cvtColor(colours, cv2.COLOR_RGB2HSV_FULL)  # hue: 256 for 360 degrees
        low = [self.low[0] * 256 / 360, self.low[1] * 2.55, self.low[2] * 2.55]
        high = [self.high[0] * 256 / 360, self.high[1] * 2.55, self.high[2] * 2.55]
        if self.low[0] <= self.high[0]:
            return cv2.inRange(hsv, np.array(low), np.array(high)) // 255
        above = cv2.inRange(hsv, np.array(low), np.array([256.0, *high[1:]]))
        below = cv2.inRange(hsv, np.array([0.0, *low[1:]]), np.array(high))
        return (above | below) // 255

    def describe(self) -> str:
        """The bounds."""
        low, high = (",".join(f"{x:g}" for x in bound) for bound in (self.low, self.high))
        return f"colours from {low} to {high} (degrees, %, %)"


def open_colour(text: str) -> Colour:
    """Read H,S,V,H,S,V.

    Raises:
        ValueError: naming the bound, its value and what is accepted.
    """
    try:
        numbers = [float(entry) for entry in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 6:
        raise ValueError(f"bounds of the colour are {text!r}; accepted: six numbers, as in {FORM}")
    low, high = tuple(numbers[:3]), tuple(numbers[3:])
    for which, bound in (("lower", low), ("upper", high)):
        for name, value, most in zip(NAMES, bound, MOST, strict=True):
            if not (math.isfinite(value) and 0 <= value <= most):
                raise ValueError(f"{which} {name} of the colour is {value:g}; accepted: 0 to {most:g}")
    for name, least, largest in list(zip(NAMES, low, high, strict=True))[1:]:
        if least > largest:
            raise ValueError(f"lower {name} of the colour is {least:g}; accepted: at most the upper one, {largest:g}")
    return Colour(low, high)  # pyright: ignore


SEGMENTERS.add("colour", open_colour)
