"""A batch of vehicles as a vectorised environment of Stable-Baselines3. `pip install 'e2efly[sb3]'`."""

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnv

from e2efly.adapters.gym import QuadrotorVectorEnv
from e2efly.config import TrainConfig


class SB3VecEnv(VecEnv):
    """A task for training with the algorithms of Stable-Baselines3.

    model = PPO("MlpPolicy", SB3VecEnv("hover", 64))
    """

    def __init__(self, task: str | TrainConfig = "hover", num_envs: int = 64, raw: bool = False) -> None:
        """Create the environments. The arguments are those of `e2efly.adapters.gym.QuadrotorVectorEnv`.

        Raises:
            ValueError: naming the field, the value and what is accepted; for a task with cameras.
        """
        self.envs = QuadrotorVectorEnv(task, num_envs, raw)
        if self.envs.stepper.env.cameras:
            raise ValueError(f"task is {task!r}, which has cameras; accepted: tasks flown by state")
        self._actions: np.ndarray | None = None
        self._returns, self._lengths = np.zeros(num_envs), np.zeros(num_envs, int)
        self._began = time.monotonic()
        self._seed: int | None = None
        super().__init__(num_envs, self.envs.single_observation_space, self.envs.single_action_space)

    def reset(self) -> Any:
        """Start all episodes."""
        first, _ = self.envs.reset(seed=self._seed)
        self._seed = None
        self._returns[:], self._lengths[:] = 0, 0
        return first

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed the next reset."""
        self._seed = seed
        return [seed] * self.num_envs

    def step_async(self, actions: np.ndarray) -> None:
        """Keep the actions for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> Any:
        """Simulate one control step and return observations, rewards, dones and infos.

        When an episode ends, its info has its last observation and its success. Like the info of SB3's `Monitor`, it
        also has its return, its length and the time. SB3 logs `ep_rew_mean` and `ep_len_mean` from them.
        """
        assert self._actions is not None
        observations, rewards, terminated, truncated, info = self.envs.step(self._actions)
        dones = terminated | truncated
        self._returns += rewards
        self._lengths += 1
        elapsed = round(time.monotonic() - self._began, 6)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(dones):
            infos[i] = {
                "terminal_observation": info["final_obs"][i],
                "TimeLimit.truncated": bool(truncated[i]),
                "is_success": bool(info["success"][i]),
                "episode": {"r": float(self._returns[i]), "l": int(self._lengths[i]), "t": elapsed},
            }
        self._returns[dones], self._lengths[dones] = 0, 0
        return observations, rewards, dones, infos

    def close(self) -> None:
        """Do nothing: there is nothing to close."""

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of the batch, repeated for each vehicle."""
        return [getattr(self.envs, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Not supported: the vehicles share their attributes."""
        raise NotImplementedError("the vehicles are one program: make another SB3VecEnv instead of changing this one")

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Not supported: the vehicles have no methods of their own."""
        raise NotImplementedError("the vehicles are one program: none has methods of its own")

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """False: no vehicle is wrapped."""
        return [False] * len(list(self._get_indices(indices)))
