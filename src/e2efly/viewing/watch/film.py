"""The pictures of the viewer without a browser: a still or a video, drawn by ray casting. Needs the extra `mesh`.

The light comes from a hemisphere: the brightness of a face depends on how far it points up and towards the sun. There
are no shadows.
"""

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from e2efly.config.drawing import Face, Line
from e2efly.simulation.scenes.faces import box, cylinder
from e2efly.simulation.scenes.meshes.engine import needed
from e2efly.viewing.watch.stage import Source, Stage, StageFrame
from e2efly.viewing.watch.triangles import (
    BEHIND,
    GOAL,
    NOSE,
    SKY,
    SLOWEST,
    Mesh,
    Quadrotor,
    face,
    mesh_of,
    quadrotor,
    rgb,
    spun,
    turned,
)

SIZE = (360, 640)
"""Rows and columns of a picture."""
MARGIN = 8
"""Margin around the image of a camera, pixels."""
SPREAD = 0.55
"""Half the visible height divided by the distance: the tangent of half the vertical field of view."""
GROUND, GRID = np.array([236, 238, 240]) / 255, np.array([0.72, 0.74, 0.77])
"""RGB of the ground and of its lines."""
SUN = np.array([0.35, 0.25, 0.9]) / np.linalg.norm([0.35, 0.25, 0.9])
CELL, LINE = 1.0, 0.012
"""Distance and half width of the lines on the ground, m."""
TRAIL = 90
"""Number of frames for which the trail is shown."""
THICK = 0.012
"""Thickness of a trail and of lines, m."""


@dataclass(frozen=True)
class Soup:
    """Triangles, each with its own colour."""

    triangles: Float[np.ndarray, "f 3 3"]
    """Corners, world, m."""
    colour: Float[np.ndarray, "f 3"]
    """RGB in [0, 1]."""

    @staticmethod
    def of(meshes: Iterable[Mesh]) -> "Soup":
        """The triangles of meshes in the world."""
        parts = [(m.vertices[m.faces], np.tile(m.colour, (len(m.faces), 1))) for m in meshes]
        if not parts:
            return Soup(np.zeros((0, 3, 3)), np.zeros((0, 3)))
        return Soup(*(np.concatenate(x) for x in zip(*parts, strict=True)))

    def __add__(self, other: "Soup") -> "Soup":
        return Soup(np.concatenate([self.triangles, other.triangles]), np.concatenate([self.colour, other.colour]))


def picture(soup: Soup, eye: np.ndarray, look_at: np.ndarray, ground: bool, size: tuple[int, int] = SIZE) -> Any:
    """The picture, (h, w, 3) uint8, from an eye that looks at a point. World up is up in the picture."""
    rows, columns = size
    ahead = (look_at - eye) / np.linalg.norm(look_at - eye)
    right = np.cross(ahead, [0, 0, 1.0])
    right /= max(float(np.linalg.norm(right)), 1e-9)
    down = np.cross(ahead, right)
    y, x = np.meshgrid(
        ((np.arange(rows) + 0.5) / rows * 2 - 1) * SPREAD,
        ((np.arange(columns) + 0.5) / columns * 2 - 1) * SPREAD * columns / rows,
        indexing="ij",
    )
    ray = (ahead + x[..., None] * right + y[..., None] * down).reshape(-1, 3)
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    seen = np.tile(SKY, (len(ray), 1))
    far = np.full(len(ray), np.inf)
    if ground:
        falls = ray[:, 2] < -1e-4
        far[falls] = -eye[2] / ray[falls, 2] if eye[2] > 0 else np.inf
        hit = np.isfinite(far) & (far < 80)
        place = eye + far[hit, None] * ray[hit]
        width = np.maximum(LINE, 0.0012 * far[hit])[:, None]
        on_line = (np.abs((place[:, :2] / CELL + 0.5) % 1 - 0.5) * CELL < width).any(axis=1)
        haze = np.clip(far[hit] / 60, 0, 1)[:, None]
        seen[hit] = (1 - haze) * np.where(on_line[:, None], GRID, GROUND) + haze * np.array(SKY)
    if len(soup.triangles):
        with needed("mesh"):
            from e2efly.simulation.scenes.meshes.embree import Embree
        start = np.broadcast_to(eye, ray.shape).astype(np.float32)
        distance, index = Embree(soup.triangles.astype(np.float32)).first(start, ray.astype(np.float32))
        near = (index >= 0) & (distance < far)
        a, b, c = (soup.triangles[:, i] for i in range(3))
        normal = np.cross(b - a, c - a)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        n = normal[index[near]]
        n = n * -np.sign((n * ray[near]).sum(axis=1, keepdims=True))
        bright = 0.55 + 0.2 * n[:, 2] + 0.3 * np.maximum(n @ SUN, 0)
        seen[near] = np.clip(soup.colour[index[near]] * bright[:, None], 0, 1)
    return np.rint(255 * seen).astype(np.uint8).reshape(rows, columns, 3)


