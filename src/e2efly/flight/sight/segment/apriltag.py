"""Masks of pads that carry AprilTags (Olson, "AprilTag: A robust and flexible visual fiducial system", 2011)."""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.flight.sight.segment import SEGMENTERS, opencv

FAMILIES = ("16h5", "25h9", "36h10", "36h11")
"""The families that OpenCV supports."""
LARGEST = 20.0
"""The largest width of a pad, in widths of its tag."""
FORM = "mask:apriltag:FAMILY[:ID[xFACTOR],...]"
_BEHIND = 1e-3
"""Corners of a pad whose depth is less than this share of the tag's depth are at or behind the camera's plane."""


@dataclass(frozen=True)
class AprilTags:
    """Finds tags of a family, and makes a mask of the pads under them."""

    family: str
    """One of `FAMILIES`."""
    factors: dict[int, float]
    """Width of the pad divided by the width of its tag, by the tag's ID. Empty: each tag of the family is a pad."""

    def __post_init__(self) -> None:
        cv2 = opencv()
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_CONTOUR  # best on drawn tags of 24 to 160 pixels
        parameters.errorCorrectionRate = 1.0  # all bits that the family can correct: a small tag may cover some of them
        parameters.minMarkerPerimeterRate = 0.02  # of the longer side: tags of a few pixels are never read
        detector = cv2.aruco.ArucoDetector(_dictionary(cv2, self.family), parameters)
        object.__setattr__(self, "_detector", detector)

    def __call__(self, colours: np.ndarray) -> np.ndarray:
        """The mask of all pads whose tags are seen; see `Segmenter`."""
        cv2 = opencv()
        detector: Any = self._detector  # pyright: ignore
        corners, numbers, _ = detector.detectMarkers(cv2.cvtColor(colours, cv2.COLOR_RGB2GRAY))
        mask = np.zeros(colours.shape[:2], np.uint8)
        for square, number in zip(corners, [] if numbers is None else numbers.ravel(), strict=True):
            if self.factors and int(number) not in self.factors:
                continue
            outline = enlarged(square.reshape(4, 2).astype(np.float64), self.factors.get(int(number), 1.0))
            fixed = np.round(outline * 16).astype(np.int32)  # sixteenths of a pixel
            cv2.fillConvexPoly(mask, fixed, 1, lineType=cv2.LINE_8, shift=4)
        return mask

    def describe(self) -> str:
        """The family and the IDs."""
        chosen = ",".join(f"{i}x{factor:g}" for i, factor in self.factors.items()) or "any"
        return f"AprilTag {self.family}, {chosen}"


def enlarged(square: np.ndarray, factor: float) -> np.ndarray:
    """A square in perspective, enlarged about its centre in its own plane. Both squares are (4, 2) corners in the
    image, pixels, in order around the square. `factor` is the new width divided by the old width. If a corner would lie
    behind the camera, it is the original square.
    """
    if factor == 1.0:
        return square
    unit = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    rows = []
    for (u, v), (x, y) in zip(unit, square, strict=True):
        rows += [[u, v, 1, 0, 0, 0, -x * u, -x * v], [0, 0, 0, u, v, 1, -y * u, -y * v]]
    matrix = np.append(np.linalg.solve(np.array(rows), square.ravel()), 1.0).reshape(3, 3)
    wider = np.column_stack([factor * unit, np.ones(4)]) @ matrix.T
    if wider[:, 2].min() < _BEHIND:
        return square
    return wider[:, :2] / wider[:, 2:]


def open_apriltag(text: str) -> AprilTags:
    """Read FAMILY[:ID[xFACTOR],...].

    Raises:
        ValueError: naming what is wrong: the family, an ID that it does not have, or a factor.
    """
    family, colon, listed = text.partition(":")
    family = family.removeprefix("tag")
    if family not in FAMILIES:
        raise ValueError(f"family of AprilTags is {family!r}; accepted: {', '.join(FAMILIES)}")
    factors: dict[int, float] = {}
    if colon:
        cv2 = opencv()
        many = len(_dictionary(cv2, family).bytesList)
        for entry in listed.split(","):
            found = re.fullmatch(r"(\d{1,6})(?:x(\d{1,4}(?:\.\d{1,6})?))?", entry, re.ASCII)
            if not found:
                raise ValueError(f"AprilTag is {entry!r}; accepted: ID or IDxFACTOR, as in {FORM}")
            number, factor = int(found[1]), float(found[2] or 1)
            if number >= many:
                raise ValueError(f"ID of an AprilTag is {number}; accepted: 0 to {many - 1} of family {family}")
            if not 1 <= factor <= LARGEST:
                raise ValueError(f"factor of AprilTag {number} is {factor:g}; accepted: 1 to {LARGEST:g}")
            if number in factors:
                raise ValueError(f"AprilTag {number} is there twice; accepted: each ID once")
            factors[number] = factor
    return AprilTags(family, factors)


def _dictionary(cv2: Any, family: str) -> Any:
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_APRILTAG_{family}"))


SEGMENTERS.add("apriltag", open_apriltag)
