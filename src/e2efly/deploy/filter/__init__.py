"""A filter between policy and sticks: it changes a command only where the vehicle could not stop in time otherwise."""
