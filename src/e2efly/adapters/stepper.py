"""The compiled steps of an environment, with NumPy arrays as input and output. All adapters use it."""

from dataclasses import dataclass, field

import jax
import numpy as np
from jaxtyping import Array, Float

from e2efly.config import NetworkConfig, TrainConfig
from e2efly.environment import Env, EnvState, Step, random_key
from e2efly.learning.networks import Features, View
from e2efly.runs import presets
from e2efly.simulation.device import wide_vectors


def configured(task: str | TrainConfig) -> TrainConfig:
    """The configuration of a task. For a name or a reference it is the PPO preset, whose reward also includes events.

    Raises:
        ValueError: for an unknown name, giving the nearest name and all known names.
    """
    return presets.preset(task, "ppo") if isinstance(task, str) else task


@dataclass
class Stepper:
    """An environment and its state."""

    config: TrainConfig
    """The configuration. Only its task, its reward and its environment are used."""
    n: int
    """Number of vehicles, 1 or more."""
    raw: bool = False
    """Return observations as measured. Otherwise as features, which are in the body frame, independent of the heading,
    and scaled (`learn.networks.Features`)."""
    state: EnvState | None = None
    """State of the environment. None before the first reset."""
    env: Env = field(init=False)
    features: Features = field(init=False)

    def __post_init__(self) -> None:
        if self.n < 1:
            raise ValueError(f"num_envs is {self.n}; accepted: 1 or more")
        self.env = Env.of(self.config.task, self.config.reward, self.config.env)
        if self.n % self.env.agents:
            raise ValueError(
                f"num_envs is {self.n}; accepted: a multiple of {self.env.agents}, the vehicles of a world of "
                f"{self.config.task.name} (e2efly.adapters.pettingzoo.QuadrotorParallelEnv is one world)"
            )
        whole = NetworkConfig(pool=(1 << 30, 1 << 30))  # images are returned separately from the features
        views = tuple(View.of(camera, whole) for camera in self.env.cameras)
        self.features = Features(self.env.fields, views)
        self.begin = jax.jit(self._begin)
        self._advance = jax.jit(self._one, static_argnums=2, compiler_options=wide_vectors(self.n))

    @property
    def size(self) -> int:
        """Length of an observation, without images."""
        return self.env.observation_size if self.raw else self.features.state_size

    def reset(self, seed: int) -> Float[np.ndarray, "n o"]:
        """Start all episodes and return their observations."""
        self.state, observation = self.begin(random_key(seed))
        return np.array(observation)

    def step(self, action: Float[np.ndarray, "n c"], restart: bool) -> tuple[Step, np.ndarray, np.ndarray]:
        """Simulate one control step.

        Args:
            action: in [-1, 1]. Values outside are clipped.
            restart: start a new episode where an episode ended.

        Returns:
            The environment's step, the observations for the next action, and the last observations before any new
            start.

        Raises:
            RuntimeError: before the first reset.
            ValueError: for actions of another shape.
        """
        if self.state is None:
            raise RuntimeError("step before the first reset")
        if np.shape(action) != (wanted := (self.n, self.env.action_size)):
            raise ValueError(f"actions have the shape {np.shape(action)}; accepted: {wanted}")
        self.state, out, shown, final = self._advance(self.state, np.asarray(action, np.float32), restart)
        return jax.tree.map(np.array, out), np.array(shown), np.array(final)  # copies: callers change them

    def images(self) -> list[np.ndarray]:
        """The newest image of each camera, (n, h, w) or (n, h, w, 3)."""
        assert self.state is not None
        return [np.asarray(image) for image in self.state.images]

    def shown(self, observation: Float[Array, "n o"]) -> Float[Array, "n s"]:
        """Observations in the form that the framework receives."""
        return observation if self.raw else self.features.of_state(observation)

    def _begin(self, key: jax.Array) -> tuple[EnvState, Array]:
        state, observation = self.env.reset(key, self.n)
        return state, self.shown(observation)

    def _one(self, state: EnvState, action: Array, restart: bool) -> tuple[EnvState, Step, Array, Array]:
        state, out = self.env.step(state, action, restart=restart)
        return state, out, self.shown(out.observation), self.shown(out.final_observation)
