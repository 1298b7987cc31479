"""A program of C, step by step: its arrays, what each step reads and writes, and where the arrays lie in memory."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

Shape = tuple[int, ...]


@dataclass(frozen=True)
class Operand:
    """An array of floats as a step reads or writes it."""

    text: str
    """An expression of C: a pointer to its first number."""
    shape: Shape
    """Without the batch axis, which is 1."""
    buffer: int | None = None
    """Of which buffer it is a part; None: a constant or an input."""
    value: np.ndarray | None = None
    """Of a constant, which has no `text` until a step reads it: `Program.held`."""

    @property
    def size(self) -> int:
        """Its numbers."""
        return math.prod(self.shape)

    def at(self, index: str) -> str:
        """The expression of one number; the only one, where there is but one."""
        return f"{self.text}[{'0' if self.size == 1 else index}]"


@dataclass(frozen=True)
class Step:
    """Statements that fill one buffer."""

    about: str
    """What it does, for a comment."""
    lines: Sequence[str]
    reads: frozenset[int]
    """Buffers."""
    writes: int
    """A buffer."""
    in_place: bool
    """Each number is read before the number of the same index is written, and no other."""


@dataclass
class Program:
    """Steps and constants as they come."""

    steps: list[Step] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)
    """Numbers of each buffer."""
    floats: dict[str, np.ndarray] = field(default_factory=dict)
    """Constants by name."""
    indices: dict[str, np.ndarray] = field(default_factory=dict)
    """Tables of places, by name."""

    def buffer(self, shape: Shape) -> Operand:
        """A new one."""
        self.sizes.append(math.prod(shape))
        index = len(self.sizes) - 1
        return Operand(f"b{index}", shape, index)

    def constant(self, name: str, value: np.ndarray) -> Operand:
        """A new constant."""
        name = f"{name}_{len(self.floats)}"
        self.floats[name] = np.asarray(value, np.float32)
        return Operand(name, self.floats[name].shape, value=self.floats[name])

    def held(self, operand: Operand) -> Operand:
        """The same, as steps may read it.

        Raises:
            ValueError: for a constant of whole numbers.
        """
        if operand.value is None or operand.text:
            return operand
        if operand.value.dtype != np.float32:
            raise ValueError(f"has a constant of {operand.value.dtype} among its inputs; accepted: float32")
        return self.constant("constant", operand.value)

    def table(self, value: Iterable[int]) -> str:
        """The name of a new table of places."""
        name = f"places_{len(self.indices)}"
        self.indices[name] = np.asarray(list(value), np.int64)
        return name

    def step(
        self, about: str, lines: Sequence[str], reads: Sequence[Operand], writes: Operand, *, in_place: bool = False
    ) -> None:
        """Add a step."""
        read = frozenset(operand.buffer for operand in reads if operand.buffer is not None)
        assert writes.buffer is not None
        self.steps.append(Step(about, lines, read, writes.buffer, in_place))


def layout(program: Program, kept: Iterable[int]) -> tuple[list[int], int]:
    """Where each buffer lies, so that those that are needed at the same time do not overlap.

    A step that may work in place writes over the buffer of its size that it reads last. Any other takes the first gap
    that is large enough.

    Args:
        program: its steps, in order.
        kept: buffers that are read after the last step.

    Returns:
        The offset of each buffer, and how many numbers all of them take.
    """
    last = {buffer: i for i, step in enumerate(program.steps) for buffer in (*step.reads, step.writes)}
    last |= dict.fromkeys(kept, len(program.steps))
    offsets, live = [0] * len(program.sizes), dict[int, int]()
    whole = 0
    for i, step in enumerate(program.steps):
        live = {buffer: end for buffer, end in live.items() if end >= i}
        if step.writes in live:
            continue
        size, written = program.sizes[step.writes], step.writes
        dying = [b for b in step.reads if b in live and live[b] == i and program.sizes[b] == size]
        if step.in_place and dying:
            offsets[written] = offsets[dying[0]]
            del live[dying[0]]
        else:
            taken = sorted((offsets[b], offsets[b] + program.sizes[b]) for b in live)
            offsets[written] = _gap(taken, size)
        live[written] = last[written]
        whole = max(whole, offsets[written] + size)
    return offsets, whole


def _gap(taken: list[tuple[int, int]], size: int) -> int:
    """The first place for so many numbers, at a multiple of four, beside what is taken."""
    at = 0
    for begin, end in taken:
        if at + size <= begin:
            return at
        at = max(at, -(-end // 4) * 4)
    return at
