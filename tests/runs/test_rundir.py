"""Run directories: what they keep, and what they refuse."""

import dataclasses
import shutil
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from e2efly.commands.cli import run as cli
from e2efly.config import TrainConfig
from e2efly.config.storage import held
from e2efly.environment.episodes import summary
from e2efly.runs.inputs import input_files
from e2efly.runs.rundir import RunDirectory
from e2efly.vehicles.loading import load_vehicle
from tests.learning.test_runner import flown, small

PACKAGE = Path(str(resources.files("e2efly")))


def own_files(folder: Path) -> TrainConfig:
    """A configuration of a race by sight whose vehicle, track and table of a noise are files in a folder."""
    folder.mkdir()
    shutil.copy(PACKAGE / "vehicles/vis_r.toml", folder / "mine.toml")
    shutil.copy(PACKAGE / "courses/tracks/s_shaped.toml", folder / "oval.toml")
    np.save(folder / "table.npy", np.ones((80, 80, 5), np.float32))
    config = small("race_clutter", "ppo")
    (camera, *_) = config.env.cameras
    noise = dataclasses.replace(camera.noise, redwood=str(folder / "table.npy"))
    env = dataclasses.replace(
        config.env, vehicle=str(folder / "mine.toml"), cameras=(dataclasses.replace(camera, noise=noise),)
    )
    task = dataclasses.replace(config.task, track=("j_shaped", str(folder / "oval.toml")))
    return dataclasses.replace(config, env=env, task=task)


def edit(file: Path) -> None:
    text = file.read_text()
    assert "value = 0.75\n" in text
    file.write_text(text.replace("value = 0.75\n", "value = 0.9\n", 1))


def test_a_run_keeps_the_files_that_it_is_made_from(tmp_path: Path) -> None:
    config, run = own_files(tmp_path / "files"), RunDirectory(tmp_path / "run")
    run.create(config)
    shutil.rmtree(tmp_path / "files")  # moved or deleted: the run is whole
    found = input_files(run.config())
    assert found.pop("task.track.0") == PACKAGE / "courses/tracks/j_shaped.toml"
    assert {field: path.relative_to(run.path / "inputs").as_posix() for field, path in found.items()} == {
        "env.vehicle": "env.vehicle/mine.toml",
        "task.track.1": "task.track.1/oval.toml",
        "env.cameras.0.noise.redwood": "env.cameras.0.noise.redwood/table.npy",
    }
    assert load_vehicle(run.config().env.vehicle).hash == load_vehicle("vis_r").hash
    run.check_same(config)  # as the command that began it named them


def test_a_reference_is_kept_too(tmp_path: Path) -> None:
    (tmp_path / "line.csv").write_text("t,x,y,z\n0,0,0,1\n1,1,0,1\n2,2,0,1\n")
    config = small("track", "bptt")
    config = dataclasses.replace(config, task=dataclasses.replace(config.task, reference=str(tmp_path / "line.csv")))
    run = RunDirectory(tmp_path / "run")
    run.create(config)
    assert run.config().task.reference == str(run.path / "inputs/task.reference/line.csv")  # pyright: ignore


def test_a_file_that_changed_is_refused_with_both_files_and_both_hashes(tmp_path: Path) -> None:
    config, run = own_files(tmp_path / "files"), RunDirectory(tmp_path / "run")
    run.create(config)
    mine = tmp_path / "files/mine.toml"
    edit(mine)
    hashes = [r"SHA-256 is [0-9a-f]{64}", r"SHA-256 [0-9a-f]{64}"]
    copy = run.path / "inputs/env.vehicle/mine.toml"
    for reader in (run.config, lambda: run.check_same(config)):
        with pytest.raises(ValueError, match=f"^{mine} has changed: its {hashes[0]}, .* made with {copy}, {hashes[1]}"):
            reader()
    assert load_vehicle(run.config(names_vehicle=True).env.vehicle).mass == 0.75
    shutil.copy(copy, mine)
    run.check_same(config)


def test_another_file_of_the_same_content_is_the_same_and_one_of_another_is_named(tmp_path: Path) -> None:
    config, run = own_files(tmp_path / "files"), RunDirectory(tmp_path / "run")
    run.create(config)
    (tmp_path / "elsewhere").mkdir()
    other = tmp_path / "elsewhere/mine.toml"
    shutil.copy(tmp_path / "files/mine.toml", other)
    moved = dataclasses.replace(config, env=dataclasses.replace(config.env, vehicle=str(other)))
    run.check_same(moved)
    edit(other)
    with pytest.raises(ValueError, match=r"env.vehicle: mine.toml \(SHA-256 \w+\) and mine.toml \(SHA-256 \w+\)$"):
        run.check_same(moved)


