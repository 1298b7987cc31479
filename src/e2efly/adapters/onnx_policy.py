"""An ONNX file of another program as a policy.onnx: the contract beside it says what it sees and what it commands.

The new file holds the other's nodes between two conversions: from our observation to what they see, and from what they
return to an action. It is checked like every policy, and flown, evaluated and validated like one.
"""

import dataclasses
import json
from dataclasses import MISSING, dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import onnx
from onnx import helper, numpy_helper

from e2efly.config import EnvConfig, NetworkConfig
from e2efly.config.names import unknown
from e2efly.config.storage import unique
from e2efly.control import COMMAND_MODES
from e2efly.environment import Env
from e2efly.learning.onnx_export import contract_of, write_policy
from e2efly.learning.onnx_layers import Graph, rotation, turned
from e2efly.policy import contract_json as read
from e2efly.policy.loader import INPUT, OUTPUT, load_policy
from e2efly.policy.observation import PAST_ACTIONS, Field
from e2efly.policy.onnx_file import file_content
from e2efly.runs import presets

OPSETS = range(13, 23)
"""Versions of ONNX's operators whose definitions are those of ours, as far as a policy may hold them."""
FORMS = {
    "quaternion": [9, 10, 11, 12], "quaternion_xyzw": [10, 11, 12, 9], "matrix": list(range(9)),
    "matrix_columns": [0, 3, 6, 1, 4, 7, 2, 5, 8], "up": [6, 7, 8],
}  # fmt: skip
"""How an attitude is shown: as a quaternion wxyz or xyzw, as the rotation from body to world by rows or by columns, or
as the world's up axis in the body frame. Columns of that rotation by rows, and of the quaternion after it."""
T = TypeVar("T")


@dataclass(frozen=True)
class NetworkInput:
    """A part of what a network of another program sees."""

    field: str
    """A field of the observation of the task."""
    frame: str = "world"
    """Of vectors of the world: world, or body, which turns them into the body frame."""
    form: str = "quaternion"
    """Of the attitude: one of `FORMS`."""
    scale: float = 1.0
    """Factor on the numbers. -1 turns a position error into the position relative to the target."""


@dataclass(frozen=True)
class NetworkOutput:
    """What a network of another program returns."""

    mode: str
    """A command mode."""
    low: tuple[float, ...]
    """Command at the lower limit, in the units of the mode."""
    high: tuple[float, ...]
    """Command at the upper limit."""
    limits: tuple[float, ...] = (-1.0, 1.0)
    """Its numbers are clipped to these limits."""
    order: tuple[int, ...] = (0, 1, 2, 3)
    """For each number of our command, in the order of the mode, its place in the output."""


@dataclass(frozen=True)
class ForeignContract:
    """The file NAME.contract.json beside NAME.onnx."""

    task: str
    """Name or reference of the task."""
    vehicle: str
    """Name or .toml file of the vehicle for which it was trained."""
    control_rate_hz: float
    """Rate at which it is called, Hz."""
    observation: tuple[NetworkInput, ...]
    """What it sees, in its order."""
    action: NetworkOutput
    """What it returns."""
    past_actions: int = 0
    """Number of its own last outputs that `past_actions` shows."""
    latency_range_s: tuple[float, ...] = ()
    """Smallest and largest latency of its training, s. If left out, the vehicle's own."""


