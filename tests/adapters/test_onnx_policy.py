"""An ONNX file of another program, with its contract beside it, acts as that program's network does."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from e2efly.adapters.onnx_policy import adopt
from e2efly.control import Quat, Vec3
from e2efly.policy.loader import load_policy
from e2efly.policy.random_inputs import random_observations

OBSERVATION: list[dict[str, Any]] = [
    {"field": "position_error", "scale": -1, "frame": "body"},
    {"field": "attitude", "form": "matrix"},
    {"field": "velocity", "scale": 0.5},
    {"field": "body_rate"},
    {"field": "past_actions"},
]
ACTION = {"mode": "ctbr", "low": [0, -6, -6, -3], "high": [25, 6, 6, 3], "limits": [0, 1], "order": [3, 0, 1, 2]}
CONTRACT = {"task": "hover", "vehicle": "vis_r", "control_rate_hz": 50, "past_actions": 1,
            "latency_range_s": [0.02, 0.05], "observation": OBSERVATION, "action": ACTION}  # fmt: skip
SIZE = 3 + 9 + 3 + 3 + 4
RNG = np.random.default_rng(0)
WEIGHTS = [RNG.normal(size=(8, SIZE)) / 3, RNG.normal(size=8), RNG.normal(size=(8, 4)) / 3, RNG.normal(size=4)]


def theirs(x: np.ndarray) -> np.ndarray:
    """The network, as its program computes it."""
    hidden = np.tanh(x @ WEIGHTS[0].T + WEIGHTS[1])
    return hidden @ WEIGHTS[2] + WEIGHTS[3]


def written(folder: Path, contract: dict[str, Any] = CONTRACT, opset: int = 18, memory: bool = False) -> list[Path]:
    """Its file, as PyTorch writes one for a batch of one, and the contract beside it; and where ours is to be."""
    constants = [numpy_helper.from_array(x.astype(np.float32), f"w{i}") for i, x in enumerate(WEIGHTS[:3])]
    nodes = [
        helper.make_node("Constant", [], ["bias"], value=numpy_helper.from_array(WEIGHTS[3].astype(np.float32))),
        helper.make_node("Flatten", ["obs"], ["flat"]),
        helper.make_node("Gemm", ["flat", "w0", "w1"], ["linear"], transB=1),
        helper.make_node("Tanh", ["linear"], ["hidden"]),
        helper.make_node("MatMul", ["hidden", "w2"], ["product"]),
        helper.make_node("Add", ["product", "bias"], ["action"]),
    ]
    sizes = {"obs": SIZE} | ({"state": 2} if memory else {})
    inputs = [helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, size]) for name, size in sizes.items()]
    outputs = [helper.make_tensor_value_info("action", TensorProto.FLOAT, [1, 4])]
    graph = helper.make_graph(nodes, "theirs", inputs, outputs, constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", opset)])
    (folder / "theirs.onnx").write_bytes(model.SerializeToString())
    (folder / "theirs.contract.json").write_text(json.dumps(contract))
    return [folder / name for name in ("theirs.onnx", "theirs.contract.json", "ours.onnx")]


def test_it_sees_in_its_own_frames_and_order_and_its_actions_are_commands(tmp_path: Path) -> None:
    adopt(*written(tmp_path))
    policy = load_policy(tmp_path / "ours.onnx")
    c = policy.contract
    assert (c.task, c.vehicle, c.control_rate_hz, c.latency_range_s) == ("hover", "vis_r", 50.0, (0.02, 0.05))
    x = random_observations(np.random.default_rng(1), c.observation, 50).astype(np.float64)
    part = {name: x[:, where] for name, where in c.slices.items()}
    attitude = Quat.of(part["attitude"])
    columns = [attitude.rotate(Vec3.of(np.broadcast_to(axis, (50, 3)))).stack() for axis in np.eye(3)]
    matrix = np.stack(columns, axis=2)
    error = np.einsum("nji,nj->ni", matrix, part["position_error"])
    before = (part["past_actions"][:, [1, 2, 3, 0]] + 1) / 2  # the network has the thrust last, from 0 to 1
    seen = np.concatenate([-error, matrix.reshape(50, 9), 0.5 * part["velocity"], part["body_rate"], before], axis=1)
    share = np.clip(theirs(seen), 0, 1)[:, [3, 0, 1, 2]]
    low, high = np.array(ACTION["low"]), np.array(ACTION["high"])
    found = policy.command(policy.act(x.astype(np.float32))[0])
    np.testing.assert_allclose(found, low + share * (high - low), atol=2e-4)
    assert np.std(share) > 0.1


@pytest.mark.parametrize(
    ("contract", "file", "said"),
    [
        ({"task": None}, {}, "contract: task is None; accepted: a text"),
        ({"vehicle": ...}, {}, "contract: lacks vehicle; accepted: all of task, vehicle, control_rate_hz, observation"),
        ({"action": {"mode": "ctbr"}}, {}, "contract: lacks action.low, action.high; accepted: all of mode, low, high"),
        ({"rate": 50}, {}, "contract: unknown key 'rate' (there are: action, control_rate_hz"),
        ({"task": "hoover"}, {}, "unknown task 'hoover'; did you mean 'hover'?"),
        ({"task": "race"}, {}, "observation[0].field: unknown field 'position_error'"),
        ({"task": "avoid"}, {}, "task is 'avoid', which is flown by sight; accepted: one that is not"),
        ({"vehicle": "vis_x"}, {}, "unknown vehicle 'vis_x'; did you mean"),
        ({"action": ACTION | {"order": [0, 1, 2, 2]}}, {}, "action.order is [0, 1, 2, 2]; accepted: the places"),
        ({"action": ACTION | {"limits": [1, 0]}}, {}, "action.limits is [1, 0]; accepted: numbers that rise"),
        ({"observation": OBSERVATION[1:]}, {}, "theirs.onnx: takes [1, 22] numbers; accepted: (1, 19), as"),
        ({"past_actions": 0}, {}, "observation[4].field: unknown field 'past_actions'"),
        ({}, {"opset": 9}, "has operators of the versions [9]; accepted: 13 to 22"),
        ({}, {"memory": True}, "has the inputs and outputs obs, state, action; accepted: one input and one output"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_named(contract: dict[str, Any], file: dict[str, Any], said: str, tmp_path: Path) -> None:
    whole = {name: value for name, value in {**CONTRACT, **contract}.items() if value is not ...}
    paths = written(tmp_path, whole, **file)
    with pytest.raises(ValueError, match="theirs") as refused:
        adopt(*paths)
    assert said in str(refused.value)
    assert not paths[2].exists()


def test_a_contract_may_leave_out_what_is_usual(tmp_path: Path) -> None:
    action = {name: ACTION[name] for name in ("mode", "low", "high")}
    lean = {name: CONTRACT[name] for name in ("task", "vehicle", "control_rate_hz")}
    network = written(
        tmp_path, lean | {"observation": [{"field": "position_error"}] * 6 + [{"field": "attitude"}], "action": action}
    )
    said = adopt(*network)
    assert (said.action.limits, said.action.order, said.past_actions) == ((-1, 1), (0, 1, 2, 3), 0)
    contract = load_policy(tmp_path / "ours.onnx").contract
    assert contract.latency_range_s == (0.06, 0.06)  # of the vehicle
    assert contract.past_actions == 0


def test_the_contract_of_the_page_is_one(tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "docs" / "benchmark.md").read_text(encoding="utf-8")
    example = text.split("```json\n")[1].split("```")[0]
    adopt(*written(tmp_path, json.loads(example)))
    assert load_policy(tmp_path / "ours.onnx").contract.action.high == (25, 6, 6, 3)


def test_a_node_that_no_policy_may_hold_is_refused(tmp_path: Path) -> None:
    paths = written(tmp_path)
    model = onnx.load(paths[0])
    model.graph.node[3].op_type = "Erf"
    paths[0].write_bytes(model.SerializeToString())
    with pytest.raises(ValueError, match="'Erf', is no operator of a policy; accepted: Add,"):
        adopt(*paths)
    assert not paths[2].exists()
