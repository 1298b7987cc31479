"""The control cascade from positions to body rates, one implementation for the simulator and for flight. No JAX."""

from e2efly.control.cascade import CASCADE, Ctbr, Motion
from e2efly.control.vectors import Quat, Vec3

__all__ = ["CASCADE", "Ctbr", "Motion", "Quat", "Vec3"]
