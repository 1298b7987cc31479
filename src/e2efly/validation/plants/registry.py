"""The plants by name. A plant registers itself: `@register("name")`. Imports no JAX."""

from collections.abc import Callable
from typing import TypeVar

from e2efly.config.registry import Registry
from e2efly.validation.plant import Plant

PLANTS: Registry[type[Plant]] = Registry("plant")
"""The classes of plants."""

P = TypeVar("P", bound=type[Plant])


def register(name: str) -> Callable[[P], P]:
    """Register a plant under the name by which `validate` knows it.

    Raises:
        ValueError: for a name that is taken, or for a class that is not a complete `Plant`, naming its origin and what
            it lacks.
    """
    return PLANTS.extending(Plant, name)
