"""Frames a second of the ray caster, beside Embree on triangles of the same worlds, with the same rays and threads.

    python benchmarks/rendering.py [--cameras 100] [--rounds 15] [--scenes 1000] [--json FILE]

The clutter scene: ground, 4 gates of 4 bars and 16 obstacles, another world for each camera. Embree's scenes are built
beforehand and stand in memory; one takes as long to build as the table says. Rounds of all rows take turns, so that a
machine whose speed varies is as fast for one as for another; a row is its median. Agreement: pixels nearer than 30 m
whose depth differs by less than a millimetre, on other random scenes; of the others, those next to a silhouette, where
our depth or instance jumps.
"""

import functools
import math
import statistics
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from common import arguments, table, write

from e2efly.simulation.device import cores, prepare

prepare()

import jax  # noqa: E402
import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402

from e2efly.config import CameraConfig  # noqa: E402
from e2efly.learning.devices import OWN, on_each, placed  # noqa: E402
from e2efly.simulation.physics.rotation import from_euler, to_matrix  # noqa: E402
from e2efly.simulation.scenes import camera  # noqa: E402
from e2efly.simulation.scenes.cast import cast, usual_light  # noqa: E402
from e2efly.simulation.scenes.mesh import GROUND, tessellate  # noqa: E402
from e2efly.simulation.scenes.scene import Scene, Solids  # noqa: E402
from e2efly.simulation.scenes.shapes import SHAPES  # noqa: E402

SEGMENTS, FINE = 32, 256
"""Around the round solids of the scenes that are timed, and of those that are compared."""
GATE = (0.5, 0.5, 0.1, 0.05)


def clutter(n: int, rng: np.random.Generator) -> Scene:
    """The scene that the figures are of."""

    def places(k: int) -> np.ndarray:
        return np.stack(
            [rng.uniform(-8, 8, (n, k)), rng.uniform(-8, 8, (n, k)), rng.uniform(0.3, 3.0, (n, k))], axis=-1
        )

    def yaw() -> np.ndarray:
        return rng.uniform(0.0, 2 * math.pi, (n, 4))

    return Scene.of(
        {
            "box": Solids.of("box", places(4), rng.uniform(0.2, 0.6, (n, 4, 3)), yaw=yaw()),
            "sphere": Solids.of("sphere", places(4), rng.uniform(0.2, 0.6, (n, 4, 1))),
            "cylinder": Solids.of("cylinder", places(4), rng.uniform(0.2, 0.8, (n, 4, 2))),
            "capsule": Solids.of("capsule", places(4), rng.uniform(0.2, 0.5, (n, 4, 2))),
            "gate": Solids.of("gate", places(4), np.array(GATE), yaw=yaw()),
        },
        n,
    )


def poses(scene: Scene, config: CameraConfig, rng: np.random.Generator) -> tuple[jax.Array, jax.Array]:
    """Origins and matrices of cameras anywhere in the scene."""
    n = scene.worlds
    position = np.stack([rng.uniform(-6, 6, n), rng.uniform(-6, 6, n), rng.uniform(1.0, 2.0, n)], axis=-1)
    angles = [jnp.asarray(rng.uniform(-a, a, n), jnp.float32) for a in (0.3, 0.3, math.pi)]
    return camera.pose(camera.mount(config, n), jnp.asarray(position, jnp.float32), from_euler(*angles))


@functools.cache
def unit(kind: str, segments: int) -> np.ndarray:
    """Triangles (f, 3, 3) of a solid of size 1; of a gate as they all are."""
    size = GATE if kind == "gate" else (1.0,) * len(SHAPES[kind].names)
    vertices, faces = tessellate(Scene.of({kind: Solids.of(kind, np.zeros((1, 1, 3)), [[size]])}, 1, None), 0, segments)
    return vertices[faces]


