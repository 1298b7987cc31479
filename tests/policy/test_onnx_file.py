"""What a policy's file may hold: one strict reader, allowed operators, limits of size, arithmetic, time and memory."""

import json
import os
import random
import re
import signal
from collections.abc import Callable
from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from e2efly.flight.sight.segment.network import OWN
from e2efly.policy import onnx_session
from e2efly.policy.contract import METADATA_KEY
from e2efly.policy.loader import load_policy
from e2efly.policy.onnx_file import FIELDS, LARGEST, read, sealed, write
from e2efly.policy.random_inputs import random_observations
from e2efly.policy.zoo import FOLDER, policy_file
from tests.policy_mutations import mutated_policy

Change = Callable[[onnx.ModelProto], None]


@pytest.fixture(autouse=True)
def _cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine on which no network has run."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def untried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Networks load without a trial: what the checks let through is harmless by itself."""
    monkeypatch.setattr(onnx_session, "_try_out", lambda content, inputs: None)


def plain() -> onnx.ModelProto:
    """A policy of the zoo, without its digest."""
    model = onnx.load(str(policy_file("hover")))
    del model.metadata_props[1:]
    return model


def refusal(content: bytes, folder: Path) -> str:
    path = folder / "policy.onnx"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=rf"^{re.escape(str(path))}: ") as error:
        load_policy(path)
    return str(error.value).removeprefix(f"{path}: ")


def test_what_is_written_is_what_was_read() -> None:
    for path in (*FOLDER.glob("*/*.onnx"), OWN):
        assert write(read(path.read_bytes())) == path.read_bytes()


def test_remarks_are_passed_over_and_numbers_may_be_packed() -> None:
    model = plain()
    model.doc_string = model.graph.doc_string = model.graph.node[0].doc_string = "a remark"
    model.graph.value_info.append(helper.make_tensor_value_info("wrong", TensorProto.FLOAT, [10**12]))
    perm = _field(1, b"perm") + _field(8, bytes([0, 2, 1])) + b"\xa0\x01\x07"
    seen = read(model.SerializeToString() + b"")
    assert write(seen) == plain().SerializeToString()
    node = read(_field(7, _field(1, _field(5, perm))))["graph"]["node"][0]
    assert node["attribute"] == [{"name": "perm", "ints": [0, 2, 1], "type": 7}]


def _varint(value: int) -> bytes:
    groups = []
    while value > 127:
        groups.append(value & 127 | 128)
        value >>= 7
    return bytes([*groups, value])


def _field(number: int, data: bytes, more: int = 0) -> bytes:
    """A field with a length; `more` is added to its tag."""
    return _varint((number << 3 | 2) + more) + _varint(len(data)) + data


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (_field(7, _field(1, _field(5, _field(6, b"", 1 << 32)))), "has field 536870918 in its attribute"),
        (_field(7, b"") * 2, "the field graph of its model has more than one value"),
        (_field(7, b"", 1 << 63), "has field 1152921504606846983 in its model"),
        (b"\x08" + b"\xff" * 9 + b"\x7f", "a number breaks off or has more than 64 bits"),
        (b"\x08" + b"\x80" * 20, "a number breaks off or has more than 64 bits"),
        (_field(1, b"\x08\x09"), "the field ir_version of its model has more than one value"),
        (_field(2, b"\xff"), "the field producer_name is no text"),
        (_field(7, _field(2, b"x" * 1001)), "has the field name of 1001 bytes; accepted: at most 1000"),
        (b"\x38\x01", "the field graph is of another kind"),
        (b"\x3b", "field 7 is of kind 3"),
        (b"\x3a\x05", "its last field breaks off"),
        (_field(7, _field(15, b"")), "has sparse numbers; accepted"),
        (_field(7, b"\x0a\x00" * (FIELDS + 1)), "has more than 100000 fields and numbers"),
    ],
)
def test_what_two_readers_could_read_in_two_ways_is_refused(content: bytes, said: str, tmp_path: Path) -> None:
    assert said in refusal(sealed(content), tmp_path)


