"""A program of instructions on single numbers, which the page's machine runs (`web/src/machine.js`).

All numbers lie in one memory: first the constants, then the inputs, then one cell for the result of each instruction.
An array is an array of addresses, so whatever only moves numbers (slices, transposes, joins) needs no instruction.
"""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any

import numpy as np

Cells = np.ndarray
"""An array of addresses: n >= 0 is the cell of an input or a result, n < 0 is the constant -1 - n."""

ELEMENTWISE = frozenset({
    "neg", "abs", "sign", "floor", "ceil", "round", "trunc", "not", "sqrt", "cbrt", "exp", "expm1", "log", "log1p",
    "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh",
    "add", "sub", "mul", "div", "max", "min", "pow", "rem", "atan2", "eq", "ne", "lt", "le", "gt", "ge", "and", "or",
    "xor", "select",
})  # fmt: skip
"""Instructions of one, two or three numbers. `select` takes its third number where the first is true."""
DOT, LOOKUP = "dot", "lookup"
"""Instructions of several numbers: a sum of products with a column of a table; the cell that an index selects."""


@dataclass
class Machine:
    """Collects the instructions of a program. Equal instructions are collected once."""

    constants: list[float] = field(default_factory=list)
    tables: list[np.ndarray] = field(default_factory=list)
    """Matrices, float32."""
    instructions: list[tuple[str, tuple[Any, ...]]] = field(default_factory=list)
    """Operation and operands: addresses; and of `DOT`: addresses, table, column; of `LOOKUP`: address, addresses."""
    taken: int = 0
    """Number of cells of the inputs."""
    _known: dict[Any, int] = field(default_factory=dict)

    def input(self, shape: tuple[int, ...]) -> Cells:
        """Cells of a new input. All inputs come before the first instruction."""
        assert not self.instructions
        size = int(np.prod(shape))
        self.taken += size
        return np.arange(self.taken - size, self.taken).reshape(shape)

    def constant(self, value: Any) -> Cells:
        """The cells of constant numbers."""
        value = np.asarray(value, np.float64)
        found = np.empty(value.shape, np.int64)
        for place, number in np.ndenumerate(value):
            key = number.tobytes()
            if key not in self._known:
                self.constants.append(float(number))
                self._known[key] = -len(self.constants)
            found[place] = self._known[key]
        return found

    def value(self, cells: Cells) -> np.ndarray:
        """The numbers of constant cells."""
        return np.asarray(self.constants)[-1 - cells]

    def emit(self, operation: str, *operands: Cells) -> Cells:
        """Add an element-wise instruction for each number of the broadcast operands."""
        assert operation in ELEMENTWISE, operation
        shape = np.broadcast_shapes(*(x.shape for x in operands))
        rows = zip(*(np.broadcast_to(x, shape).ravel().tolist() for x in operands), strict=True)
        found = [self._choice(row) if operation == "select" else self._add(operation, row) for row in rows]
        return np.array(found, np.int64).reshape(shape)

    def _choice(self, row: tuple[int, ...]) -> int:
        condition, no, yes = row
        if no == yes:
            return no
        if condition < 0:
            return yes if self.constants[-1 - condition] else no
        return self._add("select", row)

    def dot(self, x: Cells, matrix: np.ndarray) -> Cells:
        """The product of a vector (k,) and a constant matrix (k, n)."""
        self.tables.append(np.asarray(matrix, np.float32))
        vector, table = tuple(x.tolist()), len(self.tables) - 1
        return np.array([self._add(DOT, (vector, table, j)) for j in range(matrix.shape[1])], np.int64)

    def lookup(self, index: Cells, entries: Cells) -> Cells:
        """For each number, the entry (k, *shape) that its index (*shape) selects; beyond the ends, the nearest."""
        chosen = entries.reshape(len(entries), -1).T.tolist()
        pairs = zip(index.ravel().tolist(), chosen, strict=True)
        found = [row[0] if len(set(row)) == 1 else self._add(LOOKUP, (place, tuple(row))) for place, row in pairs]
        return np.array(found, np.int64).reshape(index.shape)

    def _add(self, operation: str, operands: tuple[Any, ...]) -> int:
        key = operation, operands
        if key not in self._known:
            self.instructions.append(key)
            self._known[key] = self.taken + len(self.instructions) - 1
        return self._known[key]

    def program(self, inputs: Mapping[str, Cells], outputs: Mapping[str, Cells]) -> dict[str, Any]:
        """The program as JSON, without the instructions and constants on which no output depends.

        The result of each instruction goes to the next cell, so an instruction has no target. Instructions of one kind
        that follow each other are one row: the operation, and a list for each of its operands.
        """
        wanted = {int(cell) for cells in outputs.values() for cell in cells.ravel()}
        kept: list[int] = []
        for place in reversed(range(len(self.instructions))):
            if self.taken + place in wanted:
                kept.append(place)
                wanted |= _read(*self.instructions[place])
        numbers = sorted((cell for cell in wanted if cell < 0), reverse=True)
        moved = {cell: i for i, cell in enumerate(numbers)}
        moved |= {cell: len(numbers) + cell for cell in range(self.taken)}
        first = len(numbers) + self.taken
        moved |= {self.taken + place: first + i for i, place in enumerate(reversed(kept))}
        rows = [_moved(*self.instructions[place], moved) for place in reversed(kept)]
        return {
            "constants": packed(self.value(np.array(numbers, np.int64)), "<f8"),
            "inputs": {name: [len(numbers) + int(x.flat[0]) if x.size else 0, x.size] for name, x in inputs.items()},
            "outputs": {name: [moved[cell] for cell in cells.ravel().tolist()] for name, cells in outputs.items()},
            "tables": [{"columns": table.shape[1], "numbers": packed(table)} for table in self.tables],
            "size": first + len(kept),
            "rows": [[*kind, *map(list, zip(*each, strict=True))] for kind, each in _grouped(rows)],
        }


def _read(operation: str, operands: tuple[Any, ...]) -> set[int]:
    if operation == DOT:
        return set(operands[0])
    return {operands[0], *operands[1]} if operation == LOOKUP else set(operands)


def _moved(operation: str, operands: tuple[Any, ...], to: Mapping[int, int]) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """What instructions of one row share, and the rest of their operands."""
    if operation == DOT:
        vector, table, column = operands
        return (operation, [to[cell] for cell in vector], table), (column,)
    if operation == LOOKUP:
        index, entries = operands
        return (operation,), (to[index], [to[cell] for cell in entries])
    return (operation,), tuple(to[cell] for cell in operands)


def _grouped(rows: Sequence[tuple[Any, Any]]) -> list[tuple[Any, list[Any]]]:
    return [(kind, [rest for _, rest in each]) for kind, each in groupby(rows, key=lambda row: row[0])]


def packed(numbers: np.ndarray, kind: str = "<f4") -> str:
    """Numbers as base64, in single precision if no other kind is named."""
    return base64.b64encode(np.ascontiguousarray(numbers, kind).tobytes()).decode()
