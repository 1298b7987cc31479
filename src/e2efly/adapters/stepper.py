"""The compiled steps of an environment that frameworks outside JAX call, with NumPy arrays going in and out."""

from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from e2efly import presets
from e2efly.config import NetworkConfig, TrainConfig
from e2efly.device import wide_vectors
from e2efly.env import Env, EnvState, Step, random_key
from e2efly.learn.networks import Features, View


def configured(task: str | TrainConfig) -> TrainConfig:
    """The preset of a task's name, of PPO: its rewards know events, too.

    Raises:
        ValueError: for an unknown name, with the nearest one and all there are.
    """
    return presets.preset(task, "ppo") if isinstance(task, str) else task


@dataclass
class Stepper:
    """An environment with its state; observations as `e2efly.learn` feeds its own networks, or as measured."""

    env: Env
    n: int
    """Vehicles."""
    raw: bool = False
    """Observations as measured; else as features: body frame, heading-free, scaled (`learn.networks.Features`)."""
    state: EnvState | None = None
    features: Features = field(init=False)

    def __post_init__(self) -> None:
        whole = NetworkConfig(pool=(1 << 30, 1 << 30))  # images come apart from the features
        views = tuple(View.of(camera, whole) for camera in self.env.cameras)
        self.features = Features(self.env.fields, views)
        self.begin = jax.jit(self._begin)
        self._advance = jax.jit(self._one, static_argnums=2, compiler_options=wide_vectors(self.n))

    @property
    def size(self) -> int:
        """Numbers of an observation, images aside."""
        return self.env.observation_size if self.raw else self.features.state_size

    def reset(self, seed: int) -> Float[np.ndarray, "n o"]:
        """Start all episodes: their observations."""
        self.state, observation = self.begin(random_key(seed))
        return np.array(observation)

    def step(self, action: Float[np.ndarray, "n 4"], renew: bool) -> tuple[Step, np.ndarray, np.ndarray]:
        """A control step, with new starts where an episode ended, or without.

        Returns:
            What the environment said; what to act on next; and what was reached before any new start.

        Raises:
            RuntimeError: before the first reset.
            ValueError: for actions of another shape.
        """
        if self.state is None:
            raise RuntimeError("step before the first reset")
        if np.shape(action) != (self.n, 4):
            raise ValueError(f"actions have the shape {np.shape(action)}; accepted: {(self.n, 4)}")
        self.state, out, seen, reached = self._advance(self.state, np.asarray(action, np.float32), renew)
        return jax.tree.map(np.array, out), np.array(seen), np.array(reached)  # copies: callers change them

    def images(self) -> list[np.ndarray]:
        """The newest image of each camera, (n, h, w) or (n, h, w, 3)."""
        assert self.state is not None
        return [np.asarray(image) for image in self.state.images]

    def seen(self, observation: Float[Array, "n o"]) -> Float[Array, "n s"]:
        """An observation as the framework gets it."""
        return observation if self.raw else self.features.of_state(observation)

    def _begin(self, key: jax.Array) -> tuple[EnvState, Array]:
        state, observation = self.env.reset(key, self.n)
        return state, self.seen(observation)

    def _one(self, state: EnvState, action: Array, renew: bool) -> tuple[EnvState, Step, Array, Array]:
        if renew:
            state, out = self.env.step(state, action)
        else:
            state, out = self.env.advance(state, action)
            state = self.env.look(state, jnp.zeros_like(out.terminated))
        return state, out, self.seen(out.observation), self.seen(out.final_observation)
