"""The ONNX graph of a policy: the computations of `e2efly.learning.networks` as ONNX operators."""

from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from e2efly.learning.networks import FAINTEST, NEAREST, Actor, Features, Gru, Layers, View, Weights
from e2efly.learning.raptor_actor import RaptorActor
from e2efly.policy.loader import INPUT, MEMORY, NEXT_MEMORY, OUTPUT
from e2efly.policy.raptor.raptor_form import COLUMNS, FARTHEST, FASTEST, FIELDS, OUTPUTS, ROTOR_OF, UNITS
from e2efly.simulation.sensors.eyes import image_shape

OPERATORS = {"relu": "Relu", "tanh": "Tanh", "elu": "Elu"}
"""ONNX operators of the activations, by name."""
_PAIRS = ("xx", "yy", "zz", "xy", "xz", "yz", "wx", "wy", "wz")
_R_WORLD_BODY = ("-yy-zz", "+xy-wz", "+xz+wy", "+xy+wz", "-xx-zz", "+yz-wx", "+xz-wy", "+yz+wx", "-xx-yy")
"""(R_world_body - identity) / 2, row by row, as sums of products of quaternion entries."""


class Graph:
    """Collects the nodes and the constants of a graph."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.constants: dict[str, np.ndarray] = {}

    def node(self, operator: str, inputs: list[str], output: str, **attributes: Any) -> str:
        """Add a node and return the name of its output."""
        self.nodes.append(helper.make_node(operator, inputs, [output], **attributes))
        return output

    def constant(self, name: str, value: Any) -> str:
        """Add a constant and return its name."""
        self.constants[name] = np.asarray(value, order="C")
        return name

    def layers(self, layers: Layers, source: str, operators: list[str], target: str, prefix: str = "") -> str:
        """Add layers, each with its activation. `target` is the name of the last layer's output."""
        for i, ((weight, bias), operator) in enumerate(zip(layers, operators, strict=True)):
            named = [self.constant(f"{prefix}weight_{i}", weight), self.constant(f"{prefix}bias_{i}", bias)]
            linear = self.node("Gemm", [source, *named], f"{prefix}linear_{i}")
            source = self.node(operator, [linear], target if i == len(layers) - 1 else f"{prefix}hidden_{i + 1}")
        return source

    def clip(self, source: str, most: float, target: str) -> str:
        """Add a node that clips `source` to [-most, most]."""
        ends = [self.constant(f"{target}_{side}", np.float32(sign * most)) for side, sign in (("low", -1), ("high", 1))]
        return self.node("Clip", [source, *ends], target)

    def whole(self, inputs: dict[str, tuple[int, ...]], outputs: dict[str, tuple[int, ...]]) -> onnx.GraphProto:
        """The complete graph. The shapes of inputs and outputs are given without the batch axis, which comes first."""
        taken, given = (
            [helper.make_tensor_value_info(name, TensorProto.FLOAT, ["n", *shape]) for name, shape in shapes.items()]
            for shapes in (inputs, outputs)
        )
        constants = [numpy_helper.from_array(value, name) for name, value in self.constants.items()]
        return helper.make_graph(self.nodes, "policy", taken, given, constants)


def policy_graph(weights: Weights, actor: Actor, images: list[str]) -> onnx.GraphProto:
    """The graph of a policy.

    Args:
        weights: float32 weights that match the structure of the actor.
        actor: features, encoders, GRU and head.
        images: the name of each camera's input.
    """
    graph, features, units = Graph(), actor.features, actor.network.recurrent
    if isinstance(actor, RaptorActor):
        return _raptor_graph(graph, weights)
    operator = OPERATORS[actor.network.activation]
    _of_state(graph, features)
    seen = zip(images, features.views, weights.encoders, strict=True)
    encoded = [_encoded(graph, name, view, layers, operator) for name, view, layers in seen]
    source = graph.node("Concat", ["features", *encoded], "joined", axis=1) if encoded else "features"
    if weights.cell is not None:
        source = graph.node("Concat", [source, _remembered(graph, weights.cell, source)], "known", axis=1)
    graph.layers(weights.head, source, [operator] * (len(weights.head) - 1) + ["Tanh"], OUTPUT)
    inputs: dict[str, tuple[int, ...]] = {INPUT: (sum(field.size for field in features.fields),)}
    inputs |= {name: image_shape(view.camera) for name, view in zip(images, features.views, strict=True)}
    memory = {MEMORY: (units,)} if units else {}
    action = {OUTPUT: (len(weights.head[-1][1]),)}
    return graph.whole(inputs | memory, action | ({NEXT_MEMORY: (units,)} if units else {}))


