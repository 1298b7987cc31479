"""A world of triangles, the same for all environments. World frame: x, y horizontal, z up, m."""

import dataclasses
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import jax
import numpy as np
from jaxtyping import Array, Float, Int, UInt8

from e2efly.config.tables import LARGEST
from e2efly.courses.solids import CLASSES
from e2efly.simulation.scenes.scene import COLOURS, GROUND, OBSTACLE, SKY

_FLAT = 1e-7
"""A triangle is degenerate if its height is at most this share of its longest side."""
_WHITE = np.full((1, 1, 3), 255, np.uint8)


@dataclass(frozen=True)
class MeshPart:
    """A surface with at most one texture. Parts with the same name are one object."""

    name: str
    vertices: Float[np.ndarray, "v 3"]
    """Corners, world, m."""
    faces: Int[np.ndarray, "f 3"]
    """Corners counter-clockwise, as seen from the free space."""
    colour: Any = None
    """RGB in [0, 1]: (3,), (v, 3) or (f, 1, 3). It multiplies the texture. If left out: the default colour of the
    class, or white under a texture."""
    uv: Float[np.ndarray, "v 2"] | None = None
    """Texture coordinates, from the lower left corner. The texture repeats."""
    texture: UInt8[np.ndarray, "h w 3"] | None = None
    label: int | None = None
    """Semantic class. If left out: `class_of` the name."""


def class_of(name: str) -> int:
    """Semantic class from an object's name: its first word if that is one of `CLASSES`, otherwise obstacle.

    A word ends before a `.`, `_`, `-`, space or digit: `gate.001`, `Wall_north`, `pad 2`.
    """
    head = re.split(r"[._\-\s\d]", name.strip().lower(), maxsplit=1)[0]
    return CLASSES.index(head) if head in CLASSES else OBSTACLE


