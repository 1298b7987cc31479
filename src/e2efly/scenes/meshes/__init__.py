"""Worlds of triangles: scans and models from files, and halls made in code, seen through the same cameras."""
