"""Export a policy: features, network and squashing as one ONNX graph that carries its contract."""

from pathlib import Path
from typing import Any

import jax
import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from e2efly import __version__
from e2efly.config import TrainConfig
from e2efly.deploy.contract import CONTRACT_VERSION, METADATA_KEY, Action, Contract
from e2efly.deploy.policy import INPUT, OUTPUT, load_policy
from e2efly.env import Env
from e2efly.learn.checkpoint import write_atomically
from e2efly.learn.networks import Features, Layers, policy
from e2efly.observation import Field
from e2efly.physics import COMMAND_MODES, command_limits
from e2efly.vehicles import load_vehicle
from e2efly.vehicles.vehicle import quantities

OPSET, IR_VERSION = 17, 8
"""Old enough for the ONNX Runtime of any companion computer in use."""
_OPERATORS = {"relu": "Relu", "tanh": "Tanh", "elu": "Elu"}
_PAIRS = ("xx", "yy", "zz", "xy", "xz", "yz", "wx", "wy", "wz")
_R_WORLD_BODY = ("-yy-zz", "+xy-wz", "+xz+wy", "+xy+wz", "-xx-zz", "+yz-wx", "+xz-wy", "+yz+wx", "-xx-yy")
"""Row by row, half of R_world_body less the identity, as sums of products of quaternion entries."""


def contract_of(env: Env, config: TrainConfig) -> Contract:
    """The contract of a policy of this environment.

    Args:
        env: the environment that the policy was trained in.
        config: the run's; its `env` is what `env` was built from, and has the exact numbers.

    Raises:
        ValueError: when `env` was not built from `config.env` and the vehicle as it is now, naming the field.
    """
    about, physics = config.env, env.physics
    vehicle, mode = load_vehicle(about.vehicle), COMMAND_MODES[about.command_mode]
    rate = vehicle.control_rate if about.control_rate is None else about.control_rate
    low, high = command_limits(mode, vehicle, about.position_range)
    _same("command_mode", physics.command_mode, mode.name)
    _same("control_period", physics.control_period, 1 / rate)
    for name in (field.name for field in quantities()):
        _same(f"vehicle {vehicle.name}: {name}", getattr(physics.nominal, name), getattr(vehicle, name))
    _same("position_range (centre of the commands)", env.center, (low + high) / 2)
    _same("position_range (half range of the commands)", env.half, (high - low) / 2)
    latency = _decimals(env.latency_range)
    limits = (tuple(map(float, low)), tuple(map(float, high)))
    return Contract(
        contract_version=CONTRACT_VERSION,
        e2efly_version=__version__,
        task=env.task.name,
        vehicle=vehicle.name,
        vehicle_hash=vehicle.hash,
        control_rate_hz=float(rate),
        latency_s=sum(latency) / 2,
        latency_range_s=latency,
        observation_latency_range_s=_decimals(env.observation_latency_range),
        observation=env.fields,
        action=Action(mode.name, mode.fields, mode.units, *limits),
        hover_action=_decimals(env.hover),
    )


def export_policy(path: Path, layers: Layers, features: Features, activation: str, contract: Contract) -> None:
    """Write a policy as ONNX, atomically: float32 `observation` (n, o) -> `action` (n, 4) in [-1, 1].

    Args:
        path: where to.
        layers: weights (inputs, outputs) and biases of the network.
        features: what the network is fed, made of the observation inside the graph.
        activation: relu, tanh or elu, of the hidden layers.
        contract: what the file says of itself.

    Raises:
        ValueError: naming what does not fit together: layers, features, activation or contract.
        OSError: when the file cannot be written.
    """
    about = contract.to_json()
    if contract.observation != features.fields:
        raise ValueError(
            f"contract.observation is {contract.observation}; accepted: the fields of the features, {features.fields}"
        )
    arrays = [(np.asarray(weight, np.float32), np.asarray(bias, np.float32)) for weight, bias in layers]
    _check(arrays, features, activation)
    size = contract.observation_size
    nodes, constants = _feature_nodes(features)
    for i, (weight, bias) in enumerate(arrays):
        constants |= {f"weight_{i}": weight, f"bias_{i}": bias}
        source = f"hidden_{i}" if i else "features"
        nodes.append(helper.make_node("Gemm", [source, f"weight_{i}", f"bias_{i}"], [f"linear_{i}"]))
        last = i == len(arrays) - 1
        operator, target = ("Tanh", OUTPUT) if last else (_OPERATORS[activation], f"hidden_{i + 1}")
        nodes.append(helper.make_node(operator, [f"linear_{i}"], [target]))
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info(INPUT, TensorProto.FLOAT, ["n", size])],
        [helper.make_tensor_value_info(OUTPUT, TensorProto.FLOAT, ["n", 4])],
        [numpy_helper.from_array(np.ascontiguousarray(value), name) for name, value in constants.items()],
    )
    model = helper.make_model(
        graph,
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
        producer_name="e2efly",
        producer_version=contract.e2efly_version,
    )
    helper.set_model_props(model, {METADATA_KEY: about})
    onnx.checker.check_model(model, full_check=True)
    write_atomically(Path(path), model.SerializeToString())


def parity(
    path: Path, layers: Layers, features: Features, activation: str, count: int = 10_000, seed: int = 0
) -> float:
    """The largest absolute difference between an exported policy and the one it was exported from.

    Args:
        path: the `policy.onnx`, run as on the vehicle.
        layers: as for `export_policy`.
        features: as for `export_policy`.
        activation: as for `export_policy`.
        count: how many random observations.
        seed: of the observations.

    Returns:
        The difference of actions, whose range is [-1, 1].
    """
    observation = random_observations(np.random.default_rng(seed), features.fields, count)
    wanted = jax.jit(lambda layers, x: policy(layers, features(x), activation))(layers, observation)
    return float(np.max(np.abs(load_policy(path).act(observation) - np.asarray(wanted))))


