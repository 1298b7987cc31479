"""Scripts that run in separate processes, and possibly with another Python. Each needs only Python 3.8 and the package
that it serves.
"""
