"""RAPTOR's form: its checkpoints as PX4's mc_raptor and the Python package read them, and theirs as policies."""

import dataclasses
import tarfile
from pathlib import Path
from typing import Any

import foundation_policy
import h5py
import jax
import jax.numpy as jnp
import numpy as np
import onnx
import pytest
from onnx import numpy_helper
from scipy.spatial.transform import Rotation

from e2efly.commands.cli import run
from e2efly.environment import random_key
from e2efly.learning.onnx_export import contract_of, export_policy
from e2efly.learning.setup import Setup
from e2efly.learning.warm_start import started_from
from e2efly.policy.loader import Policy, load_policy
from e2efly.policy.onnx_file import sealed
from e2efly.runs.presets import preset
from e2efly.simulation.physics.rotation import yaw

PUBLISHED = Path(foundation_policy.__file__).parent / "blob" / "checkpoint.h5"
ORDER = "front_right", "rear_right", "rear_left", "front_left"
"""RAPTOR's order of the rotors."""
LAYERS = (
    ("weights", "biases"),
    ("weights_input", "biases_input", "weights_hidden", "biases_hidden", "initial_hidden_state"),
    ("weights", "biases"),
)
ENTRIES = ["actor/meta"]
for i, names in enumerate(LAYERS):
    for name in names:
        ENTRIES += [f"actor/layers/{i}/{name}/{part}" for part in ("parameters/meta", "parameters/data", "meta")]
    ENTRIES.append(f"actor/layers/{i}/meta")
ENTRIES += ["example/input/meta", "example/input/data", "example/output/meta", "example/output/data"]
"""The entries that RLtools' writer makes of such a network, in its order."""
TEXTS = {
    "actor/meta": "checkpoint_name: mine\ntype: sequential\n",
    "actor/layers/0/meta": "activation_function: RELU\ntype: dense\n",
    "actor/layers/1/meta": "type: gru\n",
    "actor/layers/2/meta": "activation_function: IDENTITY\ntype: dense\n",
    "actor/layers/0/weights/parameters/meta": "type: tensor\ndtype: float32\nnum_dims: 2\ndim_0: 16\ndim_1: 22\n",
    "actor/layers/2/biases/parameters/meta": "type: tensor\ndtype: float32\nnum_dims: 1\ndim_0: 4\n",
    "example/input/meta": "type: tensor\ndtype: float32\nnum_dims: 3\ndim_0: 500\ndim_1: 2\ndim_2: 22\n",
}


@pytest.fixture(scope="module")
def policy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A policy of the form with random weights, all of them."""
    config, rng = preset("hover", "bptt", "raptor"), np.random.default_rng(0)
    setup = Setup.of(config)
    fresh = setup.actor.init(rng, np.asarray(setup.env.hover))
    weights = jax.tree.map(lambda x: (x + rng.normal(0, 0.1, x.shape)).astype(np.float32), fresh)
    path = tmp_path_factory.mktemp("policy") / "policy.onnx"
    export_policy(path, weights, setup.actor, contract_of(setup.env, config))
    return path


def exported(policy: Path, path: Path, *options: str) -> Path:
    assert run(["export", str(policy), "--raptor", str(path), *options]) == 0
    return path


def contents(path: Path) -> dict[str, bytes]:
    with tarfile.open(path) as tar:
        return {member.name: tar.extractfile(member).read() for member in tar.getmembers()}  # type: ignore[union-attr]


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert run(["export", *words]) == 2
    return " ".join(capsys.readouterr().err.split())


def observations(policy: Policy, steps: int = 50, n: int = 8) -> np.ndarray:
    """Random ones, (steps, n, o), with unit quaternions."""
    seen = np.random.default_rng(1).normal(size=(steps, n, policy.contract.observation_size)).astype(np.float32)
    at = policy.contract.slices["attitude"]
    seen[..., at] /= np.linalg.norm(seen[..., at], axis=-1, keepdims=True)
    return seen


def inputs(policy: Policy, seen: np.ndarray) -> np.ndarray:
    """RAPTOR's inputs for observations, as PX4 computes them."""
    part = {name: seen[..., at] for name, at in policy.contract.slices.items()}
    wxyz = part["attitude"].reshape(-1, 4)
    turn = Rotation.from_quat(wxyz[:, [1, 2, 3, 0]]).as_matrix().reshape(*seen.shape[:-1], 9)
    own = [policy.contract.action.fields.index(name) for name in ORDER]
    return np.concatenate([
        np.clip(-part["position_error"], -0.5, 0.5), turn, np.clip(part["velocity"], -1, 1), part["body_rate"],
        part["past_actions"][..., own],
    ], axis=-1)  # fmt: skip


