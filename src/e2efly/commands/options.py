"""How options of a command are read."""

import importlib
import io
import sys
from contextlib import redirect_stderr
from dataclasses import MISSING, fields
from decimal import Decimal
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar, cast, get_type_hints

import tyro
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

from e2efly.commands.helping import NAMES, accepted, asks_help, names, refuse_repeated, refuse_unknown, short_help
from e2efly.vehicles.posterior import IDENTIFIED

T = TypeVar("T")
_TYPES = ConstructorRegistry()


@_TYPES.primitive_rule
def _whole_numbers(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[int] | None:
    """Whole numbers may also be written as 1e6."""
    if info.type is not int:
        return None
    return PrimitiveConstructorSpec(
        1, "INT", lambda texts: _whole(texts[0]), lambda value: isinstance(value, int), lambda value: [str(value)]
    )


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        if not float(text).is_integer():
            raise
        return int(Decimal(text))


def parse(options: type[T], command: str, arguments: list[str], **default: Any) -> T:
    """The parsed options of a command. A path must lead to a file, to a folder, or to nothing.

    `--help` prints one line for each option of the command itself; `--help-all` prints every option in full.

    Args:
        options: the dataclass of the options.
        command: the name of the command, for its help.
        arguments: the arguments that follow the command.
        default: an instance, if the defaults differ from those of the class.

    Raises:
        ValueError: for an unknown option, with the most similar ones; and for the path of a device or a pipe. Reading
            it may never end, and a report would replace it.
    """
    given: dict[str, Any] = {"prog": f"e2efly {command}", "config": (tyro.conf.AvoidSubcommands,), "registry": _TYPES}
    given |= default
    if NAMES in arguments:
        print(names(accepted(options, given)))
        raise SystemExit(0)
    if asks_help(arguments) and "--help-all" not in arguments:
        print(short_help(options.__doc__ or "", command, accepted(options, given)))
        raise SystemExit(0)
    arguments = ["--help" if argument == "--help-all" else argument for argument in _once(arguments)]
    flags = [argument.split("=")[0].replace("_", "-") for argument in arguments if argument.startswith("--")]
    if len(set(flags)) < len(flags):
        refuse_repeated(flags, accepted(options, given))
    told, left = io.StringIO(), [argument for argument in arguments if argument.startswith("--")]
    try:
        with redirect_stderr(told):
            found, left = tyro.cli(options, args=arguments, return_unknown_args=True, **given)
    except SystemExit as end:
        if end.code:
            refuse_unknown(left, command, accepted(options, given))
        sys.stderr.write(told.getvalue())
        raise
    if left:
        refuse_unknown(left, command, accepted(options, given))
        raise ValueError(f"{left[0]!r} is one argument too many for `e2efly {command}`; accepted: see its --help")
    required = {field.name for field in fields(cast(Any, options)) if field.default is MISSING}
    for name, value in vars(found).items():
        if value == () and name in required:
            raise ValueError(f"{name.upper()} is empty; accepted: one or more (see `e2efly {command} --help`)")
        if isinstance(value, Path) and value.exists() and not (value.is_file() or value.is_dir()):
            raise ValueError(f"{name} is {value}; accepted: the path of a file or of a folder")
    return found


def of_command(name: str, arguments: list[str]) -> tuple[Any, Any]:
    """The module of a command, and its options from the arguments that follow its name."""
    module = importlib.import_module(f"e2efly.commands.{name.replace('-', '_')}")
    if hasattr(module, "parse"):  # its options depend on the arguments
        return module, module.parse(arguments)
    return module, parse(get_type_hints(module.run)["options"], name, arguments)


def _once(arguments: list[str]) -> list[str]:
    """Add the factor that `--env.randomize identified` omits: 1, which means the file's standard deviations."""
    out: list[str] = []
    flag = ""
    for argument, following in pairwise([*arguments, "--"]):
        flag = argument if argument.startswith("--") else flag
        out.append(argument)
        if flag == "--env.randomize" and argument == IDENTIFIED and not _is_number(following):
            out.append("1")
    return out


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def peek(arguments: list[str], flag: str) -> str | None:
    """The value of a flag, read before the other arguments are parsed: it decides which other flags exist. As in the
    parser, the last of several counts. None: the flag is not given, or has no value.
    """
    found = None
    for argument, following in pairwise([*arguments, ""]):
        if argument.startswith(flag + "="):
            found = argument.split("=", 1)[1]
        elif argument == flag:
            found = following
    return found or None
