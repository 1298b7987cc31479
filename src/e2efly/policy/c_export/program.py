"""A C program, step by step: its arrays, the arrays that each step reads and writes, and their place in memory.

A public generator (emx-onnx-cgen 1.4.0) was measured on all policies of the zoo. It keeps its arrays on the stack, up
to 44 KB, where `layout` needs 7.7 KB of the caller's state, and a step takes 1.7 times as long.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

Shape = tuple[int, ...]


@dataclass(frozen=True)
class Operand:
    """An array of floats that a step reads or writes."""

    text: str
    """A C expression: a pointer to its first number."""
    shape: Shape
    """Shape, without the batch axis, which is 1."""
    buffer: int | None = None
    """The buffer to which it belongs. None: a constant or an input."""
    value: np.ndarray | None = None
    """Value of a constant. A constant has no `text` until a step reads it, see `Program.held`."""

    @property
    def size(self) -> int:
        """Count of its numbers."""
        return math.prod(self.shape)

    def at(self, index: str) -> str:
        """The C expression for the number at an index. If there is only one number, for that one."""
        return f"{self.text}[{'0' if self.size == 1 else index}]"


@dataclass(frozen=True)
class CStep:
    """Statements that fill one buffer."""

    about: str
    """Description of the step, for a comment."""
    lines: Sequence[str]
    reads: frozenset[int]
    """The buffers that it reads."""
    writes: int
    """The buffer that it writes."""
    in_place: bool
    """Whether it can work in place: to write the number at an index, it reads only the numbers at the same index."""


@dataclass
class CProgram:
    """Collects the steps and the constants of a program."""

    steps: list[CStep] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)
    """Count of numbers in each buffer."""
    floats: dict[str, np.ndarray] = field(default_factory=dict)
    """Float constants by name."""
    indices: dict[str, np.ndarray] = field(default_factory=dict)
    """Index tables by name."""

    def buffer(self, shape: Shape) -> Operand:
        """A new buffer."""
        self.sizes.append(math.prod(shape))
        index = len(self.sizes) - 1
        return Operand(f"b{index}", shape, index)

    def constant(self, name: str, value: np.ndarray) -> Operand:
        """A new constant."""
        name = f"{name}_{len(self.floats)}"
        self.floats[name] = np.asarray(value, np.float32)
        return Operand(name, self.floats[name].shape, value=self.floats[name])

    def held(self, operand: Operand) -> Operand:
        """The same operand in the form in which steps can read it.

        Raises:
            ValueError: for a constant of integers.
        """
        if operand.value is None or operand.text:
            return operand
        if operand.value.dtype != np.float32:
            raise ValueError(f"has a constant of {operand.value.dtype} among its inputs; accepted: float32")
        return self.constant("constant", operand.value)

    def table(self, value: Iterable[int]) -> str:
        """Add an index table and return its name."""
        name = f"places_{len(self.indices)}"
        self.indices[name] = np.asarray(list(value), np.int64)
        return name

    def step(
        self, about: str, lines: Sequence[str], reads: Sequence[Operand], writes: Operand, *, in_place: bool = False
    ) -> None:
        """Add a step. One that writes no number is left out: C has no empty arrays."""
        read = frozenset(operand.buffer for operand in reads if operand.buffer is not None)
        assert writes.buffer is not None
        if writes.size:
            self.steps.append(CStep(about, lines, read, writes.buffer, in_place))


def layout(program: CProgram, kept: Iterable[int]) -> tuple[list[int], int]:
    """Place the buffers in memory so that buffers that are needed at the same time do not overlap.

    A step that can work in place overwrites a buffer of the same size that no later step reads. Every other step uses
    the first gap that is large enough. The steps of the program are in order. The buffers `kept` are read after the
    last step.

    Returns:
        The offset of each buffer, and the count of numbers that all of them need together.
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
    """The first free offset, a multiple of four, at which `size` numbers fit between the taken ranges."""
    at = 0
    for begin, end in taken:
        if at + size <= begin:
            return at
        at = max(at, -(-end // 4) * 4)
    return at
