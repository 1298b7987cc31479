"""The small network of `mask:onnx`: its layers, its training on `pad_renders`, and its file.

Colours, less their mean and over their deviation, go down three halvings and up again, each way up beside what came
down (Ronneberger, Fischer, Brox: "U-Net", 2015); what comes out is the probability that a pixel shows a pad.
"""

from collections.abc import Iterator
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import onnx
import optax
from jaxtyping import Array, Float, PRNGKeyArray, UInt8
from onnx import TensorProto, helper, numpy_helper

WIDTHS = (16, 24, 32, 48)
"""Channels at a half, a quarter, an eighth and a sixteenth of the picture's side."""
OPSET, IR_VERSION = 17, 8
FAINTEST = 1e-2
"""Least deviation of a picture's colours that they are divided by."""
Weights = dict[str, tuple[Array, Array]]
"""Kernels (side, side, in, out) and biases of the convolutions by name."""


def _layers() -> list[tuple[str, int, int, int]]:
    """Name, side of the kernel, channels that come in, channels that go out."""
    found, before = [("down_0", 3, 12, WIDTHS[0])], WIDTHS[0]
    for level, width in enumerate(WIDTHS[1:], 1):
        found += [(f"half_{level}", 3, before, width), (f"down_{level}", 3, width, width)]
        before = width
    for level in reversed(range(len(WIDTHS) - 1)):
        width = WIDTHS[level]
        found += [(f"up_{level}", 3, before + width, width)]
        before = width
    return [*found, ("last_0", 3, before, before), ("last_1", 1, before, 4)]


def initial(key: PRNGKeyArray) -> Weights:
    """Kernels as He et al. (2015) draw them."""
    weights = {}
    for i, (name, side, into, out) in enumerate(_layers()):
        scale = (2.0 / (side * side * into)) ** 0.5
        kernel = scale * jax.random.normal(jax.random.fold_in(key, i), (side, side, into, out))
        weights[name] = (kernel, jnp.zeros(out))
    return weights


