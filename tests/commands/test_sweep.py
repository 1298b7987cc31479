"""Sweeps: runs side by side on a real Ray, resumed and never trained twice."""

import dataclasses
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from e2efly.commands.sweep import Sweep, trials_of
from tests.conftest import QUICK, NetworkTrace

SMALL = ["steps=6144", "chunk=2", "eval-episodes=20", "algo.envs=16", "algo.horizon=16", "algo.minibatch=128",
         "task.episode-s=1"]  # fmt: skip


def request(*vary: str, seeds: int = 1) -> Sweep:
    return Sweep("hover", "ppo", "nominal", seeds, vary, Path("sweep"), 1, 0, None)


def sweep(cwd: Path, *flags: str) -> subprocess.Popen[str]:
    asked = ["-m", "e2efly", "sweep", "hover", "--algo", "ppo", "--preset", "nominal", "--out", "sweep"]
    streams: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    return subprocess.Popen([sys.executable, *asked, *flags], cwd=cwd, env=os.environ | {"XLA_FLAGS": QUICK}, **streams)


def test_every_value_goes_with_every_other_and_every_seed() -> None:
    trials = list(trials_of(request("algo.gamma=0.9,0.99", "steps=1000", "network.hidden=8,8 8", seeds=2)))
    assert [t.out.name for t in trials[:3]] == [
        "algo.gamma-0.9_network.hidden-8_seed-0", "algo.gamma-0.9_network.hidden-8_seed-1",
        "algo.gamma-0.9_network.hidden-8-8_seed-0",
    ]  # fmt: skip
    assert len({t.out for t in trials}) == 8
    assert trials[-1].variant == "algo.gamma 0.99, network.hidden 8 8"
    assert trials[-1].arguments[-7:] == ("--algo.gamma", "0.99", "--steps", "1000", "--network.hidden", "8", "8")
    assert trials[-1].arguments[5:7] == ("--seed", "1")


@pytest.mark.parametrize("vary", ["seed=1,2", "device=gpu", "hosts.count=2", "algo.gamma", "algo.gamma="])
def test_what_cannot_be_varied_is_refused(vary: str) -> None:
    with pytest.raises(ValueError, match=f"--vary '{vary}'; accepted: OPTION=VALUE"):
        list(trials_of(request(vary)))


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (["--vary", "algo.gamma=0.9,0.9"], "two variants share a folder"),
        (["--vary", "algo.gamma=0.9", "algo.gamma=0.8"], "--vary algo.gamma twice"),
        (["--vary", "algo.gamma=0.9,1.9"], "algo.gamma is 1.9; accepted: a number, 1e-09 to 1"),
        (["--cores", "1000"], "--cores 1000 --gpus 0; accepted: what one machine has: "),
    ],
)
def test_what_cannot_run_is_refused_before_anything_does(flags: list[str], message: str, tmp_path: Path) -> None:
    process = sweep(tmp_path, *flags)
    told, _ = process.communicate()
    assert process.returncode == 2
    assert message in " ".join(told.split())
    assert not list(tmp_path.glob("sweep/*"))


@pytest.mark.parametrize(("name", "value"), [("seeds", 0), ("cores", 0), ("gpus", -1)])
def test_too_little_is_refused(name: str, value: int) -> None:
    with pytest.raises(ValueError, match=f"--{name} is {value}; accepted: {value + 1} or more"):
        list(trials_of(dataclasses.replace(request(), **{name: value})))


@pytest.mark.whole
def test_a_sweep_trains_on_ray_on_this_machine_alone_and_nothing_twice(tmp_path: Path, network: NetworkTrace) -> None:
    flags = ["--seeds", "1", "--vary", *SMALL, "network.hidden=8,8 8"]
    first = sweep(tmp_path, *flags)
    told, _ = first.communicate()
    assert first.returncode == 0, told
    runs = json.loads((tmp_path / "sweep/sweep.json").read_text())
    assert [run["variant"] for run in runs] == ["network.hidden 8", "network.hidden 8 8"]
    assert all(run["summary"]["env_steps"] == 6144 for run in runs)
    assert (tmp_path / "sweep/sweep.md").read_text().count("| network.hidden") == 2
    policy = tmp_path / "sweep/network.hidden-8_seed-0/policy.onnx"
    before = policy.stat().st_mtime_ns
    again = sweep(tmp_path, *flags)
    told, _ = again.communicate()
    assert again.returncode == 0
    assert "2 of them there already" in told
    assert policy.stat().st_mtime_ns == before
    other = sweep(tmp_path, *flags, "algo.gamma=0.9")
    told, _ = other.communicate()
    assert other.returncode == 2
    assert "another configuration: algo.gamma: 0.96 and 0.9" in " ".join(told.split())
    assert network.left() == []  # neither Ray's processes nor the trainings


@pytest.mark.whole
def test_a_run_that_was_cut_goes_on_and_a_lost_worker_is_replaced(tmp_path: Path) -> None:
    flags = [item if not item.startswith("steps") else "steps=40000" for item in SMALL]
    folder = tmp_path / "sweep/seed-0"

    def training() -> Path:
        return next(p for p in Path("/proc").iterdir() if p.name.isdigit() and str(folder) in _command(p))

    first = sweep(tmp_path, "--seeds", "1", "--vary", *flags)
    while _updates(folder) < 20:
        assert first.poll() is None, first.communicate()[0]
        time.sleep(0.01)
    os.kill(int(training().name), signal.SIGKILL)
    told, _ = first.communicate()
    assert first.returncode == 1, told
    assert "failed: seed-0: status -9" in " ".join(told.split())
    done, began = _updates(folder), (folder / "config.json").stat().st_mtime_ns
    second = sweep(tmp_path, "--seeds", "1", "--vary", *flags)
    while _updates(folder) <= done:
        assert second.poll() is None, second.communicate()[0]
        time.sleep(0.01)
    worker = int((training() / "stat").read_text().rsplit(")", 1)[1].split()[1])
    os.kill(worker, signal.SIGKILL)
    told, _ = second.communicate()
    assert second.returncode == 0, told
    assert json.loads((folder / "summary.json").read_text())["env_steps"] >= 40_000
    assert (folder / "config.json").stat().st_mtime_ns == began
    updates = [int(line.split(",")[0]) for line in (folder / "metrics.csv").read_text().splitlines()[1:]]
    assert updates == list(range(1, len(updates) + 1))


@pytest.mark.whole
def test_a_run_that_fails_is_told_and_the_others_end(tmp_path: Path) -> None:
    process = sweep(tmp_path, "--seeds", "1", "--vary", *SMALL, "env.vehicle=nowhere.toml,vis_r")
    told, _ = process.communicate()
    assert process.returncode == 1
    assert "failed: env.vehicle-nowhere.toml_seed-0: status 2: error:" in " ".join(told.split())
    assert (tmp_path / "sweep/env.vehicle-vis_r_seed-0/policy.onnx").exists()


def _updates(folder: Path) -> int:
    """Rows of a run's metrics so far."""
    metrics = folder / "metrics.csv"
    return metrics.read_text().count("\n") - 1 if metrics.exists() else 0


def _command(process: Path) -> str:
    try:
        return (process / "cmdline").read_text()
    except OSError:
        return ""
