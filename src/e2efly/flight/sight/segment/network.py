"""Masks from a network that has learned what pads look like."""

from pathlib import Path
from typing import Any

import numpy as np

from e2efly.flight.sight.segment import SEGMENTERS, opencv
from e2efly.policy.onnx_file import Message, file_content, read, write
from e2efly.policy.onnx_session import open_session

OWN = Path(__file__).parent / "pad.onnx"
"""The network that is loaded if no file is named. `benchmarks/pad_masks.py --train` writes it."""
LONGER_SIDE, STEP = 64, 16
"""The input size of a network that accepts any size: pixels of the longer side. All sides are multiples of the step."""
ACCEPTED = (
    "an ONNX file with one input, float32 (n, h, w, 3), red, green, blue in [0, 1], and one output, float32 (n, h, w), "
    "the probability that a pixel shows the object"
)
LARGEST_SIDE = 2048
"""Largest number of rows or columns that a network may ask for."""
OPSETS = range(11, 25)
"""Accepted versions of the operators."""
OPERATORS = frozenset({
    "Abs", "Add", "AveragePool", "BatchNormalization", "Cast", "Clip", "Concat", "Constant", "Conv", "ConvTranspose",
    "DepthToSpace", "Div", "Dropout", "Elu", "Erf", "Exp", "Flatten", "Gather", "Gelu", "Gemm", "GlobalAveragePool",
    "GlobalMaxPool", "GroupNormalization", "HardSigmoid", "HardSwish", "Identity", "InstanceNormalization",
    "LayerNormalization", "LeakyRelu", "Log", "MatMul", "Max", "MaxPool", "Min", "Mish", "Mul", "Neg", "PRelu", "Pad",
    "Pow", "ReduceMax", "ReduceMean", "ReduceSum", "Relu", "Reshape", "Resize", "Selu", "Shape", "Sigmoid", "Slice",
    "Softmax", "Softplus", "SpaceToDepth", "Split", "Sqrt", "Squeeze", "Sub", "Tanh", "Transpose", "Unsqueeze",
})  # fmt: skip
"""Accepted operators: of ONNX's own, those whose work depends on nothing but the size of the picture."""
GROWING = ("Pad", "Resize")
"""Operators of which all inputs after the first are constants: these say how large the output is."""


class MaskNetwork:
    """A mask of the pixels for which the network's probability is above one half."""

    def __init__(self, path: Path) -> None:
        """Load the network, and try it on a black image.

        Raises:
            ValueError: naming the file, and how it differs from `ACCEPTED`.
        """
        self.path = path
        try:
            model = read(file_content(path))
            _check(model)
            (given,), (_,) = model["graph"].get("input", []), model["graph"].get("output", [])
            axes = given.get("type", {}).get("tensor_type", {}).get("shape", {}).get("dim", [])
            shape = [axis.get("dim_value", 0) for axis in axes]  # 0: any
            if len(shape) != 4 or shape[3] != 3 or not all(0 <= side <= LARGEST_SIDE for side in shape[1:3]):
                raise ValueError(f"its input has the shape {shape}")
            self._name, self._sides = given.get("name", ""), (shape[1], shape[2])
            black = np.zeros((1, *(side or LONGER_SIDE for side in self._sides), 3), np.float32)
            self._session = open_session(write(model), [black], trusted=path == OWN)
            self.probability(np.zeros((LONGER_SIDE, LONGER_SIDE, 3), np.uint8))
        except Exception as error:  # any refusal of ONNX Runtime, or a wrong number of inputs or outputs
            said = str(error).strip().partition("\n")[0]
            raise ValueError(f"{path}: {said}; accepted: {ACCEPTED}") from None

    def __call__(self, colours: np.ndarray) -> np.ndarray:
        """The mask; see `Segmenter`."""
        cv2 = opencv()
        height, width, _ = colours.shape
        larger = cv2.resize(self.probability(colours), (width, height), interpolation=cv2.INTER_LINEAR)
        return (larger > 0.5).astype(np.uint8)

    def probability(self, colours: np.ndarray) -> np.ndarray:
        """The probability that a pixel shows the pad, float32, at the network's input size. `colours` is uint8 (h, w,
        3), red first.

        Raises:
            ValueError: if the network's output does not have that size.
        """
        cv2 = opencv()
        longer = max(colours.shape[:2])
        rows, columns = (
            own or max(STEP, round(side / longer * LONGER_SIDE / STEP) * STEP)
            for own, side in zip(self._sides, colours.shape, strict=False)
        )
        seen = cv2.resize(colours, (columns, rows), interpolation=cv2.INTER_AREA).astype(np.float32) / 255
        found: Any = self._session.run(None, {self._name: seen[None]})[0]
        if np.shape(found) != (1, rows, columns):
            raise ValueError(f"its output has the shape {np.shape(found)} for an image of {rows} x {columns}")
        return np.asarray(found[0], np.float32)

    def describe(self) -> str:
        """The name of the network."""
        return "the network of pads of benchmarks/pad_masks.py" if self.path == OWN else f"network {self.path}"


def _check(model: Message) -> None:
    """Refuse operators that are not in `OPERATORS`. The trial of `open_session` finds what takes too long."""
    versions = [(entry.get("domain", ""), entry.get("version", 0)) for entry in model.get("opset_import", [])]
    if len(versions) != 1 or versions[0][0] not in ("", "ai.onnx") or versions[0][1] not in OPSETS:
        raise ValueError(f"its operators have the versions {versions!r:.200}, not one of {OPSETS[0]} to {OPSETS[-1]}")
    graph = model.get("graph", {})
    constants = {""} | {tensor.get("name", "") for tensor in graph.get("initializer", [])}
    for node in graph.get("node", []):
        kind, inputs = node.get("op_type", ""), node.get("input", [])
        if node.get("domain", "") not in ("", "ai.onnx") or kind not in OPERATORS:
            raise ValueError(f"its operator {kind!r:.40} is none of {', '.join(sorted(OPERATORS))}")
        if kind in GROWING and not constants.issuperset(inputs[1:]):
            raise ValueError(f"its operator {kind!r} has an output whose size is not constant")
        constants |= set(node.get("output", [])) if kind == "Constant" else set()


def open_onnx(text: str) -> MaskNetwork:
    """Load FILE. If it is omitted, load `OWN`.

    Raises:
        ValueError: naming the file and what is accepted.
    """
    return MaskNetwork(Path(text).expanduser() if text else OWN)


SEGMENTERS.add("onnx", open_onnx)
