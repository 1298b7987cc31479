"""The interface of an engine that follows rays through triangles."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple, Protocol

import numpy as np
from jaxtyping import Bool, Float, Int


class MeshHits(NamedTuple):
    """The first hits of the r rays of each of c cameras."""

    depth: Float[np.ndarray, "c r"]
    """Parameter of the ray at the hit; `FAR` without a hit."""
    face: Int[np.ndarray, "c r"]
    """Index of the triangle; -1 without a hit."""
    u: Float[np.ndarray, "c r"]
    """Weight of the triangle's second corner."""
    v: Float[np.ndarray, "c r"]
    """Weight of the triangle's third corner."""


class Engine(Protocol):
    """One scene, ready for rays."""

    threads: int
    """Number of parts of a batch on which it works at a time."""

    def depth(
        self, origin: Float[np.ndarray, "c 3"], matrix: Float[np.ndarray, "c 3 3"], rays: Float[np.ndarray, "3 r"]
    ) -> Float[np.ndarray, "c r"]:
        """Depth of the first hits of cameras' rays `origin + t matrix ray`; `FAR` without a hit."""
        ...

    def hits(
        self, origin: Float[np.ndarray, "c 3"], matrix: Float[np.ndarray, "c 3 3"], rays: Float[np.ndarray, "3 r"]
    ) -> MeshHits:
        """All data of the first hits."""
        ...

    def blocked(self, origin: Float[np.ndarray, "m 3"], direction: Float[np.ndarray, "m 3"]) -> Bool[np.ndarray, " m"]:
        """Whether single rays hit anything."""
        ...


@contextmanager
def needed(extra: str) -> Iterator[None]:
    """Context manager for the imports of packages that an extra installs.

    Raises:
        ValueError: naming the package that is missing, and how to install it.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise ValueError(f"mesh scenes need the package {error.name}: pip install 'e2efly[{extra}]'") from None
