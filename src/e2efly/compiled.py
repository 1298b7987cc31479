"""The cache of compiled programs, each with its digest: JAX keeps none, and a flipped bit in machine code is run."""

import hashlib
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

from jax._src import compilation_cache
from jax._src.compilation_cache_interface import CacheInterface

_DIGEST = 32
"""Bytes of a SHA-256, which stand before what they are of."""


def sealed(data: bytes) -> bytes:
    """Data behind its digest."""
    return hashlib.sha256(data).digest() + data


def opened(data: bytes, file: Path) -> bytes | None:
    """What stands behind a digest; None, and a word, where the file is damaged and goes: it is made anew."""
    if hashlib.sha256(data[_DIGEST:]).digest() == data[:_DIGEST]:
        return data[_DIGEST:]
    file.unlink(missing_ok=True)
    logging.getLogger("e2efly").warning("%s is damaged: its program is compiled anew", file)
    return None


class CheckedCache(CacheInterface):
    """JAX's cache, with a digest before each entry."""

    def __init__(self, base: Any) -> None:
        self._base, self._path = base, base._path

    def get(self, key: str) -> Any:
        """An entry; None where there is none, or a damaged one."""
        data = self._base.get(key)
        return None if data is None else opened(data, Path(self._path) / f"{key}-cache")

    def put(self, key: str, value: bytes) -> None:
        """Keep an entry."""
        self._base.put(key, sealed(value))


def check_programs(folder: Callable[[], Path]) -> None:
    """Keep digests in our own cache of compiled programs, which lies in `folder()`. Before anything is compiled.

    A folder that the user names by JAX's own variable is shared with other programs, and stays in JAX's own format.
    """
    theirs = compilation_cache.get_file_cache

    def ours(path: str) -> Any:
        found = theirs(path)
        return found if found is None or Path(path) != folder() else (CheckedCache(found[0]), found[1])

    if theirs.__module__ != __name__:
        compilation_cache.get_file_cache = ours