def logits(weights: Weights, colours: Float[Array, "n h w 3"]) -> Float[Array, "n h w"]:
    """Of the probability of a pad; h and w are multiples of 16."""

    def convolved(name: str, x: Array, stride: int = 1) -> Array:
        kernel, bias = weights[name]
        before = (kernel.shape[0] - 1) // 2
        pad = [(before, before)] * 2
        y = jax.lax.conv_general_dilated(x, kernel, (stride, stride), pad, dimension_numbers=("NHWC", "HWIO", "NHWC"))
        return y + bias

    n, h, w, _ = colours.shape
    mean = colours.mean((1, 2, 3), keepdims=True)
    x = colours - mean
    x = x / (jnp.sqrt((x * x).mean((1, 2, 3), keepdims=True)) + FAINTEST)
    x = x.reshape(n, h // 2, 2, w // 2, 2, 3).transpose(0, 1, 3, 2, 4, 5).reshape(n, h // 2, w // 2, 12)
    x = jax.nn.relu(convolved("down_0", x))
    seen = [x]
    for level in range(1, len(WIDTHS)):
        x = jax.nn.relu(convolved(f"half_{level}", x, 2))
        x = x + jax.nn.relu(convolved(f"down_{level}", x))
        seen.append(x)
    for level in reversed(range(len(WIDTHS) - 1)):
        x = jnp.repeat(jnp.repeat(x, 2, 1), 2, 2)
        x = jax.nn.relu(convolved(f"up_{level}", jnp.concatenate([x, seen[level]], -1)))
    x = convolved("last_1", jax.nn.relu(convolved("last_0", x)))
    return x.reshape(n, h // 2, w // 2, 2, 2).transpose(0, 1, 3, 2, 4).reshape(n, h, w)


def loss(weights: Weights, colours: Float[Array, "n h w 3"], masks: Float[Array, "n h w"]) -> Array:
    """Cross entropy, and what the soft intersection over union of the batch lacks of 1."""
    z = logits(weights, colours)
    p = jax.nn.sigmoid(z)
    overlap = (p * masks).sum()
    union = (p + masks - p * masks).sum()
    return optax.sigmoid_binary_cross_entropy(z, masks).mean() + 0.3 * (1 - overlap / union)


def _batches(
    rng: np.random.Generator, colours: UInt8[np.ndarray, "n h w 3"], masks: UInt8[np.ndarray, "n h w"], size: int
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """For ever: pictures in any order, turned, mirrored, their channels swapped."""
    while True:
        order = rng.permutation(len(colours))
        for first in range(0, len(order) - size + 1, size):
            x, y = colours[order[first : first + size]], masks[order[first : first + size]]
            turns = int(rng.integers(4))
            x, y = np.rot90(x, turns, (1, 2)), np.rot90(y, turns, (1, 2))
            if rng.random() < 0.5:
                x, y = x[:, ::-1], y[:, ::-1]
            yield np.ascontiguousarray(x[..., rng.permutation(3)]), np.ascontiguousarray(y)


def learned(
    colours: UInt8[np.ndarray, "n h w 3"],
    masks: UInt8[np.ndarray, "n h w"],
    steps: int,
    size: int = 32,
    rate: float = 3e-3,
    seed: int = 0,
    told: Any = print,
    weights: Weights | None = None,
) -> Weights:
    """Weights by AdamW, whose rate rises for a tenth of the steps and falls to 0 by a cosine.

    Args:
        colours: 255 for 1.
        masks: 0 or 1.
        steps: of the optimizer.
        size: pictures of a step.
        rate: largest learning rate.
        seed: of weights and order.
        told: given a line about every 200 steps.
        weights: to begin from.
    """
    optimizer = optax.chain(
        optax.clip_by_global_norm(1.0),
        optax.adamw(optax.warmup_cosine_decay_schedule(0.0, rate, steps // 10, steps), weight_decay=1e-4),
    )
    weights = weights or initial(jax.random.key(seed))
    state = optimizer.init(weights)

    @partial(jax.jit, donate_argnums=(0, 1))
    def step(weights: Weights, state: Any, x: Array, y: Array) -> tuple[Weights, Any, Array]:
        value, slope = jax.value_and_grad(loss)(weights, x / 255.0, y.astype(jnp.float32))
        change, state = optimizer.update(slope, state, weights)
        return optax.apply_updates(weights, change), state, value

    mean = 0.0
    for i, (x, y) in zip(range(steps), _batches(np.random.default_rng(seed), colours, masks, size), strict=False):
        weights, state, value = step(weights, state, x, y)
        mean = 0.98 * mean + 0.02 * float(value)
        if (i + 1) % 100 == 0:
            told(f"step {i + 1}: loss {mean / (1 - 0.98 ** (i + 1)):.4f}")
    return weights


def weights_of(model: onnx.ModelProto) -> Weights:
    """The inverse of `graph`."""
    found = {tensor.name: numpy_helper.to_array(tensor) for tensor in model.graph.initializer}
    return {
        name: (
            jnp.asarray(found[f"{name}_half"].astype(np.float32).transpose(2, 3, 1, 0)),
            jnp.asarray(found[f"{name}_bias"]),
        )
        for name, *_ in _layers()
    }


def graph(weights: Weights) -> onnx.ModelProto:
    """`logits` in ONNX's operators, and their probability; kernels in half precision."""
    nodes: list[onnx.NodeProto] = []
    constants: list[onnx.TensorProto] = []

    def node(operator: str, inputs: list[str], output: str, **attributes: Any) -> str:
        nodes.append(helper.make_node(operator, inputs, [output], **attributes))
        return output

    def constant(name: str, value: np.ndarray) -> str:
        constants.append(numpy_helper.from_array(value, name))
        return name

    def convolved(name: str, x: str, stride: int = 1, relu: bool = True) -> str:
        kernel, bias = (np.asarray(w) for w in weights[name])
        half = constant(f"{name}_half", np.ascontiguousarray(kernel.transpose(3, 2, 0, 1)).astype(np.float16))
        named = node("Cast", [half], f"{name}_kernel", to=TensorProto.FLOAT)
        before = (kernel.shape[0] - 1) // 2
        y = node(
            "Conv", [x, named, constant(f"{name}_bias", bias.astype(np.float32))], f"{name}_linear",
            kernel_shape=list(kernel.shape[:2]), strides=[stride] * 2, pads=[before] * 4,
        )  # fmt: skip
        return node("Relu", [y], f"{name}_out") if relu else y

    x = node("Transpose", ["colours"], "planes", perm=[0, 3, 1, 2])
    x = node("Sub", [x, node("ReduceMean", [x], "mean", axes=[1, 2, 3])], "centred")
    power = node("ReduceMean", [node("Mul", [x, x], "squares")], "power", axes=[1, 2, 3])
    faint = constant("faintest", np.float32(FAINTEST).reshape(()))
    x = node("Div", [x, node("Add", [node("Sqrt", [power], "root"), faint], "deviation")], "even")
    # SpaceToDepth lays out (row, column, channel), as the reshape of `logits` does
    x = convolved("down_0", node("SpaceToDepth", [x], "cells", blocksize=2))
    seen = [x]
    for level in range(1, len(WIDTHS)):
        x = convolved(f"half_{level}", x, 2)
        x = node("Add", [x, convolved(f"down_{level}", x)], f"seen_{level}")
        seen.append(x)
    twice = constant("twice", np.array([1, 1, 2, 2], np.float32))
    for level in reversed(range(len(WIDTHS) - 1)):
        larger = node(
            "Resize", [x, "", twice], f"larger_{level}", mode="nearest",
            coordinate_transformation_mode="asymmetric", nearest_mode="floor",
        )  # fmt: skip
        x = convolved(f"up_{level}", node("Concat", [larger, seen[level]], f"both_{level}", axis=1))
    x = convolved("last_1", convolved("last_0", x), relu=False)
    x = node("DepthToSpace", [x], "planes_out", blocksize=2, mode="DCR")
    x = node("Squeeze", [node("Sigmoid", [x], "share"), constant("channel", np.array([1], np.int64))], "pad")
    model = helper.make_model(
        helper.make_graph(
            nodes, "pad",
            [helper.make_tensor_value_info("colours", TensorProto.FLOAT, ["n", "h", "w", 3])],
            [helper.make_tensor_value_info("pad", TensorProto.FLOAT, ["n", "h", "w"])],
            constants,
        ),
        opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION, producer_name="e2efly",
    )  # fmt: skip
    onnx.checker.check_model(model, full_check=True)
    return model
