"""A plant from a file outside of the package: flown by name and by reference, refused where it is not whole."""

import json
import shutil
from pathlib import Path

import pytest

import e2efly
from e2efly.commands.cli import run
from e2efly.config.registry import load
from e2efly.validation.plants import find_plant

EXAMPLE = Path(__file__).parents[2] / "examples" / "07_own_plant.py"
WHOLE = """
import e2efly

@e2efly.register_plant("{name}")
class Mine(e2efly.Plant):
    needs = {{"no_such_simulator": "no-such-simulator"}}
    def reset(self, state): ...
    def step(self, command, dt): ...
    @property
    def state(self): ...
"""


@pytest.mark.whole
def test_a_plant_of_ones_own_flies_as_those_of_the_package(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The zoo's hover, by a reference, in processes of their own, and by the class."""
    file, report = tmp_path / "point.py", tmp_path / "report.json"
    shutil.copy(EXAMPLE, file)
    arguments = ["--plant", f"{file}:PointMass", "--episodes", "20", "--out", str(tmp_path), "--json", str(report)]
    assert run(["validate", "hover", *arguments]) == 0
    assert "point_mass" in capsys.readouterr().out
    assert (tmp_path / "point_mass_hover.png").exists()
    content = json.loads(report.read_text())
    hover = content["criteria"]["hover"]
    assert content["plant"] == "point_mass"
    assert hover["point_mass"]["success"] == 1
    assert hover["point_mass"]["episodes"] == len(hover["starts"]) == 20
    # no lag and no drag: it is another physics, and not our simulator under another name
    assert hover["point_mass"]["mean_error_m"] != pytest.approx(hover["training"]["mean_error_m"], abs=1e-4)
    found = e2efly.validate("hover", load(f"{file}:PointMass"), episodes=2)
    assert found.plant.name == "point_mass"
    assert found.passed


@pytest.mark.parametrize(
    ("code", "message"),
    [
        (
            WHOLE.replace("def step", "def stop"),
            r"mine.py:Mine lacks step; accepted: a class that extends e2efly.validation.plant:Plant and has",
        ),
        (WHOLE.replace("def reset", "def _").replace("def state", "def __"), r"mine.py:Mine lacks reset, state; acc"),
        (WHOLE.replace("(e2efly.Plant)", ""), r"plant 'mine' is .*mine.py:Mine; accepted: a class that extends"),
        (WHOLE.replace("{name}", "mujoco"), r"'mujoco' of .*mine.py:Mine is also the name of e2efly.validation.plants"),
        (WHOLE.replace("@", "#", 1), r"mine.py:Mine is .*; accepted: what its file registers as plant"),
        (WHOLE, r"plant 'mine' needs the package no_such_simulator: pip install 'no-such-simulator'"),
    ],
)
def test_a_plant_that_is_not_whole_is_refused_before_anything_flies(code: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(code.format(name="mine"))
    with pytest.raises(ValueError, match=message):
        e2efly.validate("hover", f"{tmp_path}/mine.py:Mine")


def test_an_unregistered_class_is_named() -> None:
    with pytest.raises(
        ValueError, match=r"Plant is no registered plant; accepted: airsim, betaflight, mujoco, simulator"
    ):
        e2efly.validate("hover", e2efly.Plant)
    assert find_plant("simulator").name == "simulator"
