"""A drawing of a vehicle for whoever builds it, as SVG: from above and from the right, drawn to scale of its files.

The rotors and their order are the vehicle file's, the parts are those of a list of parts, and each camera's direction
and field of view are those that a policy was trained with.
"""

import math
from dataclasses import dataclass
from html import escape
from itertools import product

import numpy as np

from e2efly.alignment.parts import Part, prototype
from e2efly.config.drawing import INK
from e2efly.vehicles.vehicle import Vehicle
from e2efly.viewing.style import BLUE, GREEN, GREY, PALE, VERMILLION

WIDTH_PX, HEIGHT_PX = 1240, 860
SCALE = 2100.0
"""Pixels of a metre."""
ABOVE, RIGHT = (290.0, 330.0), (830.0, 390.0)
"""Where the body's origin is in the two views, px from the left and from the top."""
SEEN = 0.11
"""Length of a drawn field of view, m."""
LEGEND, LINE = 690.0, 20.0
"""Top of the list of parts, and the height of a line, px."""


@dataclass(frozen=True)
class Mounted:
    """A camera on the vehicle."""

    part: str
    """Its name in the list of parts."""
    pitch: float
    """Angle of its axis below the body's x axis, rad: -0.35 looks 20 degrees up, pi/2 straight down."""
    fov: tuple[float, float]
    """Horizontal and vertical field of view that a policy was trained with, rad."""
    seen: str
    """Words for the legend, before how much is seen of its image: `land_visual sees`."""

    @property
    def angle(self) -> str:
        """Where it looks."""
        up = round(-math.degrees(self.pitch))
        where = {90: "straight up", -90: "straight down", 0: "straight ahead"}.get(up)
        return where or f"{abs(up)}° {'up' if up > 0 else 'down'}"

    @property
    def words(self) -> str:
        """Where it looks, and how much of its image a policy sees."""
        across, down = (round(math.degrees(x)) for x in self.fov)
        return f"{self.angle}; {self.seen} {across}° x {down}°"


def drawing(vehicle: Vehicle, title: str, parts: tuple[Part, ...], cameras: tuple[Mounted, ...]) -> str:
    """The drawing, as the text of an SVG file.

    Raises:
        ValueError: for a camera that is not in the list of parts.
    """
    names = [part.name for part in parts]
    for camera in cameras:
        if camera.part not in names:
            raise ValueError(f"camera {camera.part!r} is not in the list of parts; accepted: {', '.join(names)}")
    inside = [
        f'<rect width="{WIDTH_PX}" height="{HEIGHT_PX}" fill="white"/>',
        _text(24, 36, title, 20, weight="bold"),
        *_above(vehicle, parts),
        *_beside(vehicle, parts, cameras),
        *_legend(parts, cameras),
    ]
    head = f'viewBox="0 0 {WIDTH_PX} {HEIGHT_PX}" font-family="DejaVu Sans, Arial, sans-serif" fill="{INK}"'
    return "\n".join([f'<svg xmlns="http://www.w3.org/2000/svg" {head}>', *inside, "</svg>", ""])


def _above(vehicle: Vehicle, parts: tuple[Part, ...]) -> list[str]:
    """From above: forward is up on the page, left is left."""

    def at(x: float, y: float) -> tuple[float, float]:
        return ABOVE[0] - SCALE * y, ABOVE[1] - SCALE * x

    out = [_text(24, 70, "from above", 15)]
    for rotor in vehicle.rotor_position:
        out.append(_line(ABOVE, at(*rotor), PALE, 16))
    for part in parts:
        for place in part.places:
            x, y = at(place[0], place[1])
            out.append(_shape(part, x, y, (1, 0)))
    arm = float(np.hypot(*vehicle.rotor_position[0]))
    for number, (rotor, spin) in enumerate(zip(vehicle.rotor_position, vehicle.rotor_spin, strict=True), 1):
        x, y = at(*rotor)
        out += [
            _turning(x, y, 62, clockwise=bool(spin > 0)),
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="20" fill="white"/>',
        ]
        out.append(_text(x, y + 9, str(number), 26, "middle", "bold", attributes=f'id="motor-{number}"'))
    out += _axes(ABOVE, ((0, -1, "x forward"), (-1, 0, "y left")))
    told = (
        "numbers: motors in Betaflight's order (QUADX)", "arrows: how the propellers turn (props in)",
        f"arm {1e3 * arm:.0f} mm, {2e3 * arm:.0f} mm between opposite motors",
    )  # fmt: skip
    return [*out, *(_text(ABOVE[0], ABOVE[1] + 252 + LINE * i, line, 14, "middle") for i, line in enumerate(told))]


