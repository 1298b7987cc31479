"""Tasks: what a vehicle is to do, and how its success is judged. Each task has a folder, which registers its options.

Imports no JAX: the world of a task, which trains, is in a module of its own.
"""

import importlib
import pkgutil

from e2efly.tasks.registry import TASKS, register

for _folder in pkgutil.iter_modules(__path__, f"{__name__}."):
    if _folder.ispkg:
        importlib.import_module(_folder.name)

__all__ = ["TASKS", "register"]
