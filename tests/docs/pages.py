"""What the tests of the documentation share: pages, and running what stands on them."""

import contextlib
import io
import os
import re
import runpy
import shlex
import subprocess
import sys
import traceback
from collections.abc import Callable
from pathlib import Path

import pytest

from e2efly.commands import cli
from tests.conftest import QUICK
from tests.docs.brief import shorten

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
TUTORIALS = sorted((DOCS / "tutorials").glob("*.md"))

BRIEF = {
    "train": ["--no-plots"],
    "eval": ["--episodes", "2"],
    "validate": ["--episodes", "2"],
    "render": ["--width", "64"],
    "identify": [],
}
"""Commands that compute, and what makes them brief, beside `shorten`: the last value of an option counts."""
BLOCK = re.compile(r"^```(sh|python)\n(.*?)^```", re.DOTALL | re.MULTILINE)


def blocks(page: Path) -> list[tuple[str, str]]:
    """What a page asks its reader to run, in order: (sh or python, code)."""
    return BLOCK.findall(page.read_text(encoding="utf-8"))


def needs_firmware(code: str) -> bool:
    return "betaflight" in code or "e2efly firmware" in code


def run_block(language: str, code: str, folder: Path) -> "subprocess.CompletedProcess[str]":
    """Run it in a folder, as the reader would who has activated the virtual environment.

    Python and commands that compute run in this process, which has imported what they need; all else in a shell.
    """
    if language == "python":
        (folder / "block.py").write_text(code, encoding="utf-8")
        return run_script(folder / "block.py", folder)
    commands = [shlex.split(line, comments=True) for line in code.splitlines()]
    if not needs_firmware(code) and any(command[:1] == ["e2efly"] and command[1] in BRIEF for command in commands):
        return _here(lambda: _commands(commands), folder)
    environment = os.environ | {
        "XLA_FLAGS": QUICK,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
    }
    command = ["bash", "-euo", "pipefail", "-c", 'e2efly() { python -m e2efly "$@"; }\n' + code]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def run_script(script: Path, folder: Path, *arguments: str) -> "subprocess.CompletedProcess[str]":
    """Run a file of Python in a folder as if in a process of its own, with short trainings and flights."""

    def run() -> int:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sys, "argv", [str(script), *arguments])
            runpy.run_path(str(script), run_name="__main__")
        return 0

    return _here(run, folder)


def _commands(commands: list[list[str]]) -> int:
    """Run lines `e2efly ...` until one fails; returns the exit status."""
    for command in filter(None, commands):
        assert command[0] == "e2efly", f"beside commands that compute there is {command}"
        if status := cli.run([*command[1:], *BRIEF.get(command[1], [])]):
            return status
    return 0


def _here(run: Callable[[], int], folder: Path) -> "subprocess.CompletedProcess[str]":
    """Run something in this process and in a folder as if in a process of its own."""
    out, err, status = io.StringIO(), io.StringIO(), 1
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        patch.chdir(folder)
        patch.setenv("XLA_FLAGS", f"{os.environ['XLA_FLAGS']} {QUICK}")  # the options of single programs heed it
        shorten(patch.setattr)
        try:
            status = run()
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else 1 if end.code else 0
        except Exception:
            traceback.print_exc()
    return subprocess.CompletedProcess([], status, out.getvalue(), err.getvalue())
