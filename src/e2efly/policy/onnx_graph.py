"""What a policy's graph may hold: the operators that the export writes, constant weights, and a bounded arithmetic.

`check` goes through the graph once and infers the shape of everything from the shapes of the inputs. Shapes of what is
computed do not include the batch axis, which comes first and which no operator may touch. Everything that is computed
depends on an input, so ONNX Runtime has nothing to compute while it loads the graph.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.policy.onnx_file import Message

OPSET, IR_VERSION = 17, 8
"""Versions of the operators and of the file's format. They are old enough for the ONNX Runtime of any companion
computer in use."""
AXES = 8
"""Largest number of axes of an array."""
NODES = 2000
"""Largest number of nodes. A policy of the zoo has at most 47."""
ELEMENTS = 1 << 24
"""Largest number of numbers that all weights, and everything that is computed for one observation, may have."""
WORK_PER_S, WORK = 1e10, 1e9
"""Largest number of multiply-adds per second, which one core of a companion computer can just do, and per call."""
ACCEPTED = "a graph as `e2efly export` writes it"
FLOAT, INTEGER, TRUTH = "float32", "int64", "bool"
TYPES = {1: FLOAT, 6: "int32", 7: INTEGER, 9: TRUTH, 10: "float16", 11: "float64"}
"""Types of numbers by their number in the file."""
_KINDS = {"f": 1, "i": 2, "s": 3, "t": 4, "floats": 6, "ints": 7}
"""Types of attributes by the field that holds the value."""
Shape = tuple[int, ...]


@dataclass(frozen=True)
class Array:
    """An operand of a node."""

    shape: Shape
    """Its shape; if it is computed, without the batch axis."""
    value: np.ndarray | None = None
    """Its value, of a constant. None: it is computed."""
    type: str = FLOAT


@dataclass(frozen=True)
class GraphNode:
    """A node whose operands are known."""

    given: tuple[Array, ...]
    attributes: Mapping[str, Any]
    outputs: int

    @property
    def computed(self) -> Array:
        """The first operand, which must be computed from the inputs, in floats."""
        if not self.given or self.given[0].value is not None or self.given[0].type != FLOAT:
            raise ValueError("has a first input that is constant or no float32; accepted: one that is computed")
        return self.given[0]

    def constant(self, index: int, rank: int | None = None, kind: str = FLOAT) -> np.ndarray:
        """A constant operand."""
        array = self.given[index]
        if array.value is None or array.type != kind or (rank is not None and len(array.shape) != rank):
            axes = "" if rank is None else f" of {rank} axes"
            raise ValueError(f"has another input {index}; accepted: a constant of {kind}{axes}")
        return array.value

    def need(self, allowed: bool, what: str) -> None:
        """Refuse the node unless something holds."""
        if not allowed:
            raise ValueError(f"has inputs of the shapes {[x.shape for x in self.given]}; accepted: {what}")


Made = tuple[tuple[Array, ...], int]
"""The outputs of a node, and its multiply-adds."""


def check(graph: Message, inputs: Mapping[str, Shape], outputs: Mapping[str, Shape], rate: float) -> None:
    """Refuse a graph that is not allowed. `graph` is from `onnx_file.read`. Inputs and outputs have shapes by name,
    without the batch axis. `rate` is the rate at which it is called, Hz.

    Raises:
        ValueError: naming the node or the constant, and what is accepted.
    """
    known = {name: Array(shape) for name, shape in inputs.items()}
    for tensor in graph.get("initializer", []):
        name = tensor.get("name", "")
        if name in known:
            raise ValueError(f"constant {name!r} of the graph is there twice; accepted: each name once")
        known[name] = Array(tuple(tensor.get("dims", ())), *constant(name, tensor))
    held = sum(math.prod(array.shape) for array in known.values())
    _few(held, ELEMENTS, "numbers in its weights and inputs")
    nodes, work, most = graph.get("node", []), 0, min(WORK_PER_S / rate, WORK)
    _few(len(nodes), NODES, "nodes")
    for place, message in enumerate(nodes):
        named = message.get("output", [])
        where = f"node {place} of the graph, {message.get('op_type', '')!r:.40},"
        try:
            made, more = _made(message, known)
        except ValueError as error:
            raise ValueError(f"{where} {error}") from None
        if any(len(array.shape) >= AXES for array in made):
            raise ValueError(f"{where} computes an array of more than {AXES} axes; accepted: at most that")
        if not set(named).isdisjoint(known) or len(set(named)) < len(named) or "" in named:
            raise ValueError(f"{where} has the outputs {named!r:.500}; accepted: new names")
        known |= zip(named, made, strict=True)
        held, work = held + sum(math.prod(array.shape) for array in made), work + more
        _few(held, ELEMENTS, "numbers that are held or computed for one observation")
        _few(work, most, f"multiply-adds in each of its calls, of which there are {rate:g} in a second")
    for name, shape in outputs.items():
        found = known.get(name)
        if found is None or found.value is not None or found.type != FLOAT or found.shape != shape or name in inputs:
            has = "missing" if found is None else f"of the shape {found.shape} and of {found.type}"
            accepted = f"computed, of the shape {shape} and of {FLOAT}"
            raise ValueError(f"output {name!r} of the graph is {has}; accepted: {accepted}")


def constant(name: str, tensor: Message) -> tuple[np.ndarray, str]:
    """Value and type of a constant.

    Raises:
        ValueError: naming it, for another type than float32 or int64, another size than its shape says, and numbers
            that are not finite.
    """
    shape, number, raw = tensor.get("dims", []), tensor.get("data_type", 0), tensor.get("raw_data", b"")
    kind = TYPES.get(number, f"type {number}")
    if kind not in (FLOAT, INTEGER):
        raise ValueError(f"constant {name!r} of the graph is of {kind}; accepted: {FLOAT} or {INTEGER}")
    if len(shape) > AXES or not all(0 <= size <= ELEMENTS for size in shape):
        raise ValueError(f"constant {name!r} of the graph has the shape {shape[:9]}; accepted: at most {AXES} axes")
    if math.prod(shape) * np.dtype(kind).itemsize != len(raw):
        raise ValueError(f"constant {name!r} of the graph has {len(raw)} bytes; its shape is {shape}")
    value = np.frombuffer(raw, np.dtype(kind).newbyteorder("<")).reshape(shape)
    if not np.isfinite(value).all():
        raise ValueError(f"constant {name!r} of the graph is not finite; accepted: finite numbers (did it diverge?)")
    return value, kind


def attributes(node: Message) -> dict[str, Any]:
    """The attributes of a node by name.

    Raises:
        ValueError: for a name that is there twice, and for one that has no value of its type.
    """
    found: dict[str, Any] = {}
    for entry in node.get("attribute", []):
        name, fields = entry.get("name", ""), [field for field in _KINDS if field in entry]
        if name in found or len(fields) != 1 or entry.get("type") != _KINDS[fields[0]]:
            raise ValueError(f"has the attribute {name!r} in another way; accepted: each once, with one value")
        found[name] = entry[fields[0]]
    return found


def _few(count: float, most: float, what: str) -> None:
    if count > most:
        raise ValueError(f"has {count:.4g} {what}; accepted: at most {most:.4g}")


def _made(message: Message, known: Mapping[str, Array]) -> Made:
    kind = message.get("op_type", "")
    if message.get("domain", "") not in ("", "ai.onnx") or kind not in OPERATORS:
        raise ValueError(f"is no operator of a policy; accepted: {', '.join(sorted(OPERATORS))}")
    infer, inputs, defaults = OPERATORS[kind]
    found, names = attributes(message), message.get("input", [])
    if unknown := sorted(set(found) - set(defaults)):
        raise ValueError(f"has the attribute {unknown[0]!r:.40}; accepted: {', '.join(defaults) or 'none'}")
    for name, wanted in defaults.items():
        value = found.get(name)
        if isinstance(wanted, type):
            same = isinstance(value, list) and all(isinstance(entry, int) for entry in value)
        elif isinstance(wanted, int):
            same = value == wanted and isinstance(value, int)
        else:
            same = name not in found or (isinstance(value, float) and math.isfinite(value))
        if not same:
            accepted = "a list of integers" if isinstance(wanted, type) else wanted
            raise ValueError(f"has the attribute {name!r} as {value!r:.80}; accepted: {accepted}")
    if missing := [name for name in names if name not in known]:
        raise ValueError(f"reads {missing[0]!r:.80}; accepted: an input, a constant, or what a node before it computes")
    if len(names) not in inputs:
        raise ValueError(f"has {len(names)} inputs; accepted: {' or '.join(map(str, inputs))}")
    node = GraphNode(tuple(known[name] for name in names), found, len(message.get("output", [])))
    made, work = infer(node)
    if len(made) != node.outputs:
        raise ValueError(f"has {node.outputs} outputs; accepted: {len(made)}")
    return made, work


def _each(shape: Shape, kind: str = FLOAT) -> Made:
    """One output, with one multiply-add for each of its numbers."""
    return (Array(shape, type=kind),), math.prod(shape)


def _unary(node: GraphNode) -> Made:
    return _each(node.computed.shape)


def _binary(node: GraphNode) -> Made:
    return _each(_common(node, node.given))


def _greater(node: GraphNode) -> Made:
    return _each(_common(node, node.given), TRUTH)


def _where(node: GraphNode) -> Made:
    node.need(node.given[0].type == TRUTH, "first, what Greater computes")
    return _each(_common(node, node.given, chosen=True))


def _common(node: GraphNode, given: Sequence[Array], chosen: bool = False) -> Shape:
    """The common shape of operands that are extended to it. No axis of a constant meets the batch axis."""
    computed = [array.shape for array in given if array.value is None]
    node.need(all(array.type == FLOAT for array in given[chosen:]), "of float32")
    node.need(len({len(shape) for shape in computed}) == 1, "one computed, or several of as many axes")
    rank = len(computed[0])
    shapes = [array.shape if array.value is None else array.shape[-rank:] if rank else () for array in given]
    lead = [array.shape[: max(len(array.shape) - rank, 0)] for array in given if array.value is not None]
    node.need(all(axes in ((), (1,)) for axes in lead), "constants without a batch axis")
    shapes = [(1,) * (rank - len(shape)) + shape for shape in shapes]
    sizes = [{size for size in axis if size != 1} for axis in zip(*shapes, strict=True)]
    node.need(all(len(axis) <= 1 for axis in sizes), "equal sizes, or 1")
    return tuple(next(iter(axis), 1) for axis in sizes)


def _clip(node: GraphNode) -> Made:
    low, high = node.constant(1), node.constant(2)
    node.need(low.shape == high.shape == () and bool(low <= high), "an array and two rising numbers")
    return _each(node.computed.shape)


def _gemm(node: GraphNode) -> Made:
    weight, bias = node.constant(1, 2).shape, node.constant(2, 1).shape
    node.need(node.computed.shape == weight[:1] and bias == weight[1:], "(k,), (k, n) and (n,)")
    return (Array(bias),), math.prod(weight) + weight[1]


def _matmul(node: GraphNode) -> Made:
    x, y = node.computed, node.given[1]
    node.need(y.value is None and y.type == FLOAT, "two computed ones")
    node.need(len(x.shape) == len(y.shape) == 2 and x.shape[1] == y.shape[0], "(m, k) and (k, n)")
    return (Array((x.shape[0], y.shape[1])),), math.prod(x.shape) * y.shape[1]


def _gather(node: GraphNode) -> Made:
    x, places = node.computed.shape, node.constant(1, 1, INTEGER)
    node.need(len(x) == 1, "(k,), of which it takes columns")
    if places.size and not 0 <= places.min() <= places.max() < x[0]:
        raise ValueError(f"takes the columns {places.min()} to {places.max()}; accepted: 0 to {x[0] - 1}")
    return _each(places.shape)


def _reshape(node: GraphNode) -> Made:
    x, wanted = node.computed.shape, [int(size) for size in node.constant(1, 1, INTEGER)]
    node.need(wanted[:1] == [0] and all(size != 0 or i <= len(x) for i, size in enumerate(wanted)), "a shape (0, ...)")
    shape = tuple(x[i] if size == 0 else size for i, size in enumerate(wanted[1:]))
    node.need(min(shape, default=0) >= 0 and math.prod(shape) == math.prod(x), "a shape of as many numbers")
    return _each(shape)


def _transpose(node: GraphNode) -> Made:
    x, order = node.computed.shape, node.attributes["perm"]
    node.need(sorted(order) == list(range(len(x) + 1)) and order[0] == 0, "perm with the batch axis first")
    return _each(tuple(x[i - 1] for i in order[1:]))


def _concat(node: GraphNode) -> Made:
    parts = [array.shape for array in node.given]
    node.need(all(array.value is None and array.type == FLOAT for array in node.given), "computed ones")
    node.need(all(parts) and len({shape[1:] for shape in parts}) == 1, "equal sizes but for the first")
    return _each((sum(shape[0] for shape in parts), *parts[0][1:]))


def _split(node: GraphNode) -> Made:
    x, count = node.computed.shape, node.outputs
    node.need(bool(x) and count > 0 and x[0] % count == 0, "a first size that is a multiple of the outputs")
    return (Array((x[0] // count, *x[1:])),) * count, math.prod(x)


def _norm(node: GraphNode) -> Made:
    x = node.computed.shape
    node.need(node.attributes["axes"] == list(range(1, len(x) + 1)), "all axes after the batch axis")
    return (Array((1,) * len(x)),), math.prod(x)


def _places(node: GraphNode) -> tuple[int, int]:
    """The number of rows and columns at which a window lies in an image (c, h, w)."""
    x, sides, strides = node.computed.shape, node.attributes["kernel_shape"], node.attributes["strides"]
    node.need(len(x) == 3 and len(sides) == len(strides) == 2 and min(*sides, *strides) > 0, "a window of an image")
    rows, columns = ((n - side) // stride + 1 for n, side, stride in zip(x[1:], sides, strides, strict=True))
    node.need(rows > 0 and columns > 0, "a window that is no larger than the image")
    return rows, columns


def _pool(node: GraphNode) -> Made:
    shape = (node.computed.shape[0], *_places(node))
    return (Array(shape),), math.prod(shape) * math.prod(node.attributes["kernel_shape"])


def _convolution(node: GraphNode) -> Made:
    kernel, bias, places = node.constant(1, 4).shape, node.constant(2, 1).shape, _places(node)
    node.need(kernel[1:] == (node.computed.shape[0], *node.attributes["kernel_shape"]), "a kernel of its channels")
    node.need(bias == kernel[:1], "a bias of (n,)")
    return (Array((kernel[0], *places)),), math.prod(places) * math.prod(kernel)


_WINDOW: dict[str, Any] = {"kernel_shape": list, "strides": list}
OPERATORS: dict[str, tuple[Callable[[GraphNode], Made], Sequence[int], dict[str, Any]]] = {
    **dict.fromkeys(("Identity", "Log", "Relu", "Sigmoid", "Softplus", "Tanh"), (_unary, (1,), {})),
    "Elu": (_unary, (1,), {"alpha": 1.0}),
    "LeakyRelu": (_unary, (1,), {"alpha": 0.01}),
    **dict.fromkeys(("Add", "Sub", "Mul", "Div", "Max"), (_binary, (2,), {})),
    "Greater": (_greater, (2,), {}),
    "Where": (_where, (3,), {}),
    "Clip": (_clip, (3,), {}),
    "Gemm": (_gemm, (3,), {}),
    "MatMul": (_matmul, (2,), {}),
    "Gather": (_gather, (2,), {"axis": 1}),
    "Reshape": (_reshape, (2,), {}),
    "Transpose": (_transpose, (1,), {"perm": list}),
    "Concat": (_concat, range(1, 100), {"axis": 1}),
    "Split": (_split, (1,), {"axis": 1}),
    "ReduceL2": (_norm, (1,), {"axes": list}),
    "MaxPool": (_pool, (1,), _WINDOW),
    "AveragePool": (_pool, (1,), _WINDOW),
    "Conv": (_convolution, (3,), _WINDOW),
}
"""Operators by name: their shapes, how many inputs they have, and their attributes: a list that must be there, an
integer that must be there, or a number with its default. These are the operators that `learning/onnx_layers.py`
writes, in the forms in which it writes them."""
