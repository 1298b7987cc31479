"""An algorithm of one's own is trained, resumed and swept by reference, and refused by name."""

import json
import shutil
from pathlib import Path

import pytest

import e2efly
from e2efly.commands.cli import run
from e2efly.config import ALGORITHMS, AlgorithmConfig
from e2efly.learning.programs import traced_folder
from tests.learning.one_program import compile_once

pytestmark = pytest.mark.usefixtures("quick")

EXAMPLE = Path(__file__).parents[2] / "examples" / "08_own_algorithm.py"
SMALL = ["--algo.envs", "32", "--algo.horizon", "20", "--chunk", "2", "--eval-episodes", "10", "--no-plots"]


@pytest.fixture(autouse=True)
def _forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    """What these tests register is gone after them."""
    monkeypatch.setattr(ALGORITHMS, "_known", dict(ALGORITHMS))


@pytest.mark.whole
def test_it_goes_all_the_way(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    compile_once(monkeypatch)
    file, out = tmp_path / "es.py", tmp_path / "run"
    shutil.copy(EXAMPLE, file)
    file.write_text(file.read_text().replace('register_algorithm("es")', 'register_algorithm("es_of_a_test")'))
    reference = f"{file}:ESConfig"
    train = ["train", "hover", "--algo", reference, "--out", str(out), "--steps", "5000", *SMALL]
    assert run(train) == 0
    assert "hover by ES_OF_A_TEST" in capsys.readouterr().out
    assert json.loads((out / "config.json").read_text())["algo_name"] == reference
    assert run(["eval", str(out), "--episodes", "5", "--plots", str(tmp_path / "plots")]) == 0
    assert run(["train", "--resume", str(out)]) == 0
    config = e2efly.preset("hover", reference)
    assert type(config.algo) is ALGORITHMS["es_of_a_test"]
    assert config.reward == e2efly.preset("hover", "ppo").reward
    assert traced_folder(config) is None
    assert traced_folder(e2efly.preset("hover", "ppo")) is not None
    assert run([*train[:5], str(tmp_path / "bad"), *train[6:], "--algo.sigma", "-1"]) == 2
    assert "algo.sigma is -1.0; accepted: a number, 1e-09 to 10000" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("source", "name", "message"),
    [
        ("", "Lost", "unknown name in .*own.py 'Lost'"),
        ("import nothing_of_that_name", "Own", "own.py cannot be imported: ModuleNotFoundError"),
        ("class Own: pass", "Own", r"own.py:Own is .*; accepted: what its file registers as algorithm"),
        (
            "import e2efly\nfrom e2efly.config import AlgorithmConfig\n"
            "@e2efly.register_algorithm('ppo')\nclass Own(AlgorithmConfig): pass\n",
            "Own",
            "algorithm 'ppo' of .*own.py:Own is also the name of e2efly.config.algorithms:PPOConfig",
        ),
        (
            "import e2efly\n@e2efly.register_algorithm('odd')\nclass Own: pass\n",
            "Own",
            "accepted: a class that extends .*AlgorithmConfig",
        ),
    ],
)
def test_what_is_none_is_named_before_anything_compiles(tmp_path: Path, source: str, name: str, message: str) -> None:
    (tmp_path / "own.py").write_text(source)
    with pytest.raises(ValueError, match=message):
        e2efly.preset("hover", f"{tmp_path}/own.py:{name}")


def test_a_program_that_lacks_a_method_is_named(tmp_path: Path) -> None:
    (tmp_path / "lame.py").write_text(
        "from dataclasses import dataclass\nimport e2efly\nfrom e2efly.config import AlgorithmConfig\n"
        "from e2efly.learning.algorithm import Algorithm\n"
        "class Lame(Algorithm):\n    def init(self, env, config, seed): ...\n"
        "@e2efly.register_algorithm('lame')\n@dataclass(frozen=True)\nclass LameConfig(AlgorithmConfig):\n"
        "    program = Lame\n"
    )
    with pytest.raises(ValueError, match=r"lame.py:Lame has no update; accepted: all of init, update"):
        e2efly.train("hover", f"{tmp_path}/lame.py:LameConfig", out=tmp_path / "run")
    assert not (tmp_path / "run" / "policy.onnx").exists()
    assert issubclass(ALGORITHMS["lame"], AlgorithmConfig)
