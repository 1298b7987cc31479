"""Differentiable rigid-body quadrotor dynamics: pure functions on frozen dataclasses, batched over leading axes."""

from e2efly.simulation.physics.cable import Load
from e2efly.simulation.physics.mixer import Mixer
from e2efly.simulation.physics.state import RateLoop, State
from e2efly.simulation.physics.step import INTEGRATORS, Physics, started, step

__all__ = ["INTEGRATORS", "Load", "Mixer", "Physics", "RateLoop", "State", "started", "step"]
