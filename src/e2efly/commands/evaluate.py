"""`e2efly eval`."""

import dataclasses
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from e2efly import presets
from e2efly.budget import FASTEST, check_memory, check_time
from e2efly.commands.terminal import Terminal
from e2efly.config import CameraConfig, EnvConfig, ImuConfig, RewardConfig, TaskConfig
from e2efly.deploy.images import NONE, Image
from e2efly.deploy.policy import Policy, load_policy
from e2efly.device import prepare, wide_vectors
from e2efly.learn.rundir import RunDirectory, run_of
from e2efly.storage import write_json
from e2efly.vehicles import load_vehicle, vehicle_names
from e2efly.zoo import beside, policy_path

BATCH, DRAWN = 250, 12
"""Starts that are flown at once, and flights that are drawn."""
FIGURES, ROW = 200, 3000
"""Bytes that the figures of a start take, and its row of the report."""


def eval_command(
    path: Path,
    episodes: int = 1000,
    report: Path | None = None,
    plots: Path | None = None,
    seed: int = 1_000_000,
    vehicle: str | None = None,
    device: str | None = None,
    quiet: bool = False,
) -> int:
    """Fly the ONNX file itself from unseen starts; print a table, write the report and the plots."""
    if episodes <= 0:
        raise ValueError(f"--episodes is {episodes}; accepted: more than 0")
    path = policy_path(path, vehicle)
    prepare(device)
    run = run_of(path)
    policy = load_policy(run.policy if run else path)
    if run:
        config = run.config(names_vehicle=vehicle is not None)
        task, env_config = config.task, config.env
    else:
        task, env_config = config_from_contract(policy, vehicle)
    if vehicle is not None:
        env_config = dataclasses.replace(env_config, vehicle=vehicle)
    elif (known := load_vehicle(env_config.vehicle)).hash != policy.contract.vehicle_hash:
        raise ValueError(
            f"vehicle_hash is {policy.contract.vehicle_hash} in {run.policy if run else path}, but vehicle "
            f"{env_config.vehicle} is {known.hash}; accepted: the vehicle that the policy was trained on, or --vehicle"
        )
    flown, starts = fly_suites(policy, task, env_config, episodes, seed, ROW if report else 0)
    console = Terminal(quiet=quiet)
    console.print(_table(flown, episodes))
    if report:
        write_json(report, _report(policy, path, env_config, flown, starts, seed))
        console.print(f"Report: {report}")
    folder = plots or (run.plots if run else beside(path) / "plots")
    _draw(policy, task, env_config, flown, seed, folder, run)
    console.print(f"Plots: {folder}")
    return 0


def config_from_contract(policy: Policy, vehicle: str | None = None) -> tuple[TaskConfig, EnvConfig]:
    """Task and environment as the contract of a lone policy.onnx says; the task's options are those of its preset.

    Args:
        policy: as loaded.
        vehicle: what it is to fly; may be the file of the vehicle that it was trained on.

    Raises:
        ValueError: when the vehicle that it was trained on is not to be had.
    """
    c = policy.contract
    name = c.vehicle
    if vehicle is not None and load_vehicle(vehicle).hash == c.vehicle_hash:
        name = vehicle
    findable = name == vehicle or name in vehicle_names()
    known = load_vehicle(name).hash if findable else "no vehicle that comes with the package"
    if known != c.vehicle_hash:
        raise ValueError(
            f"vehicle_hash is {c.vehicle_hash} in the contract, but vehicle {c.vehicle!r} is {known}: it was trained "
            "on other parameters; accepted: the file of that vehicle with --vehicle FILE.toml, or its run's folder"
        )
    counts = {f.name: f.size for f in c.observation}
    config = EnvConfig(
        vehicle=name,
        command_mode=c.action.mode,
        control_rate=c.control_rate_hz,
        action_latency=(c.latency_range_s[0], c.latency_range_s[1]),
        observation_latency=(c.observation_latency_range_s[0], c.observation_latency_range_s[1]),
        past_actions=counts.get("past_actions", 0) // 4,
        imu=ImuConfig(observed="gyroscope" in counts),
        cameras=tuple(_camera(image) for image in c.images),
    )
    return presets.preset(c.task, "ppo").task, config


