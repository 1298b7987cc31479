"""The one environment, for every task and algorithm."""

from e2efly.env.environment import Env
from e2efly.env.random import GENERATOR, random_key
from e2efly.env.state import EnvState, Step

__all__ = ["GENERATOR", "Env", "EnvState", "Step", "random_key"]
