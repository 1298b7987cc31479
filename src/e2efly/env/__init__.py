"""The one environment, for every task and algorithm."""

from e2efly.env.environment import Env
from e2efly.env.random import UNSEEN, is_key, key_of, numbers_of, random_key
from e2efly.env.state import EnvState, Step

__all__ = ["UNSEEN", "Env", "EnvState", "Step", "is_key", "key_of", "numbers_of", "random_key"]
