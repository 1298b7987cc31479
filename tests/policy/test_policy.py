"""Loading `policy.onnx` and acting with it, without JAX."""

import ast
import dataclasses
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

import e2efly
from e2efly.config import NetworkConfig
from e2efly.environment import Env
from e2efly.learning.networks import Actor, Weights
from e2efly.learning.onnx_export import contract_of, export_policy
from e2efly.policy.contract import METADATA_KEY
from e2efly.policy.loader import Policy, load_policy, sealed_policy
from e2efly.policy.onnx_file import sealed
from e2efly.policy.random_inputs import random_observations
from e2efly.policy.zoo import policy_file
from e2efly.runs import presets
from e2efly.vehicles.loading import load_vehicle
from tests.policy.made import made

Change = Callable[[onnx.ModelProto], None]


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A random hovering policy."""
    return made(tmp_path_factory.mktemp("policy") / "policy.onnx", 1.0, hovers=False)


@pytest.fixture(scope="module")
def policy(path: Path) -> Policy:
    return load_policy(path)


@pytest.fixture(scope="module")
def observations(policy: Policy) -> np.ndarray:
    return random_observations(np.random.default_rng(3), policy.contract.observation, 50)


@pytest.fixture
def edited(path: Path, tmp_path: Path) -> Callable[[Change], Path]:
    """Write the policy with a change of its model."""

    def edit(change: Change) -> Path:
        model = onnx.load(str(path))
        change(model)
        out = tmp_path / "edited.onnx"
        out.write_bytes(sealed(model.SerializeToString()))
        return out

    return edit


def test_a_batch_and_its_rows_act_alike(policy: Policy, observations: np.ndarray) -> None:
    batch, memory = policy.act(observations)
    assert memory.shape == (50, 0)
    assert batch.shape == (50, 4)
    assert batch.dtype == np.float32
    assert np.ptp(batch) > 0.5
    for row, action in zip(observations, batch, strict=True):
        single, _ = policy.act(row)
        assert single.shape == (4,)
        np.testing.assert_allclose(single, action, atol=1e-6)
    assert policy.act(observations[:0])[0].shape == (0, 4)


def test_other_number_types_are_taken(policy: Policy, observations: np.ndarray) -> None:
    np.testing.assert_array_equal(policy.act(observations.astype(np.float64))[0], policy.act(observations)[0])
    level = np.array([0, 0, 0, 1, *[0] * (observations.shape[1] - 4)])
    np.testing.assert_array_equal(policy.act(level)[0], policy.act(level.astype(np.float32))[0])
    np.testing.assert_array_equal(policy.act(observations[::2, ::1])[0], policy.act(observations[::2].copy())[0])


def test_saturated_actions_stay_in_range(tmp_path: Path) -> None:
    """Some arguments between 8 and 9 bring ONNX Runtime's tanh to 1.0000001."""
    config = presets.preset("hover", "ppo")
    env = Env.of(config.task, config.reward, config.env)
    actor, path = Actor.of(env.fields, (), NetworkConfig(())), tmp_path / "policy.onnx"
    weight = np.zeros((actor.features.size, 4), np.float32)
    weight[0] = [1, -1, 1, -1]
    export_policy(path, Weights((), None, [(weight, np.zeros(4, np.float32))]), actor, contract_of(env, config))
    x = np.zeros((2000, env.observation_size), np.float32)
    x[:, 0], x[:, 3] = np.linspace(0.0, 20.0, 2000), 1.0
    assert np.abs(load_policy(path).act(x)[0]).max() == 1.0


def test_command_is_the_mapping(policy: Policy) -> None:
    low, high = np.array(policy.contract.action.low), np.array(policy.contract.action.high)
    np.testing.assert_array_equal(policy.command(np.full(4, -1.0)), low)
    np.testing.assert_array_equal(policy.command(np.full(4, 1.0)), high)
    np.testing.assert_allclose(policy.command(np.zeros((2, 4))), [(low + high) / 2] * 2)
    np.testing.assert_allclose(policy.command(np.full(4, 0.5)), low + 0.75 * (high - low))
    np.testing.assert_array_equal(
        policy.command(np.array([-3.0, 3.0, 0.0, -1.1]))[[0, 1, 3]], [low[0], high[1], low[3]]
    )
    assert policy.command(np.array(policy.contract.hover_action))[0] == pytest.approx(9.81, rel=1e-6)


@pytest.mark.parametrize("action", [np.zeros(3), np.zeros((2, 5)), np.float64(0), np.array([0, np.nan, 0, 0])])
def test_a_broken_action_is_refused(policy: Policy, action: np.ndarray) -> None:
    with pytest.raises(ValueError, match=r"^action .*; accepted: "):
        policy.command(action)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e39])
