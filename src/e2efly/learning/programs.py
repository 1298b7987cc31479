"""The compiled programs of a run, and the cache of traced programs.

JAX's own compilation cache stores the results of XLA. But the tracing of Python before it takes as long as a training.
A second cache therefore stores the traced programs (StableHLO, by `jax.export`). It may only be used by processes that
run nothing but this package's code: its key covers the configuration, the vehicle and the files of the package, but no
code of the user.
"""

import dataclasses
import hashlib
import json
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib import metadata, resources
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import export

from e2efly.config import TrainConfig
from e2efly.config.registry import is_shipped
from e2efly.config.storage import cache_folder, write_atomically
from e2efly.environment import Env, random_key
from e2efly.environment.episodes import Act, Episodes, run_episodes
from e2efly.learning.algorithm import TrainState, begin
from e2efly.learning.devices import AXIS, OWN, SAME, on_each, own, shardings, stacked
from e2efly.learning.networks import Actor, Weights
from e2efly.learning.setup import Setup
from e2efly.simulation.compiled import opened, sealed
from e2efly.simulation.device import fast_compile, wide_vectors
from e2efly.simulation.rewards import TERMS


@dataclass(frozen=True)
class Programs:
    """The compiled programs of a run."""

    begin: Callable[[Env, Any, jax.Array], TrainState]
    """(environment, parameters, key) -> the first state of each device."""
    chunk: Callable[[Env, Any, TrainState, int, int], tuple[TrainState, dict[str, jax.Array]]]
    """(environment, numbers of the algorithm, state, first update, updates of the run) -> the state after
    `config.chunk` updates, and the metrics of each update. The memory of the input state is reused, so that it cannot
    be used again."""
    evaluate: Callable[[Env, Weights, jax.Array], Episodes]
    """(environment, policy weights, key) -> `eval_episodes` episodes, or a few more, which are repetitions."""

    @staticmethod
    def compile(setup: Setup, parameters: Any, traced: Path | None = None) -> "Programs":
        """Compile the training, and at the same time trace and compile the evaluation.

        Args:
            setup: the run.
            parameters: initial parameters of the algorithm.
            traced: a folder from which traced programs are read and to which they are written. None: trace anew. Only
                for processes in which no code of the package was replaced.
        """
        config, env = setup.config, setup.env
        options = fast_compile() if config.fast_compile else {}
        key = random_key(config.seed)
        started = start_program(setup).trace(env, parameters, key)
        state = started.out_info
        training = (env, config.algo, state, 0, setup.updates)
        evaluating = (next(iter(setup.judges.values())), parameters.policy, key)
        of_leaves = _of_leaves(_chunk(setup), training, lambda out: (jax.tree.leaves(out[0]), out[1]))
        lowered = _lower(of_leaves, setup, training, (SAME, SAME, OWN, SAME, SAME), (OWN, SAME), traced, "chunk")
        with ThreadPoolExecutor(1) as pool:
            compiling = pool.submit(lowered.compile, compiler_options=options | wide_vectors(setup.vehicles))
            of_leaves = _of_leaves(_evaluate(setup), evaluating, vars)
            lowered = _lower(of_leaves, setup, evaluating, (SAME, SAME, SAME), SAME, traced, "evaluate")
            start = started.lower().compile(compiler_options=options)
            evaluate = lowered.compile(compiler_options=options | wide_vectors(setup.watched))
            chunk = compiling.result()
        structure = jax.tree.structure(state)

        def run_chunk(*args: Any) -> tuple[TrainState, dict[str, jax.Array]]:
            leaves, metrics = chunk(*jax.tree.leaves(args))
            return jax.tree.unflatten(structure, leaves), metrics

        return Programs(start, run_chunk, lambda *args: Episodes(**evaluate(*jax.tree.leaves(args))))


def traced_folder(config: TrainConfig) -> Path | None:
    """The folder for traced programs of a configuration. None: they contain code from outside the package."""
    terms = (TERMS.find(name).function for name in config.reward.weights)
    shipped = all(map(is_shipped, (type(config.task), type(config.algo), *terms)))
    own_noise = any(camera.noise.own for camera in config.env.cameras)
    return cache_folder() / "traced" if shipped and not own_noise else None


def start_program(setup: Setup) -> Any:
    """The program (environment, parameters, key) -> the first `TrainState` of each device."""

    def start(env: Env, parameters: Any, key: jax.Array) -> TrainState:
        return stacked(begin(setup.algorithm, env, setup.config.algo, parameters, key))

    return on_each(start, setup.devices, (SAME, SAME, SAME), OWN)


