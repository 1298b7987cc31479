"""Differentiable rigid-body quadrotor dynamics: pure functions on frozen dataclasses, batched over leading axes."""

from e2efly.physics.control import COMMAND_MODES, CommandMode, command_limits
from e2efly.physics.mixer import Mixer
from e2efly.physics.state import State
from e2efly.physics.step import INTEGRATORS, Physics, step

__all__ = ["COMMAND_MODES", "INTEGRATORS", "CommandMode", "Mixer", "Physics", "State", "command_limits", "step"]
