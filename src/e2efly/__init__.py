"""e2efly: train an end-to-end quadrotor policy in seconds, check it, and fly it.

Importing the package imports no JAX; import the modules that you need.
"""

__version__ = "0.1.0"
