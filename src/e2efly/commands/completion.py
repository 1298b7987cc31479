"""`e2efly completion`: the script with which a shell completes commands, their options and names."""

import contextlib
import io
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, get_args

import tyro

from e2efly.commands.cli import COMMANDS
from e2efly.commands.helping import NAMES
from e2efly.commands.options import of_command
from e2efly.config import ALGORITHMS
from e2efly.policy import zoo
from e2efly.runs import presets
from e2efly.tasks import TASKS
from e2efly.vehicles.family import family_names
from e2efly.vehicles.loading import vehicle_names

Shell = Literal["bash", "zsh"]
_ZSH = "autoload -Uz compinit bashcompinit && compinit && bashcompinit"
_SCRIPT = """\
# Made by `e2efly completion`.
_e2efly() {{
  local current="${{COMP_WORDS[COMP_CWORD]}}" before="${{COMP_WORDS[COMP_CWORD-1]}}" words=
  if [ "$COMP_CWORD" -eq 1 ]; then
    words="{commands}"
  else
    case "${{COMP_WORDS[1]}} $before" in
{values}
    *)
      case "${{COMP_WORDS[1]}} $current" in
{options}
      esac ;;
    esac
  fi
  COMPREPLY=($(compgen -W "$words" -- "$current"))
}}
complete -o default -F _e2efly e2efly"""


@dataclass(frozen=True)
class Completion:
    """Print the script with which a shell completes commands, options, and the names of tasks, policies and vehicles.

    Keep it in a file, `e2efly completion bash > ~/.e2efly.bash`, and add `source ~/.e2efly.bash` to ~/.bashrc. For zsh:
    .zsh and ~/.zshrc.
    """

    shell: tyro.conf.Positional[Shell]
    """The shell."""


def run(options: Completion) -> int:
    """Print the script."""
    print(script(options.shell))
    return 0


def script(shell: Shell) -> str:
    """The script for a shell. It is made from the commands' own options, and runs nothing of e2efly itself."""
    values, options = list[str](), list[str]()
    for command in sorted(COMMANDS):
        every = _options(command)
        named = _NAMED | {option: words for option, words in every.items() if words}
        values += [_case(f'"{command} {option}"', words) for option, words in named.items() if option in every]
        options.append(_case(f'"{command} -"*', every))
        options.append(_case(f'"{command} "*', _FIRST.get(command, ())))
    text = _SCRIPT.format(commands=" ".join(sorted(COMMANDS)), values="\n".join(values), options="\n".join(options))
    return f"{_ZSH}\n{text}" if shell == "zsh" else text


_NAMED = {"--algo": (*ALGORITHMS,), "--preset": (*presets.names(),), "--vehicle": (*vehicle_names(), *family_names())}
"""Names that options accept, which say only that they accept a text."""
_FIRST = {
    **dict.fromkeys(("train", "sweep", "ablate"), (*TASKS,)),
    **dict.fromkeys(("eval", "benchmark", "watch", "export", "render", "validate", "fly", "hil"), (*zoo.names(),)),
    "completion": get_args(Shell),
}
"""Names that commands accept as their first argument, beside files."""


def _options(command: str) -> dict[str, tuple[str, ...]]:
    """The options of a command, with the words that each accepts. Those of `train` for every task and algorithm."""
    asked: list[list[str]] = [[]]
    if command == "train":
        asked = [*([task] for task in TASKS), *(["hover", "--algo", algorithm] for algorithm in ALGORITHMS)]
    said = io.StringIO()
    for arguments in asked:
        with contextlib.redirect_stdout(said), contextlib.suppress(SystemExit):
            of_command(command, [*arguments, NAMES])
    lines = (line.split() for line in said.getvalue().splitlines() if line)
    return {option: tuple(words) for option, *words in lines}


def _case(pattern: str, words: Iterable[str]) -> str:
    plain = [word for word in words if re.fullmatch(r"[\w./:+-]+", word)]  # nothing that a shell would read
    return f'    {pattern}) words="{" ".join(plain)}" ;;'
