"""Damage for files and frames: what disks, radios and strangers do to bytes."""

import random
import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

NUMBERS = (0, 1, 2, 3, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, (1 << 63) - 1, (1 << 64) - 1)
"""Numbers at the ends of what a length or a count can be."""


def mutated(data: bytes, rng: random.Random, others: Sequence[bytes] = (), tokens: Sequence[bytes] = ()) -> bytes:
    """Bytes with one to four damages: flipped, replaced, cut, removed, repeated, spliced, another length.

    Args:
        data: the whole ones.
        rng: the dice.
        others: whole ones from which pieces come.
        tokens: what has a meaning in them.
    """
    piece = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        at, size = rng.randint(0, len(piece)), rng.choice((1, 2, 4, 8, rng.randint(1, 64)))
        kind = rng.randrange(8)
        if kind == 0 and at < len(piece):
            piece[at] ^= 1 << rng.randrange(8)
        elif kind == 1:
            del piece[at:]
        elif kind == 2:
            del piece[at : at + size]
        elif kind == 3:
            piece[at : at + size] = rng.randbytes(size)
        elif kind == 4:
            piece[at:at] = piece[at : at + size] * rng.choice((1, 2, 50))
        elif kind == 5:
            width = rng.choice((1, 2, 4, 8))
            number = rng.choice((*NUMBERS, len(piece), len(piece) - at)) & ((1 << 8 * width) - 1)
            piece[at : at + width] = number.to_bytes(width, "little")
        elif kind == 6:
            other = rng.choice(others or (data,))
            begin = rng.randint(0, len(other))
            piece[at : at + rng.choice((0, size))] = other[begin : begin + 4 * size]
        else:
            piece[at : at + size] = rng.choice(tokens) if tokens else rng.randbytes(size)
    return bytes(piece)


class HangError(BaseException):
    """Not an `Exception`, so that no reader can take it for an error in a file."""


@dataclass
class Endured:
    """What a reader did with damaged files."""

    read: int = 0
    refused: int = 0
    slowest: float = 0.0
    """s."""
    faults: list[str] = field(default_factory=list)
    """Errors of other types, errors that do not name the file, and hangs."""

    def attempt(self, read: Callable[[Path], object], path: Path, data: bytes, limit: int = 5) -> None:
        """Read a file with this content. Longer than `limit`, s, is a hang."""

        def late(*_: object) -> None:
            raise HangError

        path.write_bytes(data)
        before, start = signal.signal(signal.SIGALRM, late), time.perf_counter()
        signal.alarm(limit)
        try:
            read(path)
            self.read += 1
        except ValueError as error:
            self.refused += 1
            if str(path) not in str(error):
                self.faults.append(f"does not name the file: {error}")
        except (Exception, HangError) as error:
            self.faults.append(f"{type(error).__name__}: {error}")
        finally:
            signal.alarm(0)
            signal.signal(signal.SIGALRM, before)
            self.slowest = max(self.slowest, time.perf_counter() - start)
