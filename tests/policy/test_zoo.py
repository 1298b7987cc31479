"""The policy zoo: every policy does what is said of it."""

import dataclasses
import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import e2efly
from e2efly.commands.cli import run
from e2efly.config import AHEAD
from e2efly.environment import episodes
from e2efly.environment.stress_rows import rows_for
from e2efly.learning.onnx_export import contract_of
from e2efly.learning.setup import Setup
from e2efly.policy.loader import load_policy
from e2efly.policy.zoo import FOLDER, USUAL, beside, config_file, contents, is_policy, names, policy_file
from e2efly.runs.inputs import from_json
from e2efly.simulation.device import wide_vectors
from e2efly.tasks import TASKS
from e2efly.tasks.route import usual_route
from e2efly.validation import evaluation
from e2efly.validation.candidate import candidate
from e2efly.validation.stress import stress
from e2efly.validation.stress_laws import LAWS
from e2efly.vehicles.family import family_names
from e2efly.vehicles.loading import load_vehicle, vehicle_file, vehicle_names
from tests.conftest import QUICK, NetworkTrace

USUALLY = {"xla_backend_optimization_level": 3}
"""XLA's own, instead of `QUICK`: images take longer to draw than their program takes to compile."""
POLICIES = [(vehicle, task) for vehicle, tasks in contents().items() for task in tasks]
LATER = {"avoid_together"}
"""Tasks of which no policy is good enough yet."""


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(("vehicle", "task"), POLICIES)
def test_every_policy_succeeds_as_often_as_it_says(vehicle: str, task: str, monkeypatch: pytest.MonkeyPatch) -> None:
    found, about = candidate(task, vehicle), contents()[vehicle][task]
    starts = 100 if found.policy.contract.images else 200  # what it sees takes time
    if found.policy.contract.images:
        monkeypatch.setattr(evaluation, "BATCH", starts)  # no more fly than are looked at
        episodes._programs.cache_clear()
        monkeypatch.setattr(episodes, "wide_vectors", lambda vehicles: wide_vectors(vehicles) | USUALLY)
    flown, _, _ = evaluation.fly_criteria(found, starts, 123)
    for name, stated in about["success"].items():
        chance = 4 * np.sqrt(max(stated * (1 - stated), 0.003) / starts)  # four standard deviations
        assert np.mean(flown[name].success) >= stated - chance


@pytest.mark.parametrize(("vehicle", "task"), POLICIES)
def test_a_policy_is_of_the_configuration_beside_it(vehicle: str, task: str) -> None:
    """What a training by it would export has the contract that the policy has."""
    file = policy_file(task, vehicle)
    config = from_json(json.loads(config_file(file).read_text()), "")
    contract = load_policy(file).contract
    told = contract_of(Setup.of(config).env, config)
    # a policy of before the contracts had them does not say what it was trained to sense, and of others to know
    known = {name: getattr(contract, name) and getattr(told, name) for name in ("sensing", "others")}
    assert dataclasses.replace(told, **known) == contract


def test_a_policy_was_trained_for_what_it_flies_without_options() -> None:
    for vehicle, task in POLICIES:
        contract = load_policy(policy_file(task, vehicle)).contract
        assert contract.outside(usual_route(contract).domain()) == (), (vehicle, task)


def test_a_vehicle_has_one_mount_for_all_that_look_ahead_and_the_builder_is_told_it() -> None:
    """Of tasks as of policies: the camera that a builder mounts serves each. A LiDAR has a mount of its own: level."""
    cameras = [camera for task in TASKS.values() for camera in task.cameras]
    recipes = {(camera.pitch, camera.position) for camera in cameras if camera.projection == "pinhole"}
    assert {camera.pitch for camera in cameras if camera.projection == "spherical"} == {0.0}
    assert recipes == {(AHEAD.pitch, AHEAD.position), (math.pi / 2, AHEAD.position)}
    built = (FOLDER.parents[3] / "docs" / "hardware.md").read_text(encoding="utf-8")
    for vehicle, task in POLICIES:
        for image in load_policy(policy_file(task, vehicle)).contract.images:
            level = image.projection == "spherical"
            assert any(np.isclose(image.pitch_rad, pitch) for pitch, _ in recipes) or level
            assert f"| {task} | {image.mount} |" in built