def beside(seen: UInt8[np.ndarray, "h w 3"], eyes: Mapping[str, np.ndarray]) -> UInt8[np.ndarray, "h v 3"]:
    """A picture with camera images to its right, one below the other, as large as the space allows.

    Args:
        seen: the picture.
        eyes: the images by name, RGB or grey in [0, 1]. If there are none, the picture is not changed.
    """
    if not eyes:
        return seen
    rows, columns = seen.shape[:2]
    high, wide = rows // len(eyes), columns // 2
    strip = np.full((rows, wide, 3), np.rint(255 * np.array(SKY)), np.uint8)
    for i, image in enumerate(eyes.values()):
        h, w = image.shape[:2]
        times = min((high - 2 * MARGIN) / h, (wide - 2 * MARGIN) / w)
        across, down = (np.arange(int(times * n)) / times for n in (w, h))
        large = np.rint(255 * np.clip(image, 0, 1)).astype(np.uint8)[down.astype(int)][:, across.astype(int)]
        top, left = i * high + (high - len(down)) // 2, (wide - len(across)) // 2
        strip[top : top + len(down), left : left + len(across)] = large if image.ndim == 3 else large[..., None]
    return np.concatenate([seen, strip], axis=1)


def film(
    source: Source, seconds: float, rate: float, camera: str = "follow", size: tuple[int, int] = SIZE
) -> Iterator[Any]:
    """Pictures of a source, (h, w, 3) uint8, with the images of the first vehicle's cameras beside them.

    Args:
        source: the source of the frames. The first vehicle is followed.
        seconds: duration of the flight, s.
        rate: pictures per second of the flight.
        camera: a name of `viewer.CAMERAS`. A camera that stays in place looks at the first vehicle from where that
            began.
        size: rows and columns, without the camera images.
    """
    first = source.stage_of(0)
    stage, still, shape = first, _standing(first), quadrotor(first.vehicle)
    angle, past, eye = np.zeros((1, 4)), deque[np.ndarray](maxlen=TRAIL), np.zeros(3)
    flown, due = 0.0, 1 / rate
    while flown < seconds - 1e-9:
        frame = source.step(0)
        flown += source.period
        stage, before = source.stage_of(0), stage
        if stage is not before:
            still, shape = _standing(stage), quadrotor(stage.vehicle)
        if frame.fresh:
            past.clear()
        here = frame.position[0]
        eye = here + BEHIND if not past and camera == "orbit" else eye
        past.append(here.copy())
        angle = (angle + shape.spin * frame.rotor_speed / SLOWEST * source.period) % (2 * np.pi)
        if flown < due - 1e-9:
            continue
        due += 1 / rate
        moved = Soup(still.triangles + source.origin, still.colour)
        soup = (
            moved
            + _moving(stage, frame.time, source.origin)
            + _flying(shape, frame, angle, 0.25 * float(np.max(stage.vehicle.radius)))
            + _trail(past)
        )
        ahead = turned(frame.quaternion[0], np.array([1.0, 0.0, 0.0]))
        match camera:
            case "first person":
                place = here + NOSE * ahead, here + ahead
            case "orbit":
                place = eye, here
            case _:
                place = here + BEHIND, here
        yield beside(picture(soup, *place, stage.ground, size), frame.images)


def _standing(stage: Stage) -> Soup:
    """Everything that stands still."""
    meshes = [mesh_of(body.quads, body.colour) for body in stage.bodies if body.path is None]
    for thing in stage.things:
        if isinstance(thing, Face):
            meshes.append(face(thing))
        elif isinstance(thing, Line):
            meshes += _tube(np.asarray(thing.points, float), rgb(thing.color))
    return Soup.of(meshes)


def _moving(stage: Stage, time: float, origin: np.ndarray) -> Soup:
    return Soup.of(
        mesh_of(body.quads + body.moved(time) + origin, body.colour) for body in stage.bodies if body.path is not None
    )


def _flying(shape: Quadrotor, frame: StageFrame, angle: np.ndarray, goal: float) -> Soup:
    """The vehicles, and the goal of the first vehicle with the half width `goal`, m."""

    def placed(mesh: Mesh, place: np.ndarray, attitude: np.ndarray) -> Mesh:
        return Mesh(place + turned(attitude[None], mesh.vertices), mesh.faces, mesh.colour)

    meshes = [placed(m, p, q) for p, q in zip(frame.position, frame.quaternion, strict=True) for m in shape.body]
    rotors = zip(*spun(shape, frame.position, frame.quaternion, angle), strict=True)
    meshes += [placed(shape.rotor, place, attitude) for place, attitude in rotors]
    if frame.goal is not None and np.isfinite(frame.goal[0]).all():
        meshes.append(mesh_of(cylinder(goal, goal) + frame.goal[0], GOAL))
    return Soup.of(meshes)


def _trail(past: Iterable[np.ndarray]) -> Soup:
    points = np.array(list(past))
    return Soup.of(_tube(points, (0.13, 0.57, 0.55)) if len(points) > 1 else ())


def _tube(points: np.ndarray, colour: tuple[float, float, float]) -> list[Mesh]:
    """Bars along a curve."""
    meshes = []
    for a, b in pairwise(points):
        way = b - a
        length = float(np.linalg.norm(way))
        if length < 1e-6:
            continue
        x = way / length
        y = np.cross([0, 0, 1.0] if abs(x[2]) < 0.9 else [1.0, 0, 0], x)
        y /= np.linalg.norm(y)
        meshes.append(
            mesh_of(box([length / 2, THICK / 2, THICK / 2]) @ np.stack([x, y, np.cross(x, y)]) + (a + b) / 2, colour)
        )
    return meshes