def test_only_files_of_a_certain_size_are_read(tmp_path: Path) -> None:
    with (tmp_path / "large.onnx").open("wb") as file:
        file.truncate(LARGEST + 1)
    os.mkfifo(tmp_path / "pipe.onnx")
    for name, said in (("large.onnx", "it has more than"), ("pipe.onnx", "it is no file")):
        with pytest.raises(ValueError, match=f"cannot be read: .*{said}.*; accepted: the path of a policy.onnx"):
            load_policy(tmp_path / name)
    with pytest.raises(ValueError, match=r"unknown policy '.*a\\x00b.onnx'"):
        load_policy(tmp_path / "a\0b.onnx")


def _behind(*nodes: onnx.NodeProto, **constants: object) -> Change:
    """Add nodes that make `more`, (n, 1), of `observation` and constants, and add it to the action."""

    def change(model: onnx.ModelProto) -> None:
        graph = model.graph
        graph.node[-1].output[0] = "before"
        graph.node.extend([*nodes, helper.make_node("Add", ["before", "more"], ["action"])])
        graph.initializer.extend(numpy_helper.from_array(np.asarray(v), k) for k, v in constants.items())

    return change


def _judged(model: onnx.ModelProto) -> None:
    """The action is a comparison."""
    model.graph.node[-1].output[0] = "before"
    model.graph.node.append(make("Greater", ["before", "before"], ["action"]))


make = helper.make_node
THOUSANDS = (
    make("Gather", ["observation", "columns"], ["many"], axis=1),
    make("Reshape", ["many", "row"], ["a"]),
    make("Reshape", ["many", "column"], ["b"]),
    make("MatMul", ["b", "a"], ["square"]),
)
SHAPES = {"columns": np.zeros(4000, np.int64), "row": [0, 1, 4000], "column": [0, 4000, 1]}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (_behind(make("ConstantOfShape", ["size"], ["more"]), size=[250_000_000]), "'ConstantOfShape', is no operator"),
        (_behind(make("RandomNormalLike", ["before"], ["more"])), "'RandomNormalLike', is no operator of a policy; ac"),
        (_behind(make("Tanh", ["before"], ["more"], domain="com.microsoft")), "'Tanh', is no operator of a policy"),
        (_behind(make("MatMul", ["c", "c"], ["more"]), c=np.eye(3, dtype=np.float32)), "has a first input that is con"),
        (_behind(make("Add", ["c", "c"], ["more"]), c=np.float32(0)), "one computed, or several of as many axes"),
        (_behind(*THOUSANDS, make("MatMul", ["square", "square"], ["more"]), **SHAPES), "has 3.205e+07 numbers that a"),
        (_behind(make("Gather", ["before", "c"], ["more"], axis=1), c=[0, 1]), "(4,), (2,)]; accepted: equal sizes, o"),
        (_judged, "output 'action' of the graph is of the shape (4,) and of bool; accepted: computed, of"),
        (_behind(make("Transpose", ["before"], ["more"], perm=[1, 0])), "perm with the batch axis first"),
        (_behind(make("Reshape", ["before", "to"], ["more"]), to=[4, -1]), "a shape (0, ...)"),
        (_behind(make("Add", ["before", "c"], ["more"]), c=np.zeros((7, 4), np.float32)), "without a batch axis"),
        (_behind(make("Gather", ["before", "c"], ["more"], axis=1), c=[4]), "columns 4 to 4; accepted: 0 to 3"),
        (_behind(make("Gather", ["before", "c"], ["more"], axis=0), c=[0]), "the attribute 'axis' as 0; accepted: 1"),
        (_behind(make("Split", ["before"], ["more", "a", "b"], axis=1)), "a multiple of the outputs"),
        (_behind(make("Tanh", ["nothing"], ["more"])), "reads 'nothing'; accepted: an input, a constant, or what"),
        (_behind(make("Tanh", ["before"], ["features"])), "has the outputs ['features']; accepted: new names"),
        (_behind(make("Tanh", ["before"], ["more"], alpha=1.0)), "has the attribute 'alpha'; accepted: none"),
        (_behind(make("Clip", ["before", "c", "c"], ["more"]), c=np.float64(0)), "'c' of the graph is of float64"),
        (_behind(*(make("Identity", ["before"], [f"x{i}"]) for i in range(2000))), "has 2036 nodes; accepted: at most"),
        (lambda model: model.graph.initializer[0].dims.insert(0, 2**62), "has the shape [4611686018427387904, 9]"),
        (lambda model: model.graph.initializer[0].dims.append(2), "has 72 bytes; its shape is [9, 2]"),
        (lambda model: model.opset_import.add(domain="ai.onnx.ml", version=3), "has operators of the versions"),
        (lambda model: model.metadata_props.append(model.metadata_props[0]), "'contract' is there twice"),
    ],
)  # fmt: skip
def test_a_graph_that_the_export_would_not_write_is_refused(change: Change, said: str, tmp_path: Path) -> None:
    model = plain()
    change(model)
    assert said in refusal(sealed(model.SerializeToString()), tmp_path)


