"""Random pictures of racing gates with the mask of each: what the network `gates` of `mask:onnx` learns from.

    python benchmarks/gate_renders.py [--folder gate_pictures] [--pictures 8192] [--seed 1000] [--looks FILE.py:NAME]

Gates of random width, bars, depth and distance stand on legs or in the air, some with a panel, one behind another,
among poles, beams, blocks and walls that are no gates. `gate_looks` paints them. `UNSEEN` has bars, panels and looks
that `LEARNED` lacks, and `TRIED` has other textures than both. The pictures are kept in a folder, to which another run
with another seed adds. `--looks` names a `Variety` of one's own.
"""

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from common import arguments

from e2efly.config.registry import load
from e2efly.flight.pose.gates.lens import Openings
from e2efly.flight.sight.segment import opencv
from e2efly.simulation.physics.rotation import from_euler
from e2efly.simulation.scenes import gate_looks
from e2efly.simulation.scenes.camera import Mount, mounted
from e2efly.simulation.scenes.gate_looks import KEPT_APART, SEEN, LookFamily, coloured, drawn, photographed
from e2efly.simulation.scenes.scene import GATE, Scene, Solids, join
from e2efly.validation.gate_pose import RACER

CROP = 320
"""Rows and columns of a picture to learn from."""
SIZE = (176, 320)
"""Rows and columns of the whole pictures that the network takes."""
TOGETHER = 256
"""Pictures of a file."""
GATES, CLUTTER = 4, 9
BATCH = 16
"""Pictures that are drawn at once."""


@dataclass(frozen=True)
class Variety:
    """Looks, and shapes of frames."""

    looks: LookFamily
    bars: tuple[tuple[float, float], ...]
    """Intervals of their width, m."""
    panel: str
    """Where panels are: above or beside."""


LEARNED = Variety(SEEN, ((0.08, 0.18),), "above")
TRIED = dataclasses.replace(LEARNED, looks=gate_looks.TRIED)
UNSEEN = Variety(KEPT_APART, ((0.06, 0.08), (0.18, 0.28)), "beside")


@dataclass(frozen=True)
class Pictures:
    """n pictures."""

    colours: np.ndarray
    """(n, h, w, 3) uint8, 255 for 1."""
    masks: np.ndarray
    """(n, h, w) uint8, 0 or 1."""
    openings: list[Openings]
    """Of each world, of gates that exist."""
    pose: list[tuple[np.ndarray, np.ndarray]]
    """Position (3,), m, and rotation (3, 3) body to world of each vehicle."""