def test_a_non_finite_observation_names_its_field(policy: Policy, observations: np.ndarray, value: float) -> None:
    for field in policy.contract.observation:
        x = observations.astype(np.float64)
        x[7, policy.contract.slices[field.name].stop - 1] = value
        with pytest.raises(ValueError, match=rf"^observation\[7\]: field '{field.name}' is .*accepted: finite"):
            policy.act(x)
        with pytest.raises(ValueError, match=rf"^observation: field '{field.name}' is"):
            policy.act(x[7])


@pytest.mark.parametrize(
    ("count", "message"),
    [(2, "breaks off in field 'position_error'"), (13, "breaks off in field 'past_actions'"), (23, "2 too many after")],
)
def test_a_wrong_size_names_the_field(policy: Policy, count: int, message: str) -> None:
    with pytest.raises(ValueError, match=rf"shape \({count},\).*position_error 3, attitude 4.*{message}"):
        policy.act(np.zeros(count, np.float32))


@pytest.mark.parametrize("x", [np.zeros((1, 1, 21)), np.float32(1), np.full(21, "a"), np.full(21, None), np.zeros(0)])
def test_what_is_no_vector_of_numbers_is_refused(policy: Policy, x: np.ndarray) -> None:
    with pytest.raises(ValueError, match="observation has shape"):
        policy.act(x)


@pytest.mark.parametrize("length", [0.0, 0.9, 1.1, 1e30])
def test_an_attitude_that_is_no_unit_quaternion_is_refused(
    policy: Policy, observations: np.ndarray, length: float
) -> None:
    x = observations.copy()
    x[4, 3:7] *= length
    with pytest.raises(ValueError, match=r"^observation\[4\]: field 'attitude' is .*unit quaternion"):
        policy.act(x)


def test_an_overflow_in_the_network_is_refused(policy: Policy, observations: np.ndarray) -> None:
    x = observations[0].copy()
    x[:3] = 3e38
    with pytest.raises(ValueError, match="far outside of what flies"):
        policy.act(x)


def test_one_thread(policy: Policy) -> None:
    options = policy.session.get_session_options()
    assert (options.intra_op_num_threads, options.inter_op_num_threads) == (1, 1)


def test_what_agrees_is_loaded(path: Path) -> None:
    vehicle = load_vehicle("vis_r")
    policy = load_policy(path, task="hover", vehicle=vehicle, control_rate_hz=30, command_mode="ctbr")
    assert policy.contract.vehicle_hash == vehicle.hash


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ({"task": "race"}, "task is 'race'; accepted: 'hover', for which"),
        ({"vehicle": load_vehicle("vis_h")}, "mass of vehicle 'vis_h' is 0.47 kg, 37 % less than the 0.75 kg of"),
        ({"control_rate_hz": 50.0}, "control_rate is 50.0 Hz; accepted: 30 Hz, at which"),
        ({"control_rate_hz": np.nan}, "control_rate is nan Hz; accepted: 30 Hz, at which"),
        ({"command_mode": "velocity"}, "command_mode is 'velocity'; accepted: 'ctbr', for which"),
    ],
)
def test_a_mismatch_is_refused(path: Path, wanted: dict, message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(f"{path}: {message}")):
        load_policy(path, **wanted)


def test_a_changed_vehicle_is_refused(path: Path) -> None:
    vehicle = dataclasses.replace(load_vehicle("vis_r"), mass=0.76)
    message = "mass of vehicle 'vis_r' is 0.76 kg, 1 % more than the 0.75 kg of 'vis_r'; accepted: 0.75 kg"
    with pytest.raises(ValueError, match=re.escape(message)):
        load_policy(path, vehicle=vehicle)


def test_a_truncated_file_is_refused(path: Path, tmp_path: Path) -> None:
    content, cut = path.read_bytes(), tmp_path / "cut.onnx"
    for length in [0, 1, *range(7, len(content), 97), len(content) - 1]:
        cut.write_bytes(content[:length])
        with pytest.raises(ValueError, match=rf"^{re.escape(str(cut))}: "):
            load_policy(cut)


@pytest.mark.parametrize("name", ["nowhere.onnx", ".", "text.onnx"])
def test_what_is_no_policy_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "text.onnx").write_text("policy")
    told = r"unknown policy '.*nowhere.onnx'|cannot be read: .*accepted: the path|no digest at its end"
    with pytest.raises(ValueError, match=told):
        load_policy(tmp_path / name)


