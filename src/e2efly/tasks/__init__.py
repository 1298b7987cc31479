"""Tasks: what a vehicle is to do, and when it has done it. Each has a folder, which registers its options.

Imports no JAX: a task's world, the part that trains, is in a module of its own.
"""

import importlib
import pkgutil

from e2efly.tasks.registry import TASKS, register

for _folder in pkgutil.iter_modules(__path__, f"{__name__}."):
    if _folder.ispkg:
        importlib.import_module(_folder.name)

__all__ = ["TASKS", "register"]