def flown(policy: Policy, seen: np.ndarray) -> np.ndarray:
    """The commands of the policy in RAPTOR's order."""
    memory, acted = None, []
    for observation in seen:
        action, memory = policy.act(observation, memory=memory)
        acted.append(action)
    own = [policy.contract.action.fields.index(name) for name in ORDER]
    return np.stack(acted)[..., own]


def test_the_tar_has_the_entries_of_rltools_writer(policy: Path, tmp_path: Path) -> None:
    path = exported(policy, tmp_path / "policy.tar", "--name", "mine")
    found = contents(path)
    assert list(found) == ENTRIES
    assert {name: found[name].decode() for name in TEXTS} == TEXTS
    assert len(found["actor/layers/1/weights_hidden/parameters/data"]) == 4 * 48 * 16
    header = path.read_bytes()[:512]
    assert header[257:262] == b"ustar" and header[156:157] == b"0" and header[:11] == b"actor/meta\0"
    assert max(map(len, found)) < 100 and max(len(found[name]) for name in found if name.endswith("meta")) < 100


def test_the_self_test_of_px4_passes(policy: Path, tmp_path: Path) -> None:
    """Five steps of two rows, each from the initial state: a mean difference below 1e-5."""
    found = contents(exported(policy, tmp_path / "policy.tar"))

    def array(name: str, *shape: int) -> np.ndarray:
        return np.frombuffer(found[f"{name}/data"], "<f4").reshape(shape).astype(float)

    def parameter(name: str, *shape: int) -> np.ndarray:
        return array(f"actor/layers/{name}/parameters", *shape)

    shown, wanted, off = array("example/input", 500, 2, 22), array("example/output", 500, 2, 4), []
    for row in range(2):
        state = parameter("1/initial_hidden_state", 16)
        for t in range(5):
            x = np.maximum(parameter("0/weights", 16, 22) @ shown[t, row] + parameter("0/biases", 16), 0)
            a = parameter("1/weights_input", 48, 16) @ x + parameter("1/biases_input", 48)
            b = parameter("1/weights_hidden", 48, 16) @ state + parameter("1/biases_hidden", 48)
            reset, update = 1 / (1 + np.exp(-(a + b)[:16])), 1 / (1 + np.exp(-(a + b)[16:32]))
            state = update * state + (1 - update) * np.tanh(a[32:] + reset * b[32:])
            out = parameter("2/weights", 4, 16) @ state + parameter("2/biases", 4)
            off.append(np.abs(out - wanted[t, row]).mean())
    assert np.mean(off) < 1e-6
    assert np.abs(wanted[:5]).max() > 0.1


def test_the_python_package_loads_it_and_commands_the_same(policy: Path, tmp_path: Path) -> None:
    ours = load_policy(policy)
    theirs: Any = foundation_policy.load(exported(policy, tmp_path / "policy.h5", "--name", "mine"))
    seen = observations(ours)
    np.testing.assert_allclose(np.clip(theirs.evaluate(inputs(ours, seen)), -1, 1), flown(ours, seen), atol=1e-5)
    assert theirs.checkpoint_name == "mine" and theirs.meta["environment"]["name"] == "l2f"
    assert theirs.description() == foundation_policy.Raptor().description()


def test_the_published_checkpoint_is_a_policy_of_ours_and_comes_back_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "raptor.onnx"
    assert run(["export", str(PUBLISHED), "--out", str(path)]) == 0
    ours, theirs = load_policy(path, task="hover", command_mode="rotor_speed"), foundation_policy.Raptor()
    seen = observations(ours)
    np.testing.assert_allclose(np.clip(theirs.evaluate(inputs(ours, seen)), -1, 1), flown(ours, seen), atol=1e-5)
    with h5py.File(PUBLISHED) as was, h5py.File(exported(path, tmp_path / "again.h5")) as now:
        names: list[str] = []
        was["actor"].visititems(lambda name, part: names.append(name) if isinstance(part, h5py.Dataset) else None)
        assert len(names) == 9
        for name in names:
            np.testing.assert_array_equal(np.ravel(was["actor"][name]), np.ravel(now["actor"][name]))
    tar = exported(path, tmp_path / "again.tar")
    assert run(["export", str(tar), "--out", str(tmp_path / "twice.onnx")]) == 0
    assert (tmp_path / "twice.onnx").read_bytes() == path.read_bytes()


