"""What `import e2efly` offers: training, evaluation and environments in a few lines of Python."""

import dataclasses
import os
from pathlib import Path
from typing import Any

from e2efly.config import ALGORITHMS, AlgorithmConfig, EnvConfig, NetworkConfig, RewardConfig, TaskConfig, TrainConfig
from e2efly.runs import presets
from e2efly.simulation.device import prepare
from e2efly.tasks import TASKS

TaskLike = str | type[TaskConfig] | TaskConfig
"""A task name, a reference (`path/to/file.py:Name`), a class of options, or an instance of it."""
AlgoLike = str | type[AlgorithmConfig]
"""An algorithm name, a reference, or a class of options."""


def list_tasks() -> list[str]:
    """The names of the registered tasks."""
    return list(TASKS)


def preset(task: TaskLike, algo: AlgoLike | None = None, name: str | None = None, device: str = "cpu") -> TrainConfig:
    """The configuration for learning a task.

    Args:
        task: what to learn. An instance of options replaces the task options of the preset.
        algo: ppo, bptt, shac, abpt, foppo, a reference, or a class of options. If omitted, the algorithm that learns
            the task best.
        name: robust, nominal, paper, or a variant of the task. If omitted, robust if the task has it for the
            algorithm, otherwise nominal.
        device: the device for which it is sized: cpu or gpu.

    Raises:
        ValueError: for an unknown name. The message gives the nearest name and all known names.
    """
    return _starting(task, algo, name, None, None, device)


def _starting(
    task: TaskLike, algo: AlgoLike | None, name: str | None, vehicle: str | None, start_from: str | None, device: str
) -> TrainConfig:
    """`presets.starting` for names, classes or an instance of task options."""
    options = task if isinstance(task, TaskConfig) else None
    if not isinstance(task, str):
        task = TASKS.reference(type(task) if isinstance(task, TaskConfig) else task)
    if isinstance(algo, type):
        algo = ALGORITHMS.reference(algo)
    algo, name = presets.completed(task, algo, name, lambda option: getattr(options, option, None))
    config = presets.starting(task, algo, name, vehicle, start_from, device)
    return config if options is None else dataclasses.replace(config, task=options)


def train(
    task: TaskLike,
    algo: AlgoLike | None = None,
    *,
    preset_name: str | None = None,
    out: str | os.PathLike[str] | None = None,
    vehicle: str | None = None,
    reward: dict[str, float] | RewardConfig | None = None,
    env: EnvConfig | None = None,
    network: NetworkConfig | None = None,
    options: AlgorithmConfig | None = None,
    start_from: str | os.PathLike[str] | None = None,
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = False,
    device: str | None = None,
    **changes: Any,
) -> dict[str, Any]:
    """Train a policy, as `e2efly train` does, and write it to `out` as policy.onnx.

    Args:
        task: what to learn.
        algo: the learning algorithm. If omitted, the one that learns the task best.
        preset_name: where the defaults come from. If omitted, robust if the task has it, otherwise nominal.
        out: the run directory. If omitted, the name that `e2efly train` chooses: runs/TASK-ALGO-SEED.
        vehicle: the name of a shipped vehicle, or the path of a .toml file.
        reward: weights that replace those of the preset.
        env: environment options that replace those of the preset.
        network: network options that replace those of the preset.
        options: algorithm options that replace those of the preset.
        start_from: a policy whose weights the training starts from: a task of the zoo, a run directory, or a
            policy.onnx. The learning rate is then the one with which other trainings end, unless `options` sets it.
        resume: continue the run in `out`.
        overwrite: delete the run in `out` and start again.
        progress: print what the command line prints.
        device: cpu or gpu. The preset's sizes are those for the device. If omitted, the device that JAX finds.
        changes: other fields of `TrainConfig`, such as steps or seed.

    Returns:
        The run's summary. The success rate is at `summary["shipped"][criterion]["success"]`.

    Raises:
        ValueError: naming the field, the value and what is accepted.
        FloatingPointError: when a loss is not finite. The previous checkpoint is kept.
    """
    prepare(device)
    import jax

    first = None if start_from is None else os.fspath(start_from)
    config = _starting(task, algo, preset_name, vehicle, first, jax.default_backend())
    env = env if env is None or vehicle is None else dataclasses.replace(env, vehicle=vehicle)
    given = {"env": env, "network": network, "algo": options} | changes
    if reward is not None:
        given["reward"] = reward if isinstance(reward, RewardConfig) else RewardConfig(reward, config.reward.parameters)
    given = {name: value for name, value in given.items() if value is not None}
    config = presets.begun(dataclasses.replace(config, **given))
    from e2efly.commands.terminal import Terminal, TerminalProgress
    from e2efly.learning.runner import train as run
    from e2efly.learning.setup import Setup
    from e2efly.runs.rundir import RunDirectory, run_folder

    setup, folder = Setup.of(config), RunDirectory(run_folder(config) if out is None else Path(out))
    title = f"{config.task.name} by {config.algo.name}"
    with TerminalProgress(Terminal(quiet=not progress), title) as reporter:
        return run(setup, folder, reporter, resume, overwrite, traced=True)


def make_env(task: TaskLike, num_envs: int | None = None, *, agents: int | None = None, **options: Any) -> Any:
    """The environment of a task.

    Args:
        task: the task.
        num_envs: None returns the functional JAX environment, `e2efly.environment.Env`. A number returns a Gymnasium
            vector environment with this many vehicles (needs the extra `gym`).
        agents: number of vehicles in a world, for a task that has several, such as `swap`. Rows that are next to each
            other are one world. If omitted, as many as the task's default.
        options: fields of `EnvConfig`, such as vehicle, wind or randomize.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    config = preset(task, "ppo", presets.NOMINAL)
    config = dataclasses.replace(config, env=dataclasses.replace(config.env, **options))
    if agents is not None:
        if not hasattr(config.task, "agents"):
            raise ValueError(f"agents is {agents}; accepted: a task with several vehicles; {config.task.name} has one")
        config = dataclasses.replace(config, task=dataclasses.replace(config.task, agents=agents))
    if num_envs is not None:
        from e2efly.adapters.gym import QuadrotorVectorEnv

        return QuadrotorVectorEnv(config, num_envs)
    from e2efly.environment import Env

    return Env.of(config.task, config.reward, config.env)
