"""Vehicles: mass, thrust, drag and the other parameters, each value with its unit and source. Imports no JAX."""