def test_the_arithmetic_of_a_call_is_bounded(tmp_path: Path) -> None:
    square = {"columns": np.zeros(2000, np.int64), "row": [0, 1, 2000], "column": [0, 2000, 1]}
    model = plain()
    _behind(*THOUSANDS, make("MatMul", ["square", "square"], ["more"]), **square)(model)
    said = refusal(sealed(model.SerializeToString()), tmp_path)
    assert "has 8.004e+09 multiply-adds in each of its calls, of which there are 30 in a second; accepted: at" in said


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("task", "\ud800", "task is '\\ud800'; accepted: a text of 1 to 2000 printable"),
        ("task", "\x1b[2J", "printable characters"),
        ("task", "x" * 3000, "printable characters"),
        ("vehicle", "a\nb", "printable characters"),
        ("memory_size", 10**400, "memory_size is"),
        ("control_rate_hz", float("nan"), "control_rate_hz is nan"),
        ("control_rate_hz", float("inf"), "control_rate_hz is inf"),
        ("latency_s", 1e308, "latency_s is 1e+308"),
        ("images", [[]] * 100, "images[0] is []"),
        ("e2efly_version", "x" * 2**20, "characters; accepted: at most 1048576"),
    ],
)
def test_a_contract_with_odd_values_is_refused(key: str, value: object, said: str, tmp_path: Path) -> None:
    model = plain()
    text = json.dumps(json.loads(model.metadata_props[0].value) | {key: value})
    helper.set_model_props(model, {METADATA_KEY: text})
    found = refusal(sealed(model.SerializeToString()), tmp_path)
    assert said in found
    assert len(found) < 1000


@pytest.mark.parametrize("text", ["[" * 100_000, '{"task": ' * 50_000, f"[{'9' * 5000}]", "\0", ""])
def test_a_contract_that_is_a_trap_for_json_is_refused(text: str, tmp_path: Path) -> None:
    model = plain()
    helper.set_model_props(model, {METADATA_KEY: text})
    assert refusal(sealed(model.SerializeToString()), tmp_path).startswith("contract: ")


def test_an_image_of_any_size_makes_no_array(tmp_path: Path) -> None:
    model = onnx.load(str(policy_file("avoid")))
    del model.metadata_props[1:]
    contract = json.loads(model.metadata_props[0].value)
    contract["images"][0] |= {"width": 10**6, "height": 10**6, "pool": [1, 1]}
    helper.set_model_props(model, {METADATA_KEY: json.dumps(contract)})
    for value, size in zip(model.graph.input[1].type.tensor_type.shape.dim[1:], (10**6,) * 2, strict=True):
        value.dim_value = size
    assert "has 1e+12 numbers in its weights and inputs" in refusal(sealed(model.SerializeToString()), tmp_path)


