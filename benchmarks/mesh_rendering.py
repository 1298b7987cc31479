"""Frames a second of mesh scenes, beside bare calls of Embree with ready rays on as many threads; distance grids.

    python benchmarks/mesh_rendering.py [--cameras 100] [--rounds 30] [--json FILE]

Cameras anywhere in the package's mesh scenes, depth of 64x64 unless said, called as compiled programs call it. Embree's
own row: `embreex` with one call a camera, its rays made beforehand. Rounds of all rows take turns, so that a machine
whose speed varies is as fast for one as for another; a row is its median. Grids: 0.2 m cells; the error is that of the
interpolated distance to a ball of 1 m radius.
"""

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
from rendering import rays_of  # noqa: E402

from e2efly.config import CameraConfig  # noqa: E402
from e2efly.simulation.physics.rotation import from_euler  # noqa: E402
from e2efly.simulation.scenes import camera  # noqa: E402
from e2efly.simulation.scenes.cast import usual_light  # noqa: E402
from e2efly.simulation.scenes.meshes.distance import DistanceGrid, clearance  # noqa: E402
from e2efly.simulation.scenes.meshes.load import load_mesh_scene, mesh_scene_names  # noqa: E402
from e2efly.simulation.scenes.meshes.mesh_cast import cast  # noqa: E402
from e2efly.simulation.scenes.meshes.mesh_scene import MeshPart, MeshScene  # noqa: E402

CELL = 0.2


def config(size: int) -> CameraConfig:
    """A square image over 90 degrees."""
    return CameraConfig(width=size, height=size, fov=(math.pi / 2, math.pi / 2))


def poses(scene: MeshScene, size: int, n: int, rng: np.random.Generator) -> tuple[jax.Array, jax.Array]:
    """Origins and matrices of cameras at flying height, in the middle part of the scene."""
    low, high = (0.7 * corner for corner in scene.bounds)
    position = np.column_stack([rng.uniform(low[:2], high[:2], (n, 2)), rng.uniform(1.0, 2.5, n)])
    angles = [jnp.asarray(rng.uniform(-a, a, n), jnp.float32) for a in (0.2, 0.2, math.pi)]
    return camera.pose(camera.mount(config(size), n), jnp.asarray(position, jnp.float32), from_euler(*angles))


def ours(scene: MeshScene, size: int, channels: tuple[str, ...], pose: Any) -> Callable[[], Any]:
    """A call of a compiled program that renders all cameras."""
    n, pattern = len(pose[0]), camera.pattern(config(size))
    light = jax.tree.map(jnp.asarray, usual_light(n))
    program = jax.jit(lambda o, m, light: cast(scene, o, m, pattern, channels, light))
    return lambda: jax.block_until_ready(program(*pose, light))


def bare(scene: MeshScene, size: int, pose: Any, pool: ThreadPoolExecutor) -> Callable[[], Any]:
    """The same rays, ready, by Embree's binding."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    rays = EmbreeScene()
    mesh = TriangleMesh(rays, scene.triangles)
    origins, directions = rays_of(*pose, config(size))
    one = lambda o, d, _=mesh: rays.run(o, d, query="DISTANCE")  # noqa: E731
    return lambda: list(pool.map(one, origins, directions))


def rates(rows: dict[str, Callable[[], Any]], cameras: int, rounds: int) -> dict[str, float]:
    """Median frames a second of each row, rounds taking turns."""
    times: dict[str, list[float]] = {name: [] for name in rows}
    for call in rows.values():
        call()
    for _ in range(rounds):
        for name, call in rows.items():
            began = time.perf_counter()
            call()
            times[name].append(time.perf_counter() - began)
    return {name: cameras / statistics.median(each) for name, each in times.items()}


def grid_row(name: str, scene: MeshScene) -> dict[str, str]:
    """What a grid of distances of a scene costs."""
    began = time.perf_counter()
    grid = DistanceGrid.of(scene, CELL)
    took = time.perf_counter() - began
    points = jnp.asarray(np.random.default_rng(0).uniform(*scene.bounds, (1024, 3)), jnp.float32)
    read = jax.jit(jax.value_and_grad(lambda p: jnp.sum(clearance(grid, p))))
    per_s = rates({"": lambda: jax.block_until_ready(read(points))}, len(points), 50)[""]
    return {
        "grid": name, "cells": " x ".join(map(str, grid.values.shape)), "MB": f"{grid.values.nbytes / 1e6:.0f}",
        "built in, s": f"{took:.1f}", "distances with gradients/s": f"{per_s:.2g}",
    }  # fmt: skip


def grid_error() -> tuple[float, float]:
    """Mean and largest error for a ball, m."""
    import trimesh

    ball = trimesh.creation.icosphere(5, 1.0)
    grid = DistanceGrid.of(MeshScene.of([MeshPart("ball", np.asarray(ball.vertices), np.asarray(ball.faces))]), CELL)
    points = np.random.default_rng(0).uniform(-1.8, 1.8, (20_000, 3)).astype(np.float32)
    error = np.abs(np.asarray(clearance(grid, jnp.asarray(points))) - (np.linalg.norm(points, axis=1) - 1))
    return float(error.mean()), float(error.max())


def main() -> None:
    """Measure, print the tables, write the figures."""
    args = arguments(__doc__ or "", cameras=100, rounds=30)
    rng, shown, grids, figures = np.random.default_rng(0), [], [], {}
    with ThreadPoolExecutor(cores()) as pool:
        for name in mesh_scene_names():
            scene = load_mesh_scene(name)
            pose, small = (poses(scene, size, args.cameras, rng) for size in (64, 16))
            rows = {
                "bare Embree, depth": bare(scene, 64, pose, pool),
                "depth": ours(scene, 64, ("depth",), pose),
                "bare Embree, depth 16x16": bare(scene, 16, small, pool),
                "depth 16x16": ours(scene, 16, ("depth",), small),
                "depth, classes": ours(scene, 64, ("depth", "label"), pose),
                "colours": ours(scene, 64, ("rgb",), pose),
            }
            rate = rates(rows, args.cameras, args.rounds)
            share = {"depth": "bare Embree, depth", "depth 16x16": "bare Embree, depth 16x16"}
            figures[name] = {"frames_s": rate, "triangles": len(scene.triangles)}
            shown += [
                {
                    "scene": name, "triangles": len(scene.triangles), "image": image, "frames/s": f"{rate[image]:.0f}",
                    "of bare Embree's": f"{100 * rate[image] / rate[share[image]]:.0f} %" if image in share else "",
                }
                for image in rows
            ]  # fmt: skip
            grids.append(grid_row(name, scene))
    error = grid_error()
    print(table(shown), table(grids), sep="\n\n")
    print(f"distance to a ball: wrong by {1e3 * error[0]:.1f} mm on average, {1e3 * error[1]:.0f} mm at most")
    write("mesh_rendering", args.json, {
        "table": shown, "figures": figures, "grids": grids, "grid_error_m": error, "cameras": args.cameras,
        "threads": cores(),
    })  # fmt: skip


if __name__ == "__main__":
    main()
