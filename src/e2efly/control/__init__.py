"""The control cascade from positions to body rates: one implementation for simulator and flight. Imports no JAX."""

from e2efly.control.cascade import Ctbr, Motion
from e2efly.control.modes import COMMAND_MODES, CommandMode, command_limits
from e2efly.control.vectors import Quat, Vec3

__all__ = ["COMMAND_MODES", "CommandMode", "Ctbr", "Motion", "Quat", "Vec3", "command_limits"]
