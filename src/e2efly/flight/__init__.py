"""Flight: from poses, images and a policy to a flight controller. Imports no JAX and no simulator."""