def test_every_flipped_bit_is_found(path: Path, tmp_path: Path) -> None:
    content, out = path.read_bytes(), tmp_path / "flipped.onnx"
    bits = [
        *np.random.default_rng(0).integers(0, 8 * len(content), 200),
        *range(8 * len(content) - 640, 8 * len(content)),
    ]
    for bit in bits:
        flipped = bytearray(content)
        flipped[bit // 8] ^= 1 << bit % 8
        out.write_bytes(flipped)
        with pytest.raises(
            ValueError, match=rf"^{re.escape(str(out))}: (damaged: its SHA-256 is|no digest at its end)"
        ):
            load_policy(out)


def test_a_file_of_an_older_version_is_refused_until_it_has_its_digest(path: Path, tmp_path: Path) -> None:
    model = onnx.load(str(path))
    helper.set_model_props(model, {METADATA_KEY: model.metadata_props[0].value})
    older = tmp_path / "older.onnx"
    older.write_bytes(model.SerializeToString())
    with pytest.raises(ValueError, match=r"older e2efly; accepted: .*or an older one behind `e2efly export FILE"):
        load_policy(older)
    content = sealed_policy(older)
    assert content == path.read_bytes()
    with pytest.raises(ValueError, match="has a digest already"):
        sealed_policy(path)
    older.write_text("policy")
    with pytest.raises(ValueError, match=f"^{re.escape(str(older))}: not an ONNX file"):
        sealed_policy(older)


def _endless(model: onnx.ModelProto) -> None:
    """The action comes out of a loop of 2^62 rounds."""
    model.graph.node[-1].output[0] = "squashed"
    names = ("round", "go_on", "carried", "still", "next")
    number, truth, action = (
        helper.make_tensor_value_info(name, kind, shape)
        for name, kind, shape in ((names[0], TensorProto.INT64, []), (names[1], TensorProto.BOOL, []),
                                  (names[2], TensorProto.FLOAT, ["n", 4]))
    )  # fmt: skip
    ends = [helper.make_tensor_value_info("still", TensorProto.BOOL, []),
            helper.make_tensor_value_info("next", TensorProto.FLOAT, ["n", 4])]  # fmt: skip
    nodes = [helper.make_node("Identity", ["go_on"], ["still"]), helper.make_node("Identity", ["carried"], ["next"])]
    body = helper.make_graph(nodes, "body", [number, truth, action], ends)
    model.graph.initializer.append(numpy_helper.from_array(np.array(2**62), "rounds"))
    model.graph.initializer.append(numpy_helper.from_array(np.array(True), "begin"))
    model.graph.node.append(helper.make_node("Loop", ["rounds", "begin", "squashed"], ["action"], body=body))


def _elsewhere(model: onnx.ModelProto) -> None:
    """The first weights lie in another file."""
    tensor = next(tensor for tensor in model.graph.initializer if tensor.name == "weight_0")
    tensor.ClearField("raw_data")
    tensor.data_location = TensorProto.EXTERNAL
    tensor.external_data.add(key="location", value="weights.bin")


def _functions(model: onnx.ModelProto) -> None:
    node = helper.make_node("Tanh", ["x"], ["y"])
    model.functions.append(helper.make_function("own", "Squash", ["x"], ["y"], [node], model.opset_import))


def _metadata(text: str) -> Change:
    return lambda model: helper.set_model_props(model, {METADATA_KEY: text})


def _rename(side: str, to: str) -> Change:
    """Give the input or the output another name, and every node that uses it."""

    def change(model: onnx.ModelProto) -> None:
        value = getattr(model.graph, side)[0]
        for node in model.graph.node:
            for names in (node.input, node.output):
                names[:] = [to if name == value.name else name for name in names]
        value.name = to

    return change


def _resize(side: str, axis: int, size: int) -> Change:
    def change(model: onnx.ModelProto) -> None:
        getattr(model.graph, side)[0].type.tensor_type.shape.dim[axis].dim_value = size

    return change


def _double(model: onnx.ModelProto) -> None:
    """Behind a cast, an input of float64."""
    model.graph.node[0].input[0], model.graph.node[1].input[0] = "single", "single"
    for node in model.graph.node:
        node.input[:] = ["single" if name == "observation" else name for name in node.input]
    model.graph.node.insert(0, helper.make_node("Cast", ["observation"], ["single"], to=TensorProto.FLOAT))
    model.graph.input[0].type.tensor_type.elem_type = TensorProto.DOUBLE


def _second_output(model: onnx.ModelProto) -> None:
    model.graph.output.append(helper.make_tensor_value_info("features", TensorProto.FLOAT, ["n", 20]))


def _weights(value: float) -> Change:
    def change(model: onnx.ModelProto) -> None:
        for tensor in model.graph.initializer:
            if tensor.name == "bias_1":
                tensor.CopyFrom(numpy_helper.from_array(np.full(4, value, np.float32), tensor.name))

    return change


def _no_squashing(model: onnx.ModelProto) -> None:
    model.graph.node[-1].op_type = "Identity"
    _weights(2.0)(model)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (_endless, "has a graph inside of a node, as If, Loop and Scan have: it may never end; accepted: "),
        (_elsewhere, "has numbers in another file; accepted: a graph of plain"),
        (_functions, "has functions of its own; accepted: a graph of plain"),
        (lambda model: model.ClearField("metadata_props"), "metadata key 'contract' is missing"),
        (_metadata("{}"), "contract: missing key 'contract_version'"),
        (_metadata('{"contract_version": 1}'), "contract: contract_version is 1; accepted: 2; export it again"),
        (_metadata("hover"), "contract: not JSON"),
        (_rename("input", "state"), "input of the graph is [('state', 'float32'"),
        (_rename("output", "command"), "output of the graph is [('command', 'float32'"),
        (_resize("input", 1, 22), "input of the graph is"),
        (_resize("input", 0, 1), "input of the graph is"),
        (_resize("output", 0, 1), "output of the graph is"),
        (_double, "input of the graph is [('observation', 'float64'"),
        (_second_output, "output of the graph is [('action', 'float32', ['n', 4]), ('features'"),
        (_weights(np.nan), "constant 'bias_1' of the graph is not finite; accepted: finite numbers"),
        (_no_squashing, "does not run on the observation of a level, still vehicle: action is ["),
    ],
)
def test_a_graph_that_may_never_end_reads_other_files_or_contradicts_its_contract_is_refused(
    edited: Callable[[Change], Path], change: Change, message: str
) -> None:
    out = edited(change)
    with pytest.raises(ValueError, match=re.escape(f"{out}: {message}")):
        load_policy(out)


