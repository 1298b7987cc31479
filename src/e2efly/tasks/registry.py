"""The tasks by name. The options of a task register themselves: `@register("name")`. Imports no JAX."""

from collections.abc import Callable
from typing import TypeVar

from e2efly.config import TaskConfig
from e2efly.config.registry import Registry

TASKS: Registry[type[TaskConfig]] = Registry("task")
"""The classes of task options."""

C = TypeVar("C", bound=type[TaskConfig])


def register(name: str) -> Callable[[C], C]:
    """Register the options of a task under the name that commands, adapters and policies use.

    Raises:
        ValueError: for a name that is taken, or a class that is not a `TaskConfig`.
    """
    return TASKS.extending(TaskConfig, name)
