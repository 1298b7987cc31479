"""A policy as a vehicle runs it: its file, its contract, its runtime."""
