"""`e2efly-fly`, the part that flies: beside its own dependencies it needs nothing, and says what it lacks."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest

from e2efly.commands.cli import WHOLE
from e2efly.commands.fly import parse
from e2efly.flight.service import PERIOD_S
from e2efly.logs.flight_log import read_log
from tests.flight.test_msp_client import controller, recorded
from tests.waiting import free_port

ROOT = Path(__file__).parents[1]
ALONE = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
"""The environment of a process that finds only what its Python has."""


def project(folder: str = "") -> dict[str, Any]:
    return tomllib.loads((ROOT / folder / "pyproject.toml").read_text(encoding="utf-8"))


def needed(names: list[str]) -> set[str]:
    """Distributions by name, with all that they need."""
    found: set[str] = set()
    while names:
        name = re.sub(r"[-_.]+", "-", re.split(r"[^\w.-]", names.pop())[0]).lower()
        if name not in found:
            found.add(name)
            names += [entry for entry in metadata.requires(name) or [] if "extra ==" not in entry and _holds(entry)]
    return found


def _holds(requirement: str) -> bool:
    """Of the markers that stand in these packages: what is for other systems or older Pythons is not installed."""
    try:
        metadata.distribution(re.split(r"[^\w.-]", requirement)[0])
    except metadata.PackageNotFoundError:
        return False
    return True


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    """The distribution `e2efly-fly`, built from a copy of the sources."""
    folder = tmp_path_factory.mktemp("wheel")
    for name in ("onboard", "src", "LICENSE"):
        source = ROOT / name
        ignored = shutil.ignore_patterns("build", "*.egg-info", "__pycache__")
        shutil.copytree(source, folder / name, ignore=ignored) if source.is_dir() else shutil.copy(source, folder)
    command = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--no-build-isolation", "--no-index"]
    subprocess.run([*command, "-w", folder, folder / "onboard"], check=True, capture_output=True)
    (built,) = folder.glob("e2efly_fly-*.whl")
    return zipfile.ZipFile(built)


@pytest.fixture(scope="module")
def slim(wheel: zipfile.ZipFile, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The Python of an environment with the dependencies of `e2efly-fly` and the package, and with nothing else."""
    folder = tmp_path_factory.mktemp("slim")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
    (place,) = folder.glob("lib/python*/site-packages")
    wheel.extractall(place)
    for name in needed([*project("onboard")["project"]["dependencies"]]):
        distribution = metadata.distribution(name)
        for top in {file.parts[0] for file in distribution.files or [] if file.parts[0] not in ("..", "__pycache__")}:
            (place / top).symlink_to(Path(str(distribution.locate_file(top))))
    return folder / "bin" / "python"


def test_both_distributions_are_made_of_one_tree() -> None:
    whole, part = project()["project"], project("onboard")["project"]
    assert set(part["dependencies"]) < set(whole["dependencies"])
    left = {re.split(r"[^\w.-]", entry)[0] for entry in {*whole["dependencies"]} - {*part["dependencies"]}}
    assert left | {"jaxlib"} == set(WHOLE)
    for key in ("version", "requires-python", "scripts", "license", "authors"):
        assert part[key] == whole[key], key
    for extra, packages in part["optional-dependencies"].items():
        assert packages == whole["optional-dependencies"][extra], extra
    data, own = (project(f)["tool"]["setuptools"]["package-data"]["e2efly"] for f in ("", "onboard"))
    assert [*filter(lambda x: not x.startswith(("viewing/", "validation/")), data)] == own


def test_the_wheel_has_what_flies_and_nothing_else(wheel: zipfile.ZipFile) -> None:
    names = [name.removeprefix("e2efly/") for name in wheel.namelist() if name.startswith("e2efly/")]
    assert {name.split("/")[0] for name in names if "/" in name} == {
        "commands", "config", "control", "courses", "flight", "logs", "policy", "runs", "tasks", "vehicles",
    }  # fmt: skip
    wanted = {
        "flight/bridge.py", "flight/scripts/speech.py", "flight/sight/segment/pad.onnx", "logs/scripts/live.py",
        "policy/first_run.py", "policy/zoo/vis_r/hover.onnx", "vehicles/vis_r.toml", "py.typed",
    }  # fmt: skip
    assert wanted <= set(names)
    assert not [name for name in names if name.startswith("policy/c_export")]
    assert [name for name in wheel.namelist() if name.endswith("licenses/LICENSE")]


