"""Worlds of triangles made in code, each always the same. The floor is at z = 0, and the middle at x = y = 0."""

from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import UInt8

from e2efly.simulation.scenes.meshes.mesh_scene import MeshPart
from e2efly.simulation.scenes.meshes.surfaces import (
    Surface,
    box,
    cylinder,
    join,
    noise,
    sheet,
    speckled,
    striped,
    turned_profile,
)

_CONCRETE, _STEEL, _CARDBOARD = (0.58, 0.58, 0.56), (0.25, 0.33, 0.55), (0.66, 0.5, 0.33)


def _part(
    name: str, surface: Surface, texture: UInt8[np.ndarray, "h w 3"], metres: float = 1.0, colour: Any = None
) -> MeshPart:
    """An object whose texture is `metres` wide."""
    return MeshPart(name, surface.vertices, surface.faces, colour, surface.uv / metres, texture)


def warehouse() -> list[MeshPart]:
    """A hall of 40 x 24 x 8 m with strip lights in the roof, and six rows of racks full of boxes, 3.4 m apart."""
    rng = np.random.default_rng(1)
    wall, floor = striped(rng, (0.72, 0.72, 0.68), 4), speckled(rng, _CONCRETE, 0.06)
    card, steel, wood = speckled(rng, _CARDBOARD, 0.05), speckled(rng, _STEEL, 0.03), striped(rng, (0.6, 0.45, 0.28), 8)
    found = _shell(20.0, 12.0, 8.0, wall, floor)
    edges = [-12.2, -8.5, -7.5, -0.5, 0.5, 7.5, 8.5, 12.2]
    roof = [box((-20.2, low, 8.0), (20.2, high, 8.2)) for low, high in zip(edges[::2], edges[1::2], strict=True)]
    found.append(_part("wall roof", join(*roof), wall, 4.0))
    for row, y in enumerate(np.linspace(-8.5, 8.5, 6)):
        frame, shelves = [], []
        for x in np.linspace(-14.0, 14.0, 11):
            frame += [box((x - 0.05, y + side - 0.05, 0.0), (x + 0.05, y + side + 0.05, 5.6)) for side in (-0.5, 0.5)]
        for z in (0.1, 1.9, 3.7, 5.5):
            shelves.append(box((-14.0, y - 0.55, z - 0.1), (14.0, y + 0.55, z)))
        found += [_part(f"rack {row}", join(*frame), steel), _part(f"shelves {row}", join(*shelves), wood)]
        for bay, x in enumerate(np.linspace(-12.6, 12.6, 10)):
            stack = []
            for z in (0.1, 1.9, 3.7, 5.5):
                for shift in (-1.1, -0.55, 0.0, 0.55, 1.1):
                    if rng.uniform() < 0.9:
                        half = rng.uniform([0.18, 0.25, 0.4], [0.26, 0.45, 1.3])
                        middle = np.array([x + shift, y + rng.uniform(-0.08, 0.08), z])
                        stack.append(box(middle - [half[0], half[1], 0.0], middle + half))
            if stack:
                found.append(_part(f"boxes {row}-{bay}", join(*stack), card, 1.5, rng.uniform(0.75, 1.0) * np.ones(3)))
    return found


def garage() -> list[MeshPart]:
    """A car park of 48 x 30 x 3.2 m, open to the sides above 1.1 m: 28 round columns, beams, and cars between them."""
    rng = np.random.default_rng(2)
    concrete, asphalt = speckled(rng, _CONCRETE, 0.08), speckled(rng, (0.3, 0.3, 0.32), 0.1)
    paint, rubber = speckled(rng, (1.0, 1.0, 1.0), 0.01), speckled(rng, (0.12, 0.12, 0.12), 0.1)
    found = _shell(24.0, 15.0, 1.1, concrete, asphalt)
    beams = [box((-24.2, y - 0.2, 2.8), (24.2, y + 0.2, 3.2)) for y in (-11.0, -3.7, 3.7, 11.0)]
    found += [
        _part("wall ceiling", box((-24.2, -15.2, 3.2), (24.2, 15.2, 3.5)), concrete, 3.0),
        _part("beams", join(*beams), concrete, 2.0),
    ]
    places = [(x, y) for x in np.linspace(-21.0, 21.0, 7) for y in (-11.0, -3.7, 3.7, 11.0)]
    found += [
        _part(f"column {i}", cylinder(0.3, 0.0, 2.8, 24).turned(0.0, (x, y, 0.0)), concrete, 2.0)
        for i, (x, y) in enumerate(places)
    ]
    colours = np.array([[0.7, 0.1, 0.1], [0.15, 0.25, 0.55], [0.85, 0.85, 0.85], [0.2, 0.2, 0.22], [0.75, 0.6, 0.15]])
    stalls = [(x, y) for y in (-7.5, 7.5) for x in np.arange(-19.25, 20.0, 2.75) if np.abs((x % 7) - 0.0) > 0.9]
    for i, (x, y) in enumerate(stalls):
        if rng.uniform() < 0.65:
            yaw, place = np.pi / 2 + rng.normal(0.0, 0.03), (x, y + rng.normal(0.0, 0.15), 0.0)
            body, tyres = (part.turned(yaw, place) for part in _car())
            found += [_part(f"car {i}", body, paint, 1.0, rng.choice(colours)), _part(f"car {i}", tyres, rubber)]
    return found


