"""Rays of one tile against the solids of one world: the nearest hit of each ray.

Solids are in a table, kind after kind. A list leads from each solid to the next that may be visible in the tile, so
that one loop per kind visits only these. XLA makes one machine function of the loop, which works in the first-level
cache. XLA fuses each array that a loop carries separately, with everything from which the array is computed. A loop
therefore compares the intersection of the previous round, so that each intersection is computed only once.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from e2efly.control.vectors import Quat, Vec3
from e2efly.simulation.scenes.scene import Scene, Solids, distances, join
from e2efly.simulation.scenes.shapes import FAR, ROOM, SHAPES, Components
from e2efly.simulation.scenes.tiles import Pattern, following, longest, seen_by_tiles

Kinds = tuple[tuple[str, int], ...]
"""The kinds of solids in a table, each with the index at which it ends."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class TileSight:
    """The data that the loops of n cameras need."""

    origin: Float[Array, "n 3"]
    matrix: Float[Array, "n 3 3"]
    ground: Float[Array, " n"]
    following: Int[Array, "n t k+1"]
    forms: Float[Array, "n 16 k"]
    """Size, the rays' origin in the solid's frame, and the matrix from the sensor's frame to the solid's frame."""
    looks: Float[Array, "n 13 k"] | None
    """Label, colour, and rotation from world to solid, for channels other than distances."""
    shading: Int[Array, "n t k+1"] | None
    """Leads from each solid to the next that may cast a shadow into the tile, for colours."""


def sight(
    scene: Scene,
    origin: Float[Array, "n 3"],
    matrix: Float[Array, "n 3 3"],
    pattern: Pattern,
    looks: bool,
    sun: Float[Array, "n 3"] | None,
    farthest: float,
) -> tuple[TileSight, Kinds]:
    """The solids as cameras see them, without those that are completely beyond a depth.

    With a sun, also their shadows.
    """
    each = [(kind, scene.solids[kind]) for kind in scene.kinds]
    kinds = tuple((kind, sum(s.count for _, s in each[: i + 1])) for i, (kind, _) in enumerate(each))
    if not each:
        each = [("sphere", Solids.of("sphere", jnp.zeros((scene.worlds, 0, 3)), [1.0]))]
    solids = join(*(s for _, s in each))
    reach = jnp.concatenate([SHAPES[kind].reach(s.size) for kind, s in each], axis=1)
    turn, away = Quat.of(solids.quaternion), Vec3.of(solids.centre) - Vec3.of(origin[:, None])

    def rows(m: Any) -> list[Array]:
        columns = [turn.unrotate(Vec3(*(m[:, i, j, None] for i in range(3)))) for j in range(3)]
        return [getattr(column, axis) for axis in "xyz" for column in columns]

    start = turn.unrotate(away) * -1.0
    size, colour = (jnp.moveaxis(x, -1, 0) for x in (solids.size, solids.colour))
    forms = [*size, start.x, start.y, start.z, *rows(matrix)]
    about = [solids.label.astype(jnp.float32), *colour, *rows(jnp.eye(3)[None])]
    near = solids.active
    if math.isfinite(farthest):
        gaps = [distances(kind, s, origin, jnp.zeros(scene.worlds)) for kind, s in each]
        near &= jnp.concatenate(gaps, axis=1) < farthest * longest(pattern, matrix)[:, None]
    visible = seen_by_tiles(pattern, matrix, away, reach) & near[:, None]
    table = jnp.stack([jnp.broadcast_to(x, reach.shape) for x in about], axis=1) if looks else None
    shading = None
    if sun is not None:
        height = (origin[:, 2] - scene.ground)[:, None]
        hollow = np.array([kind == "gate" for kind, s in each for _ in range(s.count)], bool)
        throwing = _throwing(pattern, matrix, away, reach, height, Vec3.of(sun[:, None]), visible, hollow)
        shading = following(throwing & solids.active[:, None])
    found = TileSight(origin, matrix, scene.ground, following(visible), jnp.stack(forms, axis=1), table, shading)
    return found, kinds


