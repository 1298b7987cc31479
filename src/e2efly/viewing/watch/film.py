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
from jaxtyping import Float, Int, UInt8

from e2efly.config.drawing import Face, Line
from e2efly.control import Quat
from e2efly.control.vectors import rotate
from e2efly.simulation.scenes.faces import box, cylinder
from e2efly.simulation.scenes.meshes.engine import needed
from e2efly.viewing.watch.stage import Source, Stage, StageFrame
from e2efly.viewing.watch.triangles import (
    GOAL,
    GRID,
    GROUND,
    NOSE,
    SKY,
    SLOWEST,
    TRAIL,
    Mesh,
    Quadrotor,
    face,
    mesh_of,
    quadrotor,
    rgb,
    spun,
)

SIZE = (360, 640)
"""Rows and columns of a picture."""
MARGIN = 8
"""Margin around the image of a camera, pixels."""
SPREAD = 0.55
"""Half the visible height divided by the distance: the tangent of half the vertical field of view."""
FINER = 3
"""Rays along each side of a pixel where edges are."""
SUN = np.array([0.35, 0.25, 0.9]) / np.linalg.norm([0.35, 0.25, 0.9])
CELL, LINE = 0.5, 0.018
"""Distance and width of the lines on the ground, m."""
HAZE = 25.0
"""Distance at which the ground has faded to a third, m."""
SHADOW = 0.8
"""Brightness of the ground in the shadow."""
BACK, RAISED = 4.5, 1.6
"""Position of the camera behind and above the vehicle, divided by the vehicle's radius."""
FILLED = 0.9
"""The part of the picture, from its middle, within which the vehicles of a world are."""
TURN_S = 0.4
"""Time constant with which the camera turns, s."""
SLOW = 0.5
"""Speed from which on the camera looks along the flight rather than along the vehicle's nose, m/s."""
PAST = 90
"""Number of frames for which the trail is shown."""
THICK = 0.006
"""Thickness of lines, m."""
RING = 1.25
"""Radius of the ring around a goal, divided by the vehicle's radius."""


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
    """The picture, (h, w, 3) uint8, from an eye that looks at a point. World up is up in the picture.

    One ray per pixel finds where one thing ends and another begins. These pixels are drawn again with `FINER` squared
    rays, so that edges are smooth.
    """
    rows, columns = size
    axes, pixel = _axes((look_at - eye) / np.linalg.norm(look_at - eye)).astype(np.float32), 2 * SPREAD / rows

    def rays(y: np.ndarray, x: np.ndarray) -> Float[np.ndarray, "n 3"]:
        """Unit vectors through places in the picture, in pixels from its upper left corner."""
        way = np.stack([0 * x + 1, (x - columns / 2) * pixel, (y - rows / 2) * pixel], axis=1).astype(np.float32) @ axes
        return way / np.sqrt(np.einsum("ij,ij->i", way, way))[:, None]

    y, x = (place.ravel() for place in np.mgrid[:rows, :columns])
    solid = _tree(soup)
    seen, what = _seen(soup, solid, eye, rays(y + 0.5, x + 0.5), ground, pixel)
    what, edge = what.reshape(size), np.zeros(size, bool)
    for axis in (0, 1):
        differs = np.diff(what, axis=axis) != 0
        edge |= np.insert(differs, 0, False, axis) | np.insert(differs, differs.shape[axis], False, axis)
    edge, steps = np.flatnonzero(edge), (np.arange(FINER) + 0.5) / FINER
    fine = [
        _seen(soup, solid, eye, rays(y[edge] + down, x[edge] + along), ground, pixel)[0]
        for down in steps
        for along in steps
    ]
    seen[edge] = np.mean(fine, axis=0)
    return np.rint(255 * seen).astype(np.uint8).reshape(rows, columns, 3)


def _tree(soup: Soup) -> Any:
    """The triangles, ready for rays. None: there are none."""
    if not len(soup.triangles):
        return None
    with needed("mesh"):
        from e2efly.simulation.scenes.meshes.embree import Embree
    return Embree(soup.triangles.astype(np.float32))


