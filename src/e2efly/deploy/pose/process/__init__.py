"""A script that runs in a process, and a Python, of its own; nothing of the package imports it."""
