"""Training a policy: compile, update, evaluate, log, checkpoint, and ship the best.

A run is a pure function of its configuration: the number of updates, the evaluations and all random numbers depend
on nothing else, so that a run that was killed and resumed ends bit for bit like one that was not.
"""

import dataclasses
import math
import signal
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import jax
import jax.numpy as jnp
import numpy as np

from e2efly import presets
from e2efly.config import TrainConfig
from e2efly.env import Env, random_key
from e2efly.evaluate import Episodes, run_episodes
from e2efly.learn.algorithm import Algorithm, TrainState, begin, make_algorithm
from e2efly.learn.checkpoint import load_checkpoint, read_about, save_checkpoint
from e2efly.learn.devices import AXIS, OWN, SAME, on_each, own, placed, share, stacked
from e2efly.learn.clock import peak_memory, since_process_start
from e2efly.learn.networks import Features, Layers, policy
from e2efly.learn.rundir import RunDirectory, differences, versions

WATCHED, REPORTED = 1, 2
"""Streams of starts: those that training watches, and the unseen ones of the report."""
REPORT_EPISODES = 1000
FAST_COMPILE: dict[str, Any] = {"xla_cpu_use_fusion_emitters": False, "xla_backend_optimization_level": 1}
"""XLA options for programs that run for seconds only."""


class Reporter(Protocol):
    """What shows the progress of a run."""

    def compiling(self) -> None:
        """The programs are being compiled."""
        ...

    def progress(self, steps: int, total: int, rate: float, success: float, best: float) -> None:
        """Environment steps done, of how many, steps/s, success of the last and of the best evaluation."""
        ...


