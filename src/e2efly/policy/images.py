"""The images that a policy sees, as its contract describes them. Imports no JAX and no simulator."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.policy import contract_json as read

SEES = ("depth", "range", "mask", "rgb", "normal")
"""What a policy's image can show."""
PROJECTIONS = ("pinhole", "spherical")
"""A camera, or a sensor with equal angles between columns and between rows."""
ENCODINGS = ("inverse", "log", "linear")
"""How the graph encodes depth and range."""
SLOWEST = 0.01
"""Lowest image rate, Hz."""
NONE = "none"
"""Value of a field that an image does not have: a class if it is no mask, an encoding if it is not depth or range."""
_COLOURS = ("rgb", "normal")
ROUNDING = 1e-5
"""Relative tolerance for values at the ends of a range."""


@dataclass(frozen=True)
class Image:
    """One camera's image, as the camera measures it. Further processing is inside the graph."""

    name: str
    """Name of the graph's input."""
    sees: str
    """One of `SEES`."""
    of: str
    """The class that a mask shows, otherwise `NONE`."""
    width: int
    """Number of columns, counted from the left."""
    height: int
    """Number of rows, counted from the top."""
    projection: str
    """One of `PROJECTIONS`."""
    fov_rad: tuple[float, ...]
    """Horizontal and vertical field of view, rad."""
    reach_m: tuple[float, ...]
    """Nearest and farthest distance that depth and range measure, m."""
    position_m: tuple[float, ...]
    """Position of the camera in the body frame (forward, left, up), m."""
    pitch_rad: float
    """Downward pitch from straight ahead, rad."""
    rate_hz: float
    """Rate of new images, Hz. Between two images, the policy is shown the last one."""
    latency_range_s: tuple[float, ...]
    """Smallest and largest age of an image when the policy first saw it in training, s."""
    encoding: str
    """Inside the graph: one of `ENCODINGS`, or `NONE`."""
    pool: tuple[int, ...]
    """Inside the graph: rows and columns to which the image is reduced, by the mean of each cell, or for depth by its
    nearest value. If it is not reduced, its own rows and columns."""
    description: str
    """Meaning of a value."""
    preprocessing: str
    """Processing of the image inside the graph."""

    @property
    def shape(self) -> tuple[int, ...]:
        """(h, w), or (h, w, 3) for colours and normals."""
        return (self.height, self.width, *((3,) if self.sees in _COLOURS else ()))

    @property
    def tilt(self) -> str:
        """Where the camera looks, in words, to whole degrees."""
        up = round(-math.degrees(self.pitch_rad))
        if abs(up) in (0, 90):
            return {0: "looks straight ahead", 90: "looks straight up", -90: "looks straight down"}[up]
        return f"tilted {abs(up)} degrees {'up' if up > 0 else 'down'}"

    @property
    def mount(self) -> str:
        """The camera that a policy was trained with, in words, for whoever builds the vehicle: how it is turned, where
        it is on the body, how much it sees, its pixels and the age of its images.
        """
        across, down = (f"{math.degrees(angle):.0f}" for angle in self.fov_rad)
        x, y, z = (f"{100 * way:+.1f}" for way in self.position_m)
        place = f"{x} cm ahead, {y} cm left and {z} cm above" if any(self.position_m) else "in the centre of mass"
        low, high = (f"{1e3 * age:.0f}" for age in self.latency_range_s)
        return (
            f"{self.tilt}; {place}; {across} x {down} degrees ({self.projection}), {self.width} x {self.height} pixels "
            f"of {self.sees}; {self.rate_hz:g} Hz, {low} to {high} ms old"
        )

    @property
    def lacking(self) -> str:
        """The beginning of the error of whoever has no camera for it."""
        return f"image {self.name!r}: there is no camera, and the policy was trained with one ({self.mount})"

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest value."""
        if self.sees in ("depth", "range"):
            return 0.0, self.reach_m[1]
        return (-1.0 if self.sees == "normal" else 0.0), 1.0

    def check(self, x: np.ndarray, batch: tuple[int, ...]) -> None:
        """Refuse what the network must not see: one image, or one for each observation of a batch. `batch` is the shape
        before the image's own: (n,) or ().

        Raises:
            ValueError: naming the image, for a wrong shape or type, or a value out of range.
        """
        shape = (*batch, *self.shape)
        if x.shape != shape or x.dtype.kind not in "fiub":
            raise ValueError(
                f"image {self.name!r} has shape {x.shape} and type {x.dtype}; accepted: float32 of shape {shape}: "
                f"{self.description}"
            )
        low, high = self.limits
        room = ROUNDING * (high - low)
        if x.size and not (x.min() >= low - room and x.max() <= high + room):  # false for NaN
            bad = x[~((x >= low - room) & (x <= high + room))]
            raise ValueError(
                f"image {self.name!r} has the value {bad.flat[0]} ({bad.size} such values); accepted: numbers in "
                f"[{low:g}, {high:g}]: {self.description}"
            )

    @staticmethod
    def of_json(value: Any, where: str) -> "Image":
        """Read an image of a contract's JSON, checking every value.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        x = read.table(value, where, Image)
        sees = read.one_of(x["sees"], f"{where}.sees", SEES)
        of, encoding = read.text(x["of"], f"{where}.of"), read.text(x["encoding"], f"{where}.encoding")
        if (of != NONE) != (sees == "mask"):
            raise read.refusal(f"{where}.of", of, f"{NONE!r} but where sees is 'mask', and a class there")
        accepted = ENCODINGS if sees in ("depth", "range") else (NONE,)
        read.one_of(encoding, f"{where}.encoding", accepted)
        height, width = (read.whole(x[key], f"{where}.{key}", 1) for key in ("height", "width"))
        pool = tuple(
            read.whole(entry, f"{where}.pool[{i}]", 1)
            for i, entry in enumerate(read.entries(x["pool"], f"{where}.pool", 2))
        )
        if height % pool[0] or width % pool[1]:
            raise read.refusal(f"{where}.pool", list(pool), f"divisors of the {height} rows and {width} columns")
        projection = read.one_of(x["projection"], f"{where}.projection", PROJECTIONS)
        most = math.pi if projection == "pinhole" else 2 * math.pi + 1e-6
        fov, reach = (read.numbers(x[key], f"{where}.{key}", 2) for key in ("fov_rad", "reach_m"))
        if not all(0 < angle < most for angle in fov):
            raise read.refusal(f"{where}.fov_rad", list(fov), f"two angles in (0, {most:.4g}) rad")
        if not 0 <= reach[0] < reach[1]:
            raise read.refusal(f"{where}.reach_m", list(reach), "two rising numbers of metres, 0 or more")
        rate = read.number(x["rate_hz"], f"{where}.rate_hz")
        if rate < SLOWEST:
            raise read.refusal(f"{where}.rate_hz", rate, f"{SLOWEST:g} Hz or more")
        name, description, preprocessing = (
            read.text(x[key], f"{where}.{key}") for key in ("name", "description", "preprocessing")
        )
        return Image(
            name=name,
            sees=sees,
            of=of,
            width=width,
            height=height,
            projection=projection,
            fov_rad=fov,
            reach_m=reach,
            position_m=read.numbers(x["position_m"], f"{where}.position_m", 3),
            pitch_rad=read.number(x["pitch_rad"], f"{where}.pitch_rad"),
            rate_hz=rate,
            latency_range_s=read.seconds_range(x["latency_range_s"], f"{where}.latency_range_s"),
            encoding=encoding,
            pool=pool,
            description=description,
            preprocessing=preprocessing,
        )