def _seen(
    soup: Soup, solid: Any, eye: np.ndarray, ray: Float[np.ndarray, "n 3"], ground: bool, pixel: float
) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, " n"]]:
    """The colours that rays meet, and numbers of what they meet."""
    seen = np.tile(np.asarray(SKY, np.float32), (len(ray), 1))
    far, what = np.full(len(ray), np.inf, np.float32), np.full(len(ray), -1)
    if ground and eye[2] > 0:
        falls = np.flatnonzero(ray[:, 2] < -1e-4)
        far[falls] = -eye[2] / ray[falls, 2]
        place = eye.astype(np.float32) + far[falls, None] * ray[falls]
        lines = _lines(place[:, :2], far[falls], ray[falls], pixel)[:, None]
        floor = (1 - lines) * np.asarray(GROUND, np.float32) + lines * np.asarray(GRID, np.float32)
        what[falls] = -2
        if solid is not None:
            dark = np.flatnonzero(solid.blocked(place, np.broadcast_to(SUN, place.shape).astype(np.float32)))
            floor[dark] *= SHADOW
            what[falls[dark]] = -3
        clear = np.exp(-far[falls] / HAZE)[:, None]
        seen[falls] = clear * floor + (1 - clear) * np.asarray(SKY, np.float32)
    if solid is not None:
        distance, index = solid.first(np.broadcast_to(eye, ray.shape).astype(np.float32), ray)
        near = np.flatnonzero((index >= 0) & (distance < far))
        a, b, c = (soup.triangles[:, i] for i in range(3))
        normal = np.cross(b - a, c - a)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        n = normal[index[near]]
        n = n * -np.sign((n * ray[near]).sum(axis=1, keepdims=True))
        bright = 0.7 + 0.1 * n[:, 2] + 0.3 * np.maximum(n @ SUN, 0)
        seen[near] = np.clip(soup.colour[index[near]] * bright[:, None], 0, 1)
        what[near] = index[near]
    return seen, what


def _lines(
    place: Float[np.ndarray, "n 2"], far: Float[np.ndarray, " n"], ray: Float[np.ndarray, "n 3"], pixel: float
) -> Float[np.ndarray, " n"]:
    """The share of what a pixel sees of the ground that lines cover: their integral over the pixel's footprint.

    A share instead of a point of it, so that no pattern appears where lines are narrower than pixels.

    Args:
        place: where the rays meet the ground, m.
        far: length of the rays, m.
        ray: their directions, unit vectors.
        pixel: angle of a pixel, rad.
    """
    level = np.linalg.norm(ray[:, :2], axis=1)[:, None]
    along, across = np.abs(ray[:, :2]) / level, np.abs(ray[:, 1::-1]) / level
    width = pixel * far[:, None] * np.hypot(along / np.abs(ray[:, 2:]), across)

    def covered(x: np.ndarray) -> np.ndarray:
        cells = np.floor(x / CELL)
        return LINE * cells + np.minimum(x - CELL * cells, LINE)

    share = (covered(place + (LINE + width) / 2) - covered(place + (LINE - width) / 2)) / width
    return 1 - (1 - share).prod(axis=1)


def behind(
    position: Float[np.ndarray, "k 3"],
    heading: Float[np.ndarray, "2"],
    radius: float,
    ground: bool,
    size: tuple[int, int] = SIZE,
) -> tuple[np.ndarray, np.ndarray]:
    """Where the camera behind a vehicle is, and the point that it looks at, (3,) m.

    Args:
        position: position of the vehicle, m, and after it those of the others of its world. The camera is so far away
            that it sees all of them.
        heading: the direction in which the camera looks, level, of any length.
        radius: radius of a vehicle, m.
        ground: whether there is ground at height 0, above which the camera stays.
        size: rows and columns of the picture.
    """
    here = position[0]
    back = heading / max(float(np.linalg.norm(heading)), 1e-9)
    eye = here + radius * np.array([*(-BACK * back), RAISED])
    if ground:
        eye[2] = max(eye[2], 0.5 * radius)
    away = eye - here
    far = float(np.linalg.norm(away))
    to_others = (position[1:] - here) @ _axes(-away / far).T
    reach = np.array([SPREAD * size[1] / size[0], SPREAD]) * FILLED
    wanted = ((np.abs(to_others[:, 1:]) + radius) / reach).max(axis=1) - to_others[:, 0]
    return here + away * max(wanted.max(initial=0.0) / far, 1.0), here


def _axes(ahead: np.ndarray) -> Float[np.ndarray, "3 3"]:
    """The axes of a camera that looks in a direction, a unit vector: ahead, right and down, as rows."""
    right = np.cross(ahead, [0, 0, 1.0])
    right /= max(float(np.linalg.norm(right)), 1e-9)
    return np.stack([ahead, right, np.cross(ahead, right)])


def _heading(frame: StageFrame) -> Float[np.ndarray, "2"]:
    """The direction in which the first vehicle flies, or points if it is slow, level, a unit vector."""
    yaw = float(Quat.of(frame.quaternion[0]).yaw())
    way = frame.velocity[0, :2] + SLOW * np.array([np.cos(yaw), np.sin(yaw)])
    return way / max(float(np.linalg.norm(way)), 1e-9)


def snapshot(stage: Stage, frame: StageFrame, size: tuple[int, int] = SIZE) -> UInt8[np.ndarray, "h w 3"]:
    """The picture of one moment, from behind the first vehicle, with all others of its world."""
    shape, radius = quadrotor(stage.vehicle), _radius(stage)
    angle = np.zeros((len(frame.position), len(shape.rotors)))
    soup = _standing(stage) + _moving(stage, frame.time, np.zeros(3)) + _flying(shape, frame, angle, radius)
    place = behind(frame.position[: frame.together], _heading(frame), radius, stage.ground, size)
    return picture(soup, *place, stage.ground, size)


