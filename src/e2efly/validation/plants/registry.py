"""The plants by name. A plant registers itself: `@register("name")`. Imports no JAX."""

from collections.abc import Callable
from typing import TypeVar

from e2efly.registry import Registry, origin
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

    def registered(plant: P) -> P:
        accepted = "accepted: a class that extends e2efly.Plant and has state, reset and step"
        if not (isinstance(plant, type) and issubclass(plant, Plant)):
            raise ValueError(f"plant {name!r} is {origin(plant)}, no e2efly.Plant; {accepted}")
        if missing := sorted(plant.__abstractmethods__):
            raise ValueError(f"plant {name!r} of {origin(plant)} lacks {', '.join(missing)}; {accepted}")
        plant.name = name
        return PLANTS.add(name, plant)  # type: ignore[return-value]

    return registered
