"""Onboard: load a policy, check its contract, run it. Imports no JAX and no simulator."""
