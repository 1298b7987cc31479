"""Measurements of the vehicle: noise of the state, IMU, age of measurements."""