def _raptor_graph(graph: Graph, weights: Weights) -> onnx.GraphProto:
    """The graph of a policy of RAPTOR's form: `RaptorFeatures`, then `RaptorActor`. Its action is clipped.

    `e2efly.policy.raptor.raptor_network` reads its constants by name.
    """
    last = [COLUMNS["past_actions"][i] for i in ROTOR_OF]
    for name, columns in (
        ("error", COLUMNS["position_error"]),
        ("velocity", COLUMNS["velocity"]),
        ("rest", [*COLUMNS["body_rate"], *last]),
    ):
        graph.node("Gather", [INPUT, graph.constant(f"{name}_index", np.array(columns, np.int64))], name, axis=1)
    graph.node("Mul", ["error", graph.constant("minus", np.float32(-1))], "offset")
    shown = [graph.clip("offset", FARTHEST, "offset_shown"), rotation(graph, COLUMNS["attitude"][0])]
    shown += [graph.clip("velocity", FASTEST, "velocity_shown"), "rest"]
    graph.node("Concat", shown, "features", axis=1)
    assert weights.cell is not None
    graph.layers(weights.encoders[0], "features", ["Relu"], "dense", "dense_")
    graph.layers(weights.head, _remembered(graph, weights.cell, "dense"), ["Identity"], "rotors")
    index = graph.constant("rotor_index", np.array(ROTOR_OF, np.int64))
    graph.clip(graph.node("Gather", ["rotors", index], "unclipped", axis=1), 1.0, OUTPUT)
    inputs: dict[str, tuple[int, ...]] = {INPUT: (sum(FIELDS.values()),), MEMORY: (UNITS,)}
    return graph.whole(inputs, {OUTPUT: (OUTPUTS,), NEXT_MEMORY: (UNITS,)})


def perceptron_graph(
    features: Features,
    layers: Layers,
    operators: list[str],
    raw: bool = False,
    normal: tuple[np.ndarray, np.ndarray, float] | None = None,
    most: float = 1.0,
) -> onnx.GraphProto:
    """The graph of a multi-layer perceptron that another framework has learned.

    Args:
        features: the features that it was given in training.
        layers: weights (in, out) and biases (out,), float32.
        operators: the ONNX operator after each layer, such as Tanh or Identity.
        raw: whether it was given the observation itself instead of the features.
        normal: mean and standard deviation with which its input is normalised, and the limit to which the normalised
            input is clipped.
        most: its actions are clipped to [-most, most], at most to [-1, 1].
    """
    graph, source = Graph(), INPUT
    if not raw:
        _of_state(graph, features)
        source = "features"
    if normal is not None:
        mean, deviation, most = normal
        centred = graph.node("Sub", [source, graph.constant("mean", mean.astype(np.float32))], "centred")
        scaled = graph.node("Div", [centred, graph.constant("deviation", deviation.astype(np.float32))], "scaled")
        source = graph.clip(scaled, most, "normalised")
    graph.clip(graph.layers(layers, source, operators, "unclipped"), min(most, 1.0), OUTPUT)
    return graph.whole({INPUT: (sum(field.size for field in features.fields),)}, {OUTPUT: (len(layers[-1][1]),)})


