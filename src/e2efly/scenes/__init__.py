"""Worlds of solids, and what cameras see of them."""
