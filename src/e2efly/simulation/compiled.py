"""The cache of compiled programs, each with a digest.

JAX stores none, and would run machine code with a flipped bit.
"""

import hashlib
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

from jax._src import compilation_cache
from jax._src.compilation_cache_interface import CacheInterface

_DIGEST = 32
"""Length of a SHA-256, bytes. It stands before the data."""


def sealed(data: bytes) -> bytes:
    """The data with its digest in front."""
    return hashlib.sha256(data).digest() + data


def opened(data: bytes, file: Path) -> bytes | None:
    """The data behind a digest.

    None, with a message, if the file is damaged. The file is then deleted, and made again.
    """
    if hashlib.sha256(data[_DIGEST:]).digest() == data[:_DIGEST]:
        return data[_DIGEST:]
    file.unlink(missing_ok=True)
    logging.getLogger("e2efly").warning("%s is damaged: its program is compiled anew", file)
    return None


class CheckedCache(CacheInterface):
    """JAX's cache, with a digest in front of each entry."""

    def __init__(self, base: Any) -> None:
        self._base, self._path = base, base._path

    def get(self, key: str) -> Any:
        """An entry. None if it does not exist or is damaged."""
        data = self._base.get(key)
        return None if data is None else opened(data, Path(self._path) / f"{key}-cache")

    def put(self, key: str, value: bytes) -> None:
        """Store an entry."""
        self._base.put(key, sealed(value))


def check_programs(folder: Callable[[], Path]) -> None:
    """Use digests in our own cache of compiled programs, which is in `folder()`. Call it before anything is compiled.

    A folder that the user names by JAX's own variable is shared with other programs. It keeps JAX's own format.
    """
    theirs = compilation_cache.get_file_cache

    def ours(path: str) -> Any:
        found = theirs(path)
        return found if found is None or Path(path) != folder() else (CheckedCache(found[0]), found[1])

    if theirs.__module__ != __name__:
        compilation_cache.get_file_cache = ours
