"""Training a policy: compile, update, evaluate, log, write checkpoints, and ship the best policy.

A run is a pure function of its configuration: the number of updates, the evaluations and all random numbers depend
on nothing else. A run that was killed and resumed therefore ends bit for bit like a run that was not interrupted.
"""

import dataclasses
import math
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import jax
import numpy as np

from e2efly.config import TrainConfig
from e2efly.config.env import STRESS
from e2efly.config.storage import write_atomically
from e2efly.environment import Env, random_key
from e2efly.environment.episodes import Episodes
from e2efly.environment.episodes import summary as summary_of
from e2efly.flight.sight.samples import packed, samples_file
from e2efly.learning import history, hosts
from e2efly.learning.algorithm import TrainState
from e2efly.learning.checkpoint import load_checkpoint, read_about, save_checkpoint
from e2efly.learning.devices import placed
from e2efly.learning.judge import CONFIRMED, REPORTED, WATCHED, judge, score, stressed, success
from e2efly.learning.networks import Weights
from e2efly.learning.programs import Programs, start_program
from e2efly.learning.setup import Setup
from e2efly.learning.usage import peak_memory, since_process_start
from e2efly.policy.contract import Contract
from e2efly.runs.inputs import by_content
from e2efly.runs.rundir import RunDirectory, differences, different_values, fingerprint, from_json, to_json, versions

REPORT_EPISODES = 1000


class Reporter(Protocol):
    """Shows the progress of a run."""

    def compiling(self) -> None:
        """The programs are being compiled."""
        ...

    def progress(self, steps: int, total: int, rate: float, success: float, best: float, flown: str) -> None:
        """Show the progress.

        Args:
            steps: environment steps done so far.
            total: environment steps of the whole run.
            rate: environment steps per second.
            success: success rate of the last evaluation.
            best: success rate of the best evaluation.
            flown: what flew in the evaluation (`Env.vehicles`), and the stage of the curriculum, if there is one.
        """
        ...

    def judging(self, starts: int) -> None:
        """The training is over. The policy now flies `starts` starts that it has never seen."""
        ...

    def ended(self, setup: Setup, flown: dict[str, Episodes], /) -> None:
        """The run has ended. `flown` holds the flights of its best policy from unseen starts, for each criterion. If
        there are nominal environments, these are the nominal flights.
        """
        ...


@dataclass(frozen=True)
class Progress:
    """The progress of a run, as stored in the header of a checkpoint."""

    update: int = 0
    seconds: float = 0.0
    best_score: float = -math.inf
    best_update: int = 0
    best_success: float = 0.0
    last_success: float = 0.0
    stage: int = 0
    """Stage of the curriculum."""
    stage_update: int = 0
    """The update at which this stage began."""
    reached: dict[str, float] = dataclasses.field(default_factory=dict)
    """Seconds since the start of the process, and environment steps, at the first evaluation that reached `stop_at`.
    Empty before that."""


class NonFiniteError(FloatingPointError):
    """A loss or reward term was not finite."""


@hosts.together()
def train(
    config: TrainConfig,
    out: Path,
    reporter: Reporter,
    resume: bool = False,
    overwrite: bool = False,
    traced: Path | None = None,
) -> dict[str, Any]:
    """Train a policy into a run directory.

    Args:
        config: everything that determines the result.
        out: the run directory: a new one, or with `resume` that of an unfinished run.
        reporter: shows the progress.
        resume: continue from the checkpoint.
        overwrite: delete the run that `out` holds, after the new run has been compiled.
        traced: a folder for traced programs, see `Programs.compile`.

    Returns:
        The summary that is also written to summary.json.

    Raises:
        ValueError: for a configuration, folder or checkpoint that cannot be used.
        LostHostError: when another process of the run has ended or cannot be reached. The last checkpoint is kept.
        OSError: when the folder cannot be written.
        NonFiniteError: naming the term and the update. The last good checkpoint is kept.
    """
    run = RunDirectory(out)
    setup = Setup.of(config)
    with run.held() if hosts.first() else nullcontext():
        return _train(setup, run, reporter, resume, overwrite, traced)


