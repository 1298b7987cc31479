"""Worlds of solids, and the images of cameras in them."""