def _radius(stage: Stage) -> float:
    """Radius of the vehicle that flies, m."""
    return float(np.max(stage.vehicle.radius))


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
        source: the source of the frames. The first vehicle is followed. The vehicles of its world have trails.
        seconds: duration of the flight, s.
        rate: pictures per second of the flight.
        camera: a name of `viewer.CAMERAS`. One that follows stays so far behind that it sees all vehicles of the
            world. One that stays in place looks at the first vehicle from where that began.
        size: rows and columns, without the camera images.
    """
    first = source.stage_of(0)
    stage, still, shape = first, _standing(first), quadrotor(first.vehicle)
    angle, past, eye = np.zeros((1, 1)), deque[np.ndarray](maxlen=PAST), np.zeros(3)
    heading, follows = np.zeros(2), 1 - np.exp(-source.period / TURN_S)
    flown, due = 0.0, 1 / rate
    while flown < seconds - 1e-9:
        frame = source.step(0)
        flown += source.period
        stage, before = source.stage_of(0), stage
        if stage is not before:
            still, shape = _standing(stage), quadrotor(stage.vehicle)
        if frame.fresh:
            past.clear()
        world, radius = frame.position[: frame.together], _radius(stage)
        here = world[0]
        heading = heading + follows * (_heading(frame) - heading) if past else _heading(frame)
        from_behind = behind(world, heading, radius, stage.ground, size)
        eye = from_behind[0] if not past else eye
        past.append(world.copy())
        angle = (angle + shape.spin * frame.rotor_speed / SLOWEST * source.period) % (2 * np.pi)
        if flown < due - 1e-9:
            continue
        due += 1 / rate
        moved = Soup(still.triangles + source.origin, still.colour)
        soup = (
            moved
            + _moving(stage, frame.time, source.origin)
            + _flying(shape, frame, angle, radius)
            + _trails(past, 0.03 * radius)
        )
        ahead = rotate(frame.quaternion[0], np.array([1.0, 0.0, 0.0]))
        match camera:
            case "first person":
                place = here + NOSE * ahead, here + ahead
            case "orbit":
                place = eye, here
            case _:
                place = from_behind
        yield beside(picture(soup, *place, stage.ground, size), frame.images)


def _standing(stage: Stage) -> Soup:
    """Everything that stands still."""
    meshes = [mesh_of(body.quads, body.colour) for body in stage.bodies if not body.moves]
    for thing in stage.things:
        if isinstance(thing, Face):
            meshes.append(face(thing))
        elif isinstance(thing, Line):
            meshes += _tube(np.asarray(thing.points, float), rgb(thing.color), THICK)
    return Soup.of(meshes)


def _moving(stage: Stage, time: float, origin: np.ndarray) -> Soup:
    return Soup.of(
        mesh_of(body.quads + body.moved(time) + origin, body.colour)
        for body in stage.bodies
        if body.moves and body.visible(time)
    )


def _flying(shape: Quadrotor, frame: StageFrame, angle: np.ndarray, radius: float) -> Soup:
    """The vehicles, and the goal of the first vehicle: a ring around it, and a ball until the vehicle is there."""

    def placed(mesh: Mesh, place: np.ndarray, attitude: np.ndarray) -> Mesh:
        return Mesh(place + rotate(attitude[None], mesh.vertices), mesh.faces, mesh.colour)

    meshes = [placed(m, p, q) for p, q in zip(frame.position, frame.quaternion, strict=True) for m in shape.body]
    rotors = zip(*spun(shape, frame.position, frame.quaternion, angle), strict=True)
    meshes += [placed(shape.rotor, place, attitude) for place, attitude in rotors]
    if frame.goal is not None and np.isfinite(frame.goal[0]).all():
        turn = np.linspace(0, 2 * np.pi, 33)
        ring = RING * radius * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
        if np.linalg.norm(frame.goal[0] - frame.position[0]) > RING * radius:
            meshes.append(mesh_of(cylinder(0.15 * radius, 0.15 * radius) + frame.goal[0], GOAL))
        meshes += _tube(ring + frame.goal[0], GOAL, 0.05 * radius)
    return Soup.of(meshes)


def _trails(past: Iterable[Float[np.ndarray, "k 3"]], thick: float) -> Soup:
    ways = np.swapaxes(np.array(list(past)), 0, 1)
    return Soup.of(mesh for way in ways for mesh in _tube(way, TRAIL, thick))


def _tube(points: np.ndarray, colour: tuple[float, float, float], thick: float) -> list[Mesh]:
    """Bars along a curve, of a thickness in m."""
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
            mesh_of(box([length / 2, thick / 2, thick / 2]) @ np.stack([x, y, np.cross(x, y)]) + (a + b) / 2, colour)
        )
    return meshes
