"""A batch of worlds: a fixed number of solids, each present or not, and a ground. Every number is an array leaf.

All worlds have space for the same number of solids, and their own values in it. So changing a world never causes a
recompilation. World frame: x, y horizontal, z up, m. A solid that is not present (`active` false) is neither visible
nor an obstacle.
"""

import dataclasses
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from e2efly.control.vectors import unrotate
from e2efly.courses.solids import CLASSES, USUAL_CLASS
from e2efly.simulation.physics.rotation import from_euler
from e2efly.simulation.scenes.shapes import FAR, ROOM, SHAPES

SKY, GROUND, OBSTACLE, GATE, PAD, WALL, VEHICLE = range(7)
"""Semantic classes, in the order of `solids.CLASSES`."""
_BY_CLASS = [
    [0.55, 0.72, 0.92],
    [0.45, 0.47, 0.42],
    [0.62, 0.44, 0.3],
    [0.93, 0.45, 0.13],
    [0.95, 0.95, 0.93],
    [0.75] * 3,
    [0.2, 0.25, 0.3],
]
COLOURS = np.array(_BY_CLASS, np.float32)
"""Default colour of each class, RGB in [0, 1]."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Solids:
    """The solids of one kind: space for k of them in each of n worlds."""

    centre: Float[Array, "n k 3"]
    """Centre of each solid's path, world, m."""
    quaternion: Float[Array, "n k 4"]
    """Rotation from the solid's frame to the world, wxyz."""
    size: Float[Array, "n k 4"]
    """Size entries with the meaning `solids.SIZES[kind]`."""
    active: Bool[Array, "n k"]
    """Whether the solid is present."""
    label: Int[Array, "n k"]
    """Semantic class of the solid."""
    colour: Float[Array, "n k 3"]
    """RGB in [0, 1]."""
    cosine: Float[Array, "n k 3"]
    """The path: centre + cosine cos(rate t) + sine sin(rate t) + velocity t + acceleration t^2 / 2, world, m."""
    sine: Float[Array, "n k 3"]
    rate: Float[Array, "n k"]
    """Rate of the path, rad/s."""
    velocity: Float[Array, "n k 3"]
    """Velocity of the path at time 0, world, m/s: what is thrown."""
    acceleration: Float[Array, "n k 3"]
    """Acceleration of the path, world, m/s^2."""
    since: Float[Array, "n k"]
    """Time before which the solid is not present, s."""

    @staticmethod
    def of(
        kind: str,
        centre: Any,
        size: Any,
        *,
        yaw: Any = 0.0,
        active: Any = True,
        label: int | None = None,
        colour: Any = None,
    ) -> "Solids":
        """Solids that stand still.

        Args:
            kind: one of `SHAPES`.
            centre: (n, k, 3), world, m.
            size: (n, k, up to 4), or an array that broadcasts to it.
            yaw: (n, k), rad.
            active: (n, k).
            label: semantic class. If left out: the default of the kind.
            colour: (n, k, 3) RGB. If left out: the default of the class.
        """
        centre = jnp.asarray(centre, jnp.float32)
        n, k, _ = centre.shape
        label = CLASSES.index(USUAL_CLASS[kind]) if label is None else label
        size = jnp.asarray(size, jnp.float32)
        size = jnp.pad(size, [(0, 0)] * (size.ndim - 1) + [(0, ROOM - size.shape[-1])])
        angle = jnp.broadcast_to(jnp.asarray(yaw, jnp.float32), (n, k))
        zero = jnp.zeros((n, k, 3), jnp.float32)
        return Solids(
            centre=centre,
            quaternion=from_euler(jnp.zeros_like(angle), jnp.zeros_like(angle), angle),
            size=jnp.broadcast_to(size, (n, k, ROOM)),
            active=jnp.broadcast_to(jnp.asarray(active, bool), (n, k)),
            label=jnp.full((n, k), label, jnp.int32),
            colour=jnp.broadcast_to(jnp.asarray(COLOURS[label] if colour is None else colour, jnp.float32), (n, k, 3)),
            cosine=zero,
            sine=zero,
            rate=jnp.zeros((n, k), jnp.float32),
            velocity=zero,
            acceleration=zero,
            since=jnp.full((n, k), -FAR, jnp.float32),
        )

    @property
    def count(self) -> int:
        """Number of solids for which a world has space."""
        return self.centre.shape[1]

    def position(self, time: Float[Array, " n"]) -> Float[Array, "n k 3"]:
        """Positions of the solids, world, m."""
        t, angle = time[:, None, None], (self.rate * time[:, None])[..., None]
        turned = self.centre + self.cosine * jnp.cos(angle) + self.sine * jnp.sin(angle)
        return turned + t * (self.velocity + t / 2 * self.acceleration)

    def present(self, time: Float[Array, " n"]) -> Bool[Array, "n k"]:
        """Which solids are present at a time."""
        return self.active & (time[:, None] >= self.since)

    @property
    def moves(self) -> Bool[Array, "n k"]:
        """Which solids move."""
        thrown = jnp.any((self.velocity != 0) | (self.acceleration != 0), axis=-1)
        return self.active & ((self.rate != 0) | thrown)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Scene:
    """A batch of n worlds."""

    ground: Float[Array, " n"]
    """Height of the ground, m. -`FAR`: no ground."""
    solids: dict[str, Solids]
    """The solids by kind, a name of `SHAPES`."""

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds for which there is space, in the order of instance numbers."""
        return tuple(kind for kind in sorted(self.solids) if self.solids[kind].count)

    @staticmethod
    def of(solids: dict[str, Solids], n: int, ground: float | None = 0.0) -> "Scene":
        """Worlds over level ground (None: without ground)."""
        return Scene(jnp.full(n, -FAR if ground is None else ground, jnp.float32), solids)

    @property
    def worlds(self) -> int:
        """Number of worlds."""
        return self.ground.shape[0]

    def at(self, time: Float[Array, " n"]) -> "Scene":
        """The worlds at `time`, s, standing still."""

        def still(s: Solids) -> Solids:
            zero, rate, always = jnp.zeros_like(s.centre), jnp.zeros_like(s.rate), jnp.full_like(s.since, -FAR)
            moving = dict.fromkeys(("cosine", "sine", "velocity", "acceleration"), zero)
            there = {"centre": s.position(time), "active": s.present(time), "rate": rate, "since": always}
            return dataclasses.replace(s, **moving, **there)

        return dataclasses.replace(self, solids={kind: still(s) for kind, s in self.solids.items()})


def join(*solids: Solids) -> Solids:
    """Join solids of one kind."""
    return jax.tree.map(lambda *leaves: jnp.concatenate(leaves, axis=1), *solids)


def clearance(scene: Scene, position: Float[Array, "n 3"], time: Float[Array, " n"]) -> Float[Array, " n"]:
    """Signed distance of a point in each world to the nearest object, m, negative inside. Differentiable."""
    return jnp.min(gaps(scene, position, time), axis=1)


def gaps(scene: Scene, position: Float[Array, "n 3"], time: Float[Array, " n"]) -> Float[Array, "n 1+k"]:
    """Signed distance of a point in each world to the ground and to each solid, m.

    `FAR` for solids that are not present.
    """
    each = [distances(kind, scene.solids[kind], position, time) for kind in scene.kinds]
    return jnp.concatenate([position[:, 2:] - scene.ground[:, None], *each], axis=1)


def distances(
    kind: str, solids: Solids, position: Float[Array, "n 3"], time: Float[Array, " n"]
) -> Float[Array, "n k"]:
    """Signed distance of a point in each world to each solid, m. `FAR` for solids that are not present."""
    local = unrotate(solids.quaternion, position[:, None] - solids.position(time))
    return jnp.where(solids.present(time), SHAPES[kind].distance(solids.size, local), FAR)
