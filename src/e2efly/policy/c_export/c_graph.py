"""Convert the graph of a policy.onnx to a C program."""

from collections.abc import Mapping
from dataclasses import dataclass

import onnx
from onnx import numpy_helper

from e2efly.policy.c_export.operators import OF_CONSTANTS, OPERATORS
from e2efly.policy.c_export.program import CProgram, Operand


@dataclass(frozen=True)
class CNetwork:
    """A policy's graph as a program."""

    program: CProgram
    outputs: dict[str, Operand]
    """The outputs by name."""


def network(content: bytes, inputs: Mapping[str, Operand]) -> CNetwork:
    """The program of a policy's graph, for one observation. `content` is that of a policy that `load_policy` has
    checked. `inputs` has the location of each input of the graph.

    Raises:
        ValueError: for an operator that is used in a way that C is not written for, naming it and its node.
    """
    graph = onnx.load_model_from_string(content).graph
    program, known = CProgram(), dict(inputs)
    for tensor in graph.initializer:
        value = numpy_helper.to_array(tensor)
        known[tensor.name] = Operand("", value.shape, value=value)
    for node in graph.node:
        where = f"node {node.output[0]!r} of the graph"
        for output, operand in zip(node.output, _outputs(where, node, known, program), strict=True):
            known[output] = operand
    return CNetwork(program, {output.name: known[output.name] for output in graph.output})


def _outputs(where: str, node: onnx.NodeProto, known: Mapping[str, Operand], program: CProgram) -> list[Operand]:
    try:
        given = [known[name] for name in node.input if name]
        raw = 1 if node.op_type in OF_CONSTANTS else len(given)
        given[:raw] = [program.held(operand) for operand in given[:raw]]
        return OPERATORS[node.op_type](node, given, program)
    except ValueError as error:
        raise ValueError(f"{where}, {node.op_type}, {error}") from None