@jax.tree_util.register_static
@dataclass(frozen=True, eq=False)
class MeshScene:
    """Triangles with their properties. Scenes are compared by identity, and are constants in compiled programs."""

    triangles: Float[np.ndarray, "f 3 3"]
    """Corners, world, m."""
    label: Int[np.ndarray, " f"]
    """Semantic class."""
    instance: Int[np.ndarray, " f"]
    """Number of the object. Everything of class ground has 1. The other objects follow in the order of the file."""
    names: tuple[str, ...]
    """Names of the objects by instance number. 0 is the sky."""
    colour: Float[np.ndarray, "f 3 3"]
    """RGB in [0, 1] of each corner. It multiplies the texture."""
    uv: Float[np.ndarray, "f 3 2"]
    """Texture coordinates of each corner."""
    texture: Int[np.ndarray, " f"]
    """Number of the texture. 0 is white."""
    textures: tuple[UInt8[np.ndarray, "h w 3"], ...]
    dropped: int
    """Number of degenerate triangles of the parts that were left out."""

    @staticmethod
    def of(parts: Sequence[MeshPart]) -> "MeshScene":
        """One world from parts, without their degenerate triangles, which are counted.

        Raises:
            ValueError: naming the object, what is wrong with it and what is accepted.
        """
        names, textures, pieces = ["sky", "ground"], [_WHITE], []
        for part in parts:
            _check(part)
            label = class_of(part.name) if part.label is None else part.label
            if label != GROUND and part.name not in names[2:]:
                names.append(part.name)
            corners = np.asarray(part.vertices, np.float32)[part.faces]
            count = len(corners)
            if part.texture is not None:
                textures.append(np.ascontiguousarray(part.texture))
            piece = {
                "triangles": corners,
                "label": np.full(count, label, np.int32),
                "instance": np.full(count, 1 if label == GROUND else 2 + names[2:].index(part.name), np.int32),
                "colour": _corner_colours(part, label),
                "uv": np.zeros((count, 3, 2)) if part.uv is None else np.asarray(part.uv)[part.faces],
                "texture": np.full(count, 0 if part.texture is None else len(textures) - 1, np.int32),
            }
            full = ~_degenerate(corners)
            pieces.append({name: value[full] for name, value in piece.items()} | {"dropped": np.sum(~full)})
        if not sum(len(piece["label"]) for piece in pieces):
            raise ValueError("there are no triangles of any area; accepted: at least one")
        whole = {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0] if name != "dropped"}
        whole |= {name: whole[name].astype(np.float32) for name in ("colour", "uv")}
        dropped = int(sum(piece["dropped"] for piece in pieces))
        return MeshScene(**whole, names=tuple(names), textures=tuple(textures), dropped=dropped)

    def at(self, time: Float[Array, " n"]) -> "MeshScene":
        """The world at any time. Nothing in it moves."""
        return self

    def beside(self, other: "MeshScene") -> "MeshScene":
        """Both worlds in one. The instance numbers of the other's objects follow those of this one's."""
        objects, textures = len(self.names) - 2, len(self.textures) - 1

        def later(numbers: np.ndarray, by: int, least: int) -> np.ndarray:
            return np.where(numbers >= least, numbers + by, numbers).astype(np.int32)

        theirs = dataclasses.replace(
            other, instance=later(other.instance, objects, 2), texture=later(other.texture, textures, 1)
        )
        each = "triangles", "label", "instance", "colour", "uv", "texture"
        return MeshScene(
            **{name: np.concatenate([getattr(self, name), getattr(theirs, name)]) for name in each},
            names=(*self.names, *other.names[2:]),
            textures=(*self.textures, *other.textures[1:]),
            dropped=self.dropped + other.dropped,
        )

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest corner, m."""
        corners = self.triangles.reshape(-1, 3)
        return corners.min(axis=0), corners.max(axis=0)

    @cached_property
    def normal(self) -> Float[np.ndarray, "f 3"]:
        """Unit vectors on the side from which the corners run counter-clockwise."""
        a, b, c = np.moveaxis(self.triangles.astype(np.float64), 1, 0)
        cross = np.cross(b - a, c - a)
        return (cross / np.linalg.norm(cross, axis=1, keepdims=True)).astype(np.float32)

    @cached_property
    def _texels(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """All textures one after the other, the start index of each, and their heights and widths."""
        sizes = np.array([image.shape[:2] for image in self.textures])
        begins = np.concatenate([[0], np.cumsum(np.prod(sizes, axis=1))[:-1]])
        return np.concatenate([image.reshape(-1, 3) for image in self.textures]), begins, sizes

    def colours(
        self, face: Int[np.ndarray, " r"], u: Float[np.ndarray, " r"], v: Float[np.ndarray, " r"]
    ) -> Float[np.ndarray, "r 3"]:
        """RGB at points of triangles, from the nearest texel of the texture.

        `u` and `v` are the weights of the triangle's second and third corner.
        """
        weight = np.stack([1 - u - v, u, v], axis=1)[:, None]
        texels, begins, sizes = self._texels
        x, y = (weight @ self.uv[face])[:, 0].T
        number = self.texture[face]
        height, width = sizes[number].T
        row = np.minimum(((1 - (y - np.floor(y))) * height).astype(np.int64), height - 1)
        column = np.minimum(((x - np.floor(x)) * width).astype(np.int64), width - 1)
        colour = (weight @ self.colour[face])[:, 0]
        return colour * texels[begins[number] + row * width + column] * np.float32(1 / 255)


def _check(part: MeshPart) -> None:
    where = f"object {part.name!r}"
    if part.vertices.ndim != 2 or part.vertices.shape[1] != 3 or not _usual(part.vertices):
        raise ValueError(
            f"{where}: vertices are not all finite numbers of metres, at most {LARGEST:g} in size; accepted: (v, 3) of "
            "those (another unit of the file? far from its origin?)"
        )
    faces = part.faces
    if (
        faces.ndim != 2
        or faces.shape[1] != 3
        or (faces.size and not 0 <= faces.min() <= faces.max() < len(part.vertices))
    ):
        raise ValueError(f"{where}: faces name vertices that are not there; accepted: 3 of {len(part.vertices)} each")
    if part.texture is not None and part.uv is None:
        raise ValueError(f"{where}: has a texture, but no texture coordinates; accepted: both or none")
    if part.uv is not None and not (part.uv.shape == (len(part.vertices), 2) and _usual(part.uv)):
        raise ValueError(
            f"{where}: texture coordinates are not all finite; accepted: 2 finite numbers per vertex, at most "
            f"{LARGEST:g} in size"
        )
    shapes = ((3,), (len(part.vertices), 3), (len(faces), 1, 3))
    if part.colour is not None and not (np.shape(part.colour) in shapes and _usual(part.colour)):
        raise ValueError(
            f"{where}: colours have shape {np.shape(part.colour)}, or are not all finite; accepted: 3 numbers in "
            "[0, 1], for all of it or for each vertex or triangle"
        )
    if part.label is not None and not SKY < part.label < len(CLASSES):
        raise ValueError(f"{where}: label is {part.label}; accepted: 1 to {len(CLASSES) - 1}")


def _usual(numbers: Any) -> bool:
    """Whether all numbers are finite, and not larger than float32 represents precisely."""
    return bool(np.all(np.abs(numbers) <= LARGEST))  # false for NaN


def _corner_colours(part: MeshPart, label: int) -> Float[np.ndarray, "f 3 3"]:
    usual = COLOURS[label] if part.texture is None else np.ones(3)
    colour = np.asarray(usual if part.colour is None else part.colour, np.float32)
    if colour.ndim == 2:
        colour = colour[part.faces]
    return np.broadcast_to(colour, (len(part.faces), 3, 3))


def _degenerate(corners: Float[np.ndarray, "f 3 3"]) -> np.ndarray:
    a, b, c = np.moveaxis(corners.astype(np.float64), 1, 0)
    longest = np.max([np.sum((q - p) ** 2, axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) <= _FLAT * longest
