"""The plants of the package. Each has a file, which registers it. Imports no JAX and no simulator."""

import importlib
import importlib.util
import pkgutil

from e2efly.validation.plant import Plant
from e2efly.validation.plants.registry import PLANTS, register

for _file in pkgutil.iter_modules(__path__, f"{__name__}."):
    importlib.import_module(_file.name)


def find_plant(name: str) -> type[Plant]:
    """The class of a plant.

    It is found by its name, its name and address, `NAME:ADDRESS`, or its reference, `path/to/file.py:Name` or
    `module:Name`.

    Raises:
        ValueError: for an unknown name, with all names; for an address that the plant does not accept; for a plant that
            needs a package that is not installed.
    """
    known, colon, address = name.partition(":")
    if colon and known in PLANTS and PLANTS[known].takes_address:
        plant = PLANTS[known].at(address)
    else:
        plant = PLANTS.find(name)
    for package, install in plant.needs.items():
        if importlib.util.find_spec(package) is None:
            raise ValueError(f"plant {plant.name!r} needs the package {package}: pip install '{install}'")
    return plant


__all__ = ["PLANTS", "find_plant", "register"]
