"""A filter between policy and sticks. It changes a command only if the vehicle could otherwise not stop in time."""