def random_observations(rng: np.random.Generator, fields: tuple[Field, ...], count: int) -> np.ndarray:
    """Float32 (count, o): any attitude, past actions all over their range, the rest normal, of twice its scale."""

    def draw(field: Field) -> np.ndarray:
        if field.frame == "none":
            return rng.uniform(-field.scale, field.scale, (count, field.size))
        normal = rng.standard_normal((count, field.size))
        if field.frame == "world_body":
            return normal / np.linalg.norm(normal, axis=-1, keepdims=True)
        return 2 * field.scale * normal

    return np.concatenate([draw(field) for field in fields], axis=-1).astype(np.float32)


def _feature_nodes(features: Features) -> tuple[list[onnx.NodeProto], dict[str, np.ndarray]]:
    """The nodes from `observation` to `features` and their constants: `Features` again, for ONNX."""
    starts = np.cumsum([0, *(field.size for field in features.fields)])
    columns = [(field, list(range(a, a + field.size))) for field, a in zip(features.fields, starts, strict=False)]
    attitude = next(where[0] for field, where in columns if field.frame == "world_body")
    vectors = [i for field, where in columns if field.frame == "world" for i in where]
    rest = [i for field, where in columns if field.frame in ("body", "none") for i in where]
    # turned vectors, up and the rest lie side by side in `parts`; `order` puts them into the order of the fields,
    # up, of three numbers and no scale, in the place of the attitude's first three
    place = {column: p for p, column in enumerate([*vectors, *range(attitude, attitude + 3), *rest])}
    order = [place[i] for _, where in columns for i in where if i in place]
    scale = [1.0 if f.frame == "world_body" else f.scale for f, where in columns for i in where if i in place]

    table = np.zeros((len(_PAIRS), 9), np.float32)
    for entry, terms in enumerate(_R_WORLD_BODY):
        for sign, pair in ((terms[0], terms[1:3]), (terms[3], terms[4:6])):
            table[_PAIRS.index(pair), entry] = 2.0 if sign == "+" else -2.0
    first, second = ([attitude + "wxyz".index(pair[i]) for pair in _PAIRS] for i in (0, 1))
    constants: dict[str, Any] = {
        "first_index": first,
        "second_index": second,
        "up_index": [6, 7, 8],
        "vectors_index": vectors,
        "rest_index": rest,
        "order": order,
        "matrix_shape": [0, 3, 3],  # 0: as it is
        "vectors_shape": [0, len(vectors) // 3, 3],
        "flat_shape": [0, len(vectors)],
    }
    constants = {name: np.array(value, np.int64) for name, value in constants.items()}
    floats = {"table": table, "identity": np.eye(3).reshape(9), "scale": scale}
    constants |= {name: np.array(value, np.float32) for name, value in floats.items()}

    def gather(data: str, index: str, output: str) -> onnx.NodeProto:
        return helper.make_node("Gather", [data, index], [output], axis=1)

    nodes = [
        gather(INPUT, "first_index", "first"),
        gather(INPUT, "second_index", "second"),
        helper.make_node("Mul", ["first", "second"], ["products"]),
        helper.make_node("Gemm", ["products", "table", "identity"], ["R_flat"]),
        gather("R_flat", "up_index", "up"),
        helper.make_node("Reshape", ["R_flat", "matrix_shape"], ["R_world_body"]),
        gather(INPUT, "vectors_index", "vectors_flat"),
        helper.make_node("Reshape", ["vectors_flat", "vectors_shape"], ["vectors_world"]),
        # vectors are rows: v^T R_world_body is R_body_world v
        helper.make_node("MatMul", ["vectors_world", "R_world_body"], ["vectors_body"]),
        helper.make_node("Reshape", ["vectors_body", "flat_shape"], ["turned"]),
        gather(INPUT, "rest_index", "rest"),
        helper.make_node("Concat", ["turned", "up", "rest"], ["parts"], axis=1),
        gather("parts", "order", "ordered"),
        helper.make_node("Div", ["ordered", "scale"], ["features"]),
    ]
    return nodes, constants


def _check(layers: list[tuple[np.ndarray, np.ndarray]], features: Features, activation: str) -> None:
    if activation not in _OPERATORS:
        raise ValueError(f"activation is {activation!r}; accepted: {', '.join(_OPERATORS)}")
    size = features.size
    for i, (weight, bias) in enumerate(layers):
        outputs = 4 if i == len(layers) - 1 else bias.size
        if weight.shape != (size, outputs) or bias.shape != (outputs,):
            raise ValueError(
                f"layers[{i}] has shapes {weight.shape} and {bias.shape}; accepted: "
                f"({size}, {outputs}) and ({outputs},)"
            )
        if not (np.isfinite(weight).all() and np.isfinite(bias).all()):
            raise ValueError(f"layers[{i}] is not finite; accepted: finite numbers (did the training diverge?)")
        size = outputs
    if not layers:
        raise ValueError("layers is empty; accepted: at least one layer")


def _same(name: str, has: Any, wanted: Any) -> None:
    """Equal, up to the rounding of the environment's type."""
    same = has == wanted if isinstance(wanted, str) else np.allclose(has, wanted, rtol=1e-6, atol=0.0)
    if not same:
        raise ValueError(f"{name} of the environment is {has}; its configuration and vehicle say {wanted}")


def _decimals(values: Any) -> tuple[float, ...]:
    """The shortest decimal numbers that round to these, so that 0.03 in float32 reads 0.03."""
    return tuple(float(str(value)) for value in np.asarray(values))
