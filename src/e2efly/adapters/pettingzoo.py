"""A PettingZoo environment: the vehicles of one world, each an agent. `pip install 'e2efly[pettingzoo]'`."""

from typing import Any

import gymnasium.utils.seeding
import numpy as np
from gymnasium.spaces import Space
from pettingzoo import ParallelEnv

from e2efly.adapters.gym import Observation, action_space, info_of, observation_space, observations, picture, rendering
from e2efly.adapters.stepper import Stepper, configured
from e2efly.config import TrainConfig
from e2efly.environment import Env


class QuadrotorParallelEnv(ParallelEnv[str, Observation, np.ndarray]):
    """One world of a task with several vehicles. All act at the same time, and their episodes end together.

    A batch of worlds steps in one program as `e2efly.adapters.gym.QuadrotorVectorEnv`, whose `info["world"]` tells the
    world of each vehicle.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 30, "is_parallelizable": True}

    def __init__(self, task: str | TrainConfig = "swap", raw: bool = False, render_mode: str | None = None) -> None:
        """Create the environment. The arguments are those of `e2efly.adapters.gym.QuadrotorEnv`.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        config = configured(task)
        agents = Env.of(config.task, config.reward, config.env).agents
        self.stepper = Stepper(config, agents, raw)
        self.possible_agents = [f"vehicle_{i}" for i in range(agents)]
        self.agents: list[str] = []
        self.render_mode, metadata = rendering(self.metadata, render_mode, self.stepper)
        self.metadata = metadata | {"name": f"e2efly_{config.task.name}_v0"}
        self._observation_space, self._action_space = observation_space(self.stepper), action_space(self.stepper)
        self._rng, _ = gymnasium.utils.seeding.np_random()

    def observation_space(self, agent: str) -> Space[Any]:
        """The space of an agent's observations: the same for all."""
        return self._observation_space

    def action_space(self, agent: str) -> Space[Any]:
        """The commands of an agent, each in [-1, 1]: the same for all."""
        return self._action_space

    def render(self) -> np.ndarray | None:
        """The picture of the first vehicle, uint8 (h, w, 3). None without a render mode."""
        return None if self.render_mode is None else picture(self.stepper, 0)

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Start an episode."""
        del options
        if seed is not None:
            self._rng, _ = gymnasium.utils.seeding.np_random(seed)
        first = self.stepper.reset(int(self._rng.integers(2**32)))
        self.agents = list(self.possible_agents)
        return self._observed(first), {name: {} for name in self.agents}

    def step(
        self, actions: dict[str, np.ndarray]
    ) -> tuple[dict[str, Any], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Simulate one control step. `info` is as that of `QuadrotorEnv`.

        Raises:
            ValueError: if the actions are not one for each agent of a world that flies.
        """
        if sorted(actions) != sorted(self.agents) or not self.agents:
            flying = ", ".join(self.agents) or "none, as the episode is over: call reset"
            raise ValueError(f"actions are for {', '.join(actions) or 'nobody'}; accepted: one for each of {flying}")
        out, _, final = self.stepper.step(np.stack([actions[name] for name in self.possible_agents]), restart=False)
        names, told = self.agents, info_of(out)
        infos = {name: {key: x[i].item() for key, x in told.items()} for i, name in enumerate(names)}
        rewards = dict(zip(names, out.reward.tolist(), strict=True))
        ended, late = (dict(zip(names, x.tolist(), strict=True)) for x in (out.terminated, out.truncated))
        seen = self._observed(final)
        self.agents = [] if out.done.any() else names
        return seen, rewards, ended, late, infos

    def _observed(self, state: np.ndarray) -> dict[str, Observation]:
        batch = observations(self.stepper, state)
        if isinstance(batch, dict):
            return {name: {key: part[i] for key, part in batch.items()} for i, name in enumerate(self.possible_agents)}
        return {name: batch[i] for i, name in enumerate(self.possible_agents)}
