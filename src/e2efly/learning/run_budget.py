"""Resources that a run needs: memory and environment steps, by the options that determine them.

The constants agree, within a factor of two, with XLA's own figures for the compiled programs of hover, avoid and
race_clutter with all algorithms.
"""

from itertools import pairwise

import jax

from e2efly.config import TrainConfig
from e2efly.config.budget import FASTEST, check_memory, check_time, machine_memory
from e2efly.environment import Env
from e2efly.learning.networks import Actor

LARGEST = 2**31 - 1
"""Largest number that the programs can count to: they count with int32."""


def check_run(config: TrainConfig, env: Env, actor: Actor, updates: int, judged: int, members: int = 1) -> None:
    """Refuse a run that does not fit into the machine's memory, that takes too long, or whose numbers exceed int32.

    Args:
        config: the run. Each of its numbers has already been checked by itself.
        env: its environment.
        actor: its policy.
        updates: updates of the whole run.
        judged: control steps to evaluate one start with all criteria.
        members: number of runs that are trained together.

    Raises:
        ValueError: naming the options, what they need and what is accepted.
    """
    check_memory(run_memory(config, env, actor, members), _memory())
    check_time({name: members * steps / FASTEST for name, steps in run_steps(config, updates, judged).items()})
    for name, value, most in (
        ("steps", config.steps, LARGEST * config.algo.steps),
        ("chunk", config.chunk, LARGEST),
        ("algo.envs", config.algo.envs, LARGEST // config.algo.horizon),
    ):
        if value > most or (name == "steps" and updates > LARGEST):
            raise ValueError(f"{name} is {value}; accepted: at most {most}: int32 counts updates and samples")


def run_memory(config: TrainConfig, env: Env, actor: Actor, members: int = 1) -> dict[str, float]:
    """Memory that a run needs, in bytes, by the options that determine it. The estimate is low by a factor of two at
    most.
    """
    algo, network, features = config.algo, config.network, float(actor.features.size)
    units = float(sum(network.hidden) + sum(network.encoder) * len(env.cameras) + 4 * network.recurrent)
    worlds = {name: getattr(config.task, name, None) for name in ("forest", "clutter")}
    rooms = {f"task.{name}.room {world.room}": world.room for name, world in worlds.items() if world is not None}
    images = {f"images of {camera.width} x {camera.height}": camera.width * camera.height for camera in env.cameras}
    solids, pixels = float(sum(rooms.values())), float(sum(images.values()))
    vehicle = 4 * (150 + 4.0 * env.queue + 17.0 * env.past + 6 * pixels + 30 * solids + units)
    step = 4 * (200 + 2 * features + (1.3 * units + 25 * solids if algo.exact else 0))
    past = [] if config.env.past_actions is None else [f"env.past_actions {config.env.past_actions}"]
    together = [f"{members} runs together"] if members > 1 else []
    observed = ", ".join((f"with {env.observation_size} observed numbers", *past, *rooms, *images, *together))
    parts = {
        f"network.hidden is {network.hidden}, recurrent {network.recurrent}, encoder {network.encoder}, "
        f"convolution {network.convolution}, {observed}": 40
        * _weights(actor, env.action_size)
        * (config.devices or 1)
        * members,
        f"algo.envs is {algo.envs}, algo.horizon {algo.horizon}, {observed}": (
            algo.envs * (algo.horizon * step + vehicle * members)
        ),
        f"eval_episodes is {config.eval_episodes}, {observed}": config.eval_episodes * vehicle,
        f"chunk is {config.chunk}": 4e3 * config.chunk * members,
    }
    if (minibatch := getattr(algo, "minibatch", 0)) > 0:
        parts[f"algo.minibatch is {minibatch}"] = 8 * units * minibatch
    for name, (count, what) in algo.kept().items():
        size = vehicle if what == "state" else 4 * (3 * features + 26)
        parts[f"algo.{name} is {count}"] = size * count * members
    return parts


def run_steps(config: TrainConfig, updates: int, judged: int) -> dict[str, float]:
    """Environment steps of a whole run, with the samples of its gradient steps, by the options that determine them."""
    algo = config.algo
    samples, learning = algo.fitted()
    flown = f"eval_episodes is {config.eval_episodes}, task.episode_s {config.task.episode_s}"
    return {
        f"steps is {config.steps}, chunk {config.chunk}{learning}": float(updates) * (algo.steps + samples),
        flown: float(-(-updates // config.chunk)) * config.eval_episodes * judged,
    }


def _weights(actor: Actor, action_size: int) -> float:
    """Number of weights of a policy. A critic has about as many."""
    network, count = actor.network, 0.0
    size = actor.features.state_size + len(actor.features.views) * (network.encoder or (0,))[-1]
    for view in actor.features.views:
        cells, channels = view.rows * view.columns, view.channels
        for side, wider in zip(view.patches, network.convolution, strict=False):
            count += float(side * side * channels * wider)
            cells, channels = cells // side**2, wider
        count += _layers((cells * channels, *network.encoder))
    count += 3.0 * network.recurrent * (size + network.recurrent)
    return count + _layers((size + network.recurrent, *network.hidden, action_size))


def _layers(sizes: tuple[int, ...]) -> float:
    return float(sum(n * m for n, m in pairwise(sizes)))


def _memory() -> float:
    """Memory of all JAX devices together, in bytes. The cores of a CPU share the memory of the machine."""
    if jax.default_backend() == "cpu":
        return machine_memory()
    limits = [(device.memory_stats() or {}).get("bytes_limit", 0) for device in jax.local_devices()]
    return float(sum(limits)) or machine_memory()
