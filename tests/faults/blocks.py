"""Seeds of a campaign: those for work, and blocks for publishing, each for one state of the package."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

FIRST, SIZE = 10_000, 500
"""The first seed of the first block; seeds below it are for work. Number of seeds in a block."""


@dataclass(frozen=True)
class Block:
    """Seeds that one state of the package has been judged by."""

    number: int
    """Counted from 0."""
    date: str
    """When they were first flown."""
    package: str
    """Digest of all that flew."""

    @property
    def seeds(self) -> range:
        first = FIRST + SIZE * self.number
        return range(first, first + SIZE)


def used_in(results: dict[str, Any]) -> tuple[Block, ...]:
    """The blocks that a file of results names."""
    return tuple(Block(**block) for block in results.get("blocks", ()))


def told(used: tuple[Block, ...]) -> dict[str, Any]:
    return {"blocks": [asdict(block) for block in used]}


def next_of(used: tuple[Block, ...], package: str, date: str) -> tuple[tuple[Block, ...], Block]:
    """The blocks used from now on, and the one to fly.

    A package that has not changed since the last block goes on with it: its flights would be the same.
    """
    if used and used[-1].package == package:
        return used, used[-1]
    block = Block(len(used), date, package)
    return (*used, block), block


def problem_of(seeds: Iterable[int], used: tuple[Block, ...]) -> str | None:
    """Why these seeds must not be flown for work. None: they may."""
    known = FIRST + SIZE * len(used)
    if all(0 <= seed < known for seed in seeds):
        return None
    return f"seeds are {min(seeds)} to {max(seeds)}; accepted: 0 to {known - 1}; --publish flies those that follow"
