"""The shapes of vehicles and solids as triangles, for the viewer and for films. Needs only NumPy."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from e2efly.config.drawing import Face
from e2efly.control.vectors import rotate
from e2efly.simulation.scenes.faces import Quads, box, cylinder
from e2efly.vehicles.vehicle import Vehicle

DARK, FRONT, METAL = (0.22, 0.26, 0.31), (0.94, 0.48, 0.17), (0.36, 0.42, 0.49)
"""RGB of body and rear arms, of the arms in front, and of motors. All colours here are those of the page's bright style
(`web/assets/page.css`).
"""
BLADE = METAL
"""RGB of rotors."""
GOAL, TRAIL = (0.11, 0.46, 0.82), (0.89, 0.33, 0.18)
"""RGB of goals and of trails."""
SKY, GROUND, GRID = (0.91, 0.93, 0.96), (0.85, 0.87, 0.91), (0.68, 0.74, 0.8)
"""RGB of the background, the ground, and the lines on it."""
SLOWEST = 40.0
"""Factor by which rotors are drawn slower than they turn. At full speed they would seem to stand still."""
BEHIND = np.array([-1.1, -1.1, 0.6])
"""Position of the following camera relative to the vehicle, m."""
NOSE = 0.12
"""Distance of the first-person camera in front of the centre of mass, m."""
LIFTED = 0.004
"""Height above the ground at which faces on the ground are drawn, m."""
REACH = 0.46
"""Radius of a rotor divided by the distance between the nearest two rotors."""


@dataclass(frozen=True)
class Mesh:
    """Triangles of one colour."""

    vertices: Float[np.ndarray, "v 3"]
    """Corners, m."""
    faces: Int[np.ndarray, "f 3"]
    """Indices of the corners, counter-clockwise as seen from outside."""
    colour: tuple[float, float, float]
    """RGB in [0, 1]."""


@dataclass(frozen=True)
class Quadrotor:
    """A vehicle's meshes."""

    body: tuple[Mesh, ...]
    """Meshes in the body frame."""
    rotor: Mesh
    """Two blades at the origin. They turn about z."""
    rotors: Float[np.ndarray, "r 3"]
    """Positions of the rotors, body frame, m."""
    spin: Float[np.ndarray, " r"]
    """Sign of the rotation about body z. Counter-clockwise as seen from above is positive."""


def mesh_of(quads: Quads, colour: Sequence[float] | Float[np.ndarray, "3"]) -> Mesh:
    """The mesh of faces with four corners, of which two may coincide.

    Args:
        quads: (f, 4, 3), m.
        colour: RGB in [0, 1].
    """
    quads = np.asarray(quads, np.float32)
    first = 4 * np.arange(len(quads))[:, None]
    faces = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])])
    corners = quads.reshape(-1, 3)
    a, b, c = (corners[faces[:, i]] for i in range(3))
    whole = np.linalg.norm(np.cross(b - a, c - a), axis=1) > 0
    red, green, blue = (float(x) for x in colour)
    return Mesh(corners, faces[whole].astype(np.uint32), (red, green, blue))


def face(thing: Face) -> Mesh:
    """The mesh of a flat polygon of a task."""
    corners = np.asarray(thing.points, np.float32) + np.array([0, 0, LIFTED], np.float32)
    fan = np.array([[0, i, i + 1] for i in range(1, len(corners) - 1)], np.uint32)
    return Mesh(corners, fan, rgb(thing.color))


def rgb(colour: str) -> tuple[float, float, float]:
    """The colour `#RRGGBB` as RGB in [0, 1]."""
    red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue


def quadrotor(vehicle: Vehicle) -> Quadrotor:
    """The meshes of a vehicle: arms from the middle to the rotors, the front ones in orange. The sizes follow from the
    positions of the rotors.
    """
    count, given = vehicle.rotor_count, np.asarray(vehicle.rotor_position, float)
    places = given.reshape(-1, count, given.shape[-1])[0, :, :2]
    apart = min(float(np.linalg.norm(a - b)) for i, a in enumerate(places) for b in places[:i])
    thick, reach = 0.07 * apart, REACH * apart
    front = places[:, 0] > places[:, 0].mean()
    middle = places.mean(axis=0)
    arms = {True: [], False: []}
    motors = []
    for place, ahead in zip(places, front, strict=True):
        arms[bool(ahead)].append(_bar(middle, place, thick))
        motors.append(cylinder(thick * 0.9, 0.5 * thick) + np.array([*place, 0.5 * thick]))
    plate = box([0.24 * apart, 0.16 * apart, 0.6 * thick]) + np.array([*middle, 0.0])
    pack = box([0.2 * apart, 0.11 * apart, 0.7 * thick]) + np.array([*middle, 1.2 * thick])
    body = (
        mesh_of(np.concatenate([plate, pack, *arms[False]]), DARK),
        mesh_of(np.concatenate(arms[True] or [plate]), FRONT),
        mesh_of(np.concatenate(motors), METAL),
    )
    blade = box([reach / 2, 0.06 * apart, 0.08 * thick])
    blades = np.concatenate([blade + np.array([side * reach / 2, 0, 0]) for side in (-1, 1)])
    height = np.full((count, 1), 1.15 * thick)
    # the reaction torque on the body is opposite to the rotation of the rotor
    spin = -np.sign(np.asarray(vehicle.rotor_spin, float).reshape(-1, count)[0])
    return Quadrotor(body, mesh_of(blades, BLADE), np.concatenate([places, height], axis=1), spin)


def _bar(start: np.ndarray, end: np.ndarray, thick: float) -> Quads:
    """A level bar between two points of the x-y plane."""
    way = end - start
    length = float(np.linalg.norm(way))
    cos, sin = way / length
    turned = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return box([length / 2, thick / 2, thick / 3]) @ turned.T + np.array([*(start + end) / 2, 0.0])


def spun(
    shape: Quadrotor,
    position: Float[np.ndarray, "n 3"],
    quaternion: Float[np.ndarray, "n 4"],
    angle: Float[np.ndarray, "n r"],
) -> tuple[Float[np.ndarray, "m 3"], Float[np.ndarray, "m 4"]]:
    """Positions and attitudes of the m = r n rotors of n vehicles, in the world. All are drawn level.

    Args:
        shape: the shape of the vehicles.
        position: positions of the vehicles, m.
        quaternion: attitudes of the vehicles, wxyz, body to world.
        angle: angle of each rotor about body z, rad.
    """  # fmt: skip
    places = position[:, None] + rotate(quaternion[:, None], shape.rotors[None])
    w, x, y, z = np.moveaxis(quaternion, -1, 0)[:, :, None]
    c, s = np.cos(angle / 2), np.sin(angle / 2)
    attitude = np.stack([w * c - z * s, x * c + y * s, y * c - x * s, z * c + w * s], axis=-1)
    return places.reshape(-1, 3), attitude.reshape(-1, 4)
