"""Differentiable rigid-body quadrotor dynamics: pure functions on frozen dataclasses, batched over leading axes."""

from e2efly.physics.mixer import Mixer
from e2efly.physics.state import RateLoop, State
from e2efly.physics.step import INTEGRATORS, Physics, started, step

__all__ = ["INTEGRATORS", "Mixer", "Physics", "RateLoop", "State", "started", "step"]