def _throwing(
    pattern: Pattern,
    matrix: Float[Array, "n 3 3"],
    away: Vec3,
    reach: Float[Array, "n k"],
    height: Float[Array, "n 1"],
    sun: Vec3,
    visible: Bool[Array, "n t k"],
    hollow: Bool[np.ndarray, " k"],
) -> Bool[Array, "n t k"]:
    """Whether shadows of the solids' balls may fall on objects in the tiles: on the ground or another solid's ball."""
    steep = jnp.maximum(sun.z, 1e-3)
    on_ground = seen_by_tiles(pattern, matrix, away - sun * ((away.z + height) / steep), reach / steep)
    apart = Vec3(*(jnp.expand_dims(x, 1) - jnp.expand_dims(x, 2) for x in (away.x, away.y, away.z)))  # (n, onto, from)
    touching = reach[:, :, None] + reach[:, None]
    nearer = apart.dot(Vec3(*(x[:, None] for x in (sun.x, sun.y, sun.z))))
    beside = apart.dot(apart) - nearer**2
    between = (beside <= touching**2) & (nearer > -touching) & (hollow | ~np.eye(len(hollow), dtype=bool))
    on_solids = jnp.einsum("ntb,nba->nta", visible.astype(jnp.float32), between.astype(jnp.float32)) > 0
    return on_ground | on_solids


@dataclass(frozen=True)
class Form:
    """A solid as one camera sees it, in scalars."""

    size: Array
    origin: Array
    matrix: Array

    @staticmethod
    def of(seen: TileSight, i: Array) -> "Form":
        """The solid at a place in the table."""
        row = seen.forms[:, i]
        return Form(row[:ROOM], row[ROOM : ROOM + 3], row[ROOM + 3 :])

    def direction(self, d: Float[Array, "3 r"]) -> Components:
        """Directions of the sensor's rays in the solid's frame."""
        return turned(self.matrix, d)


def turned(matrix: Float[Array, " 9"], d: Any) -> Components:
    """Product of a matrix, given row by row, and the components of a vector."""
    x, y, z = (sum(matrix[3 * i + j] * d[j] for j in range(3)) for i in range(3))
    return x, y, z  # pyright: ignore


def number(i: Array) -> Array:
    """Instance number of the solid at a place in the table."""
    return (i + 2).astype(jnp.float32)


def over(kinds: Kinds, after: Callable[[Array], Array], body: Callable[[str, Array, Any], Any], state: Any) -> Any:
    """Fold `body(kind, place, state)` over places of a table. `after` leads from each to the next, starting from -1."""
    i = after(jnp.int32(-1))
    for kind, end in kinds:
        i, state = jax.lax.while_loop(
            lambda s, end=end: s[0] < end, lambda s, kind=kind: (after(s[0]), body(kind, s[0], s[1])), (i, state)
        )
    return state


def ground(seen: TileSight, d: Float[Array, "3 r"]) -> Float[Array, " r"]:
    """Parameter at which rays meet the ground. `FAR`: they do not."""
    speed = turned(seen.matrix.reshape(9), d)[2]
    below = speed < -1e-6
    t = (seen.ground - seen.origin[2]) / jnp.where(below, speed, 1.0)
    return jnp.where(below, jnp.clip(t, 0.0, FAR), FAR)


def entered(kind: str, seen: TileSight, i: Array, d: Float[Array, "3 r"]) -> Float[Array, " r"]:
    """Parameter at which rays enter a solid."""
    form = Form.of(seen, i)
    x, y, z = form.origin
    return SHAPES[kind].enter(form.size, (x, y, z), form.direction(d))


def depth(seen: TileSight, kinds: Kinds, tile: Array, d: Float[Array, "3 r"]) -> Float[Array, " r"]:
    """Depth of the nearest hits."""
    following = seen.following[tile]
    return over(
        kinds, lambda i: following[i + 1], lambda kind, i, t: jnp.minimum(t, entered(kind, seen, i, d)), ground(seen, d)
    )


def hits(
    seen: TileSight, kinds: Kinds, tile: Array, d: Float[Array, "3 r"], below: Float[Array, " r"]
) -> tuple[Float[Array, " r"], Float[Array, " r"]]:
    """Depth of the nearest hits, and instance number of what is hit. `below` is the number where no solid is hit."""
    following = seen.following[tile]

    def settled(t: Array, who: Array, last: Array, name: Array) -> tuple[Array, Array]:
        return jnp.minimum(t, last), jnp.where(last < t, name, who)

    def tried(kind: str, i: Array, state: Any) -> Any:
        return (*settled(*state), entered(kind, seen, i, d), number(i))

    t = ground(seen, d)
    return settled(*over(kinds, lambda i: following[i + 1], tried, (t, below, jnp.full_like(t, FAR), jnp.float32(0))))
