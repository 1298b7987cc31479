"""The small networks of `mask:onnx`: their layers, their training on rendered pictures, and their files.

Colours, less their mean and over their deviation, are cut into cells of pixels. These go down some halvings and up
again, each way up beside what came down (Ronneberger, Fischer, Brox: "U-Net", 2015). What comes out is the probability
that a pixel shows the object.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import onnx
import optax
from jaxtyping import Array, Float, Num, PRNGKeyArray, UInt8
from onnx import TensorProto, helper, numpy_helper

OPSET, IR_VERSION = 17, 8
FAINTEST = 1e-2
"""Least deviation of a picture's colours that they are divided by."""
RARE = -2.0
"""Logit of the probability of an object before anything is learned."""
Weights = dict[str, tuple[Array, Array]]
"""Kernels (side, side, in, out) and biases of the convolutions by name."""


@dataclass(frozen=True)
class Unet:
    """The shape of a network. Sides of its pictures are multiples of `step`."""

    widths: tuple[int, ...]
    """Channels of the cells, and after each halving."""
    cell: int
    """Rows and columns of a cell, pixels."""

    @property
    def step(self) -> int:
        """Pixels of a cell after all halvings."""
        return self.cell * 2 ** (len(self.widths) - 1)

    @property
    def layers(self) -> list[tuple[str, int, int, int]]:
        """Name, side of the kernel, channels that come in, channels that go out."""
        area, widths = self.cell**2, self.widths
        found, before = [("down_0", 3, 3 * area, widths[0])], widths[0]
        for level, width in enumerate(widths[1:], 1):
            found += [(f"half_{level}", 3, before, width), (f"down_{level}", 3, width, width)]
            before = width
        for level, width in reversed(list(enumerate(widths[:-1]))):
            found += [(f"up_{level}", 3, before + width, width)]
            before = width
        return [*found, ("last_0", 3, before, before), ("last_1", 1, before, area)]


PADS, GATES = Unet((16, 24, 32, 48), 2), Unet((16, 20, 32, 32), 2)
"""The networks that ship."""


def initial(unet: Unet, key: PRNGKeyArray) -> Weights:
    """Kernels as He et al. (2015) draw them."""
    weights = {}
    for i, (name, side, into, out) in enumerate(unet.layers):
        scale = (2.0 / (side * side * into)) ** 0.5
        kernel = scale * jax.random.normal(jax.random.fold_in(key, i), (side, side, into, out))
        weights[name] = (kernel, jnp.full(out, RARE if name == "last_1" else 0.0))
    return weights


