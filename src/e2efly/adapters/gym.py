"""Gymnasium environments: one vehicle (`QuadrotorEnv`), or a batch that steps together (`QuadrotorVectorEnv`).

`pip install 'e2efly[gym]'`. Importing this module registers `e2efly/TASK-v0` for every task, for `gymnasium.make` and
`gymnasium.make_vec(..., vectorization_mode="vector_entry_point")`.
"""

import math
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Dict, Space
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from e2efly.adapters.stepper import Stepper, configured
from e2efly.config import TrainConfig
from e2efly.env import Env
from e2efly.sensors.eyes import image_shape
from e2efly.tasks import TASKS

Observation = np.ndarray | dict[str, np.ndarray]
STATE, IMAGE = "state", "image_{}"
"""Names of an observation's parts where there are cameras."""


def observation_space(stepper: Stepper) -> Space[Any]:
    """A vector; with cameras a dictionary of it and the images: metres, or [0, 1]."""
    state = Box(-math.inf, math.inf, (stepper.size,), np.float32)
    if not stepper.env.cameras:
        return state
    parts: dict[str, Space[Any]] = {STATE: state}
    for i, camera in enumerate(stepper.env.cameras):
        low, high = {"depth": (0.0, camera.reach[1]), "range": (0.0, camera.reach[1]), "normal": (-1.0, 1.0)}.get(
            camera.sees, (0.0, 1.0)
        )
        parts[IMAGE.format(i)] = Box(low, high, image_shape(camera), np.float32)
    return Dict(parts)


def action_space() -> Box:
    """What the policy commands, each of four in [-1, 1] (docs/architecture.md)."""
    return Box(-1.0, 1.0, (4,), np.float32)


class QuadrotorEnv(gymnasium.Env[Any, np.ndarray]):
    """One vehicle."""

    metadata: dict[str, Any] = {"render_modes": []}

    def __init__(self, task: str | TrainConfig = "hover", raw: bool = False, render_mode: None = None) -> None:
        """Make it.

        Args:
            task: the name of a task, with its preset for PPO, or a configuration, of which task, reward and
                environment count.
            raw: observations as measured, not as features.
            render_mode: none there is.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        config = configured(task)
        self.stepper = Stepper(Env.of(config.task, config.reward, config.env), 1, raw)
        self.observation_space, self.action_space = observation_space(self.stepper), action_space()
        self.render_mode = render_mode

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict]:
        """Start an episode."""
        super().reset(seed=seed, options=options)
        first = self.stepper.reset(_drawn(self.np_random))
        return self._whole(first), {}

    def step(self, action: np.ndarray) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """A control step. `info` has `success`, `error` (m) and the weighted terms of the reward, `reward/NAME`."""
        out, _, reached = self.stepper.step(np.asarray(action)[None], renew=False)
        info = {name: value[0].item() for name, value in _told(out).items()}
        return self._whole(reached), float(out.reward[0]), bool(out.terminated[0]), bool(out.truncated[0]), info

    def _whole(self, state: np.ndarray) -> Observation:
        whole = _with_images(self.stepper, state)
        return {name: part[0] for name, part in whole.items()} if isinstance(whole, dict) else whole[0]


class QuadrotorVectorEnv(VectorEnv[Any, np.ndarray, np.ndarray]):
    """A batch of vehicles in one compiled program; an episode that ends is followed by a new one in the same step.

    What was reached before the new start stands in `info["final_obs"]`, rows that count in `info["_final_obs"]`; it
    holds no images.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.SAME_STEP}

    def __init__(
        self, task: str | TrainConfig = "hover", num_envs: int = 64, raw: bool = False, render_mode: None = None
    ) -> None:
        """Make it; see `QuadrotorEnv`.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        if num_envs < 1:
            raise ValueError(f"num_envs is {num_envs}; accepted: 1 or more")
        config = configured(task)
        self.num_envs, self.render_mode = num_envs, render_mode
        self.stepper = Stepper(Env.of(config.task, config.reward, config.env), num_envs, raw)
        self.single_observation_space, self.single_action_space = observation_space(self.stepper), action_space()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict]:
        """Start all episodes."""
        super().reset(seed=seed, options=options)
        first = self.stepper.reset(_drawn(self.np_random))
        return _with_images(self.stepper, first), {}

    def step(self, actions: np.ndarray) -> tuple[Observation, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """A control step of all. `info` as of `QuadrotorEnv`, of all vehicles, and the last observations."""
        out: Any
        out, seen, reached = self.stepper.step(actions, renew=True)
        info: dict[str, Any] = _told(out)
        if out.done.any():
            info |= {"final_obs": reached, "_final_obs": np.asarray(out.done)}
        return _with_images(self.stepper, seen), out.reward, out.terminated, out.truncated, info


def _drawn(rng: np.random.Generator) -> int:
    return int(rng.integers(2**32))


def _told(out: Any) -> dict[str, np.ndarray]:
    return {"success": out.success, "error": out.error} | {f"reward/{name}": x for name, x in out.terms.items()}


def _with_images(stepper: Stepper, state: np.ndarray) -> Observation:
    if not stepper.env.cameras:
        return state
    return {STATE: state} | {IMAGE.format(i): image for i, image in enumerate(stepper.images())}


for _task in TASKS:
    gymnasium.register(
        f"e2efly/{_task}-v0",
        entry_point="e2efly.adapters.gym:QuadrotorEnv",
        vector_entry_point="e2efly.adapters.gym:QuadrotorVectorEnv",
        kwargs={"task": _task},
        disable_env_checker=True,
    )
