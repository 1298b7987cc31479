"""How far the parameters of a vehicle may be drawn from those of its file."""

import dataclasses
from collections.abc import Mapping

import numpy as np

from e2efly.config.names import unknown
from e2efly.vehicles.posterior import IDENTIFIED
from e2efly.vehicles.vehicle import Vehicle, principal_moments, quantities, terms


def check_widths(vehicle: Vehicle, widths: Mapping[str, float], where: str) -> None:
    """Check the parameters of a vehicle that an option (`where`) draws: the relative half-width of each one's random
    factor. `IDENTIFIED` is no parameter.
    """
    names = [f.name for f in quantities(vehicle)]
    for name, width in widths.items():
        if name == IDENTIFIED:
            continue
        if name not in names and any(name == term.name for term in terms()):
            raise ValueError(
                f"{where}.{name} is {width}, and vehicle {vehicle.name!r} has no {name}; accepted: a vehicle file "
                f"with an entry [{name}], or what vehicle {vehicle.name!r} has: {', '.join(names)}"
            )
        if name not in names:
            raise ValueError(unknown("vehicle parameter", name, names))
        if not 0 <= width < 1:
            raise ValueError(f"{where}.{name} is {width}; accepted: at least 0 and below 1")
    if vehicle.inertia_products is None:
        return
    less, more = widths.get("inertia", 0.0), widths.get("inertia_products", 0.0)
    products = -(1 + more) * np.abs(vehicle.inertia_products)
    drawn = dataclasses.replace(vehicle, inertia=(1 - less) * vehicle.inertia, inertia_products=products)
    if principal_moments(drawn)[0] <= 0:
        raise ValueError(
            f"{where} is {dict(widths)}: an inertia of these draws may have no positive principal moment (inertia "
            f"{vehicle.inertia.tolist()}, inertia_products {vehicle.inertia_products.tolist()}); accepted: smaller "
            "widths of inertia and inertia_products"
        )