def _chunk(setup: Setup) -> Callable[..., tuple[TrainState, dict[str, jax.Array]]]:
    def chunk(
        env: Env, algo: Any, state: TrainState, first: jax.Array, updates: jax.Array
    ) -> tuple[TrainState, dict[str, jax.Array]]:
        def update(state: TrainState, index: jax.Array) -> tuple[TrainState, dict[str, jax.Array]]:
            return setup.algorithm.update(env, algo, state, index / updates)

        state, metrics = jax.lax.scan(update, own(state), first + jnp.arange(setup.config.chunk))
        return stacked(state), jax.lax.pmean(metrics, AXIS)

    return chunk


def _evaluate(setup: Setup) -> Callable[[Env, Weights, jax.Array], Episodes]:
    config, actor = setup.config, setup.actor

    def evaluate(env: Env, weights: Weights, key: jax.Array) -> Episodes:
        act = acting(actor, weights)
        part = jax.lax.axis_index(AXIS), setup.devices
        # parts of a vehicle alone are filled up by `run_episodes`, so that their starts do not depend on the devices
        count = config.eval_episodes if env.agents == 1 else env.whole(config.eval_episodes, setup.devices)
        flown = run_episodes(env, act, key, count, setup.episode_steps, setup.config.task.settling_s, part)
        return jax.tree.map(lambda x: jax.lax.all_gather(x, AXIS, tiled=True), flown)

    return evaluate


def acting(actor: Actor, weights: Weights) -> Act:
    """A policy with these weights, for `e2efly.environment.episodes`."""
    return Act(
        lambda observation, images, memory: actor(weights, actor.features(observation, images), memory), actor.memory
    )


def _of_leaves(function: Callable, args: tuple, result: Callable[[Any], Any]) -> Callable:
    """`function` as a function of the leaves of its arguments, because a traced program cannot store classes."""
    structure = jax.tree.structure(args)
    return lambda *leaves: result(function(*jax.tree.unflatten(structure, leaves)))


def _lower(
    function: Callable, setup: Setup, args: tuple, takes: tuple, returns: Any, traced: Path | None, name: str
) -> jax.stages.Lowered:
    """Trace a program of leaves, or read the traced program from the cache, and prepare it for compilation."""
    places = tuple(place for arg, place in zip(args, takes, strict=True) for _ in jax.tree.leaves(arg))
    leaves = jax.tree.leaves(args)
    donated = tuple(i for i, place in enumerate(places) if place == OWN)
    program = on_each(function, setup.devices, places, returns, donated)  # traced only when needed
    if traced is None:
        return program.lower(*leaves)
    file = traced / f"{name}-{_fingerprint(setup, args)}"
    found = _read(file)
    if found is None:
        found = bytes(export.export(program)(*leaves).serialize())
        with suppress(OSError):  # a cache that cannot be written costs time, not the run
            traced.mkdir(parents=True, exist_ok=True)
            write_atomically(file, sealed(found))
    call = export.deserialize(bytearray(found)).call
    inside, outside = shardings(places, setup.devices), shardings(returns, setup.devices)
    return jax.jit(call, in_shardings=inside, out_shardings=outside, donate_argnums=donated).lower(*leaves)


def _read(file: Path) -> bytes | None:
    """The content of a cache file. None if it is missing or damaged; it is then made again."""
    if not file.is_file():
        return None
    return opened(file.read_bytes(), file)


def _fingerprint(setup: Setup, args: tuple) -> str:
    """Hash of everything that a traced program depends on."""
    config = dataclasses.asdict(dataclasses.replace(setup.config, seed=0, stop_at=None, start_from=None))
    shapes = [(np.shape(x), str(x.dtype) if hasattr(x, "dtype") else type(x).__name__) for x in jax.tree.leaves(args)]
    numbers = [np.asarray(x).tolist() for x in jax.tree.leaves((setup.env, setup.judges))]
    device = jax.devices()[0]
    about = [config, shapes, str(jax.tree.structure(args)), numbers, device.platform, device.device_kind,
             metadata.version("jax"), metadata.version("jaxlib"), _source_hash()]  # fmt: skip
    return hashlib.sha256(json.dumps(about, default=str).encode()).hexdigest()[:32]


@cache
def _source_hash() -> str:
    """Hash of every Python file of the package. The data files are covered by the numbers of the environments."""
    package = Path(str(resources.files("e2efly")))
    total = hashlib.sha256()
    for file in sorted(package.rglob("*.py")):
        total.update(str(file.relative_to(package)).encode() + file.read_bytes())
    return total.hexdigest()
