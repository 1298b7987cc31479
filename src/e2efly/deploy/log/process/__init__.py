"""Scripts that run in a process, and perhaps a Python, of their own, and what they share with the package."""
