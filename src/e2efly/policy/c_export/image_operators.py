"""ONNX operators on images as C statements, as in `e2efly.policy.c_export.operators`."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from onnx import NodeProto, helper

from e2efly.policy.c_export.program import CProgram, Operand, Shape
from e2efly.policy.c_export.text import number

Given = Sequence[Operand]
"""The operands that a node reads."""


def attributes(node: NodeProto) -> dict[str, Any]:
    """The attributes of a node."""
    return {entry.name: helper.get_attribute_value(entry) for entry in node.attribute}


def norm(node: NodeProto, given: Given, program: CProgram) -> list[Operand]:
    """The square root of the sum of the squares of an image."""
    (x,) = given
    out = program.buffer((1,) * len(x.shape))
    lines = [
        "real sum = 0.0f;",
        f"for (int i = 0; i < {x.size}; i++) sum += {x.text}[i] * {x.text}[i];",
        f"{out.text}[0] = REAL(sqrt)(sum);",
    ]
    program.step(node.op_type, lines, given, out)
    return [out]


def _window(node: NodeProto, x: Operand) -> tuple[list[int], list[int], Shape]:
    """The sides and strides of a window that never reaches beyond the rows and columns, and its positions."""
    about = attributes(node)
    sides, strides = about["kernel_shape"], list(about["strides"])
    places = tuple((n - side) // stride + 1 for n, side, stride in zip(x.shape[1:], sides, strides, strict=True))
    return list(sides), strides, places


def pool(node: NodeProto, given: Given, program: CProgram) -> list[Operand]:
    """The maximum or the mean of each window of an image."""
    (x,) = given
    (h, w), (down, right), (rows, columns) = _window(node, x)
    channels, height, width = x.shape
    out, largest = program.buffer((channels, rows, columns)), node.op_type == "MaxPool"
    read = f"{x.text}[at + {width} * row + k]"
    taken = f"if ({read} > value) value = {read};" if largest else f"value += {read};"
    lines = [
        f"for (int c = 0; c < {channels}; c++)",
        f"    for (int i = 0; i < {rows}; i++)",
        f"        for (int j = 0; j < {columns}; j++) {{",
        f"            const int at = {height * width} * c + {width * down} * i + {right} * j;",
        f"            real value = {f'{x.text}[at]' if largest else '0.0f'};",
        f"            for (int row = 0; row < {h}; row++)",
        f"                for (int k = 0; k < {w}; k++) {taken}",
        f"            {out.text}[{rows * columns} * c + {columns} * i + j] = "
        f"{'value' if largest else f'value / {number(h * w)}'};",
        "        }",
    ]
    program.step(f"{node.op_type}, {h} x {w}", lines, given, out)
    return [out]


def convolution(node: NodeProto, given: Given, program: CProgram) -> list[Operand]:
    """Convolution: sums over windows of an image, weighted by filters."""
    x, kernel, bias = given
    assert kernel.value is not None
    assert bias.value is not None
    (h, w), (down, right), (rows, columns) = _window(node, x)
    filters = kernel.value.shape[0]
    weight = program.constant("kernel", np.moveaxis(kernel.value, 0, -1).reshape(-1, filters))
    start = program.constant("bias", bias.value)
    channels, height, width = x.shape
    # the sums of all filters are stored side by side after the output, so that the compiler can vectorise
    both = program.buffer((filters * (rows * columns + 1),))
    sums = f"({both.text} + {filters * rows * columns})"
    lines = [
        f"for (int i = 0; i < {rows}; i++)",
        f"    for (int j = 0; j < {columns}; j++) {{",
        f"        const float *w = {weight.text};",
        f"        for (int f = 0; f < {filters}; f++) {sums}[f] = {start.text}[f];",
        f"        for (int c = 0; c < {channels}; c++)",
        f"            for (int row = 0; row < {h}; row++)",
        f"                for (int k = 0; k < {w}; k++, w += {filters}) {{",
        f"                    const real x = {x.text}[{height * width} * c + {width} * ({down} * i + row)"
        f" + {right} * j + k];",
        f"                    for (int f = 0; f < {filters}; f++) {sums}[f] += x * w[f];",
        "                }",
        f"        for (int f = 0; f < {filters}; f++)",
        f"            {both.text}[{rows * columns} * f + {columns} * i + j] = {sums}[f];",
        "    }",
    ]
    program.step(f"{node.op_type}, {h} x {w}, {channels} to {filters}", lines, [x], both)
    return [replace(both, shape=(filters, rows, columns))]