@pytest.mark.parametrize(("task", "said"), [("hover", 0), ("hover", 32), ("hover_aware", 8)])
def test_a_contract_that_knows_another_memory_than_the_graph_is_refused(task: str, said: int, tmp_path: Path) -> None:
    file, out = policy_file(task), tmp_path / "policy.onnx"
    has = load_policy(file).contract.memory_size
    model = onnx.load(str(file))
    contract = json.loads(model.metadata_props[0].value) | {"memory_size": said}
    _metadata(json.dumps(contract))(model)
    out.write_bytes(sealed(model.SerializeToString()))
    with pytest.raises(ValueError, match=f"memory_size is {said} in the contract; accepted: {has}, the numbers of mem"):
        load_policy(out)


def test_metadata_that_is_no_text_is_refused(path: Path, tmp_path: Path) -> None:
    content, out = path.read_bytes(), tmp_path / "bytes.onnx"
    assert content.count(b'"task"') == 1
    out.write_bytes(sealed(content.replace(b'"task"', b'"t\xff\xfek"')))
    with pytest.raises(ValueError, match=re.escape(str(out))):
        load_policy(out)


def test_loading_imports_no_jax_and_no_simulator(path: Path) -> None:
    code = f"import sys; from e2efly import load_policy; load_policy({str(path)!r}); print(*sys.modules)"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    out = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    loaded = out.stdout.split()
    assert "e2efly.policy.loader" in loaded
    ours = {name.split(".")[1] for name in loaded if name.startswith("e2efly.")}
    assert ours == {"config", "control", "policy", "vehicles"}
    assert not {"jax", "jaxlib", "jaxtyping", "onnx", "optax", "scipy", "matplotlib"} & set(loaded)


OURS = ("__version__", "config", "control", "courses", "flight", "logs", "policy", "vehicles")
"""Parts of the package that flight may import."""
EXPORTS = {"c_export", "raptor"}
"""What makes other files of a policy, and is not flown."""


def test_no_file_of_flight_names_jax_or_the_simulator() -> None:
    folders = [Path(e2efly.__file__).parent / room for room in OURS[1:]]
    files = sorted(file for folder in folders for file in folder.glob("**/*.py") if not EXPORTS & set(file.parts))
    assert {"contract.py", "bridge.py", "flight_log.py"} <= {file.name for file in files}
    for file in files:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import | ast.ImportFrom) else []
            if isinstance(node, ast.ImportFrom):
                assert node.level == 0, f"{file}: a relative import"
                names = [f"{node.module}.{name}" for name in names]
            for name in names:
                root, part = (*name.split("."), "")[:2]
                assert root not in ("jax", "jaxlib", "jaxtyping", "optax", "onnx"), f"{file} imports {name}"
                assert root != "e2efly" or part in OURS, f"{file} imports {name}"