def _train(
    setup: Setup, run: RunDirectory, reporter: Reporter, resume: bool, overwrite: bool, traced: Path | None
) -> dict[str, Any]:
    """Train, in a folder that no other process writes to."""
    config, content = setup.config, by_content(setup.config)
    if hosts.first():
        hosts.told({"resume": resume, "versions": _deciding(versions()), "config": to_json(content)})
        if resume:
            _check_resume(run, config)
        elif not overwrite:
            run.check_new()
    else:
        _check_same(content, resume)
    parameters = setup.algorithm.init(setup.env, config.algo, config.seed)
    if config.start_from is not None and not (resume and run.checkpoint.exists()):
        from e2efly.learning.warm_start import started_from

        parameters = started_from(parameters, Path(config.start_from), setup)
    reporter.compiling()
    programs = Programs.compile(setup, parameters, traced if jax.process_count() == 1 else None)
    if resume and hosts.told(run.checkpoint.exists()):
        state, best, progress = _resumed(setup, run, parameters)
    else:
        state, best = programs.begin(setup.env, parameters, random_key(config.seed)), parameters.policy
        progress = Progress()
    if hosts.first():
        if not resume:
            run.create(config, overwrite)  # only after every step that can fail because of the configuration
        run.forget_after(progress.update)
        setup = dataclasses.replace(setup, config=run.with_copies(config))
        if different := list(differences(content, by_content(setup.config))):
            raise ValueError(f"a file changed while the run began: {'; '.join(different)}; start it again")
    if config.start_from is not None and not progress.update:
        _save(run, config, state, best, progress)  # the run it starts from may be gone when this run is resumed
    state, best, progress, stopped = _loop(setup, programs, run, reporter, state, best, progress)
    return _finish(setup, programs, run, reporter, state, best, progress, stopped)


def _loop(
    setup: Setup, programs: Programs, run: RunDirectory, reporter: Reporter, state: Any, best: Any, progress: Progress
) -> tuple[Any, Any, Progress, bool]:
    """Run chunks of updates, with an evaluation and a checkpoint after each chunk.

    It ends after the last update, when `stop_at` is reached, or at Ctrl-C.
    """
    config = setup.config
    before, stopped = progress.seconds, False  # of earlier processes of this run
    with _writing(run, progress.update * setup.steps_per_update) as write, _interruptible() as stop:
        while progress.update < setup.updates and not progress.reached:
            if stopped := hosts.any_of(stop.is_set()):
                if not progress.update:  # there is no checkpoint yet to continue from
                    _save(run, config, state, best, progress)
                break
            began = time.perf_counter()
            number, stages = progress.stage, len(setup.stages)
            stage, final = setup.stages[number], number == stages - 1
            state, metrics = programs.chunk(stage.env, config.algo, state, progress.update, setup.updates)
            metrics = {name: np.asarray(x, np.float64) for name, x in metrics.items()}
            _check_finite(metrics, progress.update)
            rate = config.chunk * setup.steps_per_update / (time.perf_counter() - began)
            weights = policy_of(state)
            flown = judge(setup, programs.evaluate, weights, WATCHED, config.eval_episodes, stage.judges)
            reached, last, now = progress.reached, success(flown), score(config.task, flown)
            if config.stop_at and final and not reached and last >= config.stop_at:
                confirmed = judge(setup, programs.evaluate, weights, CONFIRMED, REPORT_EPISODES)
                if success(confirmed) >= config.stop_at:
                    steps = (progress.update + config.chunk) * setup.steps_per_update
                    reached = {"seconds": before + since_process_start(), "steps": steps}
            update = progress.update + config.chunk
            promoted = stage.is_over(last, (update - progress.stage_update) * setup.steps_per_update)
            # only the task itself (the last stage) ranks policies; the policy that met `stop_at` is the one shipped
            better = now > progress.best_score or not final or bool(reached)
            progress = Progress(
                update=update,
                seconds=before + since_process_start(),
                best_score=-math.inf if not final else now if better else progress.best_score,
                best_update=update if better else progress.best_update,
                best_success=last if better else progress.best_success,
                last_success=last,
                stage=number + promoted,
                stage_update=update if promoted else progress.stage_update,
                reached=reached,
            )
            if better:
                best = weights
            write(_rows(setup, metrics, progress, rate, flown, number))
            _save(run, config, state, best, progress)
            if hosts.first() and history.is_kept(update, config.chunk, setup.updates):
                history.keep(run.history, update, weights, last)
            reporter.progress(
                progress.update * setup.steps_per_update,
                setup.updates * setup.steps_per_update,
                rate,
                last,
                progress.best_success,
                setup.env.vehicles + (f", stage {progress.stage + 1} of {stages}" if stages > 1 else ""),
            )
        return state, best, progress, stopped


