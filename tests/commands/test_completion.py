"""What a shell completes, by the script of `e2efly completion`."""

import subprocess
from pathlib import Path

import pytest

from e2efly.commands.cli import COMMANDS
from e2efly.commands.completion import script


@pytest.fixture(scope="module")
def bash(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("completion") / "e2efly.bash"
    path.write_text(script("bash"), encoding="utf-8")
    return path


def completed(bash: Path, *words: str) -> list[str]:
    """What bash offers for the last of the words of a line."""
    code = 'source "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _e2efly; printf "%s\\n" "${COMPREPLY[@]}"'
    done = subprocess.run(["bash", "-c", code, "bash", str(bash), *words], capture_output=True, text=True, check=True)
    assert not done.stderr
    return done.stdout.split()


def test_it_is_a_script_and_knows_every_command(bash: Path) -> None:
    subprocess.run(["bash", "-n", str(bash)], check=True)
    assert completed(bash, "e2efly", "") == sorted(COMMANDS)


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("e2efly tr", ["train"]),
        ("e2efly train ho", ["hover", "hover_aware", "hover_payload"]),
        ("e2efly train race --task.tr", ["--task.track"]),  # an option of a task that is not the usual one
        ("e2efly train hover --algo pp", ["ppo"]),
        ("e2efly train hover --vehicle craz", ["crazyflie"]),
        ("e2efly benchmark any/tr", ["any/track"]),
        ("e2efly benchmark hover --base", ["--baseline"]),
        ("e2efly watch any/ho", ["any/hover", "any/hover_rotors"]),
        ("e2efly render forest --camera fp", ["fpv"]),
        ("e2efly fly-report x.mcap --ou", ["--out"]),
        ("e2efly completion z", ["zsh"]),
    ],
)
def test_commands_options_and_names_are_completed(bash: Path, line: str, offered: list[str]) -> None:
    assert completed(bash, *line.split(" ")) == offered


def test_zsh_takes_the_same_script_by_its_own_words_for_it(bash: Path) -> None:
    first, _, rest = script("zsh").partition("\n")
    assert "bashcompinit" in first
    assert rest == bash.read_text(encoding="utf-8")