def test_it_looks_at_a_controller_without_jax(slim: Path, tmp_path: Path) -> None:
    """With `--check`, for a policy of the zoo."""
    code = (
        "import sys; from e2efly.commands.cli import run; s = run(sys.argv[1:]); print('modules', *sys.modules);"
        "sys.exit(s)"
    )
    with controller(recorded) as client:
        command = [slim, "-c", code, "fly", "hover", "--check", "--link", client.link.name]  # type: ignore[attr-defined]
        done = subprocess.run(
            [*command, "--pose", f"udp:{free_port()}"], capture_output=True, text=True, cwd=tmp_path, env=ALONE
        )
    assert done.returncode == 1, done.stderr  # nothing is set up on the recorded one
    assert "msp_override_channels_mask" in done.stdout
    loaded = done.stdout.rsplit("modules", 1)[1].split()
    assert "e2efly.flight.bridge" in loaded
    assert not [name for name in loaded if name.split(".")[0] in WHOLE]


def test_the_bridge_runs_with_its_watchdog_and_writes_its_log(slim: Path, tmp_path: Path) -> None:
    log = tmp_path / "flight.mcap"
    with controller(recorded) as client:
        command = [slim, "-m", "e2efly", "fly", "hover", "--link", client.link.name]  # type: ignore[attr-defined]
        process = subprocess.Popen(
            [*command, "--pose", f"udp:{free_port()}", "--log", log],
            stdout=subprocess.PIPE,
            text=True,
            cwd=tmp_path,
            env=ALONE,
        )
        try:
            assert process.stdout is not None
            end = time.monotonic() + 60
            while "INIT:" not in (line := process.stdout.readline()):
                assert line
                assert time.monotonic() < end
            time.sleep(1.0)
            process.send_signal(signal.SIGINT)
            assert process.wait(30) == 0
        finally:
            process.kill()
            process.communicate()
    assert len(read_log(log)["command"]) > 20
    assert json.loads(log.with_suffix(".throttle.json").read_text())["scale"] == 1.0


@pytest.mark.parametrize(
    ("arguments", "lacks"),
    [
        (["train", "hover"], "e2efly.learning"),
        (["fly-report", "x.mcap"], "e2efly.viewing"),
        (["export", "hover", "--c", "x"], "e2efly."),
    ],
)
def test_what_it_cannot_do_is_named(arguments: list[str], lacks: str, slim: Path, tmp_path: Path) -> None:
    done = subprocess.run([slim, "-m", "e2efly", *arguments], capture_output=True, text=True, cwd=tmp_path, env=ALONE)
    assert done.returncode == 2
    said = " ".join(done.stderr.split())
    assert f"`e2efly {arguments[0]}` needs {lacks}" in said
    assert "the part of e2efly that flies, e2efly-fly; accepted: `fly`, or an environment with the whole" in said
    assert not [*tmp_path.iterdir()]


def unit() -> dict[str, str]:
    """The lines of the service's unit."""
    text = (ROOT / "onboard" / "e2efly-fly.service").read_text(encoding="utf-8")
    return dict(line.split("=", 1) for line in text.splitlines() if "=" in line and not line.startswith("#"))


def test_the_unit_leaves_the_landing_to_the_watchdog_process() -> None:
    """Whatever ends the bridge, systemd kills nothing else, and waits for a landing."""
    lines = unit()
    assert (lines["Type"], lines["NotifyAccess"]) == ("notify", "main")
    assert (lines["KillMode"], lines["SendSIGKILL"], lines["OOMPolicy"]) == ("process", "no", "continue")
    assert lines["TimeoutStopSec"] == "infinity"
    assert float(lines["WatchdogSec"]) > 10 * PERIOD_S
    assert int(lines["LimitRTPRIO"]) >= 20  # that of the watchdog process


def test_the_unit_starts_a_command_that_there_is() -> None:
    name, value = (ROOT / "onboard" / "fly.env").read_text(encoding="utf-8").strip().split("=", 1)
    program, command, given = unit()["ExecStart"].split()
    assert (Path(program).name, command, given) == ("e2efly", "fly", f"${name}")
    assert parse(value.split()).policy == Path("hover")
