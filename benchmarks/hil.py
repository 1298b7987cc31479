"""Hardware in the loop: from the arrival of a pose to its image, and the largest rate of large images on one core.

    python benchmarks/hil.py [--seconds 60]

Run it on a machine that does nothing else.
"""

import argparse
import dataclasses
import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

TASKS = ("avoid", "race_clutter", "land_visual")
"""Of the zoo, those that see."""
POSES_HZ = 120.0
"""Rate of the simulated motion capture system."""


def send_poses(port: int, stop: threading.Event) -> None:
    """Poses of a vehicle that circles slowly, at `POSES_HZ`."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        due = began = time.monotonic()
        while not stop.wait(max(due - time.monotonic(), 0.0)):
            now = time.monotonic()
            phase = 0.5 * (now - began)
            position = [0.5 * np.cos(phase), 0.5 * np.sin(phase), 3.0]
            velocity = [-0.25 * np.sin(phase), 0.25 * np.cos(phase), 0.0]
            pose = {"position": position, "velocity": velocity, "quaternion": [1, 0, 0, 0], "body_rate": [0, 0, 0]}
            out.sendto(json.dumps({**pose, "stamp": now}).encode(), ("127.0.0.1", port))
            due += 1 / POSES_HZ


def latencies(task: str, seconds: float, rate: float) -> dict[str, float]:
    """What the node reports of a task, driven over UDP."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("127.0.0.1", 0))
        port = found.getsockname()[1]
    stop = threading.Event()
    sender = threading.Thread(target=send_poses, args=(port, stop))
    sender.start()
    try:
        with tempfile.TemporaryDirectory() as folder:
            given = ["--pose", f"udp:{port}", "--image", f"image_0=shm:benchmark-{os.getpid()}"]
            told = ["--rate", str(rate), "--seconds", str(seconds), "--report", folder]
            subprocess.run([sys.executable, "-m", "e2efly", "hil", task, *given, *told], check=True)
            return json.loads((Path(folder) / "latency.json").read_text())
    finally:
        stop.set()
        sender.join()


def large_scan(file: Path, least: int = 100_000) -> int:
    """Write the mesh scene terrain, its triangles cut until there are so many; how many there are."""
    import trimesh

    from e2efly.simulation.scenes.meshes.load import load_mesh_scene

    corners = load_mesh_scene("terrain").triangles.reshape(-1, 3)
    mesh = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)
    while len(mesh.faces) < least:
        mesh = mesh.subdivide()
    mesh.export(file)
    return len(mesh.faces)


def largest_rate(size: int, images: int, scene: str | None = None) -> tuple[float, float, float]:
    """Images of depth a second on one core, and of its time alone, and the 99th percentile of the time of one, s.

    Args:
        size: rows and columns.
        images: how many.
        scene: what is seen in place of the world of avoid, with the check of virtual collisions.
    """
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    from e2efly.simulation.device import compute_at_once, prepare

    compute_at_once()
    prepare("cpu")
    from e2efly.courses.origin import Origin
    from e2efly.validation.candidate import candidate
    from e2efly.validation.plant import RigidState
    from e2efly.validation.scene_files import SceneFile
    from e2efly.validation.scenery import Scenery

    found = candidate("avoid")
    env = found.environment(next(iter(found.task.criteria().values())))
    large = dataclasses.replace(env.cameras[0], width=size, height=size)
    scenery = Scenery.draw(dataclasses.replace(env, cameras=(large,)), 0)
    assert scenery is not None
    if scene is not None:
        scenery = SceneFile(scene).put(scenery)
    took, used = [], 0.0
    for k in range(images + 1):
        angle = 0.05 * k
        turn = np.array([np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)])
        state = RigidState(np.array([0.0, 0.0, 1.5]), np.zeros(3), turn, np.zeros(3))
        began = time.perf_counter()
        computing = time.process_time()
        scenery.images(state, 0.0, k)
        if scene is not None:
            scenery.nearest(list(np.linspace([-0.2, 0.0, 1.5], state.position, 5)), [0.0] * 5, Origin(), 0.15)
        took.append(time.perf_counter() - began)
        used += time.process_time() - computing if k else 0.0  # the first is compiled
    return images / sum(took[1:]), images / used, float(np.quantile(took[1:], 0.99))


def main() -> None:
    """Measure and print."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seconds", type=float, default=60.0)
    options.add_argument("--rate", type=float, default=30.0)
    options.add_argument("--tasks", nargs="*", default=list(TASKS))
    chosen = options.parse_args()
    print("| task | images | Hz | pose to image p50 | p99 | largest |\n| --- | --- | --- | --- | --- | --- |")
    for task in chosen.tasks:
        found = latencies(task, chosen.seconds, chosen.rate)
        p50, p99, largest = (1e3 * found[key] for key in ("p50_s", "p99_s", "max_s"))
        print(
            f"| {task} | {found['images']} | {found['rate_hz']:.1f} | {p50:.1f} ms | {p99:.1f} ms | {largest:.1f} ms |"
        )
    with tempfile.TemporaryDirectory() as folder:
        scan = Path(folder) / "scan.ply"
        count = large_scan(scan)
        for name, scene in (("world of avoid", None), (f"scan of {count} triangles, with collisions", str(scan))):
            rate, alone, p99 = largest_rate(256, 300, scene)
            print(
                f"256x256 depth of the {name}, one core: {rate:.0f} images a second ({alone:.0f} of the core's own "
                f"time), {1e3 * p99:.1f} ms (p99) each"
            )


if __name__ == "__main__":
    main()
