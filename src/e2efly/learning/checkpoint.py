"""Checkpoints: one safetensors file, written atomically and checked when it is read. No pickle."""

import json
import zlib
from pathlib import Path
from typing import Any

import jax
import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from e2efly.config.storage import finite, write_atomically
from e2efly.environment import is_key, key_of, numbers_of

FORMAT = 2
"""Version of the content of a checkpoint and of the way in which a run continues from it."""


def save_checkpoint(path: Path, tree: Any, about: dict[str, Any]) -> None:
    """Write the leaves of a tree, and the description `about` as JSON."""
    arrays = _arrays(tree)
    header = {**about, "format": FORMAT, "crc32": _checksum(arrays)}
    write_atomically(path, save(arrays, {"about": json.dumps(finite(header), allow_nan=False)}))


def read_about(path: Path) -> dict[str, Any]:
    """The description stored in a checkpoint.

    Raises:
        ValueError: when the file is missing, truncated or of another format.
    """
    try:
        with safe_open(path, "numpy") as file:
            about = json.loads((file.metadata() or {}).get("about", "{}"))
    except (SafetensorError, OSError, ValueError) as error:
        raise ValueError(f"checkpoint {path} cannot be read (truncated or damaged?): {error}") from None
    if about.get("format") != FORMAT:
        raise ValueError(f"checkpoint {path}: format is {about.get('format')!r}; accepted: {FORMAT}")
    return about


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """The leaves of the tree that was saved, by the path of each, such as `['state'].parameters.log_std`.

    Raises:
        ValueError: when the file is missing, truncated, damaged or of another format.
    """
    about = read_about(path)
    try:
        with safe_open(path, "numpy") as file:
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (not a dict)
    except (SafetensorError, OSError) as error:
        raise ValueError(f"checkpoint {path} cannot be read (truncated or damaged?): {error}") from None
    if _checksum(arrays) != about["crc32"]:
        raise ValueError(f"checkpoint {path}: its checksum is wrong; the file is damaged")
    return arrays


def load_checkpoint(path: Path, like: Any) -> Any:
    """Read a tree that has the structure, shapes and types of `like`.

    Raises:
        ValueError: when the file is missing, truncated, damaged, or has another structure.
    """
    arrays = read_arrays(path)
    leaves, structure = jax.tree_util.tree_flatten_with_path(like)
    found = []
    for where, leaf in leaves:
        name = jax.tree_util.keystr(where)
        key = is_key(leaf)
        wanted = jax.eval_shape(numbers_of, leaf)
        array = arrays.pop(name, None)
        if array is None or array.shape != wanted.shape or array.dtype != wanted.dtype:
            has = "is missing" if array is None else f"is {array.dtype}{list(array.shape)}"
            raise ValueError(f"checkpoint {path}: {name} {has}; accepted: {wanted.dtype}{list(wanted.shape)}")
        found.append(key_of(array) if key else array)
    if arrays:
        raise ValueError(f"checkpoint {path}: {', '.join(sorted(arrays))} belong to no part of this run")
    return jax.tree_util.tree_unflatten(structure, found)


def _arrays(tree: Any) -> dict[str, np.ndarray]:
    leaves = jax.tree_util.tree_flatten_with_path(tree)[0]
    return {jax.tree_util.keystr(where): np.asarray(numbers_of(leaf), order="C") for where, leaf in leaves}


def _checksum(arrays: dict[str, np.ndarray]) -> int:
    total = 0
    for name in sorted(arrays):
        total = zlib.crc32(np.ascontiguousarray(arrays[name]).tobytes(), zlib.crc32(name.encode(), total))
    return total
