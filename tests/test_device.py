"""How programs are compiled."""

import subprocess
import sys
from pathlib import Path

import pytest

from e2efly.device import wide_vectors

GRADIENT = """
import dataclasses, resource
from e2efly.device import set_xla_options
set_xla_options()
from e2efly import presets
from e2efly.learn.programs import Programs
from e2efly.learn.setup import Setup
config = presets.preset("hover", "bptt")
algo = dataclasses.replace(config.algo, envs=16, horizon=16)
setup = Setup.of(dataclasses.replace(config, algo=algo, chunk=2, eval_episodes=20, devices=1))
parameters = setup.algorithm.init(setup.env, algo, 0)
resource.setrlimit(resource.RLIMIT_DATA, (2 << 30, 2 << 30))
Programs.compile(setup, parameters)
"""


def test_the_gradient_of_a_few_vehicles_compiles_in_little_memory(tmp_path: Path) -> None:
    file = tmp_path / "gradient.py"
    file.write_text(GRADIENT)
    done = subprocess.run([sys.executable, str(file)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_many_vehicles_have_wide_vectors() -> None:
    assert wide_vectors(17) == {"xla_cpu_prefer_vector_width": 512}
    assert wide_vectors(16) == {}


def test_what_the_user_says_of_vectors_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XLA_FLAGS", "--xla_cpu_prefer_vector_width=256")
    assert wide_vectors(100) == {}
