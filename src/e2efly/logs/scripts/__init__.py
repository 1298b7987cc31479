"""Scripts that run in a separate process, possibly with another Python, and code that the package shares with them."""
