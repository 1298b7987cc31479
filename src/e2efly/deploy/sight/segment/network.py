"""Masks from a network that has learned what pads look like."""

from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime

from e2efly.deploy.sight.segment import SEGMENTERS, opencv

OWN = Path(__file__).parent / "pad.onnx"
"""The network that is loaded if no file is named. `benchmarks/pad_masks.py --train` writes it."""
LONGER_SIDE, STEP = 64, 16
"""The input size of a network that accepts any size: pixels of the longer side. All sides are multiples of the step."""
ACCEPTED = (
    "an ONNX file with one input, float32 (n, h, w, 3), red, green, blue in [0, 1], and one output, float32 (n, h, w), "
    "the probability that a pixel shows the pad"
)


class Network:
    """A mask of the pixels for which the network's probability is above one half."""

    def __init__(self, path: Path) -> None:
        """Load the network, and try it on a black image.

        Raises:
            ValueError: naming the file, and how it differs from `ACCEPTED`.
        """
        self.path = path
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = 4  # what is wrong is in the exception
        try:
            content = path.read_bytes()
        except OSError as error:
            raise ValueError(f"{path}: {error.strerror}; accepted: {ACCEPTED}") from None
        try:
            self._session = onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
            (given,), (_,) = self._session.get_inputs(), self._session.get_outputs()
            self._name, (_, *sides, channels) = given.name, given.shape
            self._sides = tuple(side if isinstance(side, int) else 0 for side in sides)  # 0: any
            if len(self._sides) != 2 or channels != 3:
                raise ValueError(f"its input has the shape {given.shape}")
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
        """The probability that a pixel shows the pad, float32, at the network's input size.

        Args:
            colours: uint8 (h, w, 3), red first.

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


def open_onnx(text: str) -> Network:
    """Load FILE. If it is omitted, load `OWN`.

    Raises:
        ValueError: naming the file and what is accepted.
    """
    return Network(Path(text).expanduser() if text else OWN)


SEGMENTERS.add("onnx", open_onnx)
