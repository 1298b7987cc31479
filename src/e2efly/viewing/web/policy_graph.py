"""The graph of a policy.onnx as a function of JAX."""

from collections.abc import Callable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import onnx
from jax import Array
from onnx import helper, numpy_helper

OPERATORS: dict[str, Callable[..., Any]] = {
    "Add": jnp.add,
    "Clip": jnp.clip,
    "Concat": lambda *parts, axis: jnp.concatenate(parts, axis),
    "Div": jnp.divide,
    "Elu": lambda x, alpha=1.0: jnp.where(x > 0, x, alpha * jnp.expm1(x)),
    "Gather": lambda x, index, axis: x.take(index, axis, mode="clip"),
    "Gemm": lambda x, weight, bias: x @ weight + bias,
    "Greater": jnp.greater,
    "Identity": lambda x: x,
    "LeakyRelu": lambda x, alpha=0.01: jnp.where(x > 0, x, alpha * x),
    "Log": jnp.log,
    "MatMul": jnp.matmul,
    "Max": jnp.maximum,
    "Mul": jnp.multiply,
    "ReduceL2": lambda x, axes: jnp.linalg.norm(x, axis=tuple(axes), keepdims=True),
    "Relu": lambda x: jnp.maximum(x, 0.0),
    "Reshape": lambda x, wanted: x.reshape([x.shape[i] if n == 0 else int(n) for i, n in enumerate(wanted)]),
    "Sigmoid": jax.nn.sigmoid,
    "Softplus": jax.nn.softplus,
    "Split": lambda x, axis, parts: jnp.split(x, parts, axis),
    "Sub": jnp.subtract,
    "Tanh": jnp.tanh,
    "Transpose": lambda x, perm: x.transpose(perm),
    "Where": jnp.where,
}
"""The operators of policies without cameras: the operands, and the attributes by name."""


def policy_function(content: bytes) -> Callable[[Mapping[str, Array]], dict[str, Array]]:
    """The function of a policy's graph: inputs by name to outputs by name.

    Args:
        content: what `load_policy` has checked, its `content`.
    """
    graph = onnx.load_model_from_string(content).graph
    constants = {tensor.name: numpy_helper.to_array(tensor) for tensor in graph.initializer}

    def called(inputs: Mapping[str, Array]) -> dict[str, Array]:
        known: dict[str, Array | np.ndarray] = {**constants, **inputs}
        for node in graph.node:
            options = {a.name: helper.get_attribute_value(a) for a in node.attribute}
            if node.op_type == "Split":
                options["parts"] = len(node.output)
            found = OPERATORS[node.op_type](*(known[name] for name in node.input), **options)
            known |= zip(node.output, found if node.op_type == "Split" else [found], strict=True)
        return {output.name: jnp.asarray(known[output.name]) for output in graph.output}

    return called
