"""Options of commands whose defaults are those of a policy."""

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from e2efly.commands.options import parse, peek
from e2efly.config import TaskConfig
from e2efly.config.changes import differing

if TYPE_CHECKING:
    from e2efly.evaluation import Candidate


@dataclass(frozen=True)
class Asked:
    """What a command is asked to do with a policy."""

    options: Any
    """As given."""
    task: dict[str, Any]
    """Values of `--task`, by dotted name, that are not the policy's own."""


def asked_of(options: type, command: str, arguments: list[str]) -> Asked:
    """The options of a command; the defaults of `--task` are what the policy's run or contract says.

    Args:
        options: of the command, with a field `task`.
        command: its name.
        arguments: what follows it.

    Raises:
        ValueError: for unknown names, and for a policy that is not there.
    """
    given = [argument for argument in arguments if argument.startswith("--task.")]
    if not given or "--help" in arguments:
        return Asked(parse(options, command, arguments), {})
    found = named_first(command, arguments, given[0])
    kind = with_task(options, found.task)
    read = parse(kind, command, arguments, default=kind(tyro.MISSING, task=found.task))
    return Asked(read, values(found.task, read.task))


def named_first(command: str, arguments: list[str], given: str) -> "Candidate":
    """The policy that a command names first.

    Args:
        command: its name.
        arguments: what follows it.
        given: an option among them whose default is the policy's own.

    Raises:
        ValueError: where something else stands first, or there is no such policy.
    """
    if arguments[0].startswith("-"):
        option = given.split(".")[0]
        raise ValueError(f"{command} begins with {arguments[0]}; accepted: the policy first, where {option}.* is given")
    from e2efly.evaluation import candidate

    return candidate(arguments[0], peek(arguments, "--vehicle", "") or None)


def with_task(options: type, task: TaskConfig) -> Any:
    """Options of a command whose field `task` is of the class of a policy's task."""
    kind = Annotated[type(task), tyro.conf.arg(help="What the policy is to fly.")]
    return dataclasses.make_dataclass(options.__name__, [("task", kind, task)], bases=(options,), frozen=True)


def values(own: Any, given: Any) -> dict[str, Any]:
    """What is given in place of a policy's own options, by dotted name."""
    return {name: value for name, (_, value) in differing(own, given).items()}
