"""The policy zoo: every policy does what is said of it."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from e2efly.commands import evaluate
from e2efly.commands.evaluate import config_from_contract, fly_suites
from e2efly.deploy.policy import load_policy
from e2efly.device import wide_vectors
from e2efly.tasks import TASKS
from e2efly.vehicles import vehicle_names
from e2efly.zoo import FOLDER, USUAL, beside, contents, policy_path
from tests.conftest import QUICK, NetworkTrace

USUALLY = {"xla_backend_optimization_level": 3}
"""XLA's own, instead of `QUICK`: images take longer to draw than their program takes to compile."""
POLICIES = [(vehicle, task) for vehicle, tasks in contents().items() for task in tasks]


@pytest.mark.parametrize(("vehicle", "task"), POLICIES)
def test_every_policy_succeeds_as_often_as_it_says(vehicle: str, task: str, monkeypatch: pytest.MonkeyPatch) -> None:
    policy, about = load_policy(policy_path(Path(task), vehicle)), contents()[vehicle][task]
    starts = 100 if policy.contract.images else 200  # what it sees takes time
    if policy.contract.images:
        monkeypatch.setattr(evaluate, "wide_vectors", lambda vehicles: wide_vectors(vehicles) | USUALLY)
    flown, _ = fly_suites(policy, *config_from_contract(policy), starts, 123)
    for name, stated in about["success"].items():
        chance = 4 * np.sqrt(max(stated * (1 - stated), 0.003) / starts)  # four standard deviations
        assert np.mean(flown[name].success) >= stated - chance


def test_it_has_every_task_for_the_usual_vehicle_and_none_is_large() -> None:
    assert set(contents()[USUAL]) == set(TASKS)
    assert set(contents()) == set(vehicle_names())
    assert {file.stem for file in FOLDER.glob("*/*.onnx")} == set(TASKS)
    assert max(file.stat().st_size for file in FOLDER.glob("*/*.onnx")) < 1_000_000


def test_a_task_is_the_name_of_its_policy(tmp_path: Path) -> None:
    assert policy_path(Path("hover")) == FOLDER / USUAL / "hover.onnx"
    assert policy_path(Path("hover"), "crazyflie") == FOLDER / "crazyflie" / "hover.onnx"
    assert policy_path(tmp_path) == tmp_path
    assert policy_path(Path("runs/mine")) == Path("runs/mine")
    with pytest.raises(ValueError, match=r"unknown policy 'hovr'.*hover"):
        policy_path(Path("hovr"))
    with pytest.raises(ValueError, match=r"no policy 'avoid' of vehicle 'crazyflie'; accepted: vis_r"):
        policy_path(Path("avoid"), "crazyflie")
    assert beside(FOLDER / USUAL / "hover.onnx") == Path("runs/zoo-hover-vis_r")


def test_eval_by_name_works_at_once_writes_nothing_into_the_package_and_reaches_nobody(
    tmp_path: Path, network: NetworkTrace
) -> None:
    command = [sys.executable, "-m", "e2efly", "eval", "hover", "--episodes", "20", "--json", "report.json"]
    environment = os.environ | {"XLA_FLAGS": QUICK}
    subprocess.run(command, cwd=tmp_path, env=environment, check=True, stdout=subprocess.DEVNULL)
    assert json.loads((tmp_path / "report.json").read_text())["criteria"]["hover"]["mean"]["success"] == 1.0
    assert (tmp_path / "runs/zoo-hover-vis_r/plots/errors.png").exists()
    assert not (FOLDER / USUAL / "plots").exists()
    assert network.left() == []


def test_a_damaged_file_of_the_zoo_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(FOLDER, tmp_path / "zoo")
    monkeypatch.setattr("e2efly.zoo.FOLDER", tmp_path / "zoo")
    hover, index = tmp_path / "zoo" / USUAL / "hover.onnx", tmp_path / "zoo" / "zoo.json"
    assert policy_path(Path("hover")) == hover
    shutil.copy(hover.with_name("land.onnx"), hover)
    with pytest.raises(ValueError, match=r"hover\.onnx: SHA-256 is \w+, another than zoo\.json says; install"):
        policy_path(Path("hover"))
    for text in ("", "{", "[1]", '{"vis_r": 1}', '{"vis_r": {"hover": []}}', "[" * 100_000):
        index.write_text(text)
        with pytest.raises(ValueError, match=r"zoo\.json: damaged .*; install e2efly again"):
            policy_path(Path("hover"))
