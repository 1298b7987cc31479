"""Gymnasium environments: one vehicle (`QuadrotorEnv`), or a batch that steps together (`QuadrotorVectorEnv`).

`pip install 'e2efly[gym]'`. Importing this module registers `e2efly/TASK-v0` for every task that is known then, and
`e2efly/task-v0`, whose `task` is a name or a reference, such as `path/to/file.py:Orbit`. Both are for `gymnasium.make`
and for `gymnasium.make_vec(..., vectorization_mode="vector_entry_point")`.
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
from e2efly.simulation.sensors.eyes import image_shape
from e2efly.tasks import TASKS

Observation = np.ndarray | dict[str, np.ndarray]
STATE, IMAGE = "state", "image_{}"
"""Names of the parts of an observation when there are cameras."""
PICTURE = (320, 480)
"""Rows and columns of what `render` returns."""


def observation_space(stepper: Stepper) -> Space[Any]:
    """A vector. With cameras, a dictionary of this vector and the images: depth and range in metres, normals in
    [-1, 1], others in [0, 1].
    """
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


def action_space(stepper: Stepper) -> Box:
    """The commands of a policy, each in [-1, 1]: four, or one for each rotor (docs/decisions.md)."""
    return Box(-1.0, 1.0, (stepper.env.action_size,), np.float32)


class QuadrotorEnv(gymnasium.Env[Any, np.ndarray]):
    """A task for one vehicle."""

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 30}

    def __init__(self, task: str | TrainConfig = "hover", raw: bool = False, render_mode: str | None = None) -> None:
        """Create the environment.

        Args:
            task: the name of a task or a reference to it, with its preset for PPO. Or a configuration, of which only
                the task, the reward and the environment are used.
            raw: return observations as measured, not as features.
            render_mode: with rgb_array, `render` returns a picture from behind the vehicle. With None, it returns None.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        self.stepper = Stepper(configured(task), 1, raw)
        self.observation_space, self.action_space = observation_space(self.stepper), action_space(self.stepper)
        self.render_mode, self.metadata = rendering(self.metadata, render_mode, self.stepper)

    def render(self) -> np.ndarray | None:  # type: ignore[override]
        """The picture of the vehicle, uint8 (h, w, 3). None without a render mode."""
        return None if self.render_mode is None else picture(self.stepper, 0)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict]:
        """Start an episode."""
        super().reset(seed=seed, options=options)
        first = self.stepper.reset(_seed(self.np_random))
        return self._observation(first), {}

    def step(self, action: np.ndarray) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Simulate one control step. `info` has `success`, `error` (m) and the weighted reward terms, `reward/NAME`."""
        out, _, final = self.stepper.step(np.asarray(action)[None], restart=False)
        info = {name: value[0].item() for name, value in info_of(out).items()}
        return self._observation(final), float(out.reward[0]), bool(out.terminated[0]), bool(out.truncated[0]), info

    def _observation(self, state: np.ndarray) -> Observation:
        batch = observations(self.stepper, state)
        return {name: part[0] for name, part in batch.items()} if isinstance(batch, dict) else batch[0]


class QuadrotorVectorEnv(VectorEnv[Any, np.ndarray, np.ndarray]):
    """A task for a batch of vehicles in one compiled program.

    An episode that ends is followed by a new one in the same step. `info["final_obs"]` then holds the last observations
    of the old episodes, without images, in the rows that `info["_final_obs"]` marks.
    """

    metadata: dict[str, Any] = {
        "render_modes": ["rgb_array"], "render_fps": 30, "autoreset_mode": AutoresetMode.SAME_STEP,
    }  # fmt: skip

    def __init__(
        self, task: str | TrainConfig = "hover", num_envs: int = 64, raw: bool = False, render_mode: str | None = None
    ) -> None:
        """Create the environments. The arguments are those of `QuadrotorEnv`, and `num_envs`, the number of vehicles.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        self.num_envs = num_envs
        self.stepper = Stepper(configured(task), num_envs, raw)
        self.render_mode, self.metadata = rendering(self.metadata, render_mode, self.stepper)
        self.single_observation_space = observation_space(self.stepper)
        self.single_action_space = action_space(self.stepper)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def render(self) -> tuple[np.ndarray, ...] | None:  # type: ignore[override]
        """The picture of each vehicle, uint8 (h, w, 3). None without a render mode."""
        return None if self.render_mode is None else tuple(picture(self.stepper, i) for i in range(self.num_envs))

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict]:
        """Start all episodes."""
        super().reset(seed=seed, options=options)
        first = self.stepper.reset(_seed(self.np_random))
        return observations(self.stepper, first), {}

    def step(self, actions: np.ndarray) -> tuple[Observation, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Simulate one control step of all vehicles. `info` has the entries of `QuadrotorEnv` for each vehicle, and
        `final_obs`. If a world has several vehicles, it has `world`, the number of the world of each.
        """
        out: Any
        out, shown, final = self.stepper.step(actions, restart=True)
        info: dict[str, Any] = info_of(out)
        if self.stepper.env.agents > 1:
            info["world"] = np.arange(self.num_envs) // self.stepper.env.agents
        if out.done.any():
            info |= {"final_obs": final, "_final_obs": np.asarray(out.done)}
        return observations(self.stepper, shown), out.reward, out.terminated, out.truncated, info


def rendering(metadata: dict[str, Any], mode: str | None, stepper: Stepper) -> tuple[str | None, dict[str, Any]]:
    """The render mode, and the metadata with the frames per second of the task."""
    if mode not in (None, *metadata["render_modes"]):
        raise ValueError(f"render_mode is {mode!r}; accepted: None, {', '.join(metadata['render_modes'])}")
    return mode, metadata | {"render_fps": round(1 / float(stepper.env.control_period))}


def picture(stepper: Stepper, row: int) -> np.ndarray:
    """A picture from behind a vehicle, uint8 (h, w, 3)."""
    if stepper.state is None:
        raise RuntimeError("render before the first reset")
    from e2efly.viewing.watch.film import snapshot  # both import what only pictures need
    from e2efly.viewing.watch.simulation import moment

    return snapshot(*moment(stepper.env, stepper.config.task, stepper.state, row), PICTURE)


def _seed(rng: np.random.Generator) -> int:
    return int(rng.integers(2**32))


def info_of(out: Any) -> dict[str, np.ndarray]:
    """What a step tells of each vehicle besides its observation, (n,) each."""
    return {"success": out.success, "error": out.error} | {f"reward/{name}": x for name, x in out.terms.items()}


def observations(stepper: Stepper, state: np.ndarray) -> Observation:
    """The observations of all vehicles, with their images."""
    if not stepper.env.cameras:
        return state
    return {STATE: state} | {IMAGE.format(i): image for i, image in enumerate(stepper.images())}


for _task in (*TASKS, None):
    gymnasium.register(
        f"e2efly/{_task or 'task'}-v0",
        entry_point="e2efly.adapters.gym:QuadrotorEnv",
        vector_entry_point="e2efly.adapters.gym:QuadrotorVectorEnv",
        kwargs={"task": _task} if _task else {},
        disable_env_checker=True,
    )
