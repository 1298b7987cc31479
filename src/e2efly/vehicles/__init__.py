"""Vehicles: mass, thrust, drag and the other parameters, each value with its unit and source. Imports no JAX."""

from e2efly.config.names import nearest, unknown
from e2efly.vehicles.family import Family, Ranges, family_names, load_family, nominal_vehicle
from e2efly.vehicles.vehicle import Controller, Flown, Vehicle, load_vehicle, vehicle_file, vehicle_names

__all__ = [
    "Controller", "Family", "Flown", "Ranges", "Vehicle", "family_names", "load_family", "load_vehicle", "nearest",
    "nominal_vehicle", "unknown", "vehicle_file", "vehicle_names",
]  # fmt: skip
