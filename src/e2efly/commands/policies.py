"""Options of commands whose defaults are those of a policy."""

import dataclasses
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from e2efly.commands.options import peek
from e2efly.config import TaskConfig
from e2efly.config.changes import differing

if TYPE_CHECKING:
    from e2efly.evaluation import Candidate


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
