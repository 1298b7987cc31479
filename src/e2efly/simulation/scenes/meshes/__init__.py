"""Worlds of triangles, seen through the same cameras: scans and models from files, and worlds made in code."""
