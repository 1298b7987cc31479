"""The command line as its user meets it."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import e2efly
from e2efly.commands.cli import COMMANDS, run
from e2efly.commands.train import parse
from e2efly.learning.judge import verdict
from e2efly.runs.inputs import to_json
from e2efly.vehicles.loading import vehicle_file
from tests.learning.one_program import compile_once

pytestmark = pytest.mark.usefixtures("quick")


def error_of(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """The error text of a call that must end with status 2."""
    try:
        status = run(arguments)
    except SystemExit as end:  # the parser's own way out
        status = end.code
    assert status == 2
    captured = capsys.readouterr()
    return " ".join((captured.err + captured.out).split())


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["trian"], "unknown command 'trian'; did you mean 'train'?"),
        (["play"], "unknown command 'play'; did you mean 'watch'?"),
        (["score"], "unknown command 'score'; did you mean 'benchmark'?"),
        (["fyl"], "unknown command 'fyl' (there are: ablate,"),  # never one that moves a real vehicle
        (["list", "reward"], "unknown catalogue 'reward'; did you mean 'rewards'?"),
        (
            ["train", "hover", "lr=1e-3"],
            "unknown option 'lr=1e-3'; did you mean --env.lost-rotor or --algo.learning-rate?",
        ),
        (
            ["train", "hover", "--lr", "1e-3"],
            "unknown option '--lr'; did you mean --env.lost-rotor or --algo.learning-rate?",
        ),
        (
            ["train", "hover", "--reward.weights", "v1", "1", "--reward.weights", "near", "1"],
            "--reward.weights is given twice; accepted: once, with all of its values after it",
        ),
        (["train", "hover", "--gpu"], "unknown option '--gpu'; did you mean --device gpu?"),
        (["train", "race", "--task.lap=2"], "unknown option '--task.lap=2'; did you mean --task.laps"),
        (["eval", "--episode", "5"], "unknown option '--episode'; did you mean --episodes or"),  # and no policy
        (["export", "hover", "there"], "'there' is one argument too many for `e2efly export`"),
        (
            ["train", "hoover"],
            "unknown task 'hoover'; did you mean 'hover'? (there are: avoid, avoid_together, dodge, gap, hall, hover, ",
        ),
        (
            ["train"],
            "train needs a task first: avoid, avoid_together, dodge, gap, hall, hover, hover_aware, hover_payload",
        ),
        (["train", "hover", "--algo", "bppt"], "unknown algorithm 'bppt'; did you mean 'bptt'?"),
        (["train", "hover", "--preset", "papr"], "unknown preset 'papr'; did you mean 'paper'?"),
        (["train", "hover", "--vehicle", "vis_x"], "unknown vehicle 'vis_x'; did you mean 'vis_r'?"),
        (["train", "hover", "--algo.gama", "0.9"], "--algo.gamma"),
        (["train", "race", "--task.track", "s_shape"], "unknown track 's_shape'; did you mean 's_shaped'?"),
        (["train", "track", "--task.reference", "cirle"], "unknown reference 'cirle'; did you mean 'circle'?"),
        (["train", "hover", "--env.command-mode", "ctrb"], "unknown command mode 'ctrb'; did you mean 'ctbr'?"),
        (["train", "hover", "--reward.weights", "prog9", "1"], "unknown reward term 'prog9'"),
        (["train", "hover", "--algo.envs", "0"], "algo.envs is 0; accepted: a whole number, 1 to 2147483647"),
        (
            ["train", "hover", "--algo", "ppo", "--algo.minibatch", "1000"],
            "algo.minibatch is 1000; accepted: a divisor",
        ),
        (["train", "hover", "--env.randomize", "mas", "0.1"], "unknown vehicle parameter 'mas'; did you mean 'mass'?"),
        (
            ["train", "hover", "--vehicle", "vis_r", "--env.vehicle", "crazyflie"],
            "--vehicle is vis_r and --env.vehicle is crazyflie; accepted: one of them alone",
        ),
        (
            ["train", "hover", "--env.vehicle=vis_r", "--vehicle=crazyflie"],
            "--vehicle is crazyflie and --env.vehicle is vis_r; accepted: one of them alone",
        ),
        (
            ["train", "hover", "--task.target", "0", "0", "-3"],
            "task.target is (0.0, 0.0, -3.0); accepted: a place more than 0.05 m over the ground",
        ),
        (["train", "hover_aware", "--task.target", "0", "0", "0"], "task.target is (0.0, 0.0, 0.0); accepted: a place"),
        (["train", "track", "--task.centre", "0", "0", "-1"], "task.centre is (0.0, 0.0, -1.0); accepted: a place"),
        (["train", "hover", "--device", "gpu"], "--device gpu is not available"),
        (["train", "hover", "--hosts.count", "0", "--hosts.coordinator", "a:1"], "hosts.count is 0; accepted: 1 or"),
        (["train", "hover", "--task.radius", "-1"], "task.radius is -1.0; accepted: a number, 1e-09 to 10000"),
        (
            ["train", "hover", "--task.hold-s", "100"],
            "task.hold_s is 100.0; accepted: 0 to the 8 s of task.episode_s",
        ),
        *(
            (
                ["train", "hover", "--env.control-rate", "5e3", f"--task.{name.replace('_', '-')}", "9000"],
                f"task.{name} is 9000.0; accepted: at most 3355.44 s, as far as float32 counts the control steps",
            )
            for name in ("episode_s", "judged_s")
        ),
        (
            ["train", "avoid", "--task.forest.density", "0.2"],
            "task.forest.room is 64; accepted: 128 or more, the trees",
        ),
        (
            ["train", "race_clutter", "--task.clutter.room", "18"],
            "task.clutter.room is 18; accepted: a positive multiple",
        ),
        (
            ["train", "race_clutter", "--task.clutter.obstacles", "20"],
            "task.clutter.obstacles is 20.0; accepted: at most",
        ),
        (["ablate", "hover", "--seeds", "0"], "--seeds is 0; accepted: 1 or more"),
        (["fly", "--link", "tcp:127.0.0.1:1", "--latency", "60"], "--latency is 60.0; accepted: 0 to 0.5 s"),
        (["fly", "--link", "tcp:127.0.0.1:1", "--latency", "-1"], "--latency is -1.0; accepted: 0 to 0.5 s"),
        (
            ["fly", "hover", "--link", "tcp:127.0.0.1:1", "--throttle-map", "nowhere.json"],
            "--throttle-map nowhere.json: No such file or directory",
        ),
        (["eval", "nowhere.onnx"], "nowhere.onnx"),
        (["eval", "nowhere.onnx", "--episodes", "0"], "--episodes is 0; accepted: more than 0"),
        (
            ["export", "nowhere"],
            "unknown policy 'nowhere'; did you mean 'hover'? (there are: any/hover, any/hover_rotors, any/land",
        ),
        (
            ["render", "forst"],
            "unknown scene or policy 'forst'; did you mean 'forest'? (there are: any/hover, any/hover_rotors,",
        ),
        (["render", "nowhere.toml"], "nowhere.toml: No such file or directory; accepted: the path of a .toml file"),
        (["render", "forest", "--width", "4"], "--width is 4; accepted: 8 to 4096 pixels"),
        (["render", "forest", "--camera", "fvp"], "--camera"),
        (["render", "forest", "--yaw", "nan"], "--yaw is nan; accepted: finite numbers"),
        (["render", "forest", "--time", "inf"], "--time is inf; accepted: finite numbers"),
        (
            ["render", "forest", "--position", "0", "nan", "1"],
            "--position is (0.0, nan, 1.0); accepted: finite numbers",
        ),
    ],
)
def test_bad_input_is_named_with_what_exists(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    if arguments[0] == "train" and len(arguments) > 1:
        arguments = [*arguments, "--out", str(tmp_path / "run")]
    assert said in error_of(arguments, capsys)


def test_whole_numbers_may_be_written_with_an_exponent(capsys: pytest.CaptureFixture[str]) -> None:
    asked = parse(["hover", "--steps", "1e6", "--algo.horizon", "1.28e2", "--seed", "7"]).config
    assert (asked.steps, asked.algo.horizon, asked.seed) == (1_000_000, 128, 7)
    for wrong in ("1e-6", "1.5", "many", "inf"):
        assert "Error parsing --steps" in error_of(["train", "hover", "--steps", wrong], capsys)


@pytest.mark.parametrize(
    ("arguments", "folder"),
    [
        ("hover", "runs/hover-bptt-0"),
        ("hover --algo ppo --seed 3", "runs/hover-ppo-3"),
        ("hover --vehicle crazyflie", "runs/hover-bptt-crazyflie-0"),
        ("hover --env.vehicle=my/heavy.toml", "runs/hover-bptt-heavy-0"),
        ("hover --vehicle crazyflie --out here", "here"),
    ],
)
def test_runs_of_another_vehicle_have_a_folder_of_their_own(
    arguments: str, folder: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my").mkdir()
    (tmp_path / "my/heavy.toml").write_text(vehicle_file("vis_r").read_text())
    assert parse(arguments.split()).out == Path(folder)


@pytest.mark.whole
def test_a_run_is_deleted_only_when_that_is_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    compile_once(monkeypatch)
    folder, mine = tmp_path / "run", tmp_path / "run" / "notes.txt"
    flags = ["--algo", "ppo", "--preset", "nominal", "--steps", "1024", "--chunk", "2", "--eval-episodes", "20",
             "--algo.envs", "16", "--algo.horizon", "16", "--algo.minibatch", "128", "--task.episode-s", "1",
             "--no-plots", "--out", str(folder)]  # fmt: skip
    assert run(["train", "hover", *flags]) == 0
    mine.write_text("mine")
    before = (folder / "checkpoint.safetensors").read_bytes()
    assert "already holds a run; accepted: a new folder, --resume to go on with this one, or --overwrite" in error_of(
        ["train", "hover", *flags, "--seed", "3"], capsys
    )
    assert "--resume and --overwrite are both given" in error_of(
        ["train", "hover", *flags, "--resume", "--overwrite"], capsys
    )
    # what is refused deletes nothing
    assert "unknown vehicle" in error_of(["train", "hover", *flags, "--overwrite", "--vehicle", "vis_x"], capsys)
    assert (folder / "checkpoint.safetensors").read_bytes() == before
    assert run(["train", "hover", *flags, "--seed", "3", "--overwrite"]) == 0
    assert json.loads((folder / "summary.json").read_text())["seed"] == 3
    assert len((folder / "metrics.csv").read_text().splitlines()) == 5  # a header, and its own four updates
    assert mine.read_text() == "mine"


def test_resume_needs_a_run(capsys: pytest.CaptureFixture[str]) -> None:
    assert "--resume names no run; accepted: the run's folder, as in `e2efly train --resume DIR`" in error_of(
        ["train", "--resume"], capsys
    )
    for arguments in (["--resume", "nowhere"], ["--resume=nowhere"], ["--out", "nowhere", "--resume"]):
        assert "nowhere holds no run: there is no config.json" in error_of(["train", *arguments], capsys)
    assert not Path("nowhere").exists()


def test_a_folder_that_cannot_be_made_is_named(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert "cannot make --out" in error_of(["train", "hover", "--out", str(tmp_path / "file/run")], capsys)


@pytest.mark.parametrize("arguments", [["--help"], ["train", "--help"], ["train", "race", "--algo", "bptt", "--help"],
                                       ["eval", "--help"], ["bench", "--help"], ["benchmark", "--help"],
                                       ["render", "--help"], ["--version"]])  # fmt: skip
def test_help_imports_no_jax(arguments: list[str]) -> None:
    code = (
        "import sys; from e2efly.commands.cli import run\n"
        f"try: run({arguments!r})\nexcept SystemExit: pass\n"
        "sys.exit('jax' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
    assert done.returncode == 0
    assert b"e2efly" in done.stdout or b"0." in done.stdout


def test_a_configuration_file_gives_all_that_options_do_not_change(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, own = tmp_path / "mine.json", ["--seed", "3", "--task.track", "s_shaped", "--reward.weights", "goal", "2"]
    first = parse(["race", "--algo", "ppo", *own]).config
    file.write_text(json.dumps(to_json(first)), encoding="utf-8")
    given = ["--config", str(file)]
    assert parse(given).config == parse(["race", *given]).config == first
    other = parse([*given, "--seed", "4", "--reward.weights", "goal", "0"])
    assert (other.config.seed, other.config.task, other.out) == (4, first.task, Path("runs/race-ppo-4"))
    assert {**other.config.reward.weights, "goal": 2.0} == first.reward.weights
    for arguments, said in (
        (["hover", *given], f"TASK is hover, but --config {file} gives the defaults (race); accepted: to leave it out"),
        ([*given, "--algo", "bptt"], "--algo is bptt, but"),
        ([*given, "--preset", "paper"], "--preset is paper, but"),
        (["--config", str(tmp_path / "no.json")], "no.json cannot be read"),
    ):
        assert said in error_of(["train", *arguments], capsys)
    file.write_text(json.dumps({**to_json(first), "sed": 1}), encoding="utf-8")
    assert f"{file}: unknown or missing key: ['sed']" in error_of(["train", *given], capsys)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_is_one_screen_and_names_its_arguments(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "110")
    with pytest.raises(SystemExit):
        run([command, "--help"])
    said = capsys.readouterr().out
    assert said.startswith(f"usage: e2efly {command} ")
    assert len(said.splitlines()) <= 50
    assert "[[" not in said
    assert "{None}" not in said
    assert f"`e2efly {command} --help-all` prints every option in full" in said


@pytest.mark.parametrize(("command", "other"), [("bench", "benchmark"), ("benchmark", "bench")])
def test_two_commands_of_like_names_say_what_the_other_does(
    command: str, other: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        run([command, "--help"])
    assert f"(`e2efly {other}` " in capsys.readouterr().out


def test_every_option_of_train_has_help() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "e2efly", "train", "race", "--help-all"], capture_output=True, check=True, text=True
    )
    for flag in ("TASK", "--algo ", "--vehicle", "--seed", "--out", "--resume", "--algo.gamma", "--task.laps",
                 "--env.noise.position", "--env.imu.observed", "--reward.weights", "--network.hidden"):  # fmt: skip
        assert flag in done.stdout


@pytest.mark.parametrize("command", [["--help"], ["list"]])
def test_a_reader_that_has_enough_is_no_error(command: list[str]) -> None:
    """As `e2efly list | head -1`."""
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, "-m", "e2efly", *command], stdout=writing, stderr=subprocess.PIPE, check=False
    )
    os.close(writing)
    assert done.stderr == b""
    assert done.returncode == 141


def test_list_names_everything(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["list"]) == 0
    out = capsys.readouterr().out
    assert len(out.splitlines()) <= 10
    for name in ("hover", "bptt", "vis_r", "crazyflie", "robust", "any/hover", "zoo|rewards"):
        assert name in out
    for catalogue, names in {
        "tasks": ["Fly to a point"], "algorithms": ["Proximal policy"], "presets": ["any_track"],
        "vehicles": ["crazyflie", "0.027"], "families": ["0.025 to 12"], "zoo": ["vis_h/avoid", "lemniscate"],
        "rewards": ["avoid2", "sparse"], "scenes": ["forest", "circle_3d", ".glb"], "cameras": ["d435i", "spherical"],
        "rest": ["circle_3d", "position", "rk3", "mpc", "mujoco", "lemniscate"],
    }.items():  # fmt: skip
        assert run(["list", catalogue]) == 0
        out = capsys.readouterr().out
        assert all(name in out for name in names), catalogue
        assert "\u2026" not in out  # nothing is cut in a pipe


def a_summary(success: float, reached: dict[str, float]) -> dict[str, Any]:
    """Of a run whose shipped policy succeeds so often by its worse criterion."""
    shipped = {"update": 20, "circle": {"success": success}, "lemniscate": {"success": 1.0}}
    return {"task": "track", "algorithm": "ppo", "shipped": shipped, "reached_criterion": reached}


@pytest.mark.parametrize(
    ("success", "stop_at", "reached", "said"),
    [
        (0.0, None, {}, "Did not learn track by PPO: no success"),
        (0.4, None, {}, "Did not learn track by PPO reliably: success 40.0% (vehicle of the file)"),
        (0.94, None, {}, "Did not learn track by PPO reliably: success 94.0% (vehicle of the file)"),
        (0.95, None, {}, "Learned track by PPO: success 95.0% (vehicle of the file)"),
        (0.97, 0.99, {}, "Did not learn track by PPO reliably: success 97.0% (vehicle of the file)"),
        (0.985, 0.99, {"seconds": 3.0, "steps": 1e6}, "Learned track by PPO: success 98.5% (vehicle of the file)"),
        (0.8, 0.8, {}, "Learned track by PPO: success 80.0% (vehicle of the file)"),
    ],
)
def test_what_was_not_learned_is_not_called_learned(
    success: float, stop_at: float | None, reached: dict[str, float], said: str
) -> None:
    assert verdict(a_summary(success, reached), stop_at) == said


@pytest.mark.parametrize(
    ("success", "learned"), [(0.46, "Did not learn track by PPO reliably"), (0.9, "Learned track by PPO")]
)
def test_a_policy_for_random_vehicles_is_learned_if_it_flies_them(success: float, learned: str) -> None:
    summary = a_summary(success, {}) | {"nominal": a_summary(1.0, {})["shipped"]}
    told = f"{learned}: success 100.0% (vehicle of the file), {success:.1%} (random vehicles)"
    assert verdict(summary, None) == told


@pytest.mark.whole
def test_train_eval_export_and_plots_end_to_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "run"
    flags = ["--algo", "ppo", "--steps", "2048", "--chunk", "2", "--eval-episodes", "20", "--algo.envs", "16",
             "--algo.horizon", "16", "--algo.minibatch", "128", "--task.episode-s", "1"]  # fmt: skip
    mine = tmp_path / "mine.toml"
    mine.write_text((Path(e2efly.__file__).parent / "vehicles/vis_r.toml").read_text())
    flags += ["--vehicle", str(mine)]
    assert run(["train", "hover", "--out", str(folder), *flags]) == 0
    told = capsys.readouterr().out
    assert "Did not learn hover by PPO: no success" in told
    assert "nan" not in told
    files = ("config.json", "versions.json", "metrics.csv", "summary.json", "policy.onnx", "checkpoint.safetensors")
    for name in (*files, *(f"plots/{plot}.png" for plot in ("learning", "errors", "flights_hover", "time_hover"))):
        assert (folder / name).stat().st_size > 0
    assert list((folder / "events").iterdir())
    report = tmp_path / "report.json"
    assert run(["eval", str(folder), "--episodes", "30", "--json", str(report)]) == 0
    content = json.loads(report.read_text())
    starts = content["criteria"]["hover"]["starts"]
    assert len(starts) == 30
    assert len({tuple(row["start"]["position"]) for row in starts}) == 30
    assert all(abs(x) <= 2 for row in starts for x in row["start"]["velocity"])
    assert 0 <= content["criteria"]["hover"]["success_interval_95"][1] <= 1
    before = (folder / "policy.onnx").read_bytes()
    assert run(["export", str(folder)]) == 0
    assert (folder / "policy.onnx").read_bytes() == before
    older = tmp_path / "older.onnx"
    older.write_bytes(before[: before.rindex(b"\x72\x4a\x0a\x06sha256")])
    assert "of an older e2efly" in error_of(["eval", str(older)], capsys)
    assert run(["export", str(older)]) == 0
    assert older.read_bytes() == before
    assert "has a digest already" in error_of(["export", str(older)], capsys)
    (folder / "policy.onnx").write_bytes(before[:100])
    assert "policy.onnx" in error_of(["eval", str(folder)], capsys)
    assert "already holds a run" in error_of(["train", "hover", "--out", str(folder)], capsys)
    assert "seed: 0 and 3" in error_of(
        ["train", "hover", "--out", str(folder), *flags, "--seed", "3", "--resume"], capsys
    )
    (folder / "policy.onnx").write_bytes(before)
    for options, said in (
        (["--seed", "3"], "another configuration: seed: 0 and 3"),
        (["--algo", "bptt"], f"--algo is bptt, but {folder} goes on as it began (ppo); accepted: to leave it out"),
        (["--preset", "paper"], "--preset is paper, but"),
        (["--task.target", "0", "0", "4"], "another configuration: task.target: (0.0, 0.0, 3.0) and (0.0, 0.0, 4.0)"),
    ):
        assert said in error_of(["train", "--resume", str(folder), *options], capsys)
    mine.write_text(mine.read_text().replace("value = 0.75\n", "value = 0.9\n", 1))  # the mass
    for command in (["eval"], ["export"], ["validate"], ["fly"], ["train", "--resume"]):
        said = error_of([*command, str(folder)], capsys)
        assert f"{mine} has changed: its SHA-256 is" in said, command
        assert f"but the run was made with {folder}/inputs/env.vehicle/mine.toml, SHA-256" in said, command
    assert (folder / "policy.onnx").read_bytes() == before
    mine.unlink()  # what is moved or deleted does not matter
    assert run(["export", str(folder)]) == 0
    assert (folder / "policy.onnx").read_bytes() == before
    assert "--link tcp:127.0.0.1:1: " in error_of(["fly", str(folder), "--link", "tcp:127.0.0.1:1"], capsys)
