"""What `import e2efly` offers: training, evaluation and environments in a few lines of Python."""

import dataclasses
import os
from pathlib import Path
from typing import Any

from e2efly import presets
from e2efly.config import AlgorithmConfig, EnvConfig, NetworkConfig, RewardConfig, TaskConfig, TrainConfig
from e2efly.device import prepare
from e2efly.tasks import TASKS

TaskLike = str | type[TaskConfig] | TaskConfig
"""A name, a reference (`path/to/file.py:Name`), a class of options, or options."""


def list_tasks() -> list[str]:
    """The names of the registered tasks."""
    return list(TASKS)


def preset(task: TaskLike, algo: str | None = None, name: str = presets.OURS) -> TrainConfig:
    """The configuration by which a task is learned.

    Args:
        task: what to learn; options take the place of the preset's.
        algo: ppo, bptt, shac, abpt or foppo; left out: what learns the task best.
        name: ours, paper, or a variant of the task.

    Raises:
        ValueError: for an unknown name, with the nearest one and all there are.
    """
    options = task if isinstance(task, TaskConfig) else None
    if not isinstance(task, str):
        task = TASKS.reference(type(task) if isinstance(task, TaskConfig) else task)
    config = presets.preset(task, algo or TASKS.find(task).best, name)
    return config if options is None else dataclasses.replace(config, task=options)


def train(
    task: TaskLike,
    algo: str | None = None,
    *,
    preset_name: str = presets.OURS,
    out: str | os.PathLike[str] | None = None,
    vehicle: str | None = None,
    reward: dict[str, float] | RewardConfig | None = None,
    env: EnvConfig | None = None,
    network: NetworkConfig | None = None,
    options: AlgorithmConfig | None = None,
    resume: bool = False,
    progress: bool = False,
    device: str | None = None,
    **changes: Any,
) -> dict[str, Any]:
    """Train a policy, as `e2efly train` does; it lies in `out` as policy.onnx.

    Args:
        task: what to learn.
        algo: by which algorithm; left out: the one that learns it best.
        preset_name: where the defaults come from.
        out: the run directory; runs/TASK-ALGO-SEED when left out.
        vehicle: a shipped one, or the path of a .toml file.
        reward: weights in place of the preset's.
        env: in place of the preset's.
        network: in place of the preset's.
        options: of the algorithm, in place of the preset's.
        resume: go on with the run in `out`.
        progress: print what the command line prints.
        device: cpu or gpu.
        changes: other fields of `TrainConfig`, such as steps or seed.

    Returns:
        The run's summary; success is at summary["shipped"][criterion]["success"].

    Raises:
        ValueError: naming the field, the value and what is accepted.
        FloatingPointError: when a loss is not finite; the checkpoint before is kept.
    """
    config = preset(task, algo, preset_name)
    given = {"env": env, "network": network, "algo": options} | changes
    if reward is not None:
        given["reward"] = reward if isinstance(reward, RewardConfig) else RewardConfig(reward, config.reward.parameters)
    config = dataclasses.replace(config, **{name: value for name, value in given.items() if value is not None})
    if vehicle is not None:
        config = dataclasses.replace(config, env=dataclasses.replace(config.env, vehicle=vehicle))
    name = presets.algorithm_name(config.algo)
    folder = Path("runs") / f"{config.task.name}-{name}-{config.seed}" if out is None else Path(out)
    prepare(device)
    from e2efly.commands.progress import TerminalProgress
    from e2efly.commands.terminal import Terminal
    from e2efly.learn.programs import traced_folder
    from e2efly.learn.runner import train as run

    with TerminalProgress(Terminal(quiet=not progress), f"{config.task.name} by {name}") as reporter:
        return run(config, folder, reporter, resume, traced=traced_folder(config))


def make_env(task: TaskLike, num_envs: int | None = None, **options: Any) -> Any:
    """The environment of a task.

    Args:
        task: which.
        num_envs: None: the functional environment of JAX, `e2efly.env.Env`; else a Gymnasium vector environment of so
            many vehicles (needs the extra `gym`).
        options: of `EnvConfig`, such as vehicle, wind or randomize.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    config = preset(task, "ppo")
    config = dataclasses.replace(config, env=dataclasses.replace(config.env, **options))
    if num_envs is not None:
        from e2efly.adapters.gym import QuadrotorVectorEnv

        return QuadrotorVectorEnv(config, num_envs)
    from e2efly.env import Env

    return Env.of(config.task, config.reward, config.env)
