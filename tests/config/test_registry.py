"""Users' own code: found by reference, and refused with the file, the name and what is accepted."""

import subprocess
import sys
from pathlib import Path

import pytest

from e2efly.config.registry import Registry, is_shipped, load, origin
from e2efly.runs import presets
from e2efly.tasks import TASKS

TASK = """
from dataclasses import dataclass
from e2efly.config import TaskConfig
from e2efly.tasks import register

class World:
    pass

@register({name!r})
@dataclass(frozen=True)
class Mine(TaskConfig):
    world = World
    reward = {{"near": 1.0}}

@dataclass(frozen=True)
class Unregistered(TaskConfig):
    pass
"""


@pytest.fixture(autouse=True)
def _as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a test registers goes with it."""
    monkeypatch.setattr(TASKS, "_known", dict(TASKS._known))


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "my_task.py"
    path.write_text(TASK.format(name="mine_" + tmp_path.name.replace("-", "_")))
    return path


def test_a_file_of_ones_own_is_found_again_by_its_reference(file: Path) -> None:
    task = TASKS.find(f"{file}:Mine")
    assert TASKS.find(f"{file}:Mine") is task  # imported once
    assert TASKS.reference(task) == f"{file}:Mine" == origin(task)
    assert not is_shipped(task)
    assert TASKS.find(TASKS.reference(task)) is task
    assert TASKS.reference(TASKS["hover"]) == "hover"
    assert is_shipped(TASKS["hover"])
    assert TASKS.find("e2efly.tasks.hover:HoverConfig") is TASKS["hover"]


@pytest.mark.parametrize(
    ("reference", "message"),
    [
        ("hoover", r"unknown task 'hoover'.*hover.*path/to/file.py:Name, or module:Name"),
        ("{folder}/none.py:Mine", "there is no file .*none.py"),
        ("{file}:Other", r"name in .*my_task.py.*'Other'.*Mine"),
        ("{file}:", r"accepted: path/to/file.py:Name"),
        ("{file}:World", "accepted: what its file registers as task"),
        ("{file}:Unregistered", "accepted: what its file registers as task"),
        ("no.such.module:Mine", "no.such.module cannot be imported: ModuleNotFoundError"),
        ("{folder}/broken.py:Mine", r"broken.py cannot be imported: ZeroDivisionError: division by zero"),
        ("{folder}/taken.py:Mine", r"'hover' of .*taken.py:Mine is also the name of e2efly.tasks.hover:HoverConfig"),
        ("{folder}/word.py:Mine", r"task 'my task' of .*word.py:Mine; accepted: a name of letters, digits and _"),
        ("{folder}/circle.py:Mine", r"circle.py has no Mine yet: it imports itself"),
        ("{folder}/plain.py:Mine", r"task 'plain' is .*plain.py:Mine; accepted: a class that extends .*:TaskConfig"),
    ],
)
def test_what_leads_nowhere_is_named(reference: str, message: str, file: Path, tmp_path: Path) -> None:
    (tmp_path / "broken.py").write_text("1 / 0")
    (tmp_path / "taken.py").write_text(TASK.format(name="hover"))
    (tmp_path / "word.py").write_text(TASK.format(name="my task"))
    (tmp_path / "plain.py").write_text(TASK.format(name="plain").replace("class Mine(TaskConfig)", "class Mine"))
    (tmp_path / "circle.py").write_text(
        f"from e2efly.config.registry import load\nload({str(tmp_path / 'circle.py:Mine')!r})"
    )
    with pytest.raises(ValueError, match=message):
        TASKS.find(reference.format(file=file, folder=tmp_path))
    assert list(TASKS).count("hover") == 1


def test_a_file_that_failed_is_read_anew(tmp_path: Path) -> None:
    path = tmp_path / "mended.py"
    path.write_text("import nothing_of_that_name")
    with pytest.raises(ValueError, match="nothing_of_that_name"):
        load(f"{path}:Thing")
    path.write_text("class Thing: pass")
    assert load(f"{path}:Thing").__name__ == "Thing"


def test_a_task_without_its_methods_is_refused_before_anything_compiles(file: Path) -> None:
    from e2efly.learning.setup import Setup

    with pytest.raises(ValueError, match=r"my_task.py:World has no of, start, goal, .*accepted: all of of, start"):
        Setup.of(presets.preset(f"{file}:Mine", "ppo"))


def test_a_registry_keeps_the_order_and_what_was_registered_twice_is_one() -> None:
    registry: Registry[type] = Registry("thing")
    assert registry.add("b", int) is int
    registry.add("a", str)
    registry.add("b", int)
    assert list(registry) == ["b", "a"]
    with pytest.raises(ValueError, match="thing 'b' of builtins:str is also the name of builtins:int"):
        registry.add("b", str)


def test_the_public_face_is_lazy_and_says_what_it_offers() -> None:
    code = (
        "import sys, e2efly\n"
        "print(e2efly.list_tasks()[0], e2efly.load_vehicle('vis_r').name, 'jax' in sys.modules)\n"
        "try:\n    e2efly.trian\n"
        "except AttributeError as error:\n    print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    first, second = done.stdout.splitlines()
    assert first == "avoid vis_r False"
    assert second.startswith(
        "module 'e2efly' has no attribute 'trian'; it offers Plant, RigidState, evaluate, export, list_tasks"
    )
