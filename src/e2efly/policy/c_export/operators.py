"""ONNX operators as C statements, for one observation at a time.

`real` is the type of the computed numbers, and REAL(f) is the function f of <math.h> for that type. Weights are float.

Each function takes the node, its operands and the program. It adds constants, buffers and a step to the program and
returns the outputs. Arrays are stored row by row. Their shapes do not include the batch axis, which is 1.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import accumulate

from onnx import NodeProto

from e2efly.policy.c_export.image_operators import Given, attributes, convolution, norm, pool
from e2efly.policy.c_export.program import CProgram, Operand, Shape
from e2efly.policy.c_export.text import number

UNARY = {
    "Relu": "{0} > 0.0f ? {0} : 0.0f",
    "Tanh": "REAL(tanh)({0})",
    "Sigmoid": "1.0f / (1.0f + REAL(exp)(-{0}))",
    "Log": "REAL(log)({0})",
    "Softplus": "({0} > 0.0f ? {0} : 0.0f) + REAL(log1p)(REAL(exp)(-REAL(fabs)({0})))",
}
"""C expressions of one number."""
SLOPED = {
    "Elu": ("{0} > 0.0f ? {0} : {alpha} * (REAL(exp)({0}) - 1.0f)", 1.0),
    "LeakyRelu": ("{0} > 0.0f ? {0} : {alpha} * {0}", 0.01),
}
"""C expressions of one number and `alpha`, and the default of `alpha`."""
BINARY = {
    "Add": "{} + {}",
    "Sub": "{} - {}",
    "Mul": "{} * {}",
    "Div": "{} / {}",
    "Max": "{0} > {1} ? {0} : {1}",
    "Greater": "{} > {} ? 1.0f : 0.0f",
}
"""C expressions of two numbers."""
BLOCK = 4
"""Number of matrix rows that are added at once. An output is then read and written only once per this many rows."""


def _each(node: NodeProto, program: CProgram, shape: Shape, reads: Given, expression: str) -> list[Operand]:
    """Add a step that computes its output element by element."""
    out = program.buffer(shape)
    whole = {operand.buffer for operand in reads if operand.size == out.size}
    in_place = all(operand.buffer is None or operand.buffer in whole for operand in reads)
    in_place = in_place and all(operand.text == f"b{operand.buffer}" for operand in reads if operand.buffer is not None)
    lines = [f"for (int i = 0; i < {out.size}; i++) {out.text}[i] = {expression};"]
    program.step(node.op_type, lines, reads, out, in_place=in_place)
    return [out]


def _unary(node: NodeProto, given: Given, program: CProgram) -> list[Operand]:
    (x,) = given
    form, default = SLOPED.get(node.op_type) or (UNARY[node.op_type], None)
    alpha = default and number(attributes(node).get("alpha", default))
    return _each(node, program, x.shape, given, form.format(x.at("i"), alpha=alpha))


def _binary(node: NodeProto, given: Given, program: CProgram) -> list[Operand]:
    shape = _common(given)
    return _each(node, program, shape, given, BINARY[node.op_type].format(*(x.at("i") for x in given)))


def _where(node: NodeProto, given: Given, program: CProgram) -> list[Operand]:
    condition, a, b = given
    expression = f"{condition.at('i')} > 0.0f ? {a.at('i')} : {b.at('i')}"
    return _each(node, program, _common(given), given, expression)


def _clip(node: NodeProto, given: Given, program: CProgram) -> list[Operand]:
    x = given[0]
    v, a, b = (operand.at("i") for operand in given)
    return _each(node, program, x.shape, given, f"{v} < {a} ? {a} : {v} > {b} ? {b} : {v}")


def _common(given: Given) -> Shape:
    """The common shape of operands of which each has this shape or is a single number."""
    largest = max(given, key=lambda x: (x.size, len(x.shape))).shape
    for x in given:
        if x.size not in (1, math.prod(largest)) or (x.size > 1 and _tight(x.shape) != _tight(largest)):
            raise ValueError(f"has inputs of the shapes {[x.shape for x in given]}; accepted: equal ones, or 1 number")
    return largest


def _tight(shape: Shape) -> Shape:
    return tuple(n for n in shape if n != 1)


def _identity(node: NodeProto, given: Given, program: CProgram) -> list[Operand]:
    del node, program
    return list(given)


def _gemm(node: NodeProto, given: Given, program: CProgram) -> list[Operand]:
    """A matrix product, computed row by row of the matrix, so that the compiler can vectorise over the outputs."""
    x, matrix, bias = given
    assert matrix.value is not None
    assert bias.value is not None
    rows, columns = matrix.shape
    weight, start = program.constant("weight", matrix.value), program.constant("bias", bias.value)
    out = program.buffer((columns,))
    lines = [f"for (int j = 0; j < {columns}; j++) {out.text}[j] = {start.text}[j];"]
    blocks = rows // BLOCK * BLOCK
    if blocks:
        lines += [
            f"for (int i = 0; i < {blocks}; i += {BLOCK}) {{",
            f"    const float *w = {weight.text} + i * {columns};",
        ]
        lines += [f"    const real {', '.join(f'x{k} = {x.text}[i + {k}]' for k in range(BLOCK))};"]
        terms = " + ".join(f"x{k} * w[j{f' + {k * columns}' if k else ''}]" for k in range(BLOCK))
        lines += [f"    for (int j = 0; j < {columns}; j++) {out.text}[j] += {terms};", "}"]
    for row in range(blocks, rows):
        term = f"{x.text}[{row}] * {weight.text}[j + {row * columns}]"
        lines.append(f"for (int j = 0; j < {columns}; j++) {out.text}[j] += {term};")
    program.step(f"{node.op_type}, {rows} to {columns}", lines, [x], out)
    return [out]


def _matmul(node: NodeProto, given: Given, program: CProgram) -> list[Operand]:
    a, b = given
    (m, k), n = a.shape, b.shape[1]
    out = program.buffer((m, n))
    terms = " + ".join(f"{a.text}[{k} * i + {q}] * {b.text}[j + {n * q}]" for q in range(k))
    if k > 16:
        raise ValueError(f"has {k} terms; accepted: up to 16, as to turn vectors")
    lines = [f"for (int i = 0; i < {m}; i++)", f"    for (int j = 0; j < {n}; j++) {out.text}[{n} * i + j] = {terms};"]
    program.step(f"{node.op_type}, {m} x {k} x {n}", lines, given, out)
    return [out]


def _gather(node: NodeProto, given: Given, program: CProgram) -> list[Operand]:
    x, index = given
    assert index.value is not None
    places = [int(i) for i in index.value]
    out = program.buffer((len(places),))
    if places:
        table = program.table(places)
        lines = [f"for (int i = 0; i < {out.size}; i++) {out.text}[i] = {x.text}[{table}[i]];"]
        program.step(node.op_type, lines, [x], out)
    return [out]


def _reshape(node: NodeProto, given: Given, program: CProgram) -> list[Operand]:
    del node, program
    x, wanted = given
    assert wanted.value is not None
    return [replace(x, shape=tuple(x.shape[i] if n == 0 else int(n) for i, n in enumerate(wanted.value[1:])))]


def _transpose(node: NodeProto, given: Given, program: CProgram) -> list[Operand]:
    (x,) = given
    axes = [axis - 1 for axis in attributes(node)["perm"][1:]]
    shape = tuple(x.shape[axis] for axis in axes)
    kept = [axis for axis in axes if x.shape[axis] != 1]
    if kept == sorted(kept):  # the numbers keep their order
        return [replace(x, shape=shape)]
    strides = _strides(x.shape)
    out, names = program.buffer(shape), [f"t{axis}" for axis in axes]
    target = " + ".join(f"{stride} * {name}" for name, stride in zip(names, _strides(shape), strict=True))
    source = " + ".join(f"{strides[axis]} * {name}" for name, axis in zip(names, axes, strict=True))
    lines = [f"for (int {name} = 0; {name} < {n}; {name}++)" for name, n in zip(names, shape, strict=True)]
    program.step(node.op_type, [*lines, f"    {out.text}[{target}] = {x.text}[{source}];"], given, out)
    return [out]


def _strides(shape: Shape) -> list[int]:
    return [math.prod(shape[i + 1 :]) for i in range(len(shape))]


def _concat(node: NodeProto, given: Given, program: CProgram) -> list[Operand]:
    out = program.buffer((sum(x.shape[0] for x in given), *given[0].shape[1:]))
    starts = accumulate((x.size for x in given), initial=0)
    lines = [
        f"for (int i = 0; i < {x.size}; i++) {out.text}[i + {start}] = {x.text}[i];"
        for x, start in zip(given, starts, strict=False)
        if x.size
    ]
    program.step(node.op_type, lines, given, out)
    return [out]


def _split(node: NodeProto, given: Given, program: CProgram) -> list[Operand]:
    del program
    x, count = given[0], len(node.output)
    shape = (x.shape[0] // count, *x.shape[1:])
    return [replace(x, text=f"({x.text} + {part * math.prod(shape)})", shape=shape) for part in range(count)]


OPERATORS: dict[str, Callable[[NodeProto, Given, CProgram], list[Operand]]] = (
    dict.fromkeys([*UNARY, *SLOPED], _unary)
    | dict.fromkeys(BINARY, _binary)
    | dict.fromkeys(["MaxPool", "AveragePool"], pool)
    | {
        "Where": _where, "Clip": _clip, "Identity": _identity, "Gemm": _gemm, "MatMul": _matmul, "Gather": _gather,
        "Reshape": _reshape, "Transpose": _transpose, "Concat": _concat, "Split": _split, "ReduceL2": norm,
        "Conv": convolution,
    }
)  # fmt: skip
"""Functions by the name of the ONNX operator: all operators that the policies of this package use."""
OF_CONSTANTS = ("Gemm", "Gather", "Reshape", "Conv")
"""Operators that need their constants in another form than in the graph."""
