"""Processes that train together, on one machine or on several (`e2efly.simulation.device.Hosts`).

Each process runs the same program on its own devices. Only process 0 reads and writes files. A process that runs alone
is process 0.
"""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import jax
import numpy as np

from e2efly.environment import is_key, key_of, numbers_of


class LostHostError(RuntimeError):
    """Another process of the run has ended or can no longer be reached."""


def first() -> bool:
    """Whether this process reads and writes the files."""
    return jax.process_index() == 0


def gather(tree: Any) -> Any:
    """A tree of arrays as NumPy arrays, with the parts held by other processes. Random keys become their numbers."""

    def gathered(x: Any) -> np.ndarray:
        x = numbers_of(x)
        if isinstance(x, jax.Array) and not (x.is_fully_addressable or x.is_fully_replicated):
            from jax.experimental.multihost_utils import process_allgather

            x = process_allgather(x, tiled=True)
        return np.asarray(x)

    return jax.tree.map(gathered, tree)


def broadcast(tree: Any, like: Any) -> Any:
    """The arrays of process 0, in every process.

    Args:
        tree: the arrays in process 0. Ignored in other processes.
        like: their shapes and types.
    """
    if jax.process_count() == 1:
        return tree
    from jax.experimental.multihost_utils import broadcast_one_to_all

    def empty(x: Any) -> np.ndarray:
        numbers = jax.eval_shape(numbers_of, x)
        return np.zeros(numbers.shape, numbers.dtype)

    found = broadcast_one_to_all(gather(tree) if first() else jax.tree.map(empty, like))
    return jax.tree.map(lambda wanted, x: key_of(x) if is_key(wanted) else np.asarray(x), like, found)


def broadcast_json(content: Any) -> Any:
    """The JSON content of process 0, in every process."""
    if jax.process_count() == 1:
        return content
    data = np.frombuffer(json.dumps(content).encode(), np.uint8) if first() else np.zeros(0, np.uint8)
    size = int(broadcast(np.int32(data.size), np.int32(0)))
    return json.loads(bytes(broadcast(data, np.zeros(size, np.uint8))))


def any_of(flag: bool) -> bool:
    """Whether `flag` is true in any process."""
    if jax.process_count() == 1:
        return flag
    from jax.experimental.multihost_utils import process_allgather

    return bool(np.any(process_allgather(np.array(flag))))


@contextmanager
def together() -> Iterator[None]:
    """Report the loss of another process by an error of its own.

    Raises:
        LostHostError: when a computation over all processes fails.
    """
    try:
        yield
    except (ValueError, RuntimeError) as error:  # the types with which JAX reports failed collectives
        text = str(error)
        if jax.process_count() > 1 and any(word in text for word in ("Gloo", "NCCL", "oordination service")):
            raise LostHostError(
                f"another process of the run ended or cannot be reached: {text.splitlines()[0][:200]}"
            ) from None
        raise
