"""The help of commands, and suggestions for options that do not exist."""

import argparse
import re
import shutil
import textwrap
import warnings
from collections import Counter
from collections.abc import Sequence
from difflib import SequenceMatcher
from typing import Any

import tyro

NAMES = "--help-names"
"""Prints the options of a command for a program: one a line, with the words that it accepts, if these are known."""
HELP = ("-h", "--help", "--help-all", NAMES)
SIMILAR = 0.6
"""Least similarity of an option that is suggested, 0 to 1."""
SUGGESTED = 3
"""Largest number of options that are suggested."""
WIDE = 110
"""Largest width of the help, columns."""


def asks_help(arguments: Sequence[str]) -> bool:
    """Whether arguments ask for help."""
    return bool(set(HELP) & set(arguments))


def accepted(options: Any, given: dict[str, Any]) -> list[argparse.Action]:
    """The arguments that a command accepts, with their help. `given`: what `tyro.cli` is given beside the options."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # tyro has no other way to list them
        parser = tyro.extras.get_parser(options, add_help=False, **given)
    return [action for action in parser._actions if action.help != argparse.SUPPRESS]


def names(actions: Sequence[argparse.Action]) -> str:
    """What `NAMES` prints."""
    lines = (" ".join([flag, *map(str, action.choices or ())]) for action in actions for flag in action.option_strings)
    return "\n".join(lines)


def refuse_unknown(given: Sequence[str], command: str, actions: Sequence[argparse.Action]) -> None:
    """Refuse the first argument that is no option, if it looks like one: `--name`, `-name` or `name=value`.

    Raises:
        ValueError: naming it and the most similar options.
    """
    known = {flag for action in actions for flag in action.option_strings}
    for argument in given:
        name = argument.split("=")[0]
        if not re.match(r"--?[A-Za-z]|\w[\w.-]*=", argument) or name.replace("_", "-") in known:
            continue
        near = similar(name, actions)
        guess = f"; did you mean {' or '.join(near)}?" if near else ""
        raise ValueError(f"unknown option {argument!r}{guess} (`e2efly {command} --help-all` lists all options)")


def refuse_repeated(flags: Sequence[str], actions: Sequence[argparse.Action]) -> None:
    """Refuse an option of several values that is given twice: the values of the last one alone would count. Of an
    option of one value, the last counts, as everywhere.

    Raises:
        ValueError: naming it.
    """
    known = {flag: action for action in actions for flag in action.option_strings}
    seen: set[str] = set()
    for flag in flags:
        action = known.get(flag)
        if action is None or action.nargs not in ("*", "+"):
            continue
        if action.dest in seen:
            raise ValueError(f"{flag} is given twice; accepted: once, with all of its values after it")
        seen.add(action.dest)


def similar(name: str, actions: Sequence[argparse.Action]) -> list[str]:
    """The options that are most similar to a name, best first: by spelling, by their words or the initials of these,
    or because the name is one of the option's values.
    """
    name = name.strip("-").replace("_", "-").lower()
    rated = []
    for action in actions:
        for flag in action.option_strings:
            if name in (action.choices or ()):
                rated.append((2.0, f"{flag} {name}"))
            elif (rate := _similarity(name, flag.strip("-"))) >= SIMILAR:
                rated.append((rate, flag))
    return [text for _, text in sorted(rated, key=lambda pair: -pair[0])[:SUGGESTED]]


def _similarity(name: str, option: str) -> float:
    """From 0 to 1. The last part of a dotted name counts as much as the whole."""
    tail, last = name.rsplit(".", 1)[-1], option.rsplit(".", 1)[-1]
    words = last.split("-")
    if tail in (last, "".join(word[0] for word in words if word)):
        return 1.0
    if set(tail.split("-")) <= set(words):
        return 0.9
    return max(SequenceMatcher(None, *pair).ratio() for pair in ((name, option), (tail, last)))


def short_help(about: str, command: str, actions: Sequence[argparse.Action]) -> str:
    """One screen: what a command does, the first sentence of each of its own options, and which others there are."""
    own = [action for action in actions if "." not in action.dest]
    groups = Counter(action.dest.split(".")[0] for action in actions if "." in action.dest)
    wide = min(shutil.get_terminal_size((WIDE, 24)).columns, WIDE)
    names = {action.dest: _named(action) for action in own}
    column = min(max((len(name) for name in names.values()), default=0), 28) + 4
    positional = [names[action.dest] for action in own if not action.option_strings]
    lines = [" ".join(["usage: e2efly", command, *positional, "[OPTIONS]"]), "", about.split("\n\n")[0].strip(), ""]
    for action in own:
        lines += textwrap.wrap(
            f"  {names[action.dest]:<{column - 4}}  {_said(action)}", wide, subsequent_indent=" " * column,
            break_long_words=False, break_on_hyphens=False, drop_whitespace=True,
        )  # fmt: skip
    more = [f"  --{name}.*  {count} option{'s' * (count > 1)}" for name, count in groups.items()]
    full = f"`e2efly {command} --help-all` prints every option in full{':' if more else '.'}"
    return "\n".join([*lines, "", full, *more])


def _named(action: argparse.Action) -> str:
    """An argument as it is typed."""
    kind = str(action.metavar or "").replace("{None}|", "").replace("None,", "")
    kind = re.sub(r"^\[(.*) \[\1 \.\.\.\]\]$", r"\1 ...", kind)
    if not action.option_strings:
        return kind
    flag = f"--[no-]{action.dest}" if action.default is True else action.option_strings[0]
    return f"{flag} {kind}".strip()


def _said(action: argparse.Action) -> str:
    """The first sentence of an argument's help, and its default."""
    said, _, default = " ".join((action.help or "").split()).partition(" (default: ")
    said = said.removesuffix(" (required)")
    first = re.split(r"(?<=\.) (?=[A-Z`])", said)[0]
    default = default.removesuffix(")")
    return first if default in ("", "None", "False", "True") else f"{first} [{default}]"
