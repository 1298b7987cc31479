"""How options of a command are read."""

from decimal import Decimal
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

import tyro
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

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

    Args:
        options: the dataclass of the options.
        command: the name of the command, for its help.
        arguments: the arguments that follow the command.
        default: an instance, if the defaults differ from those of the class.

    Raises:
        ValueError: for the path of a device or a pipe. Reading it may never end, and a report would replace it.
    """
    config = (tyro.conf.AvoidSubcommands,)
    found = tyro.cli(
        options, args=_once(arguments), prog=f"e2efly {command}", config=config, registry=_TYPES, **default
    )
    for name, value in vars(found).items():
        if isinstance(value, Path) and value.exists() and not (value.is_file() or value.is_dir()):
            raise ValueError(f"{name} is {value}; accepted: the path of a file or of a folder")
    return found


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


def peek(arguments: list[str], flag: str, default: str) -> str:
    """The value of a flag, read before the other arguments are parsed: it decides which other flags exist."""
    for i, argument in enumerate(arguments):
        if argument.startswith(flag + "="):
            return argument.split("=", 1)[1]
        if argument == flag and i + 1 < len(arguments):
            return arguments[i + 1]
    return default
