"""A policy's graph in double precision: its exact values, to measure the rounding errors of other implementations."""

from collections.abc import Sequence

import numpy as np
import onnx
from onnx import TensorProto, numpy_helper
from onnx.reference import ReferenceEvaluator

from e2efly.policy.contract import Contract
from e2efly.policy.loader import INPUT, MEMORY, NEXT_MEMORY, OUTPUT


class Exact:
    """The graph of a policy.onnx, evaluated by ONNX's reference implementation in double precision, operator by
    operator.
    """

    def __init__(self, contract: Contract, content: bytes) -> None:
        model = onnx.load_model_from_string(content)
        for tensor in model.graph.initializer:
            if tensor.data_type == TensorProto.FLOAT:
                tensor.CopyFrom(numpy_helper.from_array(numpy_helper.to_array(tensor).astype(np.float64), tensor.name))
        for value in (*model.graph.input, *model.graph.output):
            value.type.tensor_type.elem_type = TensorProto.DOUBLE
        self.contract, self._graph = contract, ReferenceEvaluator(model)

    def act(
        self, observation: np.ndarray, images: Sequence[np.ndarray], memory: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Actions (n, c) and next memories (n, k), float64, for observations (n, o), images and memories (n, k)."""
        size = self.contract.memory_size
        fed = {INPUT: observation} | {image.name: x for image, x in zip(self.contract.images, images, strict=True)}
        fed |= {MEMORY: memory} if size else {}
        fed = {name: np.asarray(x, np.float64) for name, x in fed.items()}
        action, *after = self._graph.run([OUTPUT, *([NEXT_MEMORY] if size else [])], fed)
        return np.asarray(action), np.asarray(after[0]) if size else np.zeros((len(observation), 0))
