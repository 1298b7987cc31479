"""The one environment, for every task and algorithm."""

from e2efly.environment.env_state import EnvState, Step
from e2efly.environment.environment import Env
from e2efly.environment.random import UNSEEN, is_key, key_of, numbers_of, random_key

__all__ = ["UNSEEN", "Env", "EnvState", "Step", "is_key", "key_of", "numbers_of", "random_key"]