def _camera(image: Image) -> CameraConfig:
    """The camera of a contract's image."""
    known: dict[str, Any] = {"sees": image.sees, "projection": image.projection}
    known |= {"of": image.of} if image.of != NONE else {}
    known |= {"encoding": image.encoding} if image.encoding != NONE else {}
    return CameraConfig(
        width=image.width,
        height=image.height,
        fov=(image.fov_rad[0], image.fov_rad[1]),
        position=(image.position_m[0], image.position_m[1], image.position_m[2]),
        pitch=image.pitch_rad,
        reach=(image.reach_m[0], image.reach_m[1]),
        rate=image.rate_hz,
        latency=(image.latency_range_s[0], image.latency_range_s[1]),
        **known,
    )


def fly_suites(
    policy: Policy, task: TaskConfig, env_config: EnvConfig, episodes: int, seed: int, kept: int = 0
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Fly `episodes` starts of every criterion of a task.

    Args:
        policy: as loaded.
        task: what it flies.
        env_config: where.
        episodes: starts of each criterion.
        seed: of the starts.
        kept: bytes that the caller keeps of every start, beside the figures.

    Raises:
        ValueError: for more starts than fit into the machine's memory, or than anybody can wait for.

    Returns:
        By the criterion's name and of NumPy arrays: `Episodes`, and the `State` that each started from.
    """
    import jax

    from e2efly.env import UNSEEN, Env, random_key
    from e2efly.evaluate import run_episodes

    flown, starts = {}, {}

    @partial(jax.jit, static_argnums=2, compiler_options=wide_vectors(BATCH))
    def program(env: Env, key: Any, steps: int, settle: float) -> Any:
        start = env.reset(key, BATCH)[0].vehicle
        return run_episodes(env, callback(policy), key, BATCH, steps, settle), start

    suites = task.criteria()
    envs = {name: Env.of(suite, RewardConfig({"prog2": 1.0}), env_config) for name, suite in suites.items()}
    asked = f"--episodes is {episodes}"
    check_memory({asked: float(episodes) * len(suites) * (FIGURES + kept)})
    check_time({asked: sum(episode_steps(suites[name], envs[name]) for name in suites) * float(episodes) / FASTEST})
    for name, suite in suites.items():
        env = envs[name]
        check_observation(policy, env)
        steps, settle = episode_steps(suite, env), float(getattr(suite, "settle_s", 0.0))
        keys = [random_key(seed, UNSEEN, i) for i in range(-(-episodes // BATCH))]
        parts = [jax.tree.map(np.asarray, program(env, key, steps, settle)) for key in keys]
        flown[name], starts[name] = jax.tree.map(lambda *x: np.concatenate(x)[:episodes], *parts)
    return flown, starts


def callback(policy: Policy) -> Any:
    """The ONNX file as an `e2efly.evaluate.Act`, inside compiled programs."""
    import jax
    import jax.numpy as jnp

    from e2efly.evaluate import Act

    size = policy.contract.memory_size

    def act(observation: Any, images: Any, memory: Any) -> Any:
        n = observation.shape[0]
        shapes = jax.ShapeDtypeStruct((n, 4), jnp.float32), jax.ShapeDtypeStruct((n, size), jnp.float32)
        return jax.pure_callback(onnx, shapes, observation, images, memory)

    def onnx(observation: Any, images: Any, memory: Any) -> Any:
        return policy.act(np.asarray(observation), [np.asarray(x) for x in images], np.asarray(memory))

    return Act(act, lambda n: jnp.zeros((n, size)))


def episode_steps(task: TaskConfig, env: Any) -> int:
    """Control steps of the longest episode."""
    return int(np.ceil(float(task.episode_s) / env.control_period - 1e-6))


def check_observation(policy: Policy, env: Any) -> None:
    """Refuse a policy whose observation or images are not the environment's.

    Raises:
        ValueError: naming the field or the image, and what either side has.
    """
    wanted = [(f.name, f.size, f.frame, f.unit) for f in policy.contract.observation]
    offered = [(f.name, f.size, f.frame, f.unit) for f in env.fields]
    if wanted != offered:
        odd = [f for f in wanted if f not in offered] + [f for f in offered if f not in wanted]
        raise ValueError(
            f"observation: the policy wants {wanted}, the environment gives {offered}; they differ in {odd}"
        )
    seen = [(i.sees, i.of, i.height, i.width) for i in policy.contract.images]
    shown = [(c.sees, c.of if c.sees == "mask" else NONE, c.height, c.width) for c in env.cameras]
    if seen != shown:
        raise ValueError(f"images: the policy wants {seen}, the cameras of the environment give {shown}")


def _table(flown: dict[str, Any], episodes: int) -> Table:
    from e2efly.evaluate import wilson

    table = Table(f"of {episodes} starts", *flown, box=None, header_style="bold", pad_edge=False)

    def row(heading: str, show: Callable[[Any], str]) -> None:
        table.add_row(heading, *(show(e) for e in flown.values()))

    def interval(e: Any) -> str:
        low, high = wilson(int(e.success.sum()), len(e.success))
        return f"{low:.2%} to {high:.2%}"

    row("success", lambda e: f"{e.success.mean():.2%}")
    row("95 % interval", interval)
    row("final error", lambda e: f"{100 * e.final_error.mean():.2f} cm")
    row("mean error", lambda e: f"{100 * e.mean_error.mean():.2f} cm")
    row("time of a success", lambda e: f"{e.duration[e.success].mean():.2f} s" if e.success.any() else "none")
    row("top speed", lambda e: f"{e.top_speed.max():.1f} m/s")
    row("roughness", lambda e: f"{e.roughness.mean():.3f}")
    return table


def _report(
    policy: Policy, path: Path, env_config: EnvConfig, flown: dict[str, Any], starts: dict[str, Any], seed: int
) -> dict[str, Any]:
    """The report of `--json`: a summary and a row for every start, by criterion."""
    from e2efly.evaluate import wilson

    def criterion(e: Any, start: Any) -> dict[str, Any]:
        begun = {name: np.asarray(getattr(start, name)) for name in ("position", "velocity", "quaternion", "body_rate")}
        ok = np.asarray(e.success)
        names = [f.name for f in dataclasses.fields(e)]
        columns = {name: np.asarray(getattr(e, name)) for name in names}
        return {
            "episodes": len(ok),
            "success": float(ok.mean()),
            "success_interval_95": wilson(int(ok.sum()), len(ok)),
            "mean": {name: float(column.mean()) for name, column in columns.items()},
            "median": {name: float(np.median(column)) for name, column in columns.items() if column.dtype != bool},
            "mean_duration_of_success_s": float(columns["duration"][ok].mean()) if ok.any() else None,
            "starts": [
                {name: (bool if c.dtype == bool else float)(c[i]) for name, c in columns.items()}
                | {"start": {name: x[i].round(6).tolist() for name, x in begun.items()}}
                for i in range(len(ok))
            ],
        }

    return {
        "policy": str(path),
        "task": policy.contract.task,
        "vehicle": env_config.vehicle,
        "seed": seed,
        "units": {
            "duration": "s", "final_error": "m", "mean_error": "m", "top_speed": "m/s", "top_rate": "rad/s",
            "roughness": "mean |change of action| a step, action in [-1, 1]",
            "start": "position m, velocity m/s (world), quaternion wxyz (body to world), body_rate rad/s",
        },
        "criteria": {name: criterion(e, starts[name]) for name, e in flown.items()},
    }  # fmt: skip


def _draw(
    policy: Policy,
    task: TaskConfig,
    env_config: EnvConfig,
    flown: dict[str, Any],
    seed: int,
    folder: Path,
    run: RunDirectory | None,
) -> None:
    import jax

    from e2efly.env import UNSEEN, Env, random_key
    from e2efly.view import plots
    from e2efly.view.worlds import plot_flights_in_worlds

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OSError(f"cannot make the folder of the plots {folder}: {error.strerror}") from error
    title, key = f"{policy.contract.task} on {policy.contract.vehicle}", random_key(seed, UNSEEN, 0)
    for name, suite in task.criteria().items():
        env = Env.of(suite, RewardConfig({"prog2": 1.0}), env_config)
        flights = plots.fly(env, callback(policy), key, DRAWN, episode_steps(suite, env))
        tag = f"{title}: {name}" if len(flown) > 1 else title
        if env_config.cameras:  # every flight has a world of its own
            begun = jax.jit(Env.reset, static_argnums=2)(env, key, DRAWN)[0]
            plot_flights_in_worlds(flights, env.task.scene(begun.memory), folder / f"flights_{name}.png", tag)
        else:
            plots.plot_flights(suite, flights, folder / f"flights_{name}.png", tag)
        plots.plot_time(flights, 0, folder / f"time_{name}.png", tag)
    plots.plot_errors(flown, folder / "errors.png", title, plots.limits(task.criteria()))
    if run and (rows := run.rows()):
        shipped = run.read_json("summary.json").get("shipped") if (run.path / "summary.json").exists() else None
        update = shipped.get("update") if isinstance(shipped, dict) else None
        plots.plot_learning(rows, folder / "learning.png", title, best_update=update)
