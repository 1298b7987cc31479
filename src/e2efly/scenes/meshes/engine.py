"""What an engine that follows rays through triangles offers."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple, Protocol

import numpy as np
from jaxtyping import Bool, Float, Int


class Hits(NamedTuple):
    """What each of c cameras' r rays meets first."""

    depth: Float[np.ndarray, "c r"]
    """Parameter of the ray; `FAR` where it meets nothing."""
    face: Int[np.ndarray, "c r"]
    """Triangle; -1 for none."""
    u: Float[np.ndarray, "c r"]
    """Weight of its second corner."""
    v: Float[np.ndarray, "c r"]
    """Weight of its third."""


class Engine(Protocol):
    """One scene, ready."""

    threads: int
    """How many parts of a batch it works on at a time."""

    def depth(
        self, origin: Float[np.ndarray, "c 3"], matrix: Float[np.ndarray, "c 3 3"], rays: Float[np.ndarray, "3 r"]
    ) -> Float[np.ndarray, "c r"]:
        """Depth of what cameras' rays `origin + t matrix ray` meet first; `FAR` for nothing."""
        ...

    def hits(
        self, origin: Float[np.ndarray, "c 3"], matrix: Float[np.ndarray, "c 3 3"], rays: Float[np.ndarray, "3 r"]
    ) -> Hits:
        """All about what they meet first."""
        ...

    def blocked(self, origin: Float[np.ndarray, "m 3"], direction: Float[np.ndarray, "m 3"]) -> Bool[np.ndarray, " m"]:
        """Whether single rays meet anything."""
        ...


@contextmanager
def needed(extra: str) -> Iterator[None]:
    """Around the imports of what an extra installs.

    Raises:
        ValueError: naming the package that is missing, and how to install it.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise ValueError(f"mesh scenes need the package {error.name}: pip install 'e2efly[{extra}]'") from None