def _encoded(graph: Graph, name: str, view: View, layers: Layers, operator: str) -> str:
    """Add the encoder of an image (see `View`), with the channels before the rows, as ONNX requires."""
    c = view.camera

    def at(what: str) -> str:
        return f"{name}_{what}"

    def number(what: str, value: float) -> str:
        return graph.constant(at(what), np.float32(value))

    if view.channels == 3:
        x = graph.node("Transpose", [name], at("planes"), perm=[0, 3, 1, 2])
    else:
        x = graph.node("Reshape", [name, graph.constant(at("planes_shape"), [0, 1, c.height, c.width])], at("planes"))
    if view.measures:
        far, measured = number("farthest", c.reach[1]), graph.node("Greater", [x, number("hole", 0)], at("measured"))
        filled = graph.node("Where", [measured, x, far], at("filled"))
        depth = graph.node("Max", [filled, number("nearest", NEAREST)], at("depth"))
        if c.encoding == "inverse":
            inverse = graph.node("Div", [number("metre", 1), depth], at("inverse"))
            x = graph.node("Sub", [inverse, number("inverse_farthest", 1 / c.reach[1])], at("encoded"))
        elif c.encoding == "log":
            x = graph.node("Log", [graph.node("Div", [far, depth], at("ratio"))], at("encoded"))
        else:
            share = graph.node("Div", [depth, far], at("share"))
            x = graph.node("Sub", [number("whole", 1), share], at("encoded"))
    cell = [c.height // view.rows, c.width // view.columns]
    if cell != [1, 1]:
        x = graph.node(
            "MaxPool" if view.measures else "AveragePool", [x], at("pooled"), kernel_shape=cell, strides=cell
        )
    if c.sees == "mask":
        norm = graph.node("ReduceL2", [x], at("norm"), axes=[1, 2, 3])
        floor = graph.node("Add", [norm, number("faintest", FAINTEST)], at("norm_and_faintest"))
        scaled = graph.node("Mul", [x, number("contrast", view.contrast)], at("scaled"))
        x = graph.node("Concat", [x, graph.node("Div", [scaled, floor], at("relative"))], at("both"), axis=1)
    channels = view.channels
    for i, (side, (weight, bias)) in enumerate(zip(view.patches, layers, strict=False)):
        kernel = np.asarray(weight).reshape(side, side, channels, -1).transpose(3, 2, 0, 1)
        named = [graph.constant(at(f"kernel_{i}"), kernel), graph.constant(at(f"kernel_bias_{i}"), bias)]
        convolved = graph.node("Conv", [x, *named], at(f"convolved_{i}"), kernel_shape=[side] * 2, strides=[side] * 2)
        x, channels = graph.node(operator, [convolved], at(f"patches_{i}")), kernel.shape[0]
    rest = layers[len(view.patches) :]
    last = graph.node("Transpose", [x], at("channels_last"), perm=[0, 2, 3, 1])
    flat = graph.node("Reshape", [last, graph.constant(at("flat_shape"), [0, rest[0][0].shape[0]])], at("flat"))
    return graph.layers(rest, flat, [operator] * len(rest), at("seen"), f"{name}_")


def _remembered(graph: Graph, cell: Gru, source: str) -> str:
    """Add the next memory: `Gru`, gate by gate. ONNX's own GRU operator crashes the process for an empty batch."""
    names = {f"gru_{name}": value for name, value in vars(cell).items()}
    weight, recurrent, bias, recurrent_bias = (graph.constant(name, value) for name, value in names.items())
    graph.node("Gemm", [source, weight, bias], "gates_of_input")
    graph.node("Gemm", [MEMORY, recurrent, recurrent_bias], "gates_of_memory")
    for of in ("input", "memory"):
        parts = [f"{gate}_of_{of}" for gate in ("update", "reset", "candidate")]
        graph.nodes.append(helper.make_node("Split", [f"gates_of_{of}"], parts, axis=1))
    for gate in ("update", "reset"):
        both = graph.node("Add", [f"{gate}_of_input", f"{gate}_of_memory"], f"{gate}_sum")
        graph.node("Sigmoid", [both], gate)
    graph.node("Mul", ["reset", "candidate_of_memory"], "candidate_recalled")
    graph.node("Tanh", [graph.node("Add", ["candidate_of_input", "candidate_recalled"], "candidate_sum")], "candidate")
    # (1 - update) candidate + update memory
    change = graph.node("Sub", [MEMORY, "candidate"], "memory_less_candidate")
    return graph.node("Add", ["candidate", graph.node("Mul", ["update", change], "kept")], NEXT_MEMORY)


def _of_state(graph: Graph, features: Features) -> None:
    """Add the computation of `features` from `observation`, see `Features.of_state`."""
    starts = np.cumsum([0, *(field.size for field in features.fields)])
    columns = [(field, list(range(a, a + field.size))) for field, a in zip(features.fields, starts, strict=False)]
    attitude = next(where[0] for field, where in columns if field.frame == "world_body")
    vectors = [i for field, where in columns if field.frame == "world" for i in where]
    rest = [i for field, where in columns if field.frame in ("body", "none") for i in where]
    # `parts` holds the rotated vectors, the up axis and the rest side by side; `order` puts them into the order of the
    # fields; the up axis has three numbers and no scale, and takes the place of the attitude's first three numbers
    place = {column: p for p, column in enumerate([*vectors, *range(attitude, attitude + 3), *rest])}
    order = [place[i] for _, where in columns for i in where if i in place]
    scale = [1.0 if f.frame == "world_body" else f.scale for f, where in columns for i in where if i in place]

    rotation(graph, attitude)
    for name, index in (("up_index", [6, 7, 8]), ("rest_index", rest), ("order", order)):
        graph.constant(name, np.array(index, np.int64))
    graph.constant("scale", np.array(scale, np.float32))
    graph.node("Gather", ["R_flat", "up_index"], "up", axis=1)
    turned(graph, vectors)
    graph.node("Gather", [INPUT, "rest_index"], "rest", axis=1)
    graph.node("Concat", ["turned", "up", "rest"], "parts", axis=1)
    graph.node("Gather", ["parts", "order"], "ordered", axis=1)
    graph.node("Div", ["ordered", "scale"], "features")


def rotation(graph: Graph, attitude: int) -> str:
    """Add `R_flat`, (n, 9): the rotation from body to world, row by row, of the quaternion that begins in a column of
    the observation.
    """
    table = np.zeros((len(_PAIRS), 9), np.float32)
    for entry, terms in enumerate(_R_WORLD_BODY):
        for sign, pair in ((terms[0], terms[1:3]), (terms[3], terms[4:6])):
            table[_PAIRS.index(pair), entry] = 2.0 if sign == "+" else -2.0
    for name, i in (("first_index", 0), ("second_index", 1)):
        columns = [attitude + "wxyz".index(pair[i]) for pair in _PAIRS]
        graph.constant(name, np.array(columns, np.int64))
    graph.constant("table", table)
    graph.constant("identity", np.eye(3, dtype=np.float32).reshape(9))
    graph.node("Gather", [INPUT, "first_index"], "first", axis=1)
    graph.node("Gather", [INPUT, "second_index"], "second", axis=1)
    graph.node("Mul", ["first", "second"], "products")
    return graph.node("Gemm", ["products", "table", "identity"], "R_flat")


def turned(graph: Graph, vectors: list[int]) -> str:
    """Add `turned`: vectors of the world in these columns of the observation, three for each, in the axes of the body.
    It needs `rotation`.
    """
    for name, index in (
        ("vectors_index", vectors),
        ("matrix_shape", [0, 3, 3]),  # 0: as it is
        ("vectors_shape", [0, len(vectors) // 3, 3]),
        ("flat_shape", [0, len(vectors)]),
    ):
        graph.constant(name, np.array(index, np.int64))
    graph.node("Reshape", ["R_flat", "matrix_shape"], "R_world_body")
    graph.node("Gather", [INPUT, "vectors_index"], "vectors_flat", axis=1)
    graph.node("Reshape", ["vectors_flat", "vectors_shape"], "vectors_world")
    # vectors are rows: v^T R_world_body is R_body_world v
    graph.node("MatMul", ["vectors_world", "R_world_body"], "vectors_body")
    return graph.node("Reshape", ["vectors_body", "flat_shape"], "turned")
