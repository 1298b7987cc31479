"""What a policy learns from: another policy, or the expert of the task. Both know more than the one that learns."""

import dataclasses
from dataclasses import dataclass
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from e2efly.config.algorithms import EXPERT
from e2efly.environment import Env, EnvState
from e2efly.learning.networks import Actor, Weights
from e2efly.learning.warm_start import network_of, weights_of
from e2efly.policy.contract import Contract
from e2efly.policy.loader import load_policy
from e2efly.policy.zoo import policy_file
from e2efly.tasks.task import Guided


@dataclass(frozen=True)
class Teacher:
    """A policy without cameras that flies in an environment which may hide from others what it sees."""

    contract: Contract
    actor: Actor
    weights: Weights

    def memory(self, n: int) -> Float[Array, "n m"]:
        """Its memories at the start of an episode."""
        return self.actor.memory(n)

    def act(
        self, env: Env, state: EnvState, memory: Float[Array, "n m"]
    ) -> tuple[Float[Array, "n c"], Float[Array, "n m"]]:
        """Its actions and its next memories. It is shown the true motion, without age and errors."""
        features = self.actor.features(self._told(env).shown(state, state.vehicle))
        return jax.lax.stop_gradient(self.actor(self.weights, features, memory))

    def _told(self, env: Env) -> Env:
        told = env.showing([field.name for field in self.contract.observation])
        return dataclasses.replace(told, seen_actions=self.contract.past_actions)

    def check(self, env: Env) -> None:
        """Refuse an environment in which it cannot fly.

        Raises:
            ValueError: naming what the teacher sees or commands, and what the environment has.
        """
        known = {field.name: (field.size, field.frame, field.scale) for field in self._told(env).fields}
        for field in self.contract.observation:
            if known.get(field.name) != (field.size, field.frame, field.scale):
                raise ValueError(
                    f"algo.teacher observes {field.name} with {field.size} numbers; accepted: a policy that observes "
                    f"some of {', '.join(f'{name} ({size})' for name, (size, *_) in known.items())}"
                )
        if env.queue < self.contract.past_actions:
            raise ValueError(
                f"algo.teacher observes {self.contract.past_actions} past actions; accepted: at most {env.queue}, as "
                f"many as this environment keeps, or env.past_actions {self.contract.past_actions}"
            )
        action = self.contract.action
        has = np.stack([np.asarray(action.low), np.asarray(action.high)])
        wanted = np.stack([env.center - env.half, env.center + env.half])
        if action.mode != env.physics.command_mode or has.shape != wanted.shape or not np.allclose(has, wanted, 1e-4):
            raise ValueError(
                f"algo.teacher commands {action.mode} from {list(action.low)} to {list(action.high)}; accepted: "
                f"{env.physics.command_mode} from {wanted[0].tolist()} to {wanted[1].tolist()}"
            )


@dataclass(frozen=True)
class Expert:
    """The expert of a task (`e2efly.tasks.task.Guided`) as a teacher."""

    def memory(self, n: int) -> Float[Array, "n 0"]:
        """It remembers nothing."""
        return jnp.zeros((n, 0))

    def act(
        self, env: Env, state: EnvState, memory: Float[Array, "n 0"]
    ) -> tuple[Float[Array, "n c"], Float[Array, "n 0"]]:
        """Its actions."""
        return env.expert_action(state), memory

    def check(
        self, env: Env, option: str = "algo.teacher", value: object = EXPERT, otherwise: str = "a policy"
    ) -> None:
        """Refuse a task without an expert, and commands that it does not give, for an option that asks for an expert.
        `otherwise` is what else that option accepts.

        Raises:
            ValueError: naming the option, its value and what is accepted.
        """
        if not isinstance(env.task, Guided) or env.physics.command_mode != "ctbr":
            raise ValueError(
                f"{option} is {value}; accepted: for a task with an expert and env.command_mode ctbr, or {otherwise}"
            )


@cache
def teacher_of(name: str) -> Teacher | Expert:
    """A teacher by its name: `expert`, a task of the zoo, a run, or a policy.onnx.

    Raises:
        ValueError: when there is no such policy, when it sees images, and when its network is not one of e2efly.
    """
    return Expert() if name == EXPERT else _policy(name)


def _policy(policy: str) -> Teacher:
    file = policy_file(policy)
    loaded = load_policy(file)
    if loaded.contract.images:
        raise ValueError(f"algo.teacher is {policy}, which sees images; accepted: a policy without images")
    fields = loaded.contract.observation
    actor = Actor.of(fields, (), network_of(file, loaded))
    like = actor.init(np.random.default_rng(0), np.asarray(loaded.contract.hover_action))
    weights = weights_of(file, loaded.content, like, actor)
    return Teacher(loaded.contract, actor, jax.tree.map(np.asarray, weights))  # cached: nothing of a trace
