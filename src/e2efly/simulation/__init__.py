"""What is simulated: the physics, the sensors, the worlds and the reward."""
