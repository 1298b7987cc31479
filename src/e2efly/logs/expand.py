"""Decompression that ends: of data that somebody else wrote, never more comes out than a budget allows."""

import bz2
from collections.abc import Callable
from io import BytesIO
from typing import IO

PIECE = 256 << 20
"""Largest piece that is taken out of one compressed block, bytes."""
BASE, RATIO = 16 << 20, 50
"""A file may expand to `BASE` bytes and `RATIO` times its own size. Flight logs expand by a factor of up to 20."""
ZSTD = b"\x28\xb5\x2f\xfd"
"""First bytes of data that zstd compressed."""


def _zstd(data: bytes) -> IO[bytes]:
    import zstandard

    return zstandard.ZstdDecompressor(max_window_size=PIECE).stream_reader(BytesIO(data), read_across_frames=True)


def _lz4(data: bytes) -> IO[bytes]:
    import lz4.frame

    return lz4.frame.open(BytesIO(data))


OPENED: dict[str, Callable[[bytes], IO[bytes]]] = {
    "": BytesIO,
    "none": BytesIO,
    "bz2": lambda data: bz2.BZ2File(BytesIO(data)),
    "lz4": _lz4,
    "zstd": _zstd,
}
"""The kinds of compression that logs use, by their names in MCAP and in ROS 1 bags."""


class Expander:
    """Expands the compressed blocks of one file, within the budget that its size gives."""

    def __init__(self, size: int) -> None:
        """Begin a file of `size` bytes."""
        self.left = BASE + RATIO * size
        """Bytes that may still come out."""

    def __call__(self, kind: str, data: bytes) -> bytes:
        """The content of a block.

        Raises:
            ValueError: for an unknown kind of compression, for damaged data, and when more comes out than is allowed.
        """
        if kind not in OPENED:
            raise ValueError(f"compression is {kind!r}; accepted: {', '.join(filter(None, OPENED))}")
        most = min(self.left, PIECE)
        try:
            with OPENED[kind](data) as stream:
                out = stream.read(most + 1)
        except ImportError as error:
            raise ValueError(
                f"compression is {kind!r}: no package for it ({error}); accepted: pip install mcap"
            ) from None
        except Exception as error:  # the errors of the decompressors have no common class
            raise ValueError(f"data that {kind} cannot decompress ({error})") from None
        if len(out) > most:
            raise ValueError(
                f"a block expands to more than {most} bytes; accepted: {PIECE} bytes a block, and for a whole file "
                f"{BASE} bytes and {RATIO} times its size"
            )
        self.left -= len(out)
        return out
