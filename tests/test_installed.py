"""What an installed package registers by entry points is there by name."""

import sys
from pathlib import Path

import pytest

import e2efly
from e2efly.commands.cli import run
from e2efly.flight.pose.registry import SOURCES
from e2efly.flight.pose.sources import open_source
from e2efly.tasks import TASKS
from e2efly.validation.plants import PLANTS

MODULE = """
import e2efly
from e2efly.tasks.hover import HoverConfig
from dataclasses import dataclass

@e2efly.register_task("patrol")
@dataclass(frozen=True)
class Patrol(HoverConfig): ...

@e2efly.register_pose_source("lighthouse", "lighthouse:HEIGHT")
class Beacon:
    def __init__(self, where):
        self.height, self.problem, self.refused = float(where), None, 0
    def read(self, now): return []
    def close(self): ...
    def describe(self): return f"a beacon at {self.height} m"

@e2efly.register_plant("tunnel")
class Tunnel(e2efly.Plant):
    def reset(self, state): ...
    def step(self, command, dt): ...
    @property
    def state(self): ...
"""


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A distribution with an entry point; what it registers goes with the test."""
    about = tmp_path / "my_lab-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: my-lab\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[e2efly]\neverything = my_lab_of_the_test\n")
    module = tmp_path / "my_lab_of_the_test.py"
    module.write_text(MODULE)
    monkeypatch.syspath_prepend(tmp_path)
    for registry in (TASKS, PLANTS, SOURCES):
        monkeypatch.setattr(registry, "_known", dict(registry._known))
    monkeypatch.delitem(sys.modules, module.stem, raising=False)
    return module


def test_a_name_that_is_unknown_is_looked_for_in_installed_packages(installed: Path) -> None:
    assert TASKS.find("hover").name == "hover"
    assert installed.stem not in sys.modules  # nobody asked for more
    assert e2efly.preset("patrol", "ppo").task.name == "patrol"
    assert PLANTS.find("tunnel").name == "tunnel"
    assert open_source("lighthouse:2").describe() == "a beacon at 2.0 m"
    assert TASKS.reference(TASKS["patrol"]) == f"{installed.stem}:Patrol"
    sys.modules.pop(installed.stem)


def test_list_shows_what_installed_packages_register(installed: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for catalogue, name in (("tasks", "patrol"), ("rest", "tunnel")):
        assert run(["list", catalogue]) == 0
        assert name in capsys.readouterr().out
    sys.modules.pop(installed.stem)


def test_a_package_that_cannot_be_imported_is_named(installed: Path) -> None:
    installed.write_text("import nothing_of_that_name")
    message = "entry point everything = my_lab_of_the_test of the package my-lab cannot be imported: ModuleNotFound"
    with pytest.raises(ValueError, match=message):
        TASKS.find("hoover")