def _save(run: RunDirectory, config: TrainConfig, state: Any, best: Any, progress: Progress) -> None:
    """Write a checkpoint. Process 0 writes the file; all processes contribute their part."""
    whole = hosts.whole({"state": state, "best": best})
    if hosts.first():
        save_checkpoint(run.checkpoint, whole, _about(config, progress))


def _finish(
    setup: Setup,
    programs: Programs,
    run: RunDirectory,
    reporter: Reporter,
    state: Any,
    best: Any,
    progress: Progress,
    stopped: bool,
) -> dict[str, Any]:
    """Judge the best and the last policy on unseen starts, and write policy.onnx and summary.json."""
    from e2efly.learning.onnx_export import contract_of, export_policy

    trained = progress.seconds
    config = setup.config

    def flown(weights: Weights, judges: dict[str, Env]) -> dict[str, Episodes]:
        return judge(setup, programs.evaluate, weights, REPORTED, REPORT_EPISODES, judges)

    def told(flown: dict[str, Episodes]) -> dict[str, Any]:
        return {name: summary_of(e) for name, e in flown.items()}

    reporter.judging(REPORT_EPISODES)
    by_best = flown(best, setup.judges)
    is_last = progress.best_update == progress.update
    by_last = by_best if is_last else flown(policy_of(state), setup.judges)
    summary = {
        "task": config.task.name,
        "algorithm": config.algo.name,
        "vehicle": setup.env.physics.nominal.name,
        "seed": config.seed,
        "finished": progress.update >= setup.updates or bool(progress.reached),
        "stopped_by_user": stopped,
        "env_steps": progress.update * setup.steps_per_update,
        "seconds_trained_from_process_start": round(trained, 3),
        "reached_criterion": progress.reached,
        "peak_memory_gb": round(peak_memory() / 1e9, 3),
        "shipped": {"update": progress.best_update, **told(by_best)},
        "last": {"update": progress.update, **told(by_last)},
        "vehicles": {"shipped": setup.env.vehicles, "last": setup.env.vehicles},
        "episodes": REPORT_EPISODES,
        "versions": versions(),
    }
    if nominal := setup.nominal:
        summary["nominal"] = told(by_best := flown(best, nominal))
        summary["vehicles"]["nominal"] = setup.env.undisturbed().vehicles
        if setup.env.family is None:  # the rows of the stress test are defined relative to one vehicle
            summary["stress"] = told(stressed(setup, best, REPORT_EPISODES))
            summary["vehicles"]["stress"] = STRESS
    if hosts.first():
        contract = contract_of(setup.env, config)
        export_policy(run.policy, best, setup.actor, contract)
        if contract.images:
            write_atomically(samples_file(run.policy), packed(_seen(state, contract)))
        run.write_json("summary.json", summary | {"configuration": fingerprint(config)})
    reporter.ended(setup, by_best)
    return summary


def _seen(state: TrainState, contract: Contract) -> dict[str, np.ndarray]:
    """The last images that the policy saw in training, by their names."""
    seen = (image.addressable_data(0) if isinstance(image, jax.Array) else image for image in state.env.images)
    return {image.name: np.asarray(x).reshape(-1, *image.shape) for image, x in zip(contract.images, seen, strict=True)}


def policy_of(state: TrainState) -> Weights:
    """The weights of the policy, on the host. They are the same on every device."""
    return jax.tree.map(
        lambda x: np.asarray(x.addressable_data(0) if isinstance(x, jax.Array) else x)[0], state.parameters.policy
    )


@contextmanager
def _writing(run: RunDirectory, steps: int) -> Iterator[Callable[[list[dict[str, float]]], None]]:
    """A function that writes rows to metrics.csv, and the last row to the TensorBoard events, by environment steps.

    In processes other than 0 it does nothing.
    """
    from e2efly.learning.events import event_file

    if not hosts.first():
        yield lambda rows: None
        return
    with event_file(run.events, steps) as log:

        def write(rows: list[dict[str, float]]) -> None:
            run.append(rows)
            log(rows[-1], int(rows[-1]["steps"]))

        yield write


