"""Every example runs, and every piece of Python in the docs."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import QUICK
from tests.docs.pages import run_script

ROOT = Path(__file__).parent.parent
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
BRIEFLY = f"""
import runpy, sys
sys.path.insert(0, {str(ROOT)!r})
from tests.docs.brief import shorten
shorten()
sys.argv = sys.argv[1:]
runpy.run_path(sys.argv[0], run_name="__main__")
"""
"""An example that trains, with a short training. In a process of its own: some register what is theirs."""
SNIPPETS = [
    pytest.param(code, id=f"{page.stem}-{i}")
    for page in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
    for i, code in enumerate(re.findall(r"^```python\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE))
]


def started(arguments: list[str], cwd: Path, **environment: str) -> "subprocess.CompletedProcess[str]":
    environment = os.environ | {"XLA_FLAGS": QUICK} | environment
    command = [sys.executable, *arguments]
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example(path: Path, tmp_path: Path) -> None:
    if path.stem in ("04_train", "06_own_task", "08_own_algorithm"):
        done = started(["-c", BRIEFLY, str(path), "20000"], tmp_path)
    else:
        done = started([str(path)], tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout


def test_there_are_examples() -> None:
    assert len(EXAMPLES) >= 5


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("code", SNIPPETS)
def test_snippet_of_the_docs(code: str, tmp_path: Path) -> None:
    if re.search(r"e2efly\.(train|validate)\(", code):  # briefly, that is
        (tmp_path / "snippet.py").write_text(code, encoding="utf-8")
        done = run_script(tmp_path / "snippet.py", tmp_path)
    else:
        done = started(["-c", code], tmp_path, PYTHONPATH=str(ROOT / "benchmarks"))  # some extend what is there
    assert done.returncode == 0, done.stderr


def test_there_are_snippets() -> None:
    assert SNIPPETS
