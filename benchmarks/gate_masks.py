"""A network of gates: its training on rendered pictures, and what it finds in looks that were kept apart.

    python benchmarks/gate_masks.py --file gates.onnx [--train 4000] [--folder gate_pictures] [--more 0] [--unseen 256]
        [--looks FILE.py:NAME]

`--train` learns so many steps from the pictures that `gate_renders.py` left in a folder, and writes the file; without
it the file is measured. `--more N` begins from the file that is there, in another order for each N. It is measured in
the looks of the training and in `UNSEEN` ones, of which neither textures, sun, bars, panels nor seeds are the
training's; or in those that `--looks` names. Then `eyes.py --colours gates.onnx` flies by it.
A corner is one that can be seen in the true mask. It is found if a corner of the network's mask that opens the same way
lies within 10 pixels. A gate can be seen if two of its corners can, and is found if two of them are.
"""

import time
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import onnx
from common import arguments, table, write
from gate_renders import LEARNED, SIZE, UNSEEN, Pictures, Variety, pictures, stored
from mask_network import GATES, Unet, graph, learned, loaded

from e2efly.config.registry import load
from e2efly.flight.pose.gates.error_state import ALIKE
from e2efly.flight.pose.gates.lens import NEAREST, Corners
from e2efly.flight.sight.gate_corners import gate_corners
from e2efly.flight.sight.segment.network import MaskNetwork
from e2efly.validation.gate_pose import RACER, GateCamera

LENS = GateCamera(RACER, readout=0.0).lens
DISTANCES = (0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 13.0)
"""Bounds of the table's rows, m."""
NEAR, SAME = 10.0, 3.0
"""Largest distance of a corner that is found from where it is, and of one that can be seen from its place in the true
mask, pixels."""
RUNS = 300
"""For the time of a run."""


def errors(found: Corners, pixel: np.ndarray, inward: np.ndarray) -> np.ndarray:
    """(k,) distances of corners, with directions into their openings, (k, 2), from the nearest that is found."""
    if not len(found.pixel):
        return np.full(len(pixel), np.inf)
    away = np.linalg.norm(pixel[:, None] - found.pixel[None], axis=-1)
    return np.where(inward @ found.inward.T > ALIKE, away, np.inf).min(axis=1)


def looked(network: MaskNetwork, p: Pictures) -> tuple[np.ndarray, np.ndarray, float]:
    """Of each gate that can be seen: its distance, m, and for its four corners the errors in the network's and in the
    true mask, pixels, infinite for what is not found, not a number for what cannot be seen. And corners of the
    network's masks that are none, per picture.
    """
    distance, each, wrong = [], [], 0
    for colours, mask, openings, (eye, rotation) in zip(p.colours, p.masks, p.openings, p.pose, strict=True):
        points, ways = openings.seen(eye)
        ahead, way = (points - eye) @ rotation @ LENS.matrix.T, ways @ rotation @ LENS.matrix.T
        front = ahead[..., 2] > NEAREST
        ahead[~front] = [0.0, 0.0, 1.0]
        pixel = LENS.pixels(ahead)
        inward = np.einsum("kij,kj->ki", LENS.slope(ahead.reshape(-1, 3)), way.reshape(-1, 3))
        inward /= np.linalg.norm(inward, axis=-1, keepdims=True)
        found = gate_corners(network(colours))
        got, true = (errors(c, pixel.reshape(-1, 2), inward).reshape(-1, 4) for c in (found, gate_corners(mask)))
        there = front & LENS.inside(pixel, 3.0) & (true < SAME)
        seen = there.sum(axis=1) >= 2
        got = np.where(got < NEAR, got, np.inf)
        each.append(np.where(there, [got, true], np.nan)[:, seen])
        distance.append(np.linalg.norm(openings.corners.mean(axis=1) - eye, axis=-1)[seen])
        if len(found.pixel):
            away = np.linalg.norm(found.pixel[:, None] - pixel[front][None], axis=-1)
            wrong += np.sum(away.min(axis=1, initial=np.inf) > NEAR)
    return np.concatenate(distance), np.concatenate(each, axis=1), wrong / len(p.colours)


def measured(name: str, file: Path, n: int, seed: int, variety: Variety) -> list[dict[str, str]]:
    """A row for each interval of distances. Of all pictures: overlap of all pixels, wrong corners a picture."""
    network, p = MaskNetwork(file), pictures(seed, n, variety, whole=True)
    masks = np.stack([network(c) for c in p.colours]).astype(bool)
    true = p.masks.astype(bool)
    overlap = (masks & true).sum() / (masks | true).sum()
    distance, (got, best), wrong = looked(network, p)
    rows = []
    for low, high in [*pairwise(DISTANCES), (0.0, 8.0), (0.0, 10.0)]:
        inside = (distance >= low) & (distance < high)
        g, b = got[inside], best[inside]
        can, finite = ~np.isnan(g), np.isfinite(g)
        rows.append({
            "looks": name,
            "distance": f"{low:g} to {high:g} m",
            "gates": str(inside.sum()),
            "found": f"{100 * np.mean(finite.sum(1) >= 2):.0f} %" if inside.any() else "",
            "corners found": f"{100 * finite.sum() / max(can.sum(), 1):.0f} %",
            "median error": f"{np.median(g[can]):.2f} px" if can.any() else "",
            "of those found": f"{np.median(g[finite]):.2f} px" if finite.any() else "",
            "by the true mask": f"{np.median(b[can]):.2f} px" if can.any() else "",
            "IoU, all pictures": f"{100 * overlap:.1f} %",
            "wrong corners a picture, all": f"{wrong:.2f}",
        })  # fmt: skip
    return rows


def times(file: Path) -> dict[str, float]:
    """Time of a mask of 640 x 360 pixels from colours on one thread, ms."""
    cv2.setNumThreads(1)
    network, colours = MaskNetwork(file), np.random.default_rng(0).integers(0, 255, (360, 640, 3)).astype(np.uint8)
    taken = []
    for _ in range(RUNS):
        began = time.perf_counter()
        network(colours)
        taken.append(1e3 * (time.perf_counter() - began))
    return {f"p{q}": round(float(np.quantile(taken, q / 100)), 2) for q in (0, 50, 99)}


def main() -> None:
    """Train where it is asked for, measure, print the table, write the figures."""
    args = arguments(__doc__ or "", file="gates.onnx", train=0, folder="gate_pictures", more=0, unseen=256, looks="")
    file = Path(args.file)
    if args.train:
        network, rate = (loaded(GATES, onnx.load(file)), 1e-3) if args.more else (Unet(GATES), 4e-3)
        colours, masks = stored(Path(args.folder))
        learned(network, colours, masks, args.train, 16, rate, args.more, upright=True, painted=0.2)
        file.write_bytes(graph(network, SIZE).SerializeToString())
        print(f"{file}: {file.stat().st_size} bytes")
    if args.looks:
        print(table(measured(args.looks, file, args.unseen, 2, load(args.looks))))
        return
    rows = measured("of the training's kinds, other seeds", file, args.unseen // 2, 2, LEARNED)
    rows += measured("kept apart", file, args.unseen, 3, UNSEEN)
    print(table(rows))
    write("gate_masks", args.json, {"table": rows, "bytes": file.stat().st_size, "ms": times(file)})


if __name__ == "__main__":
    main()