def read_contract(path: Path) -> ForeignContract:
    """The contract in a file.

    Raises:
        ValueError: naming the file, the field, its value and what is accepted.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"), object_pairs_hook=unique)
        return _contract(content)
    except (OSError, ValueError, RecursionError) as error:
        raise ValueError(f"{path}: {error}") from None


def _contract(content: Any) -> ForeignContract:
    found = _object(content, "", ForeignContract)
    action = _object(found["action"], "action", NetworkOutput)
    mode = read.one_of(action["mode"], "action.mode", COMMAND_MODES)
    low, high = (read.numbers(action[name], f"action.{name}", 4) for name in ("low", "high"))
    limits = read.numbers(action["limits"], "action.limits", 2)
    for name, (less, more) in {"low": (low, high), "limits": (limits[:1], limits[1:])}.items():
        if not all(a < b for a, b in zip(less, more, strict=True)):
            raise read.refusal(f"action.{name}", action[name], "numbers that rise, from action.low to action.high")
    order = tuple(action["order"]) if isinstance(action["order"], list) else ()
    if sorted(map(repr, order)) != ["0", "1", "2", "3"]:
        raise read.refusal("action.order", action["order"], "the places 0, 1, 2, 3, each once")
    entries = read.entries(found["observation"], "observation", None)
    latency = found["latency_range_s"]
    return ForeignContract(
        task=read.text(found["task"], "task"),
        vehicle=read.text(found["vehicle"], "vehicle"),
        control_rate_hz=read.number(found["control_rate_hz"], "control_rate_hz"),
        observation=tuple(_shown(entry, f"observation[{i}]") for i, entry in enumerate(entries)),
        action=NetworkOutput(mode, low, high, limits, order),
        past_actions=read.whole(found["past_actions"], "past_actions", 0),
        latency_range_s=read.seconds_range(latency, "latency_range_s") if latency else (),
    )


def _shown(value: Any, where: str) -> NetworkInput:
    x = _object(value, where, NetworkInput)
    return NetworkInput(
        field=read.text(x["field"], f"{where}.field"),
        frame=read.one_of(x["frame"], f"{where}.frame", ("world", "body")),
        form=read.one_of(x["form"], f"{where}.form", FORMS),
        scale=read.number(x["scale"], f"{where}.scale"),
    )


def _object(value: Any, where: str, kind: type) -> dict[str, Any]:
    """A JSON object with the fields of a dataclass; those that have a default may be left out."""
    fields, prefix = dataclasses.fields(kind), f"{where}." if where else ""
    known, required = [field.name for field in fields], [field.name for field in fields if field.default is MISSING]
    if not isinstance(value, dict):
        raise read.refusal(where or "contract", value, f"an object with {', '.join(required)}")
    for key in value:
        if key not in known:
            raise ValueError("contract: " + unknown("key", prefix + key, [prefix + name for name in known]))
    if missing := [prefix + key for key in required if key not in value]:
        raise ValueError(f"contract: lacks {', '.join(missing)}; accepted: all of {', '.join(required)}")
    usual = {field.name: field.default for field in fields}
    return {name: list(x) if isinstance(x, tuple) else x for name, x in usual.items()} | value


def adopt(file: Path, contract: Path, target: Path) -> ForeignContract:
    """Write an ONNX file of another program, with its contract, as a policy.onnx.

    Args:
        file: one float32 input (n, k), one output (n, 4), and nodes that a policy may hold. `Gemm` in its other forms,
            `MatMul` by constants, `Flatten` and `Constant` are rewritten as such.
        contract: its contract: `ForeignContract` as JSON.
        target: the file to write.

    Returns:
        The contract.

    Raises:
        ValueError: naming the file, the field or the node, its value and what is accepted.
        OSError: when the target cannot be written.
    """
    said = read_contract(contract)
    try:
        preset = presets.preset(said.task, "ppo")
        if preset.env.cameras:
            raise ValueError(f"contract: task is {said.task!r}, which is flown by sight; accepted: one that is not")
        config = dataclasses.replace(preset, env=_env(said, preset.env), network=NetworkConfig())
        env = Env.of(config.task, config.reward, config.env)
        select = _selection(said, env.fields)
    except ValueError as error:
        raise ValueError(f"{contract}: {error}") from None
    try:
        graph = _graph(_model(file), said, env.fields, select)
        write_policy(target, graph, contract_of(env, config), trusted=False)
        load_policy(target)
    except (ValueError, onnx.checker.ValidationError, onnx.shape_inference.InferenceError) as error:
        target.unlink(missing_ok=True)
        raise ValueError(f"{file}: {error}") from None
    return said


def _env(said: ForeignContract, usual: EnvConfig) -> EnvConfig:
    """The environment of its training, as far as a contract says it."""
    low, high = said.action.low, said.action.high
    return EnvConfig(
        vehicle=said.vehicle,
        command_mode=said.action.mode,
        control_rate=said.control_rate_hz,
        action_latency=(said.latency_range_s[0], said.latency_range_s[1]) if said.latency_range_s else None,
        command_range=((low[0], low[1], low[2], low[3]), (high[0], high[1], high[2], high[3])),
        past_actions=said.past_actions,
        payload=usual.payload,
    )


def _selection(said: ForeignContract, fields: tuple[Field, ...]) -> tuple[np.ndarray, np.ndarray]:
    """The matrix (9 + o + b, k) and the bias (k,) from the rotation, our observation of `o` numbers and its `b` numbers
    of vectors in the body frame, side by side, to what it sees.
    """
    starts = dict(zip((f.name for f in fields), np.cumsum([0, *(f.size for f in fields)]).tolist(), strict=False))
    by_name, world = {f.name: f for f in fields}, [f for f in fields if f.frame == "world"]
    size = sum(f.size for f in fields)
    in_body = dict(zip((f.name for f in world), np.cumsum([9 + size, *(f.size for f in world)]).tolist(), strict=False))
    (low, high), rows, bias = said.action.limits, list[np.ndarray](), list[float]()
    total = 9 + size + sum(f.size for f in world)
    attitude = next(9 + starts[f.name] for f in fields if f.frame == "world_body")
    for i, part in enumerate(said.observation):
        if part.field not in by_name:
            raise ValueError(f"contract: observation[{i}].field: " + unknown("field", part.field, by_name))
        field, factor, offset = by_name[part.field], part.scale, 0.0
        columns = [9 + starts[field.name] + j for j in range(field.size)]
        if field.frame == "world_body":
            columns = [j if j < 9 else attitude + j - 9 for j in FORMS[part.form]]
        elif field.frame == "world" and part.frame == "body":
            columns = [in_body[field.name] + j for j in range(field.size)]
        elif field.name == PAST_ACTIONS:  # back to its own limits and its own order
            back = np.argsort(said.action.order).tolist()
            columns = [columns[j - j % 4 + back[j % 4]] for j in range(field.size)]
            factor, offset = part.scale * (high - low) / 2, part.scale * (high + low) / 2
        rows += [factor * np.eye(total)[column] for column in columns]
        bias += [offset] * len(columns)
    return np.array(rows, np.float32).T, np.array(bias, np.float32)


def _model(file: Path) -> onnx.ModelProto:
    """The model of a file, whose numbers are all in it."""
    try:
        model = onnx.load_model_from_string(file_content(file))
    except ValueError:
        raise
    except Exception as error:  # protobuf's errors share no other base
        raise ValueError(f"not an ONNX file: {error}") from None
    versions = [entry.version for entry in model.opset_import if entry.domain in ("", "ai.onnx")]
    if len(versions) != 1 or versions[0] not in OPSETS:
        raise ValueError(f"has operators of the versions {versions}; accepted: {OPSETS[0]} to {OPSETS[-1]}")
    return model


def _graph(
    model: onnx.ModelProto, said: ForeignContract, fields: tuple[Field, ...], select: tuple[np.ndarray, np.ndarray]
) -> onnx.GraphProto:
    graph, theirs, size = Graph(), model.graph, sum(field.size for field in fields)
    starts = np.cumsum([0, *(field.size for field in fields)]).tolist()
    columns = {field: range(start, start + field.size) for field, start in zip(fields, starts, strict=False)}
    rotation(graph, next(where[0] for field, where in columns.items() if field.frame == "world_body"))
    turned(graph, [column for field, where in columns.items() if field.frame == "world" for column in where])
    graph.node("Concat", ["R_flat", INPUT, "turned"], "known", axis=1)
    held = {tensor.name: tensor for tensor in theirs.initializer}
    inputs, outputs = [x for x in theirs.input if x.name not in held], list(theirs.output)
    if len(inputs) != 1 or len(outputs) != 1:
        has = ", ".join(x.name for x in (*inputs, *outputs))
        raise ValueError(f"has the inputs and outputs {has}; accepted: one input and one output, without a memory")
    axes = [axis.dim_value for axis in inputs[0].type.tensor_type.shape.dim]
    if len(axes) != 2 or axes[1] not in (0, len(select[1])):
        raise ValueError(
            f"takes {axes} numbers; accepted: ({axes[0] or 'n'}, {len(select[1])}), as observation of its contract says"
        )
    shown = [graph.constant("select", select[0]), graph.constant("select_bias", select[1])]
    graph.node("Gemm", ["known", *shown], _theirs(inputs[0].name))
    constants = {name: _constant(tensor) for name, tensor in held.items()}
    for node in theirs.node:
        _take(graph, node, constants)
    low, high = said.action.limits
    order = np.eye(4, dtype=np.float32)[list(said.action.order)].T * np.float32(2 / (high - low))
    shift = np.full(4, -(high + low) / (high - low), np.float32)
    last = [graph.constant("order_of_action", order), graph.constant("shift_of_action", shift)]
    graph.clip(graph.node("Gemm", [_theirs(outputs[0].name), *last], "unclipped"), 1.0, OUTPUT)
    return graph.whole({INPUT: (size,)}, {OUTPUT: (4,)})


def _take(graph: Graph, node: onnx.NodeProto, constants: dict[str, np.ndarray]) -> None:
    """Add a node of the other graph, in the form in which a policy holds it."""
    given = {entry.name: helper.get_attribute_value(entry) for entry in node.attribute}
    names, target = list(node.input), _theirs(node.output[0]) if node.output else ""
    if node.op_type == "Constant" and "value" in given:
        constants[node.output[0]] = _constant(given["value"])
    elif node.op_type == "Flatten" and given.get("axis", 1) == 1:
        graph.node("Identity", [_used(graph, names[0], constants)], target)
    elif node.op_type in ("Gemm", "MatMul") and names[1] in constants and not given.get("transA", 0):
        weight = constants[names[1]].T if given.get("transB", 0) else constants[names[1]]
        bias = constants[names[2]] if len(names) > 2 and names[2] in constants else np.zeros(weight.shape[-1:])
        layer = [
            graph.constant(f"{target}_weight", np.float32(given.get("alpha", 1.0)) * weight),
            graph.constant(f"{target}_bias", np.float32(given.get("beta", 1.0)) * bias.astype(weight.dtype)),
        ]
        graph.node("Gemm", [_used(graph, names[0], constants), *layer], target)
    else:
        used = [_used(graph, name, constants) for name in names]
        graph.nodes.append(
            helper.make_node(node.op_type, used, [_theirs(x) for x in node.output], domain=node.domain, **given)
        )


def _used(graph: Graph, name: str, constants: dict[str, np.ndarray]) -> str:
    """The name in our graph of what a node of the other reads."""
    return graph.constant(_theirs(name), constants[name]) if name in constants else _theirs(name)


def _constant(tensor: onnx.TensorProto) -> np.ndarray:
    if tensor.data_location == onnx.TensorProto.EXTERNAL:
        raise ValueError(f"constant {tensor.name!r} is in another file; accepted: numbers inside of the file")
    return numpy_helper.to_array(tensor)


def _theirs(name: str) -> str:
    """A name of the other graph in ours."""
    return f"given_{name}"
