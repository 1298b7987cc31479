"""A task from a file outside of the package: trained, evaluated, resumed, refused when its file is gone."""

import dataclasses
import json
import shutil
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import e2efly
from e2efly.commands.cli import run
from e2efly.config import RewardConfig
from e2efly.config.registry import load
from e2efly.policy.odometry import Odometry
from e2efly.policy.runtime import Runtime, act, begin
from e2efly.tasks import TASKS
from e2efly.tasks.route import course_for, route_of
from tests.learning.one_program import compile_once

pytestmark = pytest.mark.usefixtures("quick")

EXAMPLE = Path(__file__).parents[2] / "examples" / "06_own_task.py"
SMALL = ["--preset", "nominal", "--steps", "4096", "--algo.envs", "32", "--algo.horizon", "32",
         "--eval-episodes", "32", "--no-plots"]  # fmt: skip


@pytest.fixture(autouse=True)
def _as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a test registers goes with it."""
    monkeypatch.setattr(TASKS, "_known", dict(TASKS._known))


@pytest.mark.whole
def test_a_task_of_ones_own_goes_all_the_way(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    compile_once(monkeypatch)
    file, out = tmp_path / "orbit.py", tmp_path / "run"
    shutil.copy(EXAMPLE, file)
    file.write_text(file.read_text().replace('register_task("orbit")', 'register_task("orbit_of_the_test")'))
    reference = f"{file}:OrbitConfig"
    assert run(["train", reference, "--out", str(out), "--task.circle", "0.7", *SMALL]) == 0
    assert json.loads((out / "config.json").read_text())["task_name"] == reference
    policy = e2efly.load_policy(out / "policy.onnx")
    assert policy.contract.task == reference
    assert policy.contract.observation[0].name == "position_error"
    capsys.readouterr()
    for what in (out, out / "policy.onnx"):
        assert run(["eval", str(what), "--episodes", "20", "--plots", str(tmp_path / "plots")]) == 0
        assert "success" in capsys.readouterr().out
    assert run(["train", "--resume", str(out)]) == 0
    assert run(["validate", str(out), "--episodes", "2", "--max-drop", "100"]) == 0
    assert "mujoco" in capsys.readouterr().out
    vehicle = e2efly.load_vehicle("vis_r")
    course = course_for(policy.contract, vehicle, route_of(policy.contract)(origin=(2.0, 0.0, 0.0)))
    flight = Runtime.of(policy, course, vehicle)
    still = Odometry(0.0, np.array([3.0, 0.0, 3.0]), np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3))
    assert act(flight, begin(flight, still, 0.0), still, 0.0)[1].position == pytest.approx([3.0, 0.0, 3.0])
    # a bad number of its own is named by its field's rule
    assert run(["train", reference, "--out", str(tmp_path / "other"), "--task.circle", "-1", *SMALL]) == 2
    assert "task.circle is -1.0; accepted: a number, 1e-09 to 10000" in capsys.readouterr().err


def test_a_run_whose_task_is_gone_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, out = tmp_path / "gone.py", tmp_path / "run"
    shutil.copy(EXAMPLE, file)
    file.write_text(file.read_text().replace('register_task("orbit")', 'register_task("orbit_that_goes")'))
    config = e2efly.preset(f"{file}:OrbitConfig")
    from e2efly.runs.rundir import RunDirectory

    RunDirectory(out).create(config)
    content = (out / "config.json").read_text()
    (out / "config.json").write_text(content.replace("gone.py", "elsewhere.py"))
    assert run(["train", "--resume", str(out)]) == 2
    assert f"there is no file {tmp_path / 'elsewhere.py'}" in " ".join(capsys.readouterr().err.split())


def test_the_python_face_takes_a_name_a_class_or_options() -> None:
    options = load("e2efly.tasks.hover:HoverConfig")
    by_name, by_class = e2efly.preset("hover", "bptt"), e2efly.preset(options, "bptt")
    assert by_name == by_class
    assert e2efly.preset(options(radius=0.2)).task.radius == 0.2
    env = e2efly.make_env("hover", wind=1.0)
    assert env.observation_size == 21
    with pytest.raises(ValueError, match=r"env\.wind is -1.0; accepted: a number, 0 to 100"):
        e2efly.make_env("hover", wind=-1.0)


def test_a_reward_term_of_ones_own_is_learned_by_and_never_from_an_old_program(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from e2efly.commands.train import parse
    from e2efly.environment import Env
    from e2efly.learning.programs import traced_folder
    from e2efly.simulation import rewards

    monkeypatch.setattr(rewards.TERMS, "_known", dict(rewards.TERMS._known))

    @e2efly.register_reward("differentiable")
    def low(height: jax.Array, steepness: float = 2.0) -> jax.Array:
        """Minus the height over the goal, m."""
        return -steepness * height

    config = e2efly.preset("hover", "ppo")
    mine = dataclasses.replace(config, reward=RewardConfig({"near": 1.0, "low": 0.5}, {"steepness": 3.0}))
    assert traced_folder(config) is not None
    assert traced_folder(mine) is None
    env = Env.of(mine.task, mine.reward, mine.env)
    state, _ = jax.eval_shape(lambda key: env.reset(key, 4), jax.random.key(0))
    _, out = jax.eval_shape(env.step, state, jnp.zeros((4, 4)))
    assert set(out.terms) == {"near", "low"}
    file = tmp_path / "terms.py"
    file.write_text(
        "import e2efly\n\n@e2efly.register_reward('differentiable')\ndef high(height):\n    return height\n"
    )
    monkeypatch.chdir(tmp_path)
    asked = parse(["hover", "--reward.weights", "terms.py:high", "0.5"]).config
    assert asked.reward.weights[f"{file}:high"] == 0.5  # found from every folder, as by --resume
    assert traced_folder(asked) is None
    _, out = jax.eval_shape(Env.of(asked.task, asked.reward, asked.env).step, state, jnp.zeros((4, 4)))
    assert "high" in out.terms
    with pytest.raises(ValueError, match=r"'high' is given by two names, .*terms.py:high, high; accepted: one weight"):
        rewards.check({**asked.reward.weights, "high": 1.0}, {})
    with pytest.raises(ValueError, match=r"unknown name in .*terms.py 'hihg'; did you mean 'high'"):
        rewards.check({f"{file}:hihg": 1.0}, {})
    with pytest.raises(
        ValueError, match=r"'near' of .*<locals>.near is also the name of e2efly.simulation.rewards:near"
    ):

        @e2efly.register_reward("differentiable")
        def near(offset: jax.Array) -> jax.Array:
            return offset[..., 0]

    with pytest.raises(ValueError, match="kind of a reward term is 'smooth'; accepted: differentiable, partly, sparse"):
        e2efly.register_reward("smooth")  # type: ignore[arg-type]
