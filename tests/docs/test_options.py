"""Every option that a documented command has is one that the command takes, and the commands of a flight parse."""

import contextlib
import io
import re
import shlex
from functools import cache
from pathlib import Path

import pytest

from e2efly.commands.cli import run
from e2efly.commands.options import of_command
from e2efly.config import ALGORITHMS
from e2efly.tasks import TASKS
from tests.docs.pages import DOCS, ROOT

PAGES = [ROOT / "README.md", *sorted(path for path in DOCS.rglob("*.md"))]
FLIGHT = [
    DOCS / name for name in ("hardware.md", "hardware-vis-r.md", "hardware-vis-h.md", "flying.md", "tutorials/fly.md")
]
"""The pages that a lab follows to its first flight."""
FREE = ("--env.", "--task.", "--goal.", "--reward.")
"""Options of a policy's task: which there are, its contract says."""


def commands(page: Path) -> list[list[str]]:
    """The words of each command line of e2efly on a page, without comments. `...` is left where it stands for the value
    of an option.
    """
    text = page.read_text(encoding="utf-8").replace("\\\n", " ")
    lines = re.findall(r"^(?:    |        |\$ |)e2efly (\S[^\n]*)$|`e2efly (\S[^`\n]*)`", text, re.MULTILINE)
    found = []
    for line in (fenced or inline for fenced, inline in lines):
        with contextlib.suppress(ValueError):  # a quote that a sentence does not close
            words = shlex.split(line.split("  #")[0].split(" # ")[0])
            found.append([word for i, word in enumerate(words) if word != "..." or words[i - 1].startswith("--")])
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


@pytest.mark.parametrize("page", FLIGHT, ids=lambda path: path.stem)
def test_the_commands_of_a_flight_parse(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With their values, and whatever the reader puts in place of `...`."""
    monkeypatch.chdir(tmp_path)
    whole = [words for words in commands(page) if len(words) > 1 and not words[-1].startswith("--help")]
    assert whole
    for name, *arguments in whole:
        of_command(name, arguments)


def test_commands_are_found() -> None:
    assert sum(len(commands(page)) for page in PAGES) > 80