def _rows(
    setup: Setup,
    metrics: dict[str, np.ndarray],
    progress: Progress,
    rate: float,
    flown: dict[str, Episodes],
    stage: int,
) -> list[dict[str, float]]:
    """One row per update. The last row of the chunk also holds the evaluation."""
    chunk = setup.config.chunk
    rows = []
    for i in range(chunk):
        update = progress.update - chunk + 1 + i
        last = i == chunk - 1
        row: dict[str, Any] = {"update": update, "steps": update * setup.steps_per_update}
        row |= {"seconds": round(progress.seconds, 3) if last else "", "rate": round(rate) if last else ""}
        if len(setup.stages) > 1:
            row["stage"] = stage + 1
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
                kept = f"the checkpoint of update {update} is kept" if update else "there is no checkpoint yet"
                raise NonFiniteError(
                    f"{name} became {metrics[name][i]} in update {update + i + 1}; {kept} "
                    "(lower algo.learning-rate or algo.max-grad-norm, or look at that term)"
                )


def _about(config: TrainConfig, progress: Progress) -> dict[str, Any]:
    return {**dataclasses.asdict(progress), "version": versions()["e2efly"], "seed": config.seed}


def _deciding(versions: dict[str, str]) -> dict[str, str | None]:
    """The versions of those packages that must not change while a run is interrupted."""
    return {name: versions.get(name) for name in ("e2efly", "jax", "jaxlib")}


def _check_same(config: TrainConfig, resume: bool) -> None:
    """Refuse anything that differs from process 0. Files are compared by their content."""
    wanted = hosts.told(None)
    different = list(different_values(wanted["versions"], _deciding(versions())))
    if not different:  # versions may differ in what can be configured
        different = list(differences(from_json(wanted["config"], "process 0"), config))
    if wanted["resume"] != resume:
        different.append(f"resume: {wanted['resume']} and {resume}")
    if different:
        raise ValueError(f"process 0 was started with another configuration: {'; '.join(different)}")


def _check_resume(run: RunDirectory, config: TrainConfig) -> None:
    run.check_same(config)
    run.check_resumable()
    if different := list(different_values(_deciding(run.read_json("versions.json")), _deciding(versions()))):
        raise ValueError(f"{run.path} was started with another version: {'; '.join(different)}")


@contextmanager
def _interruptible() -> Iterator[threading.Event]:
    """The first Ctrl-C asks the loop to stop after the current chunk. A second one interrupts at once."""
    stop = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return

    def ask(signum: int, frame: Any) -> None:
        del signum, frame
        stop.set()
        signal.signal(signal.SIGINT, old)

    watched = signal.set_wakeup_fd(-1)  # else the watcher of the command line would end a run that must stop in order
    old = signal.signal(signal.SIGINT, ask)
    try:
        yield stop
    finally:
        signal.signal(signal.SIGINT, old)
        signal.set_wakeup_fd(watched, warn_on_full_buffer=False)


def load_policy_weights(setup: Setup, run: RunDirectory, which: str) -> Weights:
    """The `best` or the `last` policy of a run's checkpoint.

    Raises:
        ValueError: when there is no complete checkpoint.
    """
    parameters = setup.algorithm.init(setup.env, setup.config.algo, setup.config.seed)
    loaded = load_checkpoint(run.checkpoint, _checkpoint_like(setup, parameters))
    return loaded["best"] if which == "best" else policy_of(loaded["state"])


def _resumed(setup: Setup, run: RunDirectory, parameters: Any) -> tuple[TrainState, Weights, Progress]:
    """The state, the best policy and the progress in process 0's checkpoint."""
    like, loaded, about = _checkpoint_like(setup, parameters), None, None
    if hosts.first():
        loaded, about = load_checkpoint(run.checkpoint, like), read_about(run.checkpoint)
    loaded, about = hosts.of_first(loaded, like), hosts.told(about)
    known = {field.name: about[field.name] for field in dataclasses.fields(Progress)}
    if known["best_score"] is None:  # as JSON has no infinities
        known["best_score"] = -math.inf
    progress = Progress(**known)
    return placed(loaded["state"], setup.devices), loaded["best"], progress


def _checkpoint_like(setup: Setup, parameters: Any) -> dict[str, Any]:
    """Shapes and types of the content of a checkpoint."""
    state = jax.eval_shape(start_program(setup), setup.env, parameters, random_key(0))
    return {"state": state, "best": parameters.policy}