def test_a_policy_of_any_other_form_is_refused(
    policy: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "policy.tar")
    said = refused(capsys, "any/hover", "--raptor", out)
    assert "observation is {'position_error': 3, 'attitude': 4, " in said and "accepted in RAPTOR's form: {" in said
    assert "--raptor is" in refused(capsys, str(policy), "--raptor", str(tmp_path / "policy.bin"))
    assert "accepted: 1 to 99 printable" in refused(capsys, str(policy), "--raptor", out, "--name", "a\nb")
    assert not Path(out).exists()


def test_a_graph_that_computes_something_else_is_refused(
    policy: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The same weights and contract, but velocities of up to 2 m/s are shown."""
    model = onnx.load_model_from_string(policy.read_bytes())
    for tensor in model.graph.initializer:
        if tensor.name.startswith("velocity_shown_"):
            tensor.CopyFrom(numpy_helper.from_array(2 * numpy_helper.to_array(tensor), tensor.name))
    del model.metadata_props[-1]  # the digest
    other = tmp_path / "other.onnx"
    other.write_bytes(sealed(model.SerializeToString()))
    said = refused(capsys, str(other), "--raptor", str(tmp_path / "policy.tar"))
    assert "its graph computes something else" in said and "accepted: at most 1e-05" in said


@pytest.mark.parametrize(("name", "value", "told"), [
    ("layers/1/weights_hidden", np.zeros((96, 32)), "layers/1/weights_hidden has shape (96, 32); accepted in"),
    ("layers/2/biases", None, "layers/2/biases is missing; accepted in RAPTOR's form: layers/0/weights, "),
    ("layers/1/initial_hidden_state", np.ones(16), "layers/1/initial_hidden_state is not zero; accepted: zeros"),
    ("layers/0/biases", np.full(16, np.nan), "layers/0/biases is not finite"),
])  # fmt: skip
def test_a_checkpoint_of_any_other_form_is_refused(
    name: str, value: np.ndarray | None, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "other.h5"
    path.write_bytes(PUBLISHED.read_bytes())
    with h5py.File(path, "a") as file:
        del file[f"actor/{name}/parameters"]
        if value is not None:
            file[f"actor/{name}/parameters"] = value.astype(np.float32)
    assert told in refused(capsys, str(path))
    assert not path.with_suffix(".onnx").exists()


def test_a_network_of_another_size_is_refused_before_it_trains(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["train", "hover", "--preset", "raptor", "--network.recurrent", "32"]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "network.recurrent is 32; accepted with network.form 'raptor': 16" in said


def test_a_training_starts_from_a_checkpoint_of_the_form(policy: Path) -> None:
    config = dataclasses.replace(preset("hover", "bptt", "raptor"), start_from=str(policy))
    setup = Setup.of(config)
    begun = started_from(setup.parameters(), policy, setup)
    seen, ours = observations(load_policy(policy)), load_policy(policy)
    memory, acted = setup.actor.memory(8), []
    for observation in seen:
        action, memory = setup.actor(begun.policy, setup.actor.features(jnp.asarray(observation)), memory)
        acted.append(np.clip(action, -1, 1))
    own = [ours.contract.action.fields.index(name) for name in ORDER]
    np.testing.assert_allclose(np.stack(acted)[..., own], flown(ours, seen), atol=1e-5)


def test_the_preset_starts_within_a_heading_that_is_an_option() -> None:
    config = preset("hover", "bptt", "raptor")
    state, _ = Setup.of(config).env.reset(random_key(0), 500)
    heading = np.abs(np.asarray(yaw(state.vehicle.quaternion)))
    assert 0.7 < heading.max() < 0.85
    assert (config.env.vehicle, config.env.control_rate, config.env.action_latency) == ("any", 100.0, (0.0, 0.034))
