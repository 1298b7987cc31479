"""Devices and processes that share a run learn what one alone does."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load_file

from e2efly.runs.rundir import RunDirectory
from tests.conftest import QUICK
from tests.learning.test_runner import MORE, SMALL, timeless, wait_for_update
from tests.waiting import free_port

Process = subprocess.Popen[bytes]
PPO = [*SMALL, *MORE["ppo"], "--algo", "ppo"]
BPTT = [*SMALL, "--algo", "bptt"]


def start(cwd: Path, out: str, *flags: str, devices: int, told: str = "output.txt") -> Process:
    command = [sys.executable, "-m", "e2efly", "train", "hover", "--preset", "nominal", *flags, "--out", out]
    with (cwd / told).open("ab") as output:
        environment = os.environ | {"JAX_NUM_CPU_DEVICES": str(devices), "XLA_FLAGS": QUICK}
        return subprocess.Popen(command, cwd=cwd, stdout=output, stderr=output, env=environment)


def pair(cwd: Path, out: str, *flags: str) -> list[Process]:
    """Two processes of one run, with a device each; `output.txt` is of the first, `other.txt` of the second."""
    hosts = ["--hosts.coordinator", f"127.0.0.1:{free_port()}", "--hosts.count", "2", "--hosts.index"]
    return [
        start(cwd, out, *flags, *hosts, str(i), devices=1, told=told)
        for i, told in enumerate(("output.txt", "other.txt"))
    ]


def ended(cwd: Path, *processes: Process) -> None:
    for process in processes:
        assert process.wait(timeout=600) == 0, "".join(file.read_text() for file in cwd.glob("*.txt"))


def same_learning(cwd: Path, one: str, other: str, rtol: float, flown: bool = True) -> None:
    """The same curves and the same policy, but for the order in which numbers were added; `flown`: evaluations, too."""
    curves = [timeless(RunDirectory(cwd / run).rows()) for run in (one, other)]
    assert len(curves[0]) == len(curves[1]) > 5
    for a, b in zip(*curves, strict=True):
        a, b = ({k: v for k, v in row.items() if flown or not k.startswith("eval/")} for row in (a, b))
        assert a == pytest.approx(b, rel=rtol, abs=rtol)
    weights = [load_file(cwd / run / "checkpoint.safetensors") for run in (one, other)]
    for name in (name for name in weights[0] if "'best'" in name):
        np.testing.assert_allclose(weights[0][name], weights[1][name], rtol=rtol, atol=rtol, err_msg=name)


@pytest.mark.whole
def test_two_processes_learn_as_one_with_two_devices(tmp_path: Path) -> None:
    ended(tmp_path, *pair(tmp_path, "two", *PPO, "--devices", "2"))
    ended(tmp_path, start(tmp_path, "one", *PPO, "--devices", "2", devices=2))
    same_learning(tmp_path, "two", "one", 1e-3)
    assert (tmp_path / "two/policy.onnx").exists()
    assert (tmp_path / "other.txt").read_text().count("success") == 0  # process 0 alone reports


@pytest.mark.whole
def test_four_devices_learn_as_one(tmp_path: Path) -> None:
    """By a method without noise, far from what ends an episode: each device draws its new starts for itself."""
    flags = ["20" if BPTT[i - 1] == "--task.episode-s" else flag for i, flag in enumerate(BPTT)]
    flags += ["--preset", "nominal", "--task.fence", "1000", "--task.target", "0", "0", "900"]
    flags += ["--chunk", "24", "--eval-episodes", "250"]  # a single evaluation, which is not compared
    for devices in ("4", "1"):
        ended(tmp_path, start(tmp_path, f"on{devices}", *flags, "--devices", devices, devices=4))
    same_learning(tmp_path, "on4", "on1", 1e-3, flown=False)  # flights of 20 s tell every last bit


@pytest.mark.whole
def test_a_run_that_lost_a_process_says_so_and_resumes(tmp_path: Path) -> None:
    flags = [*PPO[2:], "--steps", "100000", "--devices", "2"]
    first, other = pair(tmp_path, "run", *flags)
    wait_for_update(tmp_path / "run", first, 6)
    other.kill()
    other.wait()
    assert first.wait(timeout=300) == 2
    said = (tmp_path / "output.txt").read_text()
    assert "another process of the run ended" in said
    assert "--resume" in said
    done = len(RunDirectory(tmp_path / "run").rows())
    resumed = pair(tmp_path, "run", *flags, "--resume")
    wait_for_update(tmp_path / "run", resumed[0], done + 4)
    resumed[0].send_signal(signal.SIGINT)
    assert [process.wait(timeout=300) for process in resumed] == [130, 130]
    assert (tmp_path / "run/policy.onnx").exists()


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(
    ("flags", "said"), [(["--seed", "1"], "seed: 0 and 1"), (["--resume"], "resume: False and True")]
)
def test_processes_with_other_configurations_do_not_run(flags: list[str], said: str, tmp_path: Path) -> None:
    hosts = ["--hosts.coordinator", f"127.0.0.1:{free_port()}", "--hosts.count", "2", "--devices", "2", "--hosts.index"]
    both = [
        start(tmp_path, "run", *PPO, *(flags if i else []), *hosts, str(i), devices=1, told=f"{i}.txt")
        for i in range(2)
    ]
    assert both[1].wait(timeout=300) == 2
    assert f"process 0 was started with another configuration: {said}" in (tmp_path / "1.txt").read_text()
    assert both[0].wait(timeout=300) == 2


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(
    ("flags", "said"),
    [
        (["--hosts.count", "2"], "hosts.coordinator is missing"),
        (["--hosts.coordinator", "here"], "hosts.coordinator is 'here'; accepted: HOST:PORT"),
        (["--hosts.coordinator", "127.0.0.1:1", "--hosts.index", "3"], "hosts.index is 3; accepted: 0 to"),
    ],
)
def test_hosts_that_cannot_be_are_refused_by_name(flags: list[str], said: str, tmp_path: Path) -> None:
    assert start(tmp_path, "run", *flags, devices=1).wait() == 2
    assert said in (tmp_path / "output.txt").read_text()