@dataclass(frozen=True)
class Setup:
    """What a configuration comes to, before anything is compiled."""

    config: TrainConfig
    env: Env
    judges: dict[str, Env]
    """The environments of the evaluation, by the name of their criterion."""
    algorithm: Algorithm
    features: Features
    updates: int
    """Updates of the whole run."""
    devices: int
    """Devices that share the environments."""

    @staticmethod
    def of(config: TrainConfig) -> "Setup":
        """Build and check everything that a configuration names.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        presets.check(config)
        env = Env.of(config.task, config.reward, config.env)
        judges = {name: Env.of(t, config.reward, config.env) for name, t in presets.suites(config.task).items()}
        algorithm = make_algorithm(config.algo, env, config.network)
        per_update = config.algo.envs * config.algo.horizon
        chunks = math.ceil(config.steps / (per_update * config.chunk))
        devices = share(config.algo.envs, getattr(config.algo, "minibatch", None), config.devices)
        config = dataclasses.replace(config, devices=devices)
        return Setup(config, env, judges, algorithm, Features(env.fields), chunks * config.chunk, devices)

    @property
    def steps_per_update(self) -> int:
        """Environment steps of one update."""
        return self.config.algo.envs * self.config.algo.horizon

    @property
    def episode_steps(self) -> int:
        """Control steps of the longest episode."""
        return math.ceil(float(self.config.task.episode_s) / self.env.control_period - 1e-6)

    @property
    def settle(self) -> float:
        """Seconds after which the mean error counts."""
        return float(getattr(self.config.task, "settle_s", 0.0))


@dataclass(frozen=True)
class Programs:
    """The compiled programs of a run."""

    begin: Any
    chunk: Any
    evaluate: Any

    @staticmethod
    def compile(setup: Setup, parameters: Any) -> "Programs":
        """Compile the training and the evaluation side by side, on two threads."""
        config, env = setup.config, setup.env
        key = random_key(config.seed)

        def chunk(
            env: Env, algo: Any, state: TrainState, first: jax.Array, updates: jax.Array
        ) -> tuple[TrainState, dict[str, jax.Array]]:
            def update(state: TrainState, index: jax.Array) -> tuple[TrainState, dict[str, jax.Array]]:
                return setup.algorithm.update(env, algo, state, index / updates)

            state, metrics = jax.lax.scan(update, own(state), first + jnp.arange(config.chunk))
            return stacked(state), jax.lax.pmean(metrics, AXIS)

        options: dict[str, Any] = FAST_COMPILE if config.fast_compile and jax.default_backend() == "cpu" else {}

        def train_programs() -> Any:
            state = jax.eval_shape(start_program(setup), env, parameters, key)
            program = on_each(chunk, setup.devices, (SAME, SAME, OWN, SAME, SAME), (OWN, SAME), donate=(2,))
            return program.lower(env, config.algo, state, 0, setup.updates).compile(compiler_options=options)

        def other_programs() -> tuple[Any, Any]:
            judge = next(iter(setup.judges.values()))
            return (
                start_program(setup).lower(env, parameters, key).compile(compiler_options=options),
                evaluation(setup).lower(judge, parameters.policy, key).compile(compiler_options=options),
            )

        with ThreadPoolExecutor(2) as pool:
            training, other = pool.submit(train_programs), pool.submit(other_programs)
            return Programs(other.result()[0], training.result(), other.result()[1])


def start_program(setup: Setup) -> Any:
    """The program (environment, parameters, key) -> the first `TrainState` of each device."""

    def start(env: Env, parameters: Any, key: jax.Array) -> TrainState:
        return stacked(begin(env, setup.config.algo, parameters, key))

    return on_each(start, setup.devices, (SAME, SAME, SAME), OWN)


def evaluation(setup: Setup) -> Any:
    """The program (environment, policy layers, key) -> `Episodes` of `eval_episodes` starts, or a few repeated more."""
    config, features = setup.config, setup.features

    def evaluate(env: Env, layers: Layers, key: jax.Array) -> Episodes:
        act = lambda observation: policy(layers, features(observation), config.network.activation)  # noqa: E731
        part = jax.lax.axis_index(AXIS), setup.devices
        return run_episodes(env, act, key, config.eval_episodes, setup.episode_steps, setup.settle, part)

    return on_each(evaluate, setup.devices, (SAME, SAME, SAME), OWN)


def judge(
    setup: Setup, evaluate: Any, layers: Layers, stream: int, episodes: int, seed: int = 0
) -> dict[str, Episodes]:
    """Fly at least `episodes` starts of a stream for every criterion; NumPy arrays."""
    once = setup.config.eval_episodes
    flown = {}
    for name, env in setup.judges.items():
        stream_key = jax.random.fold_in(random_key(seed), stream)
        keys = [jax.random.fold_in(stream_key, i) for i in range(math.ceil(episodes / once))]
        parts = [jax.tree.map(lambda x: np.asarray(x)[:once], evaluate(env, layers, key)) for key in keys]
        flown[name] = jax.tree.map(lambda *x: np.concatenate(x)[:episodes], *parts)
    return flown


def policy_of(state: TrainState) -> Layers:
    """The policy on the host: every device has the same."""
    return jax.tree.map(lambda x: np.asarray(x)[0], state.parameters.policy)


def success(flown: dict[str, Episodes]) -> float:
    """The success rate of the worst criterion."""
    return min(float(np.mean(e.success)) for e in flown.values())


def score(task: str, flown: dict[str, Episodes]) -> float:
    """What the best policy is chosen by: success first, then precision (racing: lap time)."""

    def cost(e: Episodes) -> float:
        if task == "race":
            return float(np.mean(e.duration)) / 10
        return float(np.mean(e.mean_error if task == "track" else e.final_error))

    return min(float(np.mean(e.success)) - 0.1 * min(cost(e), 1.0) for e in flown.values())


@dataclass(frozen=True)
class Progress:
    """Where a run is: what a checkpoint says of itself."""

    update: int = 0
    seconds: float = 0.0
    best_score: float = -math.inf
    best_update: int = 0
    best_success: float = 0.0
    last_success: float = 0.0
    reached: dict[str, float] = dataclasses.field(default_factory=dict)
    """Seconds from process start and environment steps at the first evaluation at `stop_at`; empty before."""


class NonFiniteError(FloatingPointError):
    """A loss or reward term was not finite."""


def train(config: TrainConfig, out: Path, reporter: Reporter, resume: bool = False) -> dict[str, Any]:
    """Train a policy into a run directory.

    Args:
        config: everything that decides the outcome.
        out: the run directory: new, or with `resume` an unfinished one.
        reporter: shows the progress.
        resume: go on from the checkpoint.

    Returns:
        The summary that is also in summary.json.

    Raises:
        ValueError: for a configuration, folder or checkpoint that cannot be used.
        OSError: when the folder cannot be written.
        NonFiniteError: naming the term and the update; the last good checkpoint is kept.
    """
    run = RunDirectory(out)
    setup = Setup.of(config)
    if resume:
        _check_resume(run, setup.config)
    else:
        run.create(setup.config)
    parameters = setup.algorithm.init(setup.env, config.algo, config.seed)
    reporter.compiling()
    programs = Programs.compile(setup, parameters)
    key = random_key(config.seed)
    progress, best = Progress(), parameters.policy
    if resume and run.checkpoint.exists():
        loaded = load_checkpoint(run.checkpoint, _checkpoint_like(setup, parameters))
        state, best = placed(loaded["state"], setup.devices), loaded["best"]
        progress = Progress(**{f.name: read_about(run.checkpoint)[f.name] for f in dataclasses.fields(Progress)})
    else:
        state = programs.begin(setup.env, parameters, key)
    run.forget_after(progress.update)
    state, best, progress, stopped = _loop(setup, programs, run, reporter, state, best, progress)
    return _finish(setup, programs, run, state, best, progress, stopped)


def _loop(
    setup: Setup, programs: Programs, run: RunDirectory, reporter: Reporter, state: Any, best: Any, progress: Progress
) -> tuple[Any, Any, Progress, bool]:
    """Chunks of updates, an evaluation and a checkpoint after each. Ends at the last update, the goal, or Ctrl-C."""
    from tensorboardX import SummaryWriter

    config, task = setup.config, presets.task_name(setup.config.task)
    before = progress.seconds  # of earlier processes of this run
    with SummaryWriter(str(run.events), purge_step=progress.update) as events, _interruptible() as stop:
        while progress.update < setup.updates and not stop.is_set():
            began = time.perf_counter()
            state, metrics = programs.chunk(setup.env, config.algo, state, progress.update, setup.updates)
            metrics = {name: np.asarray(x, np.float64) for name, x in metrics.items()}
            _check_finite(metrics, progress.update)
            rate = config.chunk * setup.steps_per_update / (time.perf_counter() - began)
            layers = policy_of(state)
            flown = judge(setup, programs.evaluate, layers, WATCHED, config.eval_episodes)
            reached, last, now = progress.reached, success(flown), score(task, flown)
            if config.stop_at and not reached and last >= config.stop_at:
                confirmed = judge(setup, programs.evaluate, layers, REPORTED, REPORT_EPISODES)
                if success(confirmed) >= config.stop_at:
                    steps = (progress.update + config.chunk) * setup.steps_per_update
                    reached = {"seconds": before + since_process_start(), "steps": steps}
            better = now > progress.best_score
            progress = Progress(
                update=progress.update + config.chunk,
                seconds=before + since_process_start(),
                best_score=now if better else progress.best_score,
                best_update=progress.update + config.chunk if better else progress.best_update,
                best_success=last if better else progress.best_success,
                last_success=last,
                reached=reached,
            )
            if better:
                best = layers
            rows = _rows(setup, metrics, progress, rate, flown)
            run.append(rows)
            for name, value in rows[-1].items():
                events.add_scalar(name, value, int(rows[-1]["update"]))
            save_checkpoint(run.checkpoint, {"state": state, "best": best}, _about(config, progress))
            reporter.progress(
                progress.update * setup.steps_per_update,
                setup.updates * setup.steps_per_update,
                rate,
                last,
                progress.best_success,
            )
            if reached:
                break
        return state, best, progress, stop.is_set()


def _finish(
    setup: Setup, programs: Programs, run: RunDirectory, state: Any, best: Any, progress: Progress, stopped: bool
) -> dict[str, Any]:
    """Judge the best and the last policy on unseen starts; write policy.onnx and summary.json."""
    from e2efly.learn.export import contract_of, export_policy

    trained = progress.seconds
    config = setup.config
    by_best = judge(setup, programs.evaluate, best, REPORTED, REPORT_EPISODES)
    by_last = judge(setup, programs.evaluate, policy_of(state), REPORTED, REPORT_EPISODES)
    export_policy(run.policy, best, setup.features, config.network.activation, contract_of(setup.env, config))
    summary = {
        "task": presets.task_name(config.task),
        "algorithm": presets.algorithm_name(config.algo),
        "vehicle": config.env.vehicle,
        "seed": config.seed,
        "finished": progress.update >= setup.updates or bool(progress.reached),
        "stopped_by_user": stopped,
        "env_steps": progress.update * setup.steps_per_update,
        "seconds_trained_from_process_start": round(trained, 3),
        "reached_criterion": progress.reached,
        "peak_memory_gb": round(peak_memory() / 1e9, 3),
        "shipped": {"update": progress.best_update, **{n: digest(e) for n, e in by_best.items()}},
        "last": {"update": progress.update, **{n: digest(e) for n, e in by_last.items()}},
        "episodes": REPORT_EPISODES,
        "versions": versions(),
    }
    run.write_json("summary.json", summary)
    return summary


def digest(e: Episodes) -> dict[str, float]:
    """Means over episodes, and over the successful ones for the time."""
    ok = np.asarray(e.success)
    return {
        "success": round(float(np.mean(ok)), 4),
        "final_error_m": round(float(np.mean(e.final_error)), 5),
        "mean_error_m": round(float(np.mean(e.mean_error)), 5),
        "seconds_of_success": round(float(np.mean(e.duration[ok])), 4) if ok.any() else math.nan,
        "top_speed_m_s": round(float(np.max(e.top_speed)), 3),
        "roughness": round(float(np.mean(e.roughness)), 5),
    }


def _rows(
    setup: Setup, metrics: dict[str, np.ndarray], progress: Progress, rate: float, flown: dict[str, Episodes]
) -> list[dict[str, float]]:
    """A row an update; the evaluation stands in the chunk's last."""
    chunk = setup.config.chunk
    rows = []
    for i in range(chunk):
        update = progress.update - chunk + 1 + i
        last = i == chunk - 1
        row: dict[str, Any] = {"update": update, "steps": update * setup.steps_per_update}
        row |= {"seconds": round(progress.seconds, 3) if last else "", "rate": round(rate) if last else ""}
        for name, e in flown.items():
            row[f"eval/{name}/success"] = float(np.mean(e.success)) if last else ""
            row[f"eval/{name}/final_error"] = float(np.mean(e.final_error)) if last else ""
            row[f"eval/{name}/duration"] = float(np.mean(e.duration)) if last else ""
        rows.append(row | {name: float(x[i]) for name, x in sorted(metrics.items())})
    return rows