def test_a_copy_that_changed_is_refused(tmp_path: Path) -> None:
    run = RunDirectory(tmp_path / "run")
    run.create(own_files(tmp_path / "files"))
    edit(run.path / "inputs/env.vehicle/mine.toml")
    with pytest.raises(ValueError, match=r"inputs/env.vehicle/mine.toml: SHA-256 is \w+; accepted: \w+"):
        run.config()


def test_what_comes_with_the_package_has_its_name_until_the_package_changes_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = RunDirectory(tmp_path / "run")
    run.create(small())
    assert run.config().env.vehicle == "vis_r"
    about = run.read_json("inputs.json")
    edit(Path(shutil.copy(PACKAGE / "vehicles/vis_r.toml", tmp_path / "vis_r.toml")))  # as another version has it
    about["env.vehicle"]["original"] = str(tmp_path / "vis_r.toml")
    run.write_json("inputs.json", about)
    assert run.config().env.vehicle == str(run.path / "inputs/env.vehicle/vis_r.toml")


def test_a_run_of_an_older_version_is_read_without_copies(tmp_path: Path) -> None:
    run = RunDirectory(tmp_path / "run")
    config = small()
    run.create(config)
    (run.path / "inputs.json").unlink()
    assert run.config() == config


@pytest.mark.parametrize("content", [{"env.vehicle": 3}, {"env.vehicle": {"named": "vis_r"}}])
def test_damaged_inputs_are_named(content: dict[str, object], tmp_path: Path) -> None:
    run = RunDirectory(tmp_path / "run")
    run.create(small())
    run.write_json("inputs.json", content)
    with pytest.raises(ValueError, match=r"inputs.json: env.vehicle is .*; accepted: named, original and sha256"):
        run.config()


@pytest.mark.parametrize("file", ["checkpoint.safetensors", "summary.json", "policy.onnx"])
def test_a_run_is_not_overwritten(file: str, tmp_path: Path) -> None:
    run = RunDirectory(tmp_path / "run")
    run.create(small())
    (run.path / file).touch()
    with pytest.raises(ValueError, match="already holds a run"):
        run.create(small())


def row(update: int, seconds: float | str = "") -> dict[str, float | str]:
    return {"update": update, "seconds": seconds, "reward": 0.5 * update}


def test_a_run_that_never_got_to_a_checkpoint_gives_way_to_a_corrected_one(tmp_path: Path) -> None:
    run = RunDirectory(tmp_path / "run")
    run.create(small())
    run.append([row(1), row(2, 1.0)])  # its first chunk
    run.create(small(seed=5))
    assert run.config().seed == 5
    assert run.rows() == []


def test_a_run_without_its_checkpoint_is_not_begun_again(tmp_path: Path) -> None:
    run = RunDirectory(tmp_path / "run")
    run.create(small())
    run.check_resumable()  # killed before its first checkpoint: it begins again
    run.append([row(1), row(2, 1.0)])
    run.check_resumable()
    run.append([row(3), row(4, 2.0)])
    with pytest.raises(ValueError, match=r"checkpoint.safetensors is missing, but .* holds a run that had one"):
        run.check_resumable()
    run.checkpoint.touch()
    run.check_resumable()


def test_metrics_cut_anywhere_go_on_with_what_is_whole(tmp_path: Path) -> None:
    run = RunDirectory(tmp_path)
    run.append([row(1), row(2, 1.0), row(3)])
    text = run.metrics.read_text()
    whole = run.rows()
    for kept in range(len(text)):
        run.metrics.write_text(text[:kept])
        lines = max(text[:kept].count("\n") - 1, 0)
        assert run.rows() == whole[:lines]
        run.forget_after(2)
        lines = min(lines, 2)
        assert run.rows() == whole[:lines]
        run.append([row(update) for update in range(lines + 1, 4)])
        assert [r["update"] for r in run.rows()] == [1, 2, 3]


def test_a_policy_that_never_succeeds_has_no_time_of_success(tmp_path: Path) -> None:
    found = summary(flown([False, False], 1.0, 8.0)["task"])
    assert found["seconds_of_success"] is None
    run = RunDirectory(tmp_path)
    run.write_json("summary.json", {"shipped": found})
    assert run.read_json("summary.json") == {"shipped": found}


@pytest.mark.parametrize("command", ["ablate", "sweep"])
def test_the_folder_of_many_runs_is_one_process_s_too(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with held(tmp_path):
        assert cli([command, "hover", "--out", str(tmp_path)]) == 2
    assert f"--out {tmp_path} is in use by process " in " ".join(capsys.readouterr().err.split())