@pytest.mark.whole
def test_robust_policies_fly_vehicles_that_are_not_theirs() -> None:
    """Rows that failed in every start of a policy without a memory, of all vehicles, and what zoo.json says of them."""
    robust = [(vehicle, task) for vehicle, task in POLICIES if "stress" in contents()[vehicle][task]]
    assert {task for _, task in robust} == {
        "avoid", "gap", "hall", "hover", "hover_aware", "land", "land_visual", "race", "race_clutter",
        "race_clutter_room", "race_speed", "track",
    }  # fmt: skip
    for vehicle, task in robust:
        stated = contents()[vehicle][task]["stress"]
        assert set(stated) == set(rows_for(TASKS[task].cameras))
        if not TASKS[task].cameras:  # a policy that sees takes minutes for a row
            assert set(contents()[vehicle][task]["untrained"]) == set(LAWS)
    for vehicle in [vehicle for vehicle, task in robust if task == "race"]:
        rows = ("mass x1.25", "delay +40 ms", "thrust x0.8")
        report = stress("race", 60, rows=rows, vehicle=vehicle, seed=123)
        stated = contents()[vehicle]["race"]["stress"]
        for row in rows:
            chance = 4 * np.sqrt(max(stated[row] * (1 - stated[row]), 0.003) / 60)
            assert report.success[row] >= stated[row] - chance


def test_it_has_every_task_for_the_usual_vehicle_and_none_is_large() -> None:
    assert set(contents()[USUAL]) == {*TASKS, "race_any", "race_told"} - LATER
    quadrotors = {name for name in vehicle_names() if load_vehicle(name).rotor_count == 4}
    assert set(contents()) == {*quadrotors, *family_names()}
    for task in ("hover", "land", "track", "race", "race_speed"):  # by poses alone: every vehicle has them
        assert all(task in tasks for whose, tasks in contents().items() if whose != "multirotor")
    assert {file.stem for file in FOLDER.glob("*/*.onnx")} == {*TASKS, "race_any", "race_told", "hover_rotors"} - LATER
    assert max(file.stat().st_size for file in FOLDER.glob("*/*.onnx")) < 1_000_000


def test_a_task_is_the_name_of_its_policy(tmp_path: Path) -> None:
    assert policy_file("hover") == FOLDER / USUAL / "hover.onnx"
    assert policy_file("hover", "crazyflie") == FOLDER / "crazyflie" / "hover.onnx"
    assert policy_file(tmp_path) == tmp_path / "policy.onnx"
    for whatever in (None, "vis_r", "any"):  # a policy of any vehicle goes by its family's name
        assert policy_file("any/hover", whatever) == FOLDER / "any" / "hover.onnx"
    assert policy_file("hover", "any") == FOLDER / "any" / "hover.onnx"
    for wrong in ("hovr", "any/hovr", "runs/hover", "hovr.onnx"):
        with pytest.raises(ValueError, match=rf"unknown policy '{wrong}'; did you mean '.*hover'.*any/race, .*path"):
            policy_file(wrong)
    with pytest.raises(ValueError, match=r"no policy 'avoid' of vehicle 'crazyflie'; accepted: vis_h, vis_r"):
        policy_file("avoid", "crazyflie")
    for own, values, whose in (
        ("mine.toml", "crazyflie", "crazyflie"),  # its values under another name
        ("crazyflie.toml", "vis_h", "vis_h"),  # values go before the name
        ("crazyflie.toml", None, "crazyflie"),
        ("heavy.toml", None, USUAL),  # of the nearest mass
    ):
        text = vehicle_file(values or USUAL).read_text()
        (tmp_path / own).write_text(text if values else text.replace("value = 0.75\n", "value = 0.8\n", 1))
        assert policy_file("hover", tmp_path / own) == FOLDER / whose / "hover.onnx"
    # by sight there is none of that name: the mass decides
    assert policy_file("avoid", tmp_path / "crazyflie.toml") == FOLDER / USUAL / "avoid.onnx"
    (tmp_path / "light.toml").write_text(vehicle_file(USUAL).read_text().replace("value = 0.75\n", "value = 0.5\n", 1))
    assert policy_file("avoid", tmp_path / "light.toml") == FOLDER / "vis_h" / "avoid.onnx"
    with pytest.raises(ValueError, match=r"unknown vehicle 'vis_x'; did you mean 'vis_r'"):
        policy_file("hover", "vis_x")
    assert beside(FOLDER / USUAL / "hover.onnx") == Path("runs/zoo-hover-vis_r")


