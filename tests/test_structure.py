"""The house: no import circle, also where imports hide; one name for one class; one room for a file's name."""

import ast
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import e2efly

ROOT = Path(e2efly.__file__).parent
FILES = sorted(ROOT.rglob("*.py"))
SHARED = {"__init__.py", "goal.py", "world.py", "registry.py"}
"""Names of files that each room may have."""


def module(file: Path) -> str:
    return ".".join(file.relative_to(ROOT.parent).with_suffix("").parts).removesuffix(".__init__")


def trees() -> dict[str, ast.Module]:
    return {module(file): ast.parse(file.read_text(encoding="utf-8")) for file in FILES}


def imported(tree: ast.Module, known: Iterable[str]) -> Iterator[str]:
    """The modules of the package that a module imports: at its top, in functions, and for type checkers alone."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            whole = (f"{node.module}.{alias.name}" for alias in node.names)
            yield from (name if name in known else node.module for name in whole)


def test_no_modules_import_each_other() -> None:
    """The face, `import e2efly`, hands names on when they are asked for, and every module may ask for the version."""
    found = trees()
    graph = {name: {x for x in imported(tree, found) if x in found} - {name, "e2efly"} for name, tree in found.items()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        raise AssertionError(" -> ".join(error.args[1])) from None


def test_no_class_name_stands_in_two_modules() -> None:
    places = defaultdict(list)
    for name, tree in trees().items():
        for node in tree.body:
            if isinstance(node, ast.ClassDef):
                places[node.name].append(name)
    assert not {name: where for name, where in places.items() if len(where) > 1}


def test_no_file_name_stands_in_two_rooms() -> None:
    rooms = defaultdict(set)
    for file in FILES:
        place = file.relative_to(ROOT).parts
        rooms[file.name].add(place[0] if len(place) > 1 else "")
    assert not {name: where for name, where in rooms.items() if len(where) > 1 and name not in SHARED}


def test_nothing_is_loose_at_the_top() -> None:
    assert {path.name for path in ROOT.glob("*.py")} == {"__init__.py", "__main__.py", "api.py"}


@pytest.mark.parametrize(
    ("loaded", "absent"),
    [
        ("control", "jax"),
        ("validation.fleet, e2efly.validation.plants.mujoco", "jax"),
        ("commands.fly_report, e2efly.viewing.flight_report, e2efly.viewing.flight_health", "jax"),
        ("viewing.watch.beside", "jax, viser"),
    ],
)
def test_what_flies_or_reports_loads_no_simulator(loaded: str, absent: str) -> None:
    code = f"import sys, e2efly.{loaded}; sys.exit(any(name in sys.modules for name in {absent.split(', ')}))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