def triangles(scene: Scene, world: int, segments: int) -> np.ndarray:
    """Triangles (f, 3, 3) of one world, made of the unit ones: in a hundredth of the time of `tessellate`."""
    whole = [GROUND * np.array([[[-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[-1, -1, 0], [1, 1, 0], [-1, 1, 0]]], float)]
    for kind in scene.kinds:
        solids = scene.solids[kind]
        shape = unit(kind, segments)
        for centre, turn, size in zip(
            *(np.asarray(x[world]) for x in (solids.centre, to_matrix(solids.quaternion), solids.size)), strict=True
        ):
            place = shape * {"box": size[:3], "cylinder": size[[0, 0, 1]], "gate": 1.0}.get(kind, size[0])
            if kind == "capsule":
                place = place + np.sign(shape) * [0.0, 0.0, size[1] - size[0]]
            whole.append(place @ turn.T + centre)
    return np.concatenate(whole).astype(np.float32)


class Embree:
    """Embree scenes of a batch of worlds."""

    def __init__(self, scene: Scene, segments: int) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        self.scenes, self.meshes, self.build_s = [], [], []
        self.triangles = 0
        for world in range(scene.worlds):
            mesh = triangles(scene, world, segments)
            began = time.perf_counter()
            rays = EmbreeScene()
            self.meshes.append(TriangleMesh(rays, mesh))
            rays.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))
            self.build_s.append(time.perf_counter() - began)
            self.scenes.append(rays)
            self.triangles = max(self.triangles, len(mesh))

    def depth(self, world: int, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Along the directions."""
        return self.scenes[world].run(origins, directions, query="DISTANCE")


def rays_of(origin: jax.Array, matrix: jax.Array, config: CameraConfig) -> tuple[np.ndarray, np.ndarray]:
    """Origins and directions (n, rays, 3) of the same rays, for Embree."""
    own = camera.pattern(config).directions.reshape(-1, 3)
    directions = np.einsum("rj,nij->nri", own, np.asarray(matrix)).astype(np.float32)
    origins = np.broadcast_to(np.asarray(origin)[:, None], directions.shape)
    return np.ascontiguousarray(origins, np.float32), np.ascontiguousarray(directions)


def ours(scene: Scene, config: CameraConfig, channels: tuple[str, ...], origin: Any, matrix: Any) -> Callable[[], Any]:
    """A call that renders all cameras, their worlds shared among the devices."""
    count = len(jax.devices())
    pattern = camera.pattern(config)
    program = on_each(
        lambda *a: cast(*a[:3], pattern, channels, a[3]), count, (OWN,) * 4, OWN, vehicles=scene.worlds // count
    )
    given = placed((scene, origin, matrix, jax.tree.map(jnp.asarray, usual_light(scene.worlds))), count)
    return lambda: jax.block_until_ready(program(*given))


def silhouettes(depth: np.ndarray, instance: np.ndarray) -> np.ndarray:
    """Pixels (n, h, w) next to one of another instance, or whose depth is another by more than a tenth."""
    near = np.pad(np.ones(depth.shape[1:], bool), 1)
    depth, instance = (np.pad(x, [(0, 0), (1, 1), (1, 1)], mode="edge") for x in (depth, instance))
    jumps = np.zeros(depth.shape, bool)
    for shift in ((0, 1), (1, 0), (1, 1), (1, -1)):
        other, name = (np.roll(x, shift, (1, 2)) for x in (depth, instance))
        jump = (name != instance) | (np.abs(other - depth) > 0.1 * np.minimum(other, depth))
        jump &= near & np.roll(near, shift, (0, 1))
        jumps |= jump | np.roll(jump, (-shift[0], -shift[1]), (1, 2))
    return jumps[:, 1:-1, 1:-1]


def agreement(scenes: int, rng: np.random.Generator) -> tuple[float, float]:
    """Share of the pixels nearer than 30 m whose depth is within 1 mm of Embree's; of the others, at silhouettes."""
    config = CameraConfig(fov=(math.pi / 2, math.pi / 2))
    pattern = camera.pattern(config)
    look = jax.jit(lambda *given: cast(*given, pattern, ("depth", "instance")))
    counted = other = edges = 0
    batch = min(scenes, 20)
    for _ in range(scenes // batch):
        scene = clutter(batch, rng)
        origin, matrix = poses(scene, config, rng)
        images = jax.tree.map(np.asarray, look(scene, origin, matrix))
        mine, edge = (x.reshape(batch, -1) for x in (images["depth"], silhouettes(images["depth"], images["instance"])))
        embree, (origins, directions) = Embree(scene, FINE), rays_of(origin, matrix, config)
        for world in range(batch):
            theirs = embree.depth(world, origins[world], directions[world])
            inside = mine[world].min() <= 0.05  # in a solid: a full one for us, a hollow one for Embree
            near = ((mine[world] < 30) | (theirs < 30)) & (not inside)
            differs = near & ~(np.abs(mine[world] - theirs) < 1e-3)
            counted, other = counted + int(near.sum()), other + int(differs.sum())
            edges += int(np.sum(differs & edge[world]))
    return 1 - other / counted, edges / max(other, 1)


def main() -> None:
    """Measure, print the table, write the figures."""
    args = arguments(__doc__ or "", cameras=100, rounds=15, scenes=1000)
    rng = np.random.default_rng(0)
    small, large = (CameraConfig(width=s, height=s, fov=(math.pi / 2, math.pi / 2)) for s in (64, 256))
    scene = clutter(args.cameras, rng)
    pose = poses(scene, small, rng)
    embree, (origins, directions) = Embree(scene, SEGMENTS), rays_of(*pose, small)
    pool, threads = ThreadPoolExecutor(cores()), cores()

    def by_embree() -> None:
        list(pool.map(embree.depth, range(scene.worlds), origins, directions))

    rows: dict[str, Callable[[], Any]] = {
        "depth 64x64": ours(scene, small, ("depth",), *pose),
        "depth, classes, colours 64x64": ours(scene, small, ("depth", "label", "rgb"), *pose),
        "depth 256x256": ours(scene, large, ("depth",), *pose),
        "Embree, depth 64x64": by_embree,
    }
    times: dict[str, list[float]] = {name: [] for name in rows}
    for call in rows.values():
        call()
    for _ in range(args.rounds):
        for name, call in rows.items():
            began = time.perf_counter()
            call()
            times[name].append(time.perf_counter() - began)
    rate = {name: args.cameras / statistics.median(t) for name, t in times.items()}
    best = {name: args.cameras / min(t) for name, t in times.items()}
    same, at_edges = agreement(args.scenes, rng)
    reference = rate["Embree, depth 64x64"]
    shown = [
        {
            "image": name, "frames/s, median": f"{rate[name]:.0f}", "best": f"{best[name]:.0f}",
            "of Embree's": f"{rate[name] / reference:.1f}",
        }
        for name in rows
    ]  # fmt: skip
    print(table(shown))
    build = 1e3 * statistics.median(embree.build_s)
    print(f"Embree: {embree.triangles} triangles, {build:.1f} ms to build a scene, {threads} threads")
    print(
        f"agreement on {args.scenes} scenes: {100 * same:.4f} % of the pixels; "
        f"{100 * at_edges:.1f} % of the others are at silhouettes"
    )
    write("rendering", args.json, {
        "table": shown, "frames_s": rate, "best_frames_s": best, "agreement": same,
        "others_at_silhouettes": at_edges, "scenes": args.scenes,
        "cameras": args.cameras, "embree_build_ms": build, "embree_triangles": embree.triangles,
    })  # fmt: skip


if __name__ == "__main__":
    main()