def _beside(vehicle: Vehicle, parts: tuple[Part, ...], cameras: tuple[Mounted, ...]) -> list[str]:
    """From the right: forward is right on the page, up is up."""

    def at(x: float, z: float) -> tuple[float, float]:
        return RIGHT[0] + SCALE * x, RIGHT[1] - SCALE * z

    out = [_text(RIGHT[0] - 290, 70, "from the right", 15)]
    for camera, colour in zip(cameras, (BLUE, GREEN), strict=False):
        part = next(part for part in parts if part.name == camera.part)
        x, z = part.places[0][0], part.places[0][2]
        rays = [camera.pitch + sign * camera.fov[1] / 2 for sign in (-1, 1)]
        ends = [at(x + SEEN * math.cos(ray), z - SEEN * math.sin(ray)) for ray in rays]
        corners = " ".join(f"{a:.1f},{b:.1f}" for a, b in (at(x, z), *ends))
        out.append(f'<polygon points="{corners}" fill="{colour}" fill-opacity="0.12" stroke="{colour}"/>')
        ahead = at(x + SEEN * math.cos(camera.pitch), z - SEEN * math.sin(camera.pitch))
        out.append(_line(at(x, z), ahead, colour, 1.5, "6 4"))
        level = at(x + SEEN, z)
        if abs(camera.pitch) < 1.5:
            out.append(_line(at(x, z), level, GREY, 1, "2 3"))
        out.append(_text(ahead[0], ahead[1] - 6, camera.angle, 14, "middle", "bold", colour))
    for part in parts:
        for place in part.places:
            x, y = at(place[0], place[2])
            out.append(_shape(part, x, y, (0, 2)))
    shown = sorted(range(len(parts)), key=lambda i: float(parts[i].places[:, 0].max()))
    step = 540 / max(len(shown) - 1, 1)
    for row, i in enumerate(shown):
        place = parts[i].places[int(np.argmax(parts[i].places[:, 0] - 1e-3 * parts[i].places[:, 1]))]
        x = RIGHT[0] - 270 + step * row
        out.append(_line((x, 118), at(place[0], place[2]), GREY, 0.8))
        out += [
            f'<circle cx="{x:.1f}" cy="106" r="12" fill="white" stroke="{INK}"/>',
            _text(x, 111, str(i + 1), 13, "middle"),
        ]
    x, y = at(*prototype(parts).centre[[0, 2]])
    out.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" fill="white" stroke="{VERMILLION}" stroke-width="3"/>')
    out.append(_text(x + 10, y + 5, "centre of mass", 13, fill=VERMILLION))
    out += _axes((RIGHT[0] + 130, RIGHT[1] + 190), ((1, 0, "x forward"), (0, -1, "z up")))
    bar = (RIGHT[0] + 130, RIGHT[1] + 235)
    out.append(_line(bar, (bar[0] + 0.05 * SCALE, bar[1]), INK, 4))
    return [*out, _text(bar[0] + 0.05 * SCALE + 8, bar[1] + 5, "50 mm", 14)]


