"""The small networks of `mask:onnx`: their layers, their training on rendered pictures, and their files.

Colours, less their mean and over their deviation, are cut into cells of pixels. These go down some halvings and up
again, each way up beside what came down (Ronneberger, Fischer, Brox: "U-Net", 2015). What comes out is the probability
that a pixel shows the object. Needs PyTorch, which learns ten times as fast on a CPU with half precision as JAX does.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import onnx
import torch
from jaxtyping import Float, UInt8
from onnx import TensorProto, helper, numpy_helper
from torch import Tensor, nn
from torch.nn import functional

OPSET, IR_VERSION = 17, 8
FAINTEST = 1e-2
"""Least deviation of a picture's colours that they are divided by."""
RARE = -2.0
"""Logit of the probability of an object before anything is learned."""


@dataclass(frozen=True)
class Shape:
    """The shape of a network. Sides of its pictures are multiples of `step`."""

    widths: tuple[int, ...]
    """Channels of the cells, and after each halving."""
    cell: int
    """Rows and columns of a cell, pixels."""
    deep: tuple[int, ...] = ()
    """Distances of the rows that further layers look at after the last halving, which see far about themselves."""

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
        found += [(f"deep_{i}", 3, before, before) for i in range(len(self.deep))]
        for level, width in reversed(list(enumerate(widths[:-1]))):
            found += [(f"up_{level}", 3, before + width, width)]
            before = width
        return [*found, ("last_0", 3, before, before), ("last_1", 1, before, area)]


PADS, GATES = Shape((16, 24, 32, 48), 2), Shape((32, 32, 64), 4, (2, 4, 1))
"""The networks that ship."""


