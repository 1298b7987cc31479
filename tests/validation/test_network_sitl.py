"""Nothing leaves the machine. Like the firmware, the library that watches the processes needs gcc to be built."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import QUICK, NetworkTrace

ORT_FILES = ("DeveloperTools", "onnxruntime")
"""Parts of the names of what ONNX Runtime's telemetry keeps in the user's cache folder."""
CONTINUOUS = ("CI", "GITHUB_ACTIONS", "TF_BUILD", "ORT_RUNNING_UNIT_TESTS", "ORT_DISABLE_TELEMETRY")
"""Variables that end ONNX Runtime's telemetry by themselves; a user's machine has none of them."""


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A home and a cache folder of their own, on a user's machine rather than one of continuous integration."""
    for name in CONTINUOUS:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("MPLCONFIGDIR", str(Path.home() / ".cache" / "matplotlib"))  # its list of fonts takes seconds
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path


def python(code: str, *arguments: str) -> str:
    """What a new process of Python says."""
    done = subprocess.run(
        [sys.executable, "-W", "default", "-c", code, *arguments], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def kept(home: Path) -> list[str]:
    """Files of ONNX Runtime's telemetry under a home."""
    return [str(file) for file in home.rglob("*") if any(part in str(file.relative_to(home)) for part in ORT_FILES)]


def test_the_trace_sees_what_would_leave_and_lets_pass_what_stays(network: NetworkTrace) -> None:
    python(
        """if True:
        import contextlib, socket
        for host, port in ("192.0.2.1", 80), ("fleet.example", 443), ("127.0.0.1", 1), ("localhost", 1):
            with contextlib.suppress(OSError):
                socket.create_connection((host, port), 1)
        with contextlib.suppress(OSError):
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b"x", ("192.0.2.2", 53))
        """
    )
    assert [line.split(" by ")[0] for line in network.left()] == [
        "connect 192.0.2.1 80", "lookup fleet.example 0", "send 192.0.2.2 53",
    ]  # fmt: skip


@pytest.mark.whole
def test_loading_and_validating_a_policy_reach_nobody_and_keep_no_identifier(
    home: Path, network: NetworkTrace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XLA_FLAGS", QUICK)
    python(
        """if True:
        import sys
        from e2efly.policy.loader import load_policy
        from e2efly.policy.zoo import FOLDER
        assert load_policy(FOLDER / "vis_r" / "hover.onnx").contract.task == "hover"
        from e2efly.commands.cli import run
        assert run(["validate", "hover", "--episodes", "2", "--out", sys.argv[1]]) == 0
        assert {"onnxruntime", "mujoco", "jax", "matplotlib"} <= set(sys.modules)
        """,
        str(home / "plots"),
    )
    assert network.left() == []
    assert kept(home) == []


@pytest.mark.parametrize(
    "module", ["e2efly.policy.loader", "e2efly.flight.betaflight.watchdog", "e2efly.learning.onnx_export"]
)
def test_every_module_switches_telemetry_off_for_itself_and_what_it_starts(home: Path, module: str) -> None:
    code = f"import {module}; import onnxruntime, subprocess, sys; subprocess.run([sys.executable, '-c', sys.argv[1]])"
    python(code, "import onnxruntime, os; assert os.environ['RAY_USAGE_STATS_ENABLED'] == '0'")
    assert kept(home) == []


def test_onnxruntime_imported_first_is_told_of(home: Path) -> None:
    code = "import onnxruntime; import e2efly"
    said = python(code)
    assert "onnxruntime was imported before e2efly" in said
    assert "set ORT_DISABLE_TELEMETRY=1" in said
    os.environ["ORT_DISABLE_TELEMETRY"] = "1"  # `home` puts the environment back
    assert python(code) == ""


def test_what_the_users_environment_says_stays(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "1")
    assert python("import e2efly, os; print(os.environ['RAY_USAGE_STATS_ENABLED'])") == "1\n"
