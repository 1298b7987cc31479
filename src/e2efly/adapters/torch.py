"""Back-propagation from PyTorch through the environment's steps. States are shared by DLPack, without a copy.

`pip install 'e2efly[torch]'`. JAX computes the gradient, with its transposed program. The start of a new episode cuts
the gradient.
"""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import torch

from e2efly.adapters.stepper import Stepper, configured
from e2efly.config import TrainConfig
from e2efly.environment import EnvState, random_key
from e2efly.simulation.device import wide_vectors


@dataclass(frozen=True)
class TorchState:
    """The state of a batch of environments. Its tensors share memory with JAX: never change them in place."""

    moving: tuple[torch.Tensor, ...]
    """Floating-point leaves, which have a gradient."""
    rest: tuple[jax.Array, ...]
    """Leaves without a gradient: counters, keys, masks."""

    def detach(self) -> "TorchState":
        """The state without its graph. The next window of truncated back-propagation begins with it."""
        return TorchState(tuple(x.detach() for x in self.moving), self.rest)


@dataclass(frozen=True)
class TorchStep:
    """Result of a step. Each tensor is (n, ...). The first two have a gradient."""

    observation: torch.Tensor
    """Observation for the next action. If the episode ended, it is the first observation of a new episode."""
    reward: torch.Tensor
    final_observation: torch.Tensor
    """Observation after the step, before any new start."""
    terminated: torch.Tensor
    truncated: torch.Tensor
    success: torch.Tensor
    images: tuple[torch.Tensor, ...]
    """Newest image of each camera."""


class TorchEnv:
    """A batch of vehicles. PyTorch can differentiate through their steps.

    state, observation = env.reset(seed)
    state, step = env.step(state, policy(observation))
    """

    def __init__(self, task: str | TrainConfig = "hover", num_envs: int = 64, raw: bool = False) -> None:
        """Create the environments. The arguments are those of `e2efly.adapters.gym.QuadrotorVectorEnv`.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        self.num_envs = num_envs
        self.stepper = Stepper(configured(task), num_envs, raw)
        shape = jax.eval_shape(lambda key: self.stepper.env.reset(key, num_envs)[0], random_key(0))
        leaves, self._structure = jax.tree.flatten(shape)
        self._moves = [jnp.issubdtype(x.dtype, jnp.floating) for x in leaves]
        options = wide_vectors(num_envs)
        self._forward = jax.jit(self._advance, compiler_options=options)
        self._backward = jax.jit(self._transposed, compiler_options=options)

    @property
    def observation_size(self) -> int:
        """Length of an observation, without images."""
        return self.stepper.size

    def reset(self, seed: int = 0) -> tuple[TorchState, torch.Tensor]:
        """Start all episodes and return the state and the first observations (n, o)."""
        state, observation = self.stepper.begin(random_key(seed))
        moving, rest = self._apart(state)
        return TorchState(tuple(map(torch.from_dlpack, moving)), rest), torch.from_dlpack(observation)

    def step(self, state: TorchState, action: torch.Tensor) -> tuple[TorchState, TorchStep]:
        """Simulate one control step, with a new start where an episode ended.

        The state comes from `reset` or the last step. Actions, (n, c), are clipped to [-1, 1].

        Raises:
            ValueError: for actions of another shape or type.
        """
        wanted = self.num_envs, self.stepper.env.action_size
        if tuple(action.shape) != wanted or action.dtype != torch.float32:
            raise ValueError(
                f"actions are {action.dtype} of shape {tuple(action.shape)}; accepted: torch.float32 of {wanted}"
            )
        extra: dict[str, Any] = {}
        *moving, observation, reward = _Step.apply(self, state.rest, extra, action, *state.moving)  # pyright: ignore
        flags = {name: torch.from_dlpack(extra[name]) for name in ("final_observation", *_FLAGS)}
        images = tuple(map(torch.from_dlpack, extra["images"]))
        return TorchState(tuple(moving), extra["rest"]), TorchStep(observation, reward, images=images, **flags)

    def _apart(self, state: EnvState) -> tuple[tuple[jax.Array, ...], tuple[jax.Array, ...]]:
        leaves = list(zip(jax.tree.leaves(state), self._moves, strict=True))
        return tuple(x for x, moves in leaves if moves), tuple(x for x, moves in leaves if not moves)

    def _together(self, moving: tuple[jax.Array, ...], rest: tuple[jax.Array, ...]) -> EnvState:
        one, other = iter(moving), iter(rest)
        return jax.tree.unflatten(self._structure, [next(one if moves else other) for moves in self._moves])

    def _advance(self, moving: tuple, rest: tuple, action: jax.Array) -> tuple[Any, dict[str, Any]]:
        """The results that have a gradient (state, observation, reward), and those that have none."""
        state = self._together(moving, rest)
        state, out = self.stepper.env.step(state, action)
        moving, rest = self._apart(state)
        shown, final = self.stepper.shown(out.observation), self.stepper.shown(out.final_observation)
        extra = {name: getattr(out, name) for name in _FLAGS}
        return (moving, shown, out.reward), extra | {
            "final_observation": final, "rest": rest, "images": state.images
        }  # fmt: skip

    def _transposed(self, moving: tuple, rest: tuple, action: jax.Array, cotangent: Any) -> tuple[Any, jax.Array]:
        _, pull, _ = jax.vjp(lambda m, a: self._advance(m, rest, a), moving, action, has_aux=True)
        return pull(cotangent)


_FLAGS = ("terminated", "truncated", "success")


class _Step(torch.autograd.Function):
    """One step in PyTorch's graph. The backward pass computes the step again instead of storing residuals."""

    @staticmethod
    def forward(ctx: Any, env: TorchEnv, rest: tuple, extra: dict[str, Any], action: torch.Tensor, *moving: Any) -> Any:
        ctx.env, ctx.rest = env, rest
        ctx.save_for_backward(action, *moving)
        (after, observation, reward), more = env._forward(_to_jax(moving), rest, *_to_jax((action,)))
        extra |= more
        return tuple(map(torch.from_dlpack, (*after, observation, reward)))

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx: Any, *cotangents: torch.Tensor) -> Any:  # pyright: ignore[reportIncompatibleMethodOverride]
        action, *moving = ctx.saved_tensors
        *after, observation, reward = _to_jax(cotangents)
        found, of_action = ctx.env._backward(
            _to_jax(moving), ctx.rest, *_to_jax((action,)), (tuple(after), observation, reward)
        )
        return None, None, None, *map(torch.from_dlpack, (of_action, *found))


def _to_jax(tensors: Any) -> tuple[jax.Array, ...]:
    return tuple(jax.dlpack.from_dlpack(x.detach().contiguous()) for x in tensors)