@pytest.mark.usefixtures("untried")
def test_a_hundred_damaged_policies_load_or_are_refused(tmp_path: Path) -> None:
    rng, draws, path, loaded = random.Random(20), np.random.default_rng(0), tmp_path / "policy.onnx", 0
    files = [policy_file(name).read_bytes() for name in ("hover", "any/race", "avoid")]
    for _ in range(100):
        path.write_bytes(mutated_policy(rng.choice(files), rng))
        try:
            policy = load_policy(path)
        except ValueError as error:
            assert str(error).startswith(f"{path}: ")
            continue
        loaded += 1
        images = [np.zeros((2, *image.shape), np.float32) for image in policy.contract.images]
        assert np.isfinite(policy.act(random_observations(draws, policy.contract.observation, 2), images)[0]).all()
    assert 10 < loaded < 60


def network(nodes: list[onnx.NodeProto], **constants: object) -> bytes:
    """A network that no check has seen, (n, 3) -> y."""
    given = helper.make_tensor_value_info("x", TensorProto.FLOAT, ["n", 3])
    gives = helper.make_tensor_value_info("y", TensorProto.FLOAT, None)
    arrays = [numpy_helper.from_array(np.asarray(value), name) for name, value in constants.items()]
    graph = helper.make_graph(nodes, "g", [given], [gives], arrays)
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8).SerializeToString()


ONE = numpy_helper.from_array(np.ones(1, np.float32))


def test_a_network_that_takes_too_long_or_too_much_or_crashes_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    x = [np.zeros((1, 3), np.float32)]
    products = [make("MatMul", [f"c{i}", "c0"], [f"c{i + 1}"]) for i in range(60)]
    square = make("ConstantOfShape", ["size"], ["c0"], value=ONE)
    wide = make("ConstantOfShape", ["size"], ["y"], value=ONE)
    with monkeypatch.context() as hurry, pytest.raises(ValueError, match="within 2 s"):
        hurry.setattr(onnx_session, "SECONDS", 2)
        onnx_session.open_session(network([square, *products, make("Identity", ["c60"], ["y"])], size=[3000, 3000]), x)
    with pytest.raises(ValueError, match=r"can load and run: .*(alloc|memory)"):
        onnx_session.open_session(network([wide], size=[1 << 30]), x)
    with pytest.raises(ValueError, match="can load and run: "):
        onnx_session.open_session(b"no network", x)


def test_a_network_is_tried_once_on_a_machine(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    tried = []
    monkeypatch.setattr(onnx_session, "_try_out", lambda content, inputs: tried.append(len(inputs)))
    shipped, copy, other = policy_file("hover"), tmp_path / "copy.onnx", tmp_path / "other.onnx"
    copy.write_bytes(shipped.read_bytes())
    model = plain()
    model.producer_name = "someone"
    other.write_bytes(sealed(model.SerializeToString()))
    for path in (shipped, copy, other, other):
        load_policy(path)
    assert tried == [2]  # observation and memory
    onnx_session.remember(b"x")
    assert onnx_session._mark(b"x").exists()
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc/none")  # no place for notes
    load_policy(other)
    load_policy(other)
    assert tried == [2, 2, 2]


def test_a_crash_ends_the_trial_alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    script = tmp_path / "dies.py"
    script.write_text(f"import os; os.kill(os.getpid(), {int(signal.SIGSEGV)})")
    monkeypatch.setattr(onnx_session, "SCRIPT", script)
    with pytest.raises(ValueError, match=r"load and run: its process ended with status -11, within 20 s and 1024 MiB"):
        onnx_session.open_session(b"", [])
