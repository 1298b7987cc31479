"""Options of commands whose defaults come from a policy."""

import dataclasses
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from e2efly.commands.helping import asks_help
from e2efly.commands.options import parse, peek
from e2efly.config import TaskConfig
from e2efly.config.changes import differing

if TYPE_CHECKING:
    from e2efly.validation.candidate import Candidate


@dataclass(frozen=True)
class Asked:
    """What a command is asked to do with a policy."""

    options: Any
    """The options as given."""
    task: dict[str, Any]
    """Values of `--task` that differ from the policy's own, by dotted name."""
    env: dict[str, Any] = field(default_factory=dict)
    """The same for `--env`, in a command that has it."""


def asked_of(options: type, command: str, arguments: list[str]) -> Asked:
    """The options of a command. The defaults of `--task` come from the policy's run or contract.

    Args:
        options: the dataclass of the options, with a field `task`.
        command: the name of the command.
        arguments: the arguments that follow it.

    Raises:
        ValueError: for unknown names, and for a policy that does not exist.
    """
    given = [argument for argument in arguments if argument.startswith("--task.")]
    if not given or asks_help(arguments):
        return Asked(parse(options, command, arguments), {})
    found = named_first(command, arguments, given[0])
    kind = with_task(options, found.task)
    read = parse(kind, command, arguments, default=kind(tyro.MISSING, task=found.task))
    return Asked(read, values(found.task, read.task))


def named_first(command: str, arguments: list[str], given: str) -> "Candidate":
    """The policy that is the first argument of a command.

    Args:
        command: the name of the command.
        arguments: the arguments that follow it.
        given: an option among them whose default is the policy's own value.

    Raises:
        ValueError: when the first argument is something else, or when there is no such policy.
    """
    if arguments[0].startswith("-"):
        option = given.split(".")[0]
        raise ValueError(f"{command} begins with {arguments[0]}; accepted: the policy first, where {option}.* is given")
    from e2efly.validation.candidate import candidate

    return candidate(arguments[0], peek(arguments, "--vehicle"))


def with_task(options: type, task: TaskConfig) -> Any:
    """The options of a command, with a field `task` of the class of the policy's task."""
    kind = Annotated[type(task), tyro.conf.arg(help="What the policy is to fly.")]
    return dataclasses.make_dataclass(options.__name__, [("task", kind, task)], bases=(options,), frozen=True)


def values(own: Any, given: Any) -> dict[str, Any]:
    """The values that replace a policy's own options, by dotted name."""
    return {name: value for name, (_, value) in differing(own, given).items()}
