"""What an export as C says of itself, what it takes, and what it refuses; no compiler is needed."""

import hashlib
import re
from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from e2efly.commands.cli import run
from e2efly.learning.onnx_export import write_policy
from e2efly.policy.c_export.c_source import sources
from e2efly.policy.c_export.program import CProgram, layout
from e2efly.policy.loader import load_policy
from e2efly.policy.zoo import policy_file


def header(name: str, tmp_path: Path) -> str:
    assert run(["export", name, "--c", str(tmp_path)]) == 0
    return (tmp_path / "policy.h").read_text()


def test_the_header_is_the_contract(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = header("avoid", tmp_path / "a" / "c")
    file, c = policy_file("avoid"), load_policy("avoid").contract
    said = dict(re.findall(r"^#define POLICY_(\w+) (\S+)", text, re.MULTILINE))
    assert said["ONNX_SHA256"].strip('"') == hashlib.sha256(file.read_bytes()).hexdigest()
    assert said["VEHICLE_HASH"].strip('"') == c.vehicle_hash
    assert (said["TASK"], said["COMMAND_MODE"]) == ('"avoid"', '"ctbr"')
    assert np.float32(said["CONTROL_RATE_HZ"].rstrip("f")) == np.float32(c.control_rate_hz)
    assert np.float32(said["LATENCY_MAX_S"].rstrip("f")) == np.float32(c.latency_range_s[1])
    assert int(said["OBSERVATION_SIZE"]) == c.observation_size
    assert (said["IMAGE_0_HEIGHT"], said["IMAGE_0_WIDTH"], said["IMAGE_0_MAX"]) == ("12", "32", "10.0f")
    assert re.findall(r"POLICY_AT_(\w+) = (\d+)", text) == [(n.upper(), str(s.start)) for n, s in c.slices.items()]
    seen = text[text.index("typedef struct {") : text.index("} policy_seen")]
    fields = [(f"field_{field.name}", str(field.size)) for field in c.observation if field.name != "past_actions"]
    assert re.findall(r"float (\w+)\[(\d+)\]", seen) == fields
    flat = " ".join(text.replace("\n *", " ").split())
    for field in c.observation[:-1]:
        assert f"{field.unit}, frame {field.frame}, scale {field.scale:g}: {field.description} */" in flat
    for field, unit, low, high in zip(c.action.fields, c.action.units, c.action.low, c.action.high, strict=True):
        assert f"{field} {low:g} to {high:g} {unit}" in flat
    told = " ".join(capsys.readouterr().out.split())
    assert f"{said['STATE_BYTES']} bytes of state, 1536 of images and {said['CONSTANT_BYTES']} of weights" in told


def test_a_policy_of_a_family_says_its_ranges(tmp_path: Path) -> None:
    text = header("any/hover", tmp_path)
    assert "POLICY_VEHICLE_HASH" not in text
    assert "#define POLICY_VEHICLE_MASS_MIN 0.025" in text
    assert "#define POLICY_VEHICLE_MASS_MAX 12.0f" in text


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["avoid", "--memory", "4"], "--memory is 4 KiB; the policy needs 9.9 KiB: 8.4 KiB for its state, 1.5 KiB for "
         "image_0 (depth, 12 x 32); accepted: 9.9 KiB or more, or a policy of smaller images, or --precision float"),
        (["hover", "--memory", "2", "--precision", "float"], "--memory is 2 KiB; the policy needs 2.8 KiB: 2.8 KiB for "
         "its state; accepted: 2.8 KiB or more"),
        (["race", "--flash", "128"], "--flash is 128 KiB; the policy needs 231.7 KiB for its weights"),
        (["race", "--memory", "-1"], "--memory is -1.0; accepted: more than 0 KiB"),
        (["race", "--name", "Race"], "--name is 'Race'; accepted: a name of C"),
        (["race", "--out", "x.onnx"], "--out is 'x.onnx', which has no effect with --c"),
        (["race", "--web", "x"], "--web is 'x', which has no effect with --c"),
        (["race", "--vehicle", "vis_h"], "--vehicle is 'vis_h'; accepted: with --web or --crazyflie"),
        (["hoover"], "unknown policy 'hoover'"),
    ],
)  # fmt: skip
def test_what_does_not_go_is_refused_by_name(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["export", *arguments, "--c", str(tmp_path / "c")]) == 2
    assert message in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "c").exists()