def _convolved(kernel: Array, bias: Array, x: Float[Array, "n h w c"], stride: int) -> Float[Array, "n i j d"]:
    """By one product of matrices: on a CPU, XLA's gradient of a convolution takes several times as long."""
    side = kernel.shape[0]
    rows, columns = x.shape[1] // stride, x.shape[2] // stride
    x = jnp.pad(x, [(0, 0), (side // 2, side // 2), (side // 2, side // 2), (0, 0)])
    last_row, last_column = stride * (rows - 1) + 1, stride * (columns - 1) + 1
    near = [x[:, i : i + last_row : stride, j : j + last_column : stride] for i in range(side) for j in range(side)]
    return jnp.concatenate(near, axis=-1) @ kernel.reshape(-1, kernel.shape[-1]) + bias


def logits(unet: Unet, weights: Weights, colours: Float[Array, "n h w 3"]) -> Float[Array, "n h w"]:
    """Of the probability of the object; h and w are multiples of `unet.step`."""

    def convolved(name: str, x: Array, stride: int = 1) -> Array:
        return _convolved(*weights[name], x, stride)

    n, h, w, _ = colours.shape
    mean = colours.mean((1, 2, 3), keepdims=True)
    x = colours - mean
    x = x / (jnp.sqrt((x * x).mean((1, 2, 3), keepdims=True)) + FAINTEST)
    c = unet.cell
    x = x.reshape(n, h // c, c, w // c, c, 3).transpose(0, 1, 3, 2, 4, 5).reshape(n, h // c, w // c, 3 * c * c)
    x = jax.nn.relu(convolved("down_0", x))
    seen = [x]
    for level in range(1, len(unet.widths)):
        x = jax.nn.relu(convolved(f"half_{level}", x, 2))
        x = x + jax.nn.relu(convolved(f"down_{level}", x))
        seen.append(x)
    for level in reversed(range(len(unet.widths) - 1)):
        x = jnp.repeat(jnp.repeat(x, 2, 1), 2, 2)
        x = jax.nn.relu(convolved(f"up_{level}", jnp.concatenate([x, seen[level]], -1)))
    x = convolved("last_1", jax.nn.relu(convolved("last_0", x)))
    return x.reshape(n, h // c, w // c, c, c).transpose(0, 1, 3, 2, 4).reshape(n, h, w)


def loss(unet: Unet, weights: Weights, colours: Float[Array, "n h w 3"], masks: Float[Array, "n h w"]) -> Array:
    """Cross entropy, and what the soft intersection over union of the batch lacks of 1."""
    z = logits(unet, weights, colours)
    p = jax.nn.sigmoid(z)
    overlap = (p * masks).sum()
    union = (p + masks - p * masks).sum()
    return optax.sigmoid_binary_cross_entropy(z, masks).mean() + 0.3 * (1 - overlap / union)


def _batches(
    rng: np.random.Generator, colours: UInt8[np.ndarray, "n h w 3"], masks: Num[np.ndarray, "n h w"], size: int,
    upright: bool,
) -> Iterator[tuple[np.ndarray, np.ndarray]]:  # fmt: skip
    """For ever: pictures in any order, turned unless they are upright, mirrored, their channels swapped."""
    while True:
        order = rng.permutation(len(colours))
        for first in range(0, len(order) - size + 1, size):
            x, y = colours[order[first : first + size]], masks[order[first : first + size]]
            turns = 0 if upright else int(rng.integers(4))
            x, y = np.rot90(x, turns, (1, 2)), np.rot90(y, turns, (1, 2))
            if rng.random() < 0.5:
                x, y = x[:, :, ::-1], y[:, :, ::-1]
            yield np.ascontiguousarray(x[..., rng.permutation(3)]), np.ascontiguousarray(y)


def learned(
    unet: Unet,
    colours: UInt8[np.ndarray, "n h w 3"],
    masks: Num[np.ndarray, "n h w"],
    steps: int,
    size: int = 32,
    rate: float = 3e-3,
    seed: int = 0,
    told: Any = print,
    weights: Weights | None = None,
    upright: bool = False,
) -> Weights:
    """Weights by AdamW, whose rate rises for a tenth of the steps and falls to 0 by a cosine.

    Args:
        unet: the network.
        colours: 255 for 1.
        masks: the share of each pixel that shows the object, 0 to 1.
        steps: of the optimizer.
        size: pictures of a step.
        rate: largest learning rate.
        seed: of weights and order.
        told: given a line about every 200 steps.
        weights: to begin from.
        upright: the pictures have an upper side, so they are not turned.
    """
    optimizer = optax.chain(
        optax.clip_by_global_norm(1.0),
        optax.adamw(optax.warmup_cosine_decay_schedule(0.0, rate, steps // 10, steps), weight_decay=1e-4),
    )
    weights = weights or initial(unet, jax.random.key(seed))
    state = optimizer.init(weights)

    @partial(jax.jit, donate_argnums=(0, 1))
    def step(weights: Weights, state: Any, x: Array, y: Array) -> tuple[Weights, Any, Array]:
        value, slope = jax.value_and_grad(loss, argnums=1)(unet, weights, x / 255.0, y.astype(jnp.float32))
        change, state = optimizer.update(slope, state, weights)
        return optax.apply_updates(weights, change), state, value

    mean = 0.0
    batches = _batches(np.random.default_rng(seed), colours, masks, size, upright)
    for i, (x, y) in zip(range(steps), batches, strict=False):
        weights, state, value = step(weights, state, x, y)
        mean = 0.98 * mean + 0.02 * float(value)
        if (i + 1) % 100 == 0:
            told(f"step {i + 1}: loss {mean / (1 - 0.98 ** (i + 1)):.4f}")
    return weights


def weights_of(unet: Unet, model: onnx.ModelProto) -> Weights:
    """The inverse of `graph`."""
    found = {tensor.name: numpy_helper.to_array(tensor) for tensor in model.graph.initializer}
    return {
        name: (
            jnp.asarray(found[f"{name}_half"].astype(np.float32).transpose(2, 3, 1, 0)),
            jnp.asarray(found[f"{name}_bias"]),
        )
        for name, *_ in unet.layers
    }


def graph(unet: Unet, weights: Weights, size: tuple[Any, Any] = ("h", "w")) -> onnx.ModelProto:
    """`logits` in ONNX's operators, and their probability; kernels in half precision. `size` are rows and columns of
    the pictures that it takes; of any size, if they are names.
    """
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
    x = convolved("down_0", node("SpaceToDepth", [x], "cells", blocksize=unet.cell))
    seen = [x]
    for level in range(1, len(unet.widths)):
        x = convolved(f"half_{level}", x, 2)
        x = node("Add", [x, convolved(f"down_{level}", x)], f"seen_{level}")
        seen.append(x)
    twice = constant("twice", np.array([1, 1, 2, 2], np.float32))
    for level in reversed(range(len(unet.widths) - 1)):
        larger = node(
            "Resize", [x, "", twice], f"larger_{level}", mode="nearest",
            coordinate_transformation_mode="asymmetric", nearest_mode="floor",
        )  # fmt: skip
        x = convolved(f"up_{level}", node("Concat", [larger, seen[level]], f"both_{level}", axis=1))
    x = convolved("last_1", convolved("last_0", x), relu=False)
    x = node("DepthToSpace", [x], "planes_out", blocksize=unet.cell, mode="DCR")
    x = node("Squeeze", [node("Sigmoid", [x], "share"), constant("channel", np.array([1], np.int64))], "mask")
    model = helper.make_model(
        helper.make_graph(
            nodes, "mask",
            [helper.make_tensor_value_info("colours", TensorProto.FLOAT, ["n", *size, 3])],
            [helper.make_tensor_value_info("mask", TensorProto.FLOAT, ["n", *size])],
            constants,
        ),
        opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION, producer_name="e2efly",
    )  # fmt: skip
    onnx.checker.check_model(model, full_check=True)
    return model
