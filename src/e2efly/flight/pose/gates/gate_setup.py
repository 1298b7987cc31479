"""The file of a racer's eye: the track, where the vehicle stands, and the camera as it is mounted."""

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.config.tables import number, numbers, read_table, shown, text
from e2efly.courses.tracks import RaceTrack, load_track
from e2efly.flight.pose.gates.error_state import AssumedNoise
from e2efly.flight.pose.gates.lens import Lens
from e2efly.policy.images import NONE, Image

FORM = (
    "track, a name or the path of a .toml file; start = [x, y, z, heading] of the vehicle that stands, m and degrees; "
    "[camera] with width, height, fov = [across, down] and pitch in degrees, rate in Hz, and optionally position, m, "
    "latency and readout, s; [noise] with fields of AssumedNoise"
)
_CAMERA = {"width", "height", "fov", "pitch", "rate"}
_OPTIONAL = {"position", "latency", "readout"}
_SLOWEST = 1.0


@dataclass(frozen=True)
class GateSetup:
    """What an estimator by gates has to be told."""

    track: RaceTrack
    """The gates, where they stand."""
    start: np.ndarray
    """(4,) position of the centre of mass, m, and heading, rad, of the vehicle that stands."""
    lens: Lens
    """The camera."""
    rate: float
    """Images per second."""
    latency: float
    """Usual time from the exposure of an image to its stamp, s."""
    noise: AssumedNoise = AssumedNoise()
    """What the estimator assumes of its sensors."""

    @property
    def image(self) -> Image:
        """The camera's image, as a contract describes it: the mask of the gates."""
        c, size = self.lens, (self.lens.height, self.lens.width)
        return Image(
            name="gates", sees="mask", of="gate", width=c.width, height=c.height, projection="pinhole",
            fov_rad=c.fov, reach_m=(0.0, 20.0), position_m=c.position, pitch_rad=c.pitch, rate_hz=self.rate,
            latency_range_s=(0.0, 2 * self.latency), encoding=NONE, pool=size,
            description="1 where a gate is seen, 0 elsewhere", preprocessing="none",
        )  # fmt: skip


def load_setup(path: Path) -> GateSetup:
    """Read a file.

    Raises:
        ValueError: naming the file, the key, the value and what is accepted.
    """
    table = read_table(path)
    if not {"track", "start", "camera"} <= set(table) <= {"track", "start", "camera", "noise"}:
        raise ValueError(f"{path}: has {sorted(table)}; accepted: {FORM}")
    camera, noise = table["camera"], table.get("noise", {})
    if not isinstance(camera, dict) or not _CAMERA <= set(camera) <= _CAMERA | _OPTIONAL:
        raise ValueError(f"{path}: camera is {shown(camera)}; accepted: {FORM}")
    track = load_track(text(f"{path}: track", table["track"]))
    start = numbers(f"{path}: start", table["start"], 4) * [1, 1, 1, math.pi / 180]

    def of(key: str, low: float, high: float, default: float | None = None) -> float:
        value = number(f"{path}: camera.{key}", camera.get(key, default))
        if not low <= value <= high:
            raise ValueError(f"{path}: camera.{key} is {value:g}; accepted: {low:g} to {high:g}")
        return value

    def pixels(key: str) -> int:
        value = of(key, 32, 4096)
        if value != int(value):
            raise ValueError(f"{path}: camera.{key} is {value:g}; accepted: a whole number of pixels, 32 to 4096")
        return int(value)

    fov = numbers(f"{path}: camera.fov", camera["fov"], 2, " of degrees")
    if not np.all((fov > 1) & (fov < 170)):
        raise ValueError(f"{path}: camera.fov is {fov.tolist()}; accepted: two angles of 1 to 170 degrees")
    place = numbers(f"{path}: camera.position", camera.get("position", [0.0, 0.0, 0.0]), 3, " of metres")
    lens = Lens(
        pixels("width"), pixels("height"), (math.radians(fov[0]), math.radians(fov[1])),
        math.radians(of("pitch", -90, 90)), tuple(place.tolist()), of("readout", 0.0, 0.1, 0.0),
    )  # fmt: skip
    return GateSetup(
        track, start, lens, of("rate", 1.0, 500.0), of("latency", 0.0, _SLOWEST, 0.03), _noise(path, noise)
    )


def _noise(path: Path, table: Any) -> AssumedNoise:
    known = {f.name: f for f in dataclasses.fields(AssumedNoise)}
    if not isinstance(table, dict) or not set(table) <= set(known):
        raise ValueError(f"{path}: noise is {shown(table)}; accepted: {', '.join(known)}")
    values: dict[str, Any] = {}
    for name, value in table.items():
        many = name == "start"
        got = numbers(f"{path}: noise.{name}", value, 3) if many else np.array([number(f"{path}: noise.{name}", value)])
        if not np.all(got > 0):
            raise ValueError(f"{path}: noise.{name} is {shown(value)}; accepted: more than 0")
        values[name] = tuple(got.tolist()) if many else float(got[0])
    return AssumedNoise(**values)
