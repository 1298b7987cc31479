"""The package's network of pads: its training on rendered pictures, and its masks of pads that it never saw.

    python benchmarks/pad_masks.py [--train 4000] [--pictures 8192] [--more 0] [--unseen 512] [--json FILE]

`--train` learns so many steps and writes `flight/sight/segment/pad.onnx`; without it the file that ships is measured.
`--more N` begins from the file that is there, with other pictures for each N.
Outlines, markings, grounds and seeds of the unseen pictures are none of the training's: `pad_renders`.
"""

import jax
import numpy as np
import onnx
from common import arguments, table, write
from mask_network import PADS, Unet, graph, learned, loaded
from pad_renders import SEEN, SIDE, UNSEEN, Variety, pictures

from e2efly.flight.sight.segment.network import OWN, MaskNetwork

BATCH = 256
"""Pictures that are drawn at once."""
SMALL, LARGE = 64, 512
"""Pixels of a pad that divide the sizes of the table."""


def drawn(seed: int, n: int, variety: Variety) -> tuple[np.ndarray, np.ndarray]:
    """So many pictures and their masks."""
    keys = jax.random.split(jax.random.key(seed), -(-n // BATCH))
    parts = [jax.tree.map(np.asarray, pictures(key, BATCH, variety)) for key in keys]
    return tuple(np.concatenate(x)[:n] for x in zip(*parts, strict=True))  # pyright: ignore


def measured(name: str, colours: np.ndarray, truth: np.ndarray) -> list[dict[str, str]]:
    """Intersection over union of all pixels of all pictures, by the size of the pad."""
    network = MaskNetwork(OWN)
    found = np.stack([network(picture) for picture in colours]).astype(bool)
    truth, sizes = truth.astype(bool), truth.sum((1, 2))
    rows = []
    for size, least, most in (
        ("all", 0, SIDE * SIDE),
        (f"none or below {SMALL} pixels", 0, SMALL - 1),
        (f"{SMALL} to {LARGE} pixels", SMALL, LARGE),
        (f"above {LARGE} pixels", LARGE + 1, SIDE * SIDE),
    ):
        chosen = (sizes >= least) & (sizes <= most)
        a, b = found[chosen], truth[chosen]
        each = [(x & y).sum() / (x | y).sum() for x, y in zip(a, b, strict=True) if y.any()]
        rows.append({
            "pictures": name,
            "pad": size,
            "number": str(chosen.sum()),
            "IoU of all pixels": f"{100 * (a & b).sum() / max((a | b).sum(), 1):.1f} %",
            "median IoU of a picture": f"{100 * np.median(each):.1f} %" if each else "",
        })  # fmt: skip
    return rows


def main() -> None:
    """Train where it is asked for, measure, print the table, write the figures."""
    args = arguments(__doc__ or "", train=0, pictures=8192, more=0, unseen=512)
    if args.train:
        network = loaded(PADS, onnx.load(OWN)) if args.more else Unet(PADS)
        colours, masks = drawn(1 + 10 * args.more, args.pictures, SEEN)
        learned(network, colours, 255 * masks, args.train)
        OWN.write_bytes(graph(network).SerializeToString())
        print(f"{OWN}: {OWN.stat().st_size} bytes")
    rows = measured("of the training's kinds, other seeds", *drawn(2, args.unseen, SEEN))
    rows += measured("of unseen outlines, markings and grounds", *drawn(3, args.unseen, UNSEEN))
    print(table(rows))
    write("pad_masks", args.json, {"table": rows, "bytes": OWN.stat().st_size})


if __name__ == "__main__":
    main()