def test_options_of_c_need_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["export", "race", "--web", str(tmp_path / "web"), "--memory", "4"]) == 2
    assert "--memory is '4.0', which has no effect without --c" in " ".join(capsys.readouterr().err.split())
    assert run(["export", "race", "--c", str(policy_file("race"))]) == 2
    assert "a file; accepted: a folder, which is made" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    ("operator", "attributes", "message"),
    [
        ("Erf", {}, "node 0 of the graph, 'Erf', is no operator of a policy; accepted: Add, "),
        ("Elu", {"alpha": 0.5}, ""),
        ("Gemm", {"alpha": 2.0}, "node 0 of the graph, 'Gemm', has the attribute 'alpha'; accepted: none"),
        ("Slice", {}, "node 0 of the graph, 'Slice', is no operator"),
    ],
)
def test_an_operator_that_is_not_known_is_named(
    operator: str, attributes: dict[str, float], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    c = load_policy("race_any").contract
    more = {"Gemm": ["square"], "Slice": ["begin", "end", "axis"]}.get(operator, [])
    nodes = [
        helper.make_node(operator, ["observation", *more], ["odd"], **attributes),
        helper.make_node("Gather", ["odd", "columns"], ["four"], axis=1),
        helper.make_node("Tanh", ["four"], ["action"]),
    ]
    constants = [
        numpy_helper.from_array(np.eye(c.observation_size, dtype=np.float32), "square"),
        *(numpy_helper.from_array(np.array([x]), n) for n, x in (("begin", 0), ("end", 9), ("axis", 1))),
        numpy_helper.from_array(np.arange(4), "columns"),
    ]
    taken = [helper.make_tensor_value_info("observation", TensorProto.FLOAT, ["n", c.observation_size])]
    given = [helper.make_tensor_value_info("action", TensorProto.FLOAT, ["n", 4])]
    write_policy(tmp_path / "odd.onnx", helper.make_graph(nodes, "policy", taken, given, constants), c)
    assert run(["export", str(tmp_path / "odd.onnx"), "--c", str(tmp_path / "c")]) == (2 if message else 0)
    assert message in " ".join(capsys.readouterr().err.split())


def test_arrays_that_are_needed_at_the_same_time_do_not_overlap() -> None:
    """Of programs by chance: no step finds what it reads overwritten by another."""
    rng = np.random.default_rng(0)
    for _ in range(200):
        program, known = CProgram(), []
        for _ in range(rng.integers(2, 12)):
            reads = [known[i] for i in rng.integers(0, len(known), min(2, len(known)))]
            in_place = bool(rng.integers(2)) and len({x.shape for x in reads}) == 1
            out = program.buffer(reads[0].shape if in_place else (int(rng.integers(1, 9)),))
            program.step("", [], reads, out, in_place=in_place)
            known.append(out)
        kept = {known[-1].buffer, known[0].buffer}
        places, whole = layout(program, [b for b in kept if b is not None])
        holds: dict[int, int] = {}
        for step in program.steps:
            written = range(places[step.writes], places[step.writes] + program.sizes[step.writes])
            for buffer in step.reads:
                at = range(places[buffer], places[buffer] + program.sizes[buffer])
                assert {holds.get(i) for i in at} == {buffer}
                assert not set(at) & set(written) or (step.in_place and at == written)
            holds |= dict.fromkeys(
                range(places[step.writes], places[step.writes] + program.sizes[step.writes]), step.writes
            )
        for buffer in kept:
            at = range(places[buffer], places[buffer] + program.sizes[buffer])
            assert {holds.get(i) for i in at} == {buffer}
        assert max(holds) < whole


def test_scratch_is_shared_by_what_is_not_needed_at_the_same_time() -> None:
    file = policy_file("race_clutter")
    made = sources(load_policy(file).contract, file.read_bytes(), "policy", "float")
    every = [int(n) for n in re.findall(r"real \*const b\d+ = s \+ (\d+);", made.source)]
    assert len(set(every)) < len(every)
    image = 24 * 48
    assert made.needs.scratch < 2 * image  # the image is encoded where it lies
    assert onnx.load(file).graph.node
