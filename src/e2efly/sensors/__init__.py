"""What the vehicle measures: noise of the state, IMU, age of measurements."""