def _legend(parts: tuple[Part, ...], cameras: tuple[Mounted, ...]) -> list[str]:
    """The names of the numbered parts, and where the cameras look."""
    looks = {camera.part: camera for camera in cameras}
    rows = []
    for number, part in enumerate(parts, 1):
        times = f" ({len(part.places)})" if len(part.places) > 1 else ""
        words = f", {looks[part.name].words}" if part.name in looks else ""
        rows.append(f"{number}  {part.name}{times}{words}")
    half = -(-len(rows) // 2)
    return [_text(24 + 608 * (i // half), LEGEND + LINE * (i % half), row, 12.5) for i, row in enumerate(rows)]


def _shape(part: Part, x: float, y: float, axes: tuple[int, int]) -> str:
    """A part's outline as seen along one axis. `axes`: the body's axes that run up or right and across on the page."""
    fill = VERMILLION if part.battery else GREY
    style = f'fill="{fill}" fill-opacity="0.10" stroke="{fill}"'
    from_above = axes == (1, 0)
    if part.shape in ("cylinder", "tube", "sphere") and from_above:
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{SCALE * part.size[0] / 2:.1f}" {style}/>'
    size = {"box": part.size, "sphere": np.repeat(part.size[:1], 3)}.get(part.shape)
    if size is None:
        size = np.array([part.size[0], part.size[0], part.size[-1]]) if part.shape != "mesh" else np.full(3, 0.01)
    seen = np.array(list(product((-0.5, 0.5), repeat=3))) * size @ part.turn.T
    across, up = (-seen[:, 1], seen[:, 0]) if from_above else (seen[:, 0], seen[:, 2])
    points = _hull(np.stack([x + SCALE * across, y - SCALE * up], 1))
    return f'<polygon points="{" ".join(f"{a:.1f},{b:.1f}" for a, b in points)}" {style}/>'


def _hull(points: np.ndarray) -> np.ndarray:
    """The corners of the convex hull of points in a plane, (n, 2), in order around their middle."""
    from scipy.spatial import ConvexHull

    return points[ConvexHull(points).vertices]


def _turning(x: float, y: float, radius: float, clockwise: bool) -> str:
    """An arc of 250 degrees with an arrow, as seen from above."""
    sense = 1 if clockwise else -1
    start, end = -0.5 * math.pi - sense * 2.2, -0.5 * math.pi + sense * 2.2
    a, b = ((x + radius * math.cos(t), y + radius * math.sin(t)) for t in (start, end))
    tip = [
        (b[0] + 14 * math.cos(end + sense * 0.5 * math.pi), b[1] + 14 * math.sin(end + sense * 0.5 * math.pi)),
        (b[0] + 7 * math.cos(end), b[1] + 7 * math.sin(end)),
        (b[0] - 7 * math.cos(end), b[1] - 7 * math.sin(end)),
    ]
    arc = f'<path d="M{a[0]:.1f},{a[1]:.1f} A{radius},{radius} 0 1 {int(clockwise)} {b[0]:.1f},{b[1]:.1f}"'
    corners = " ".join(f"{u:.1f},{v:.1f}" for u, v in tip)
    return f'{arc} fill="none" stroke="{INK}" stroke-width="2.5"/><polygon points="{corners}"/>'


def _axes(origin: tuple[float, float], axes: tuple[tuple[int, int, str], ...]) -> list[str]:
    """Arrows of the body's axes."""
    out = []
    for dx, dy, name in axes:
        tip = (origin[0] + 70 * dx, origin[1] + 70 * dy)
        corners = [
            (tip[0] + 12 * dx, tip[1] + 12 * dy),
            (tip[0] + 5 * dy, tip[1] + 5 * dx),
            (tip[0] - 5 * dy, tip[1] - 5 * dx),
        ]
        out += [
            _line(origin, tip, VERMILLION, 3),
            f'<polygon fill="{VERMILLION}" points="{" ".join(f"{a:.1f},{b:.1f}" for a, b in corners)}"/>',
        ]
        anchor = "end" if dx < 0 else "start"
        out.append(
            _text(
                tip[0] + 16 * dx + (8 if dx == 0 else 0),
                tip[1] + 16 * dy + (5 if dx else 12),
                name,
                14,
                anchor,
                "bold",
                VERMILLION,
            )
        )
    return out


def _line(a: tuple[float, float], b: tuple[float, float], colour: str, width: float, dash: str = "") -> str:
    dashed = f' stroke-dasharray="{dash}"' if dash else ""
    ends = f'x1="{a[0]:.1f}" y1="{a[1]:.1f}" x2="{b[0]:.1f}" y2="{b[1]:.1f}"'
    return f'<line {ends} stroke="{colour}" stroke-width="{width}"{dashed}/>'


def _text(
    x: float, y: float, words: str, size: float, anchor: str = "start", weight: str = "normal", fill: str = INK,
    attributes: str = "",
) -> str:  # fmt: skip
    place = f'x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}" font-weight="{weight}" fill="{fill}"'
    halo = 'stroke="white" stroke-width="3" paint-order="stroke" xml:space="preserve"'
    return f"<text {place} {halo} {attributes}>{escape(words)}</text>"
