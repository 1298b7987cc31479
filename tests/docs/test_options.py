"""Every option that a documented command has is one that the command takes."""

import contextlib
import io
import re
import shlex
from functools import cache
from pathlib import Path

import pytest

from e2efly.commands.cli import run
from e2efly.config import ALGORITHMS
from e2efly.tasks import TASKS
from tests.docs.pages import DOCS, ROOT

PAGES = [ROOT / "README.md", *sorted(path for path in DOCS.rglob("*.md"))]
FREE = ("--env.", "--task.", "--goal.", "--reward.")
"""Options of a policy's task: which there are, its contract says."""


def commands(page: Path) -> list[list[str]]:
    """The words of each command line of e2efly on a page, comments and `...` left out."""
    text = page.read_text(encoding="utf-8").replace("\\\n", " ")
    lines = re.findall(r"^(?:    |        |\$ |)e2efly (\S[^\n]*)$|`e2efly (\S[^`\n]*)`", text, re.MULTILINE)
    found = []
    for line in (fenced or inline for fenced, inline in lines):
        with contextlib.suppress(ValueError):  # a quote that a sentence does not close
            words = shlex.split(line.split("  #")[0].split(" # ")[0])
            found.append([word for word in words if word != "..."])
    return found


@cache
def help_of(*words: str) -> str:
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.suppress(SystemExit):
        run([*words, "--help-all"])
    return said.getvalue()


def known(words: list[str]) -> str:
    """The help of a command, of the task and the algorithm that it names."""
    if words[0] != "train":
        return help_of(words[0])
    task = next((word for word in words[1:2] if word in list(TASKS)), "hover")
    algo = [words[i + 1] for i, word in enumerate(words[:-1]) if word == "--algo" and words[i + 1] in list(ALGORITHMS)]
    return help_of("train", task, *(["--algo", algo[0]] if algo else []))


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_documented_options_exist(page: Path) -> None:
    for words in commands(page):
        for flag in (word.split("=")[0] for word in words if re.match(r"--[a-z]", word)):
            if flag in ("--help", "--help-all", "--version") or (words[0] != "train" and flag.startswith(FREE)):
                continue
            said = known(words)
            assert re.search(rf"(?<![\w-]){re.escape(flag)}(?![\w.-])", said), f"e2efly {shlex.join(words)}: no {flag}"


def test_commands_are_found() -> None:
    assert sum(len(commands(page)) for page in PAGES) > 80
