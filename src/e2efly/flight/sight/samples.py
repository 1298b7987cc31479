"""Images that a policy saw in training, kept beside its file. `fly --check` shows them next to a camera's images."""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.config.storage import read_npz
from e2efly.policy.images import Image

COUNT = 6
"""How many samples are kept of each image of a policy."""
LARGEST = 1 << 28
"""Largest size of all samples, bytes."""


def samples_file(policy: Path) -> Path:
    """Path of the samples: policy.images.npz beside policy.onnx."""
    return policy.with_suffix(".images.npz")


def packed(images: Mapping[str, np.ndarray]) -> bytes:
    """The content of a samples file. The images are (k, h, w) or (k, h, w, 3), by the names of the contract. The first
    `COUNT` of each are kept.
    """
    content = io.BytesIO()
    kept: Any = {name: np.asarray(seen[:COUNT], np.float16) for name, seen in images.items()}
    np.savez_compressed(content, **kept)
    return content.getvalue()


def read_samples(policy: Path, image: Image) -> np.ndarray | None:
    """Samples of one image of a policy: (k, h, w) or (k, h, w, 3) float32. None: no samples are kept of it.

    Raises:
        ValueError: naming the file, if it does not hold images of this shape.
    """
    path = samples_file(policy)
    if not path.is_file():
        return None
    try:
        found = read_npz(path, LARGEST).get(image.name)
    except ValueError as error:
        raise ValueError(f"{path}: {error}; accepted: what a training has written, or no such file") from None
    if found is None:
        return None
    if found.shape[1:] != image.shape or not len(found) or found.dtype.kind not in "fiu":
        raise ValueError(f"{path}: {image.name} has shape {found.shape}; accepted: images of shape {image.shape}")
    return found.astype(np.float32)
