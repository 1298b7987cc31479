"""The gravity of all computations. Apart from the vehicle, because the watchdog starts without NumPy."""

GRAVITY = 9.81
"""Standard gravity as in the paper, m/s^2."""
