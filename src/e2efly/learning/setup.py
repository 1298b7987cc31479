"""The objects that a configuration defines, before anything is compiled."""

import dataclasses
from dataclasses import dataclass
from typing import Any

from e2efly.config import TrainConfig
from e2efly.environment import Env
from e2efly.learning.algorithm import Algorithm, make_algorithm
from e2efly.learning.curriculum import CurriculumStage, stages
from e2efly.learning.devices import share
from e2efly.learning.networks import Actor
from e2efly.learning.raptor_actor import actor_of
from e2efly.learning.run_budget import check_run
from e2efly.runs import presets


@dataclass(frozen=True)
class Setup:
    """The objects that a configuration defines, before anything is compiled."""

    config: TrainConfig
    stages: tuple[CurriculumStage, ...]
    """Stages of the curriculum. The last stage is the task itself."""
    algorithm: Algorithm
    actor: Actor
    updates: int
    """Updates of the whole run."""
    devices: int
    """Devices that share the environments."""

    @staticmethod
    def of(config: TrainConfig) -> "Setup":
        """Build and check everything that a configuration names.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        presets.check(config)
        env = Env.of(config.task, config.reward, config.env)
        course = stages(env, config.task, config.curriculum)
        actor = actor_of(env.fields, env.cameras, config.network)
        algorithm = make_algorithm(config.algo, actor)
        per_update = config.algo.steps
        chunks = -(-config.steps // (per_update * config.chunk))
        devices = share(config.algo.envs, getattr(config.algo, "minibatch", None), config.devices, env.agents)
        config = dataclasses.replace(config, devices=devices)
        setup = Setup(config, course, algorithm, actor, chunks * config.chunk, devices)
        setup.check()
        return setup

    def check(self, members: int = 1) -> None:
        """Refuse a configuration if `members` such runs, trained together, exceed a limit (`run_budget.py`)."""
        judged = self.episode_steps * len(self.judges)
        check_run(self.config, self.env, self.actor, self.updates, judged, members)

    def parameters(self) -> Any:
        """Fresh parameters of the algorithm."""
        return self.algorithm.init(self.env, self.config.algo, self.config.seed)

    @property
    def vehicles(self) -> int:
        """Number of vehicles that a device steps together."""
        return self.config.algo.envs // self.devices

    @property
    def watched(self) -> int:
        """Number of vehicles that a device flies together in an evaluation."""
        return -(-self.config.eval_episodes // self.devices)

    @property
    def env(self) -> Env:
        """The task's environment."""
        return self.stages[-1].env

    @property
    def judges(self) -> dict[str, Env]:
        """The environments of the evaluation, by the name of their criterion."""
        return self.stages[-1].judges

    @property
    def nominal(self) -> dict[str, Env]:
        """The same environments with the vehicle of the file in still air. Those that are already like this are left
        out.
        """
        return {name: env.undisturbed() for name, env in self.judges.items() if env.is_disturbed}

    @property
    def steps_per_update(self) -> int:
        """Environment steps per update."""
        return self.config.algo.steps

    @property
    def episode_steps(self) -> int:
        """Control steps of the longest episode in which the policy is judged."""
        return max(env.episode_steps for env in self.judges.values())
