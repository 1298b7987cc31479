"""Random observations and images, to compare two forms of one policy."""

import numpy as np

from e2efly.policy.images import Image
from e2efly.policy.observation import Field


def random_observations(rng: np.random.Generator, fields: tuple[Field, ...], count: int) -> np.ndarray:
    """Float32 (count, o): any attitude, past actions over their full range, the rest normal with twice its scale."""

    def draw(field: Field) -> np.ndarray:
        if field.frame == "none":
            return rng.uniform(-field.scale, field.scale, (count, field.size))
        normal = rng.standard_normal((count, field.size))
        if field.frame == "world_body":
            return normal / np.linalg.norm(normal, axis=-1, keepdims=True)
        return 2 * field.scale * normal

    return np.concatenate([draw(field) for field in fields], axis=-1).astype(np.float32)


def random_images(rng: np.random.Generator, image: Image, count: int) -> np.ndarray:
    """Float32 (count, h, w) or (count, h, w, 3): values over their full range, some of them 0. Masks have 0 and 1."""
    low, high = image.limits
    x = rng.uniform(low, high, (count, *image.shape))
    shown = rng.random((count, *image.shape)) < rng.random((count, *(1,) * len(image.shape)))
    return (shown * (1.0 if image.sees == "mask" else x)).astype(np.float32)