def test_every_command_takes_every_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in names():
        assert is_policy(name)
        assert policy_file(name).is_file()
    assert not is_policy("forest")
    assert run(["export", "hover"]) == 0
    assert run(["export", "any/hover", "--out", "any.onnx"]) == 0
    assert Path("runs/zoo-hover-vis_r/policy.onnx").read_bytes() == policy_file("hover").read_bytes()
    assert Path("any.onnx").read_bytes() == policy_file("any/hover").read_bytes()
    assert run(["export", "hover", "--which", "last"]) == 2
    monkeypatch.setattr("e2efly.commands.watch.run", lambda watched: len(watched.what[0]))
    assert run(["render", "any/hover"]) == len("any/hover")  # it films the policy


def test_a_policy_is_loaded_by_what_the_command_line_takes(tmp_path: Path) -> None:
    file = FOLDER / USUAL / "hover.onnx"
    shutil.copy(file, tmp_path / "policy.onnx")
    for name in ("hover", str(file), tmp_path, tmp_path / "policy.onnx"):
        assert e2efly.load_policy(name).contract.vehicle == "vis_r"
    assert e2efly.load_policy("hover", vehicle="crazyflie").contract.vehicle == "crazyflie"
    with pytest.raises(ValueError, match=r"mass of vehicle 'crazyflie' is 0.027 kg, 96 % less than .*; accepted: 0.56"):
        e2efly.load_policy(file, vehicle="crazyflie")


@pytest.mark.whole
def test_a_policy_of_the_zoo_flies_a_vehicle_of_ones_own(tmp_path: Path) -> None:
    heavy = tmp_path / "heavy.toml"
    heavy.write_text(vehicle_file("vis_r").read_text().replace("value = 0.75\n", "value = 0.8\n", 1))
    error = {}
    for task in ("hover", "hover_aware"):
        own, usual = (e2efly.evaluate(task, 10, vehicle=vehicle) for vehicle in (str(heavy), None))
        assert own.success == usual.success == 1
        assert own.as_json()["vehicle"] == str(heavy)
        ends = [each.flown[task].final_error for each in (own, usual)]
        assert not np.allclose(*ends, atol=1e-6)  # it is another vehicle that flew
        error[task] = np.mean(ends[0]) - np.mean(ends[1])
    assert max(error.values()) < 0.005  # they feel the weight


@pytest.mark.whole
def test_eval_by_name_works_at_once_writes_nothing_into_the_package_and_reaches_nobody(
    tmp_path: Path, network: NetworkTrace
) -> None:
    command = [sys.executable, "-m", "e2efly", "eval", "hover", "--episodes", "20", "--json", "report.json"]
    environment = os.environ | {"XLA_FLAGS": QUICK}
    subprocess.run(command, cwd=tmp_path, env=environment, check=True, stdout=subprocess.DEVNULL)
    assert json.loads((tmp_path / "report.json").read_text())["criteria"]["hover"]["success"] == 1.0
    assert (tmp_path / "runs/zoo-hover-vis_r/plots/errors.png").exists()
    assert not (FOLDER / USUAL / "plots").exists()
    assert network.left() == []


def test_a_damaged_file_of_the_zoo_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(FOLDER, tmp_path / "zoo")
    monkeypatch.setattr("e2efly.policy.zoo.FOLDER", tmp_path / "zoo")
    hover, index = tmp_path / "zoo" / USUAL / "hover.onnx", tmp_path / "zoo" / "zoo.json"
    assert policy_file("hover") == hover
    shutil.copy(hover.with_name("land.onnx"), hover)
    with pytest.raises(ValueError, match=r"hover\.onnx: SHA-256 is \w+, another than zoo\.json says; install"):
        policy_file("hover")
    for text in ("", "{", "[1]", '{"vis_r": 1}', '{"vis_r": {"hover": []}}', "[" * 100_000):
        index.write_text(text)
        with pytest.raises(ValueError, match=r"zoo\.json: damaged .*; install e2efly again"):
            policy_file("hover")
