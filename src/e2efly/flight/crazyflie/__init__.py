"""Crazyflies over CRTP."""