def terrain() -> list[MeshPart]:
    """Grassy hills of 64 x 64 m, level in the middle, with 40 firs and 30 rocks."""
    rng = np.random.default_rng(3)
    grass, bark = speckled(rng, (0.33, 0.42, 0.2), 0.18), striped(rng, (0.4, 0.3, 0.2), 6)
    needles, stone = speckled(rng, (0.16, 0.32, 0.18), 0.25), speckled(rng, (0.5, 0.49, 0.47), 0.12)
    along = np.linspace(-32.0, 32.0, 65)
    x, y = np.meshgrid(along, along, indexing="ij")
    rise = np.clip((np.hypot(x, y) - 6.0) / 12.0, 0.0, 1.0)
    z = 2.0 * rise * np.pad(noise(rng, 2.2), (0, 1), mode="wrap")
    found = [_part("ground", sheet(np.stack([x, y, z], axis=-1), np.stack([x, y], axis=-1)), grass, 4.0)]

    def places(count: int) -> np.ndarray:
        angle, away = rng.uniform(0.0, 2 * np.pi, count), np.sqrt(rng.uniform(6.0**2, 30.0**2, count))
        place = np.stack([away * np.cos(angle), away * np.sin(angle)], axis=-1)
        i, j = np.rint(place + 32.0).astype(int).T
        return np.column_stack([place, z[i, j] - 0.3])

    for i, place in enumerate(places(40)):
        tall = rng.uniform(4.0, 8.0)
        trunk = cylinder(0.04 * tall, 0.0, 0.35 * tall, 10)
        crown = [
            turned_profile([0.01, 0.26 * size * tall, 0.01], [low * tall, (low + 0.03) * tall, (low + 0.42) * tall], 8)
            for low, size in ((0.22, 1.0), (0.42, 0.75), (0.6, 0.5))
        ]
        found += [
            _part(f"tree {i}", part.turned(0.0, place), skin) for part, skin in ((trunk, bark), (join(*crown), needles))
        ]
    for i, place in enumerate(places(30)):
        ball = turned_profile(
            np.sin(np.linspace(0.02, np.pi - 0.02, 6)), -np.cos(np.linspace(0.02, np.pi - 0.02, 6)), 9
        )
        squeezed = ball.vertices * rng.uniform(0.4, 1.2, 3)
        found.append(_part(f"rock {i}", Surface(squeezed, ball.faces, ball.uv).turned(rng.uniform(0, 6), place), stone))
    return found


def _shell(half_x: float, half_y: float, high: float, wall: np.ndarray, floor: np.ndarray) -> list[MeshPart]:
    """A floor and four walls around it, 0.2 m thick."""
    x, y, thick = half_x, half_y, 0.2
    sides = {
        "west": ((-x - thick, -y - thick, 0.0), (-x, y + thick, high)),
        "east": ((x, -y - thick, 0.0), (x + thick, y + thick, high)),
        "south": ((-x, -y - thick, 0.0), (x, -y, high)),
        "north": ((-x, y, 0.0), (x, y + thick, high)),
    }
    ground = _part("ground", box((-x - thick, -y - thick, -thick), (x + thick, y + thick, 0.0)), floor, 3.0)
    return [ground, *(_part(f"wall {name}", box(low, high), wall, 2.0) for name, (low, high) in sides.items())]


def _car() -> tuple[Surface, Surface]:
    """Body and tyres of a car of 4.3 x 1.8 x 1.5 m along x."""
    outline = np.array(
        [[-2.1, 0.3], [-2.15, 0.85], [-1.9, 0.95], [-1.5, 1.5], [0.3, 1.5], [0.95, 1.0], [2.0, 0.85], [2.15, 0.3]]
    )
    loop = np.vstack([outline, outline[:1]])
    sides = np.stack([np.column_stack([loop[:, 0], np.full(9, y), loop[:, 1]]) for y in (0.9, -0.9)])
    around = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(loop, axis=0), axis=1))])
    skin = sheet(sides, np.stack([np.stack([around, np.full(9, y)], axis=-1) for y in (0.0, 1.8)]))
    fan = np.stack([np.zeros(6, int), np.arange(1, 7), np.arange(2, 8)], axis=1)
    ends = [Surface(sides[i, :8], fan[:, ::way], outline) for i, way in ((0, -1), (1, 1))]
    wheel = cylinder(0.32, -0.1, 0.1, 12)
    lying = Surface(wheel.vertices @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]), wheel.faces, wheel.uv)
    wheels = [lying.turned(0.0, (x, y, 0.32)) for x in (-1.35, 1.35) for y in (-0.82, 0.82)]
    return join(skin, *ends), join(*wheels)


SCENES: dict[str, Callable[[], list[MeshPart]]] = {"garage": garage, "terrain": terrain, "warehouse": warehouse}
"""The scenes by name."""
