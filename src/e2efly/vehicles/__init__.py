"""Vehicles: what they weigh, push and drag, each value with its unit and source. Imports no JAX."""

from e2efly.vehicles.names import nearest, unknown
from e2efly.vehicles.vehicle import Controller, Flown, Vehicle, load_vehicle, vehicle_file, vehicle_names

__all__ = ["Controller", "Flown", "Vehicle", "load_vehicle", "nearest", "unknown", "vehicle_file", "vehicle_names"]