def pictures(seed: int, n: int, variety: Variety, whole: bool = False) -> Pictures:
    """Windows of the racer's image, most of them around a gate, or `whole` images."""
    random, key, parts = np.random.default_rng(seed), jax.random.key(seed), []
    for i in range(-(-n // BATCH)):
        parts.append(_batch(random, jax.random.fold_in(key, i), variety, whole))
    together = [
        np.concatenate([getattr(part, name) for part in parts])[:n] for name in ("colours", "masks")
    ]  # fmt: skip
    return Pictures(
        *together, [o for part in parts for o in part.openings][:n], [p for part in parts for p in part.pose][:n]
    )


def _batch(random: np.random.Generator, key: jax.Array, variety: Variety, whole: bool) -> Pictures:
    position = np.stack([0 * random.uniform(size=BATCH)] * 2 + [random.uniform(0.4, 3.0, BATCH)], axis=-1)
    angles = random.uniform(-1, 1, (BATCH, 3)) * [0.5, 0.4, 0.3] + [0.0, 0.3, 0.0]
    quaternion = from_euler(*jnp.asarray(angles.T, jnp.float32))
    rotation = _rotations(angles)
    scene, openings = _worlds(random, position, variety)
    config = RACER if whole else dataclasses.replace(RACER, width=CROP, height=CROP)
    mount = mounted(RACER, jnp.zeros((BATCH, 3)), jnp.ones((BATCH, 1)), jnp.zeros((BATCH, 3)))
    if not whole:
        aims = [np.mean(o.corners[0], axis=0) - p for o, p in zip(openings, position, strict=True)]
        mount = _windows(random, mount, np.einsum("nij,ni->nj", rotation, np.array(aims)))
    look = drawn(key, BATCH, variety.looks)
    colours, labels = (
        np.asarray(x)
        for x in coloured(config, scene, mount, jnp.asarray(position, jnp.float32), quaternion, look)
    )  # fmt: skip
    looks = [jax.tree.map(lambda leaf, i=i: leaf[i : i + 1], look) for i in range(BATCH)]
    photographs = [photographed(c, one, 1.0, random) for c, one in zip(colours, looks, strict=True)]
    return Pictures(
        np.stack(photographs), (labels == GATE).astype(np.uint8), openings, list(zip(position, rotation, strict=True))
    )


def _worlds(random: np.random.Generator, eye: np.ndarray, variety: Variety) -> tuple[Scene, list[Openings]]:
    n, u = len(eye), random.uniform
    # gates: the first one exists, and is anywhere
    distance = np.exp(u(np.log(1.0), np.log(13.0), (n, GATES)))
    distance[:, 1:] = np.exp(u(np.log(2.5), np.log(16.0), (n, GATES - 1)))
    bearing, yaw = u(-0.8, 0.8, (n, GATES)), u(-1.1, 1.1, (n, GATES))
    yaw = bearing + yaw + np.where(u(size=yaw.shape) < 0.5, np.pi, 0.0)
    half = u(0.42, 0.7, (n, GATES, 1)) * np.where(u(size=(n, GATES, 2)) < 0.3, u(0.85, 1.15, (n, GATES, 2)), 1.0)
    interval = np.array(variety.bars)[random.integers(len(variety.bars), size=(n, GATES))]
    bar = u(interval[..., 0], interval[..., 1])
    depth = u(0.02, 0.08, (n, GATES))
    high = half[..., 1] + bar + u(0, 1, (n, GATES)) ** 2 * 2.5
    centre = np.stack([distance * np.cos(bearing), distance * np.sin(bearing), high], axis=-1)
    exists = u(size=(n, GATES)) < 0.6
    exists[:, 0] = True
    size = np.concatenate([half, bar[..., None], depth[..., None]], axis=-1)
    # panels, of the gate's class, and legs
    across = np.stack([-np.sin(yaw), np.cos(yaw), 0 * yaw], axis=-1)
    outer, panel = half + bar[..., None], u(0.1, 0.4, (n, GATES))
    if variety.panel == "above":
        offset = (outer[..., 1] + panel)[..., None] * np.array([0.0, 0.0, 1.0])
        plate = np.stack([depth, outer[..., 0], panel], axis=-1)
    else:
        offset = (outer[..., 0] + panel)[..., None] * across * np.where(u(size=(n, GATES, 1)) < 0.5, -1, 1)
        plate = np.stack([depth, panel, outer[..., 1] * u(0.5, 1.0, (n, GATES))], axis=-1)
    panels = Solids.of(
        "box", centre + offset, plate, yaw=yaw, active=exists & (u(size=(n, GATES)) < 0.3), label=GATE
    )  # fmt: skip
    leg = np.maximum(high - outer[..., 1], 0.02) / 2
    thin = u(0.02, 0.05, (n, GATES))
    stand = exists & (u(size=(n, GATES)) < 0.5)
    legs = [
        Solids.of(
            "box", (centre + side * half[..., :1] * across) * [1, 1, 0] + leg[..., None] * [0, 0, 1],
            np.stack([thin, thin, leg], axis=-1), yaw=yaw, active=stand
        )
        for side in (-1, 1)
    ]  # fmt: skip
    # poles, beams, blocks and walls
    kind = random.integers(4, size=(n, CLUTTER))
    long, short = u(0.5, 3.0, (n, CLUTTER)), u(0.02, 0.12, (n, CLUTTER))
    sizes = np.stack([
        np.stack([short, short, long], axis=-1),
        np.stack([short, long, short], axis=-1),
        u(0.1, 0.8, (n, CLUTTER, 3)),
        np.stack([short, 1.5 * long, long], axis=-1),
    ])  # fmt: skip
    clutter = np.take_along_axis(sizes, kind[None, ..., None], axis=0)[0]
    far, aside = np.exp(u(np.log(2.0), np.log(18.0), (n, CLUTTER))), u(-0.9, 0.9, (n, CLUTTER))
    far = np.where(kind == 3, np.maximum(far, 7.0), far)
    floor = np.where(kind == 1, u(0.0, 4.0, (n, CLUTTER)), 0.0)
    place = np.stack([far * np.cos(aside), far * np.sin(aside), clutter[..., 2] + floor], axis=-1)
    things = Solids.of(
        "box", place, clutter, yaw=aside + u(-0.8, 0.8, (n, CLUTTER)), active=u(size=(n, CLUTTER)) < 0.6
    )  # fmt: skip
    gates = Solids.of("gate", centre, size, yaw=yaw, active=exists)
    scene = Scene.of({"gate": gates, "box": join(panels, *legs, things)}, n)
    return scene, [_openings(*row) for row in zip(centre, yaw, half, depth, exists, strict=True)]


def _openings(centre: np.ndarray, yaw: np.ndarray, half: np.ndarray, depth: np.ndarray, exists: np.ndarray) -> Openings:
    forward = np.stack([np.cos(yaw), np.sin(yaw), 0 * yaw], axis=-1)
    across = np.stack([-np.sin(yaw), np.cos(yaw), 0 * yaw], axis=-1)
    up = np.array([0.0, 0.0, 1.0])
    corners = np.stack([
        centre + y * half[:, :1] * across + z * half[:, 1:] * up for y, z in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ], axis=1)  # fmt: skip
    return Openings(corners[exists], (depth[:, None] * forward)[exists])


def _windows(random: np.random.Generator, whole: Mount, aim: np.ndarray) -> Mount:
    """Cameras that see a part of the image, around a direction (n, 3) in the body frame, or elsewhere."""
    share = CROP / np.array([RACER.width, RACER.height])
    ahead = np.einsum("nij,nj->ni", np.linalg.inv(np.asarray(whole.matrix)), aim)
    middle = ahead[:, :2] / np.maximum(ahead[:, 2:], 0.3) + 0.7 * share * random.uniform(-1, 1, (len(aim), 2))
    middle = np.clip(middle, share - 1, 1 - share)
    part = np.zeros((len(aim), 3, 3))
    part[:, [0, 1], [0, 1]], part[:, :2, 2], part[:, 2, 2] = share, middle, 1.0
    return Mount(whole.matrix @ jnp.asarray(part, jnp.float32), whole.offset)


def _rotations(angles: np.ndarray) -> np.ndarray:
    """(n, 3, 3) of roll, pitch and yaw (n, 3)."""
    (a, b, c), (d, e, f) = np.cos(angles).T, np.sin(angles).T
    rows = [
        [c * b, c * e * d - f * a, c * e * a + f * d],
        [f * b, f * e * d + c * a, f * e * a - c * d],
        [-e, b * d, b * a],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def smaller(p: Pictures) -> tuple[np.ndarray, np.ndarray]:
    """Colours and masks of windows at the network's scale, 255 for 1. What was 0 or 1 becomes a share, so edges stay
    where they are to a part of a pixel.
    """
    cv2, side = opencv(), CROP * SIZE[1] // RACER.width
    colours, masks = (
        np.stack([cv2.resize(x, (side, side), interpolation=cv2.INTER_AREA) for x in each])
        for each in (p.colours, 255 * p.masks)
    )
    return colours, masks


def stored(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """All colours and masks of a folder.

    Raises:
        ValueError: if it has none.
    """
    files = [np.load(path, allow_pickle=False) for path in sorted(folder.glob("*.npz"))]
    if not files:
        raise ValueError(f"--folder is {folder}, which has no pictures; accepted: a folder of gate_renders.py")
    return np.concatenate([f["colours"] for f in files]), np.concatenate([f["masks"] for f in files])


def main() -> None:
    """Draw pictures, and keep them."""
    args = arguments(__doc__ or "", folder="gate_pictures", pictures=8192, seed=1000, looks="")
    folder, variety = Path(args.folder), load(args.looks) if args.looks else LEARNED
    folder.mkdir(parents=True, exist_ok=True)
    for i in range(-(-args.pictures // TOGETHER)):
        colours, masks = smaller(pictures(args.seed + i, TOGETHER, variety))
        np.savez(folder / f"{args.seed + i}.npz", colours=colours, masks=masks)
        print(f"{(i + 1) * TOGETHER} pictures", flush=True)


if __name__ == "__main__":
    main()
