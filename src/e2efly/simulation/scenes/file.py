"""Worlds from scene files, which `e2efly.courses.solids` reads."""

import dataclasses
from pathlib import Path

import jax
import jax.numpy as jnp

from e2efly.courses.solids import CLASSES, Solid, read_solids
from e2efly.simulation.physics.rotation import from_euler
from e2efly.simulation.scenes.scene import Scene, Solids, join


def load_scene(path: Path, n: int = 1) -> Scene:
    """The world of a file, in n copies.

    Raises:
        ValueError: naming the file, the solid, the key, the value and what is accepted.
    """
    ground, listed = read_solids(path)
    solids: dict[str, list[Solids]] = {}
    for one in listed:
        solids.setdefault(one.kind, []).append(_solids(one))
    scene = Scene.of({kind: join(*each) for kind, each in solids.items()}, 1, ground)
    return jax.tree.map(lambda x: jnp.repeat(x, n, axis=0), scene)


def _solids(one: Solid) -> Solids:
    """A solid as the only one of its world."""
    label = CLASSES.index(one.label)
    made = Solids.of(one.kind, one.centre[None, None], one.size[None, None], label=label, colour=one.colour)
    turned = from_euler(*(jnp.full((1, 1), angle) for angle in one.angles))
    made = dataclasses.replace(made, quaternion=turned)
    if one.path is None:
        return made
    cosine, sine = (jnp.asarray(way, jnp.float32)[None, None] for way in (one.path.cosine, one.path.sine))
    return dataclasses.replace(made, cosine=cosine, sine=sine, rate=jnp.full((1, 1), one.path.rate, jnp.float32))