class Unet(nn.Module):
    """A network; its layers are those of its shape, by name. While it is trained, what comes out of each layer but the
    last is made even over the batch (Ioffe, Szegedy, 2015); its file has this in the kernels.
    """

    def __init__(self, shape: Shape, seed: int = 0, even: bool = True) -> None:
        """Kernels as He et al. (2015) draw them."""
        super().__init__()
        torch.manual_seed(seed)
        self.shape, self.even = shape, nn.ModuleDict()
        for name, side, into, out in shape.layers:
            far = shape.deep[int(name[5:])] if name.startswith("deep") else 1
            layer = nn.Conv2d(
                into, out, side, stride=2 if name.startswith("half") else 1, padding=far * (side // 2), dilation=far
            )
            nn.init.normal_(layer.weight, std=(2.0 / (side * side * into)) ** 0.5)
            nn.init.constant_(layer.bias, RARE if name == "last_1" else 0.0)  # pyright: ignore
            self.add_module(name, layer)
            if even and name != "last_1":
                self.even[name] = nn.BatchNorm2d(out)

    def named(self, name: str) -> nn.Conv2d:
        """A layer."""
        return self.get_submodule(name)  # pyright: ignore

    def whole(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Kernel (out, in, side, side) and bias of a layer together with what makes it even."""
        layer = self.named(name)
        kernel, bias = (part.detach().double().numpy() for part in (layer.weight, layer.bias))  # pyright: ignore
        if name in self.even:
            e: Any = self.even[name]
            scale, shift, mean, power = (
                part.detach().double().numpy() for part in (e.weight, e.bias, e.running_mean, e.running_var)
            )
            scale = scale / np.sqrt(power + e.eps)
            kernel, bias = kernel * scale[:, None, None, None], (bias - mean) * scale + shift
        return kernel, bias

    def forward(self, colours: Float[Tensor, "n 3 h w"]) -> Float[Tensor, "n h w"]:
        """Logits of the probability of the object; h and w are multiples of the shape's `step`."""

        def layer(name: str, x: Tensor) -> Tensor:
            y = self.named(name)(x)
            return torch.relu(self.even[name](y) if name in self.even else y)

        last = len(self.shape.widths) - 1
        x = colours - colours.mean((1, 2, 3), keepdim=True)
        x = x / (x.square().mean((1, 2, 3), keepdim=True).sqrt() + FAINTEST)
        x = layer("down_0", _cells(x, self.shape.cell))
        seen = [x]
        for level in range(1, last + 1):
            x = layer(f"half_{level}", x)
            x = x + layer(f"down_{level}", x)
            seen.append(x)
        for i in range(len(self.shape.deep)):
            x = x + layer(f"deep_{i}", x)
        for level in reversed(range(last)):
            x = layer(f"up_{level}", torch.cat([functional.interpolate(x, scale_factor=2.0), seen[level]], 1))
        x = self.named("last_1")(layer("last_0", x))
        n, _, h, w = x.shape
        c = self.shape.cell
        return x.reshape(n, c, c, h, w).permute(0, 3, 1, 4, 2).reshape(n, h * c, w * c)


def _cells(x: Float[Tensor, "n 3 h w"], c: int) -> Float[Tensor, "n k i j"]:
    """Cells of pixels as channels, ordered (row, column, channel), as ONNX's SpaceToDepth does it."""
    n, d, h, w = x.shape
    return x.reshape(n, d, h // c, c, w // c, c).permute(0, 3, 5, 1, 2, 4).reshape(n, d * c * c, h // c, w // c)


def loss(z: Float[Tensor, "n h w"], masks: Float[Tensor, "n h w"]) -> Tensor:
    """Of logits: cross entropy, and what the soft intersection over union of the batch lacks of 1."""
    p = torch.sigmoid(z)
    overlap = (p * masks).sum()
    union = (p + masks - p * masks).sum()
    return functional.binary_cross_entropy_with_logits(z, masks) + 0.3 * (1 - overlap / union)


def _batches(
    rng: np.random.Generator, colours: UInt8[np.ndarray, "n h w 3"], masks: UInt8[np.ndarray, "n h w"], size: int,
    upright: bool, painted: float,
) -> Iterator[tuple[np.ndarray, np.ndarray]]:  # fmt: skip
    """For ever: pictures in any order, turned unless they are upright, mirrored, their channels swapped and each made
    brighter or darker, fainter or harder by a power of its values. The objects in a share of them are painted with what
    another picture shows there, so that their outlines count, not their textures.
    """
    levels = np.arange(256) / 255
    while True:
        order = rng.permutation(len(colours))
        for first in range(0, len(order) - size + 1, size):
            some = np.sort(order[first : first + size])
            x, y = colours[some], masks[some]
            turns = 0 if upright else int(rng.integers(4))
            x, y = np.rot90(x, turns, (1, 2)), np.rot90(y, turns, (1, 2))
            if rng.random() < 0.5:
                x, y = x[:, :, ::-1], y[:, :, ::-1]
            x = x[..., rng.permutation(3)]
            power, gain = np.exp(rng.normal(0, 0.3, (size, 1, 1))), np.exp(rng.normal(0, 0.2, (size, 3, 1)))
            power = power * np.exp(rng.normal(0, 0.1, (size, 3, 1)))
            tables = np.clip(gain * levels**power, 0, 1).astype(np.float32)
            planes = np.array([[tables[i, c][x[i, :, :, c]] for c in range(3)] for i in range(size)])
            share = y / np.float32(255)
            paint = share[:, None] * (rng.random((size, 1, 1, 1)) < painted)
            yield planes + paint * (np.roll(planes, 1, axis=0) - planes), share


def learned(
    network: Unet,
    colours: UInt8[np.ndarray, "n h w 3"],
    masks: UInt8[np.ndarray, "n h w"],
    steps: int,
    size: int = 32,
    rate: float = 3e-3,
    seed: int = 0,
    told: Any = print,
    upright: bool = False,
    painted: float = 0.0,
) -> None:
    """Train by AdamW, whose rate rises for a tenth of the steps and falls to 0 by a cosine. In half precision where the
    processor multiplies matrices of it.

    Args:
        network: learns in place.
        colours: 255 for 1.
        masks: the share of each pixel that shows the object, 255 for 1.
        steps: of the optimizer.
        size: pictures of a step.
        rate: largest learning rate.
        seed: of the order.
        told: given a line about every 100 steps.
        upright: the pictures have an upper side, so they are not turned.
        painted: share of the pictures whose objects are painted with what another one shows.
    """
    half = torch.cpu._is_amx_tile_supported()
    network.train().to(memory_format=torch.channels_last)  # pyright: ignore
    optimizer = torch.optim.AdamW(network.parameters(), rate, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, rate, total_steps=steps, pct_start=0.1)
    mean = 0.0
    batches = _batches(np.random.default_rng(seed), colours, masks, size, upright, painted)
    for i, (x, y) in zip(range(steps), batches, strict=False):
        planes = torch.from_numpy(x).contiguous(memory_format=torch.channels_last)
        with torch.autocast("cpu", torch.bfloat16, enabled=half):
            z = network(planes)
        value = loss(z.float(), torch.from_numpy(y))
        optimizer.zero_grad()
        value.backward()
        nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimizer.step()
        schedule.step()
        mean = 0.98 * mean + 0.02 * value.item()
        if (i + 1) % 100 == 0:
            told(f"step {i + 1}: loss {mean / (1 - 0.98 ** (i + 1)):.4f}")


def loaded(shape: Shape, model: onnx.ModelProto) -> Unet:
    """The network of a file of `graph`. It learns further without being made even."""
    found = {tensor.name: torch.tensor(numpy_helper.to_array(tensor)) for tensor in model.graph.initializer}
    network = Unet(shape, even=False)
    network.load_state_dict(
        {f"{name}.weight": found[f"{name}_half"].float() for name, *_ in shape.layers}
        | {f"{name}.bias": found[f"{name}_bias"] for name, *_ in shape.layers}
    )
    return network


def graph(network: Unet, size: tuple[Any, Any] = ("h", "w")) -> onnx.ModelProto:
    """A network in ONNX's operators, and the probability that it gives; kernels in half precision. `size` are rows and
    columns of the pictures that it takes; of any size, if they are names.
    """
    shape = network.shape
    nodes: list[onnx.NodeProto] = []
    constants: list[onnx.TensorProto] = []

    def node(operator: str, inputs: list[str], output: str, **attributes: Any) -> str:
        nodes.append(helper.make_node(operator, inputs, [output], **attributes))
        return output

    def constant(name: str, value: np.ndarray) -> str:
        constants.append(numpy_helper.from_array(value, name))
        return name

    def convolved(name: str, x: str, relu: bool = True) -> str:
        layer = network.named(name)
        kernel, bias = network.whole(name)
        half = constant(f"{name}_half", np.ascontiguousarray(kernel).astype(np.float16))
        named = node("Cast", [half], f"{name}_kernel", to=TensorProto.FLOAT)
        inputs = [x, named, constant(f"{name}_bias", bias.astype(np.float32))]
        y = node(
            "Conv", inputs, f"{name}_linear", kernel_shape=layer.kernel_size, strides=layer.stride,
            pads=[*layer.padding] * 2, dilations=layer.dilation,
        )  # fmt: skip
        return node("Relu", [y], f"{name}_out") if relu else y

    x = node("Transpose", ["colours"], "planes", perm=[0, 3, 1, 2])
    x = node("Sub", [x, node("ReduceMean", [x], "mean", axes=[1, 2, 3])], "centred")
    power = node("ReduceMean", [node("Mul", [x, x], "squares")], "power", axes=[1, 2, 3])
    faint = constant("faintest", np.float32(FAINTEST).reshape(()))
    x = node("Div", [x, node("Add", [node("Sqrt", [power], "root"), faint], "deviation")], "even")
    # SpaceToDepth lays out (row, column, channel), as `_cells` does
    x = convolved("down_0", node("SpaceToDepth", [x], "cells", blocksize=shape.cell))
    seen = [x]
    for level in range(1, len(shape.widths)):
        x = convolved(f"half_{level}", x)
        x = node("Add", [x, convolved(f"down_{level}", x)], f"seen_{level}")
        seen.append(x)
    for i in range(len(shape.deep)):
        x = node("Add", [x, convolved(f"deep_{i}", x)], f"deeper_{i}")
    twice = constant("twice", np.array([1, 1, 2, 2], np.float32))
    for level in reversed(range(len(shape.widths) - 1)):
        larger = node(
            "Resize", [x, "", twice], f"larger_{level}", mode="nearest",
            coordinate_transformation_mode="asymmetric", nearest_mode="floor",
        )  # fmt: skip
        x = convolved(f"up_{level}", node("Concat", [larger, seen[level]], f"both_{level}", axis=1))
    x = convolved("last_1", convolved("last_0", x), relu=False)
    x = node("DepthToSpace", [x], "planes_out", blocksize=shape.cell, mode="DCR")
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
