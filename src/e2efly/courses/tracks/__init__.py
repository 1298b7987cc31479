"""Race tracks as data files, and their loader."""

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.config.names import unknown
from e2efly.config.tables import number, numbers, read_table, shown

_HERE = Path(__file__).parent
_ACCEPTED = "accepted: closed (true or false), start {position [x, y, z], yaw}, gates [{position, yaw, opening [w, h]}]"


@dataclass(frozen=True)
class RaceTrack:
    """A race track, world ENU, m and rad."""

    name: str
    closed: bool
    """Whether the first gate follows the last."""
    start: np.ndarray
    """(3,) start of a race."""
    start_yaw: float
    """Heading at the start."""
    position: np.ndarray
    """(gates, 3) centres of the openings."""
    yaw: np.ndarray
    """(gates,) the direction of flight through each gate, about world z."""
    opening: np.ndarray
    """(gates, 2) inner width and height."""

    @property
    def corners(self) -> np.ndarray:
        """(gates, 4, 3) corners of the openings."""
        left = np.stack([-np.sin(self.yaw), np.cos(self.yaw), 0 * self.yaw], axis=-1) * self.opening[:, :1] / 2
        up = np.array([0.0, 0.0, 0.5]) * self.opening[:, 1:]
        return np.stack([self.position + a * left + b * up for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))], axis=1)

    def enlarged(self, scale: float) -> "RaceTrack":
        """The track with its ground plan enlarged. Heights and openings stay the same."""
        size = np.array([scale, scale, 1.0])
        return dataclasses.replace(self, start=self.start * size, position=self.position * size)


def track_names() -> list[str]:
    """Names of the tracks that the package ships."""
    return sorted(path.stem for path in _HERE.glob("*.toml"))


def track_file(name_or_path: str) -> Path:
    """The file of a shipped track, by its name, or of any other track, by its path.

    Raises:
        ValueError: when there is no such file.
    """
    path = Path(name_or_path) if name_or_path.endswith(".toml") else _HERE / f"{name_or_path}.toml"
    if not path.is_file():
        raise ValueError(unknown("track", name_or_path, track_names()) + ", or the path of a .toml file")
    return path


def load_track(name_or_path: str) -> RaceTrack:
    """Load a shipped track by name, or any other track by the path of its .toml file.

    Raises:
        ValueError: naming the file, the key, the value and what is accepted.
    """
    path = track_file(name_or_path)
    table = read_table(path)
    _keys(path, "the file", table, {"closed", "start", "gates"})
    if not isinstance(table["closed"], bool):
        raise ValueError(f"{path}: closed is {shown(table['closed'])}; accepted: true or false")
    gates = table["gates"]
    if not isinstance(gates, list) or len(gates) < 2:
        raise ValueError(f"{path}: gates is {shown(gates)}; accepted: a list of at least 2")
    _keys(path, "start", table["start"], {"position", "yaw"})
    for i, gate in enumerate(gates):
        _keys(path, f"gates[{i}]", gate, {"position", "yaw", "opening"})
    opening = np.stack([numbers(f"{path}: gates[{i}].opening", g["opening"], 2) for i, g in enumerate(gates)])
    position = np.stack([numbers(f"{path}: gates[{i}].position", g["position"], 3) for i, g in enumerate(gates)])
    for i, (p, o) in enumerate(zip(position, opening, strict=True)):
        if np.any(o <= 0.3):
            raise ValueError(f"{path}: gates[{i}].opening is {o.tolist()}; accepted: more than 0.3 m")
        if p[2] - o[1] / 2 < 0:
            raise ValueError(f"{path}: gates[{i}].position z is {p[2]} m; accepted: an opening above the ground")
    return RaceTrack(
        name=path.stem,
        closed=table["closed"],
        start=numbers(f"{path}: start.position", table["start"]["position"], 3),
        start_yaw=math.radians(number(f"{path}: start.yaw", table["start"]["yaw"])),
        position=position,
        yaw=np.radians([number(f"{path}: gates[{i}].yaw", g["yaw"]) for i, g in enumerate(gates)]),
        opening=opening,
    )


def track_text(track: RaceTrack) -> str:
    """A track as the text of a .toml file for `load_track`.

    Angles are exact to a microradian, lengths to a micrometre.
    """

    def row(values: np.ndarray) -> str:
        return "[" + ", ".join(f"{float(x):.6f}" for x in values) + "]"

    def degrees(yaw: float) -> str:
        return f"{math.degrees(float(yaw)):.5f}"

    gates = (
        f"  {{ position = {row(p)}, yaw = {degrees(yaw)}, opening = {row(o)} }},"
        for p, yaw, o in zip(track.position, track.yaw, track.opening, strict=True)
    )
    return "\n".join([
        "# Angles in degrees, lengths in metres, world ENU.",
        f"closed = {str(bool(track.closed)).lower()}",
        f"start = {{ position = {row(track.start)}, yaw = {degrees(track.start_yaw)} }}",
        "gates = [", *gates, "]", "",
    ])  # fmt: skip


def _keys(path: Path, where: str, table: Any, wanted: set[str]) -> None:
    if not isinstance(table, dict) or set(table) != wanted:
        found = sorted(table) if isinstance(table, dict) else shown(table)
        raise ValueError(f"{path}: {where} has {found}; {_ACCEPTED}")