def _check_finite(metrics: dict[str, np.ndarray], update: int) -> None:
    for i in range(len(next(iter(metrics.values())))):
        for name in sorted(metrics, key=lambda n: (not n.startswith("reward/"), n)):
            if not np.isfinite(metrics[name][i]):
                raise NonFiniteError(
                    f"{name} became {metrics[name][i]} in update {update + i + 1}; the checkpoint of update {update} "
                    "is kept (lower algo.learning-rate or algo.max-grad-norm, or look at that term)"
                )


def _about(config: TrainConfig, progress: Progress) -> dict[str, Any]:
    return {**dataclasses.asdict(progress), "version": versions()["e2efly"], "seed": config.seed}


def _check_resume(run: RunDirectory, config: TrainConfig) -> None:
    if different := list(differences(run.config(), config)):
        raise ValueError(f"{run.path} was started with another configuration: {'; '.join(different)}")
    started, now = run.read_json("versions.json"), versions()
    changed = [
        f"{name} {started.get(name)} and {now[name]}"
        for name in ("e2efly", "jax", "jaxlib")
        if started.get(name) != now[name]
    ]
    if changed:
        raise ValueError(f"{run.path} was started with another version: {', '.join(changed)}")


@contextmanager
def _interruptible() -> Iterator[threading.Event]:
    """Ctrl-C asks the loop to stop after its chunk; a second one interrupts at once."""
    stop = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return

    def ask(signum: int, frame: Any) -> None:
        del signum, frame
        stop.set()
        signal.signal(signal.SIGINT, signal.default_int_handler)

    old = signal.signal(signal.SIGINT, ask)
    try:
        yield stop
    finally:
        signal.signal(signal.SIGINT, old)


def load_policy_layers(setup: Setup, run: RunDirectory, which: str) -> Layers:
    """The `best` or the `last` policy of a run's checkpoint.

    Raises:
        ValueError: when there is no whole checkpoint.
    """
    parameters = setup.algorithm.init(setup.env, setup.config.algo, setup.config.seed)
    loaded = load_checkpoint(run.checkpoint, _checkpoint_like(setup, parameters))
    return loaded["best"] if which == "best" else policy_of(loaded["state"])


def _checkpoint_like(setup: Setup, parameters: Any) -> dict[str, Any]:
    """Shapes and types of what a checkpoint holds."""
    state = jax.eval_shape(start_program(setup), setup.env, parameters, random_key(0))
    return {"state": state, "best": parameters.policy}
