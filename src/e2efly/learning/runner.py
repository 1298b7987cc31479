"""Training a policy: compile, update, evaluate, log, write checkpoints, and ship the best policy.

A run is a pure function of its configuration: the number of updates, the evaluations and all random numbers depend
on nothing else. A run that was killed and resumed therefore ends bit for bit like a run that was not interrupted.
"""

import dataclasses
import math
import signal
import threading
import time
from collections.abc import Iterator
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
from e2efly.learning.judge import CONFIRMED, REPORTED, WATCHED, judge, score, stressed, success
from e2efly.learning.metrics import check_finite, rows_of, writing
from e2efly.learning.networks import Weights
from e2efly.learning.point import Point, Progress, weights_of
from e2efly.learning.programs import Programs, traced_folder
from e2efly.learning.setup import Setup
from e2efly.learning.usage import peak_memory, since_process_start
from e2efly.runs.inputs import by_content, differences, different_values, fingerprint, from_json, to_json
from e2efly.runs.rundir import RunDirectory, versions

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


@hosts.together()
def train(
    setup: Setup,
    run: RunDirectory,
    reporter: Reporter,
    resume: bool = False,
    overwrite: bool = False,
    traced: bool = False,
) -> dict[str, Any]:
    """Train a policy into a run directory.

    Args:
        setup: what the configuration of the run defines.
        run: the run directory: a new one, or with `resume` that of an unfinished run.
        reporter: shows the progress.
        resume: continue from the checkpoint.
        overwrite: delete the run that `run` holds, after the new run has been compiled.
        traced: whether traced programs are kept, see `Programs.compile`. Only in a process that runs nothing but the
            package's own code.

    Returns:
        The summary that is also written to summary.json.

    Raises:
        ValueError: for a configuration, folder or checkpoint that cannot be used.
        LostHostError: when another process of the run has ended or cannot be reached. The last checkpoint is kept.
        OSError: when the folder cannot be written.
        NonFiniteError: naming the term and the update. The last good checkpoint is kept.
    """
    with run.held() if hosts.first() else nullcontext():
        content = by_content(setup.config)
        if not hosts.first():
            _check_same(content, resume)
        else:
            hosts.broadcast_json({"resume": resume, "versions": _deciding(versions()), "config": to_json(content)})
            _check_folder(run, setup.config, resume, overwrite)
        reporter.compiling()
        parameters = _parameters(setup, run, resume)
        folder = traced_folder(setup.config) if traced and jax.process_count() == 1 else None
        programs = Programs.compile(setup, parameters, folder)
        if resume and hosts.broadcast_json(run.checkpoint.exists()):
            point = Point.resumed(run.checkpoint, setup, parameters)
        else:
            state = programs.begin(setup.env, parameters, random_key(setup.config.seed))
            point = Point(state, parameters.policy, Progress())
        if hosts.first():
            if not resume:
                run.create(setup.config, overwrite)  # only after all that can fail because of the configuration
            run.forget_after(point.progress.update)
            setup = dataclasses.replace(setup, config=run.with_copies(setup.config))
            if different := list(differences(content, by_content(setup.config))):
                raise ValueError(f"a file changed while the run began: {'; '.join(different)}; start it again")
        if setup.config.start_from is not None and not point.progress.update:
            point.save(run.checkpoint, setup.config.seed)  # the run it starts from may be gone when this one goes on
        training = _Training(setup, run, programs, reporter)
        return training.finish(*training.loop(point))


def _parameters(setup: Setup, run: RunDirectory, resume: bool) -> Any:
    """The initial parameters of the algorithm: fresh ones, or those of the policy that the run starts from."""
    parameters, first = setup.parameters(), setup.config.start_from
    if first is None or (resume and run.checkpoint.exists()):
        return parameters
    from e2efly.learning.warm_start import started_from

    return started_from(parameters, Path(first), setup)


@dataclass(frozen=True)
class _Training:
    """A run whose programs are compiled."""

    setup: Setup
    run: RunDirectory
    programs: Programs
    reporter: Reporter

    def loop(self, point: Point) -> tuple[Point, bool]:
        """Run chunks of updates, with an evaluation and a checkpoint after each chunk.

        It ends after the last update, when `stop_at` is reached, or at Ctrl-C.

        Returns:
            The last point, and whether the user stopped the run.
        """
        setup, run = self.setup, self.run
        before, each = point.progress.seconds, setup.steps_per_update  # seconds of earlier processes of this run
        with writing(run, point.progress.update * each) as write, _interruptible() as stop:
            while point.progress.update < setup.updates and not point.progress.reached:
                if hosts.any_of(stop.is_set()):
                    if not point.progress.update:  # there is no checkpoint yet to continue from
                        point.save(run.checkpoint, setup.config.seed)
                    return point, True
                number = point.progress.stage
                state, metrics, rate = self._updated(point)
                point, flown = self._judged(point, state, before)
                done = point.progress
                write(rows_of(metrics, flown, done, rate, each, number + 1 if len(setup.stages) > 1 else None))
                point.save(run.checkpoint, setup.config.seed)
                if hosts.first() and history.is_kept(done.update, setup.config.chunk, setup.updates):
                    history.keep(run.history, done.update, point.weights, done.last_success)
                self._tell(done, rate)
            return point, False

    def _updated(self, point: Point) -> tuple[TrainState, dict[str, np.ndarray], float]:
        """The state after a chunk of updates, their metrics, and the environment steps per second."""
        setup, update = self.setup, point.progress.update
        began, env = time.perf_counter(), setup.stages[point.progress.stage].env
        state, found = self.programs.chunk(env, setup.config.algo, point.state, update, setup.updates)
        metrics = {name: np.asarray(x, np.float64) for name, x in found.items()}
        check_finite(metrics, update)
        return state, metrics, setup.config.chunk * setup.steps_per_update / (time.perf_counter() - began)

    def _judged(self, point: Point, state: TrainState, before: float) -> tuple[Point, dict[str, Episodes]]:
        """The point after a chunk that ended in a state, and the evaluation of its policy.

        Only the task itself (the last stage) ranks policies. The policy that met `stop_at` is the one shipped.
        """
        setup, old, config = self.setup, point.progress, self.setup.config
        stage, final = setup.stages[old.stage], old.stage == len(setup.stages) - 1
        weights, update = weights_of(state), old.update + config.chunk
        flown = self._flown(weights, WATCHED, config.eval_episodes, stage.judges)
        reached, last, now = old.reached, success(flown), score(config.task, flown)
        if config.stop_at and final and last >= config.stop_at:
            confirmed = success(self._flown(weights, CONFIRMED, REPORT_EPISODES, setup.judges))
            if confirmed >= config.stop_at:
                reached = {"seconds": before + since_process_start(), "steps": update * setup.steps_per_update}
        promoted = stage.is_over(last, (update - old.stage_update) * setup.steps_per_update)
        better = now > old.best_score or not final or bool(reached)
        progress = Progress(
            update=update,
            seconds=before + since_process_start(),
            best_score=-math.inf if not final else now if better else old.best_score,
            best_update=update if better else old.best_update,
            best_success=last if better else old.best_success,
            last_success=last,
            stage=old.stage + promoted,
            stage_update=update if promoted else old.stage_update,
            reached=reached,
        )
        return Point(state, weights if better else point.best, progress), flown

    def _flown(self, weights: Weights, stream: int, episodes: int, judges: dict[str, Env]) -> dict[str, Episodes]:
        return judge(self.programs.evaluate, self.setup.config.eval_episodes, weights, stream, episodes, judges)

    def _tell(self, progress: Progress, rate: float) -> None:
        setup, stages = self.setup, len(self.setup.stages)
        each = setup.steps_per_update
        flown = setup.env.vehicles + (f", stage {progress.stage + 1} of {stages}" if stages > 1 else "")
        self.reporter.progress(
            progress.update * each, setup.updates * each, rate, progress.last_success, progress.best_success, flown
        )

    def finish(self, point: Point, stopped: bool) -> dict[str, Any]:
        """Judge the best and the last policy on unseen starts, and write policy.onnx and summary.json."""
        setup, progress, config = self.setup, point.progress, self.setup.config
        names = {"shipped": setup.env.vehicles, "last": setup.env.vehicles}
        self.reporter.judging(REPORT_EPISODES)
        found = {"shipped": self._flown(point.best, REPORTED, REPORT_EPISODES, setup.judges)}
        is_last = progress.best_update == progress.update
        found["last"] = (
            found["shipped"] if is_last else self._flown(point.weights, REPORTED, REPORT_EPISODES, setup.judges)
        )
        if nominal := setup.nominal:
            found["nominal"] = self._flown(point.best, REPORTED, REPORT_EPISODES, nominal)
            names["nominal"] = setup.env.undisturbed().vehicles
            if setup.env.family is None:  # the rows of the stress test are defined relative to one vehicle
                found["stress"] = stressed(setup, point.best, REPORT_EPISODES)
                names["stress"] = STRESS
        told: dict[str, dict[str, Any]] = {
            part: {name: summary_of(e) for name, e in flown.items()} for part, flown in found.items()
        }
        summary = {
            "task": config.task.name,
            "algorithm": config.algo.name,
            "vehicle": setup.env.physics.nominal.name,
            "seed": config.seed,
            "finished": progress.update >= setup.updates or bool(progress.reached),
            "stopped_by_user": stopped,
            "env_steps": progress.update * setup.steps_per_update,
            "seconds_trained_from_process_start": round(progress.seconds, 3),
            "reached_criterion": progress.reached,
            "peak_memory_gb": round(peak_memory() / 1e9, 3),
            **told,
            "shipped": {"update": progress.best_update, **told["shipped"]},
            "last": {"update": progress.update, **told["last"]},
            "vehicles": names,
            "episodes": REPORT_EPISODES,
            "versions": versions(),
        }
        if hosts.first():
            self._ship(point)
            self.run.write_json("summary.json", summary | {"configuration": fingerprint(config)})
        self.reporter.ended(setup, found.get("nominal", found["shipped"]))
        return summary

    def _ship(self, point: Point) -> None:
        """Write the best policy, and beside it the last images that the policy saw in training, by their names."""
        from e2efly.learning.onnx_export import contract_of, export_policy

        contract = contract_of(self.setup.env, self.setup.config)
        export_policy(self.run.policy, point.best, self.setup.actor, contract)
        if contract.images:
            seen = (x.addressable_data(0) if isinstance(x, jax.Array) else x for x in point.state.env.images)
            images = {i.name: np.asarray(x).reshape(-1, *i.shape) for i, x in zip(contract.images, seen, strict=True)}
            write_atomically(samples_file(self.run.policy), packed(images))


def _deciding(versions: dict[str, str]) -> dict[str, str | None]:
    """The versions of those packages that must not change while a run is interrupted."""
    return {name: versions.get(name) for name in ("e2efly", "jax", "jaxlib")}


def _check_same(config: TrainConfig, resume: bool) -> None:
    """Refuse anything that differs from process 0. Files are compared by their content."""
    wanted = hosts.broadcast_json(None)
    different = list(different_values(wanted["versions"], _deciding(versions())))
    if not different:  # versions may differ in what can be configured
        different = list(differences(from_json(wanted["config"], "process 0"), config))
    if wanted["resume"] != resume:
        different.append(f"resume: {wanted['resume']} and {resume}")
    if different:
        raise ValueError(f"process 0 was started with another configuration: {'; '.join(different)}")


def _check_folder(run: RunDirectory, config: TrainConfig, resume: bool, overwrite: bool) -> None:
    """Refuse a folder that holds another run than the one that is to begin or to go on."""
    if not resume:
        return None if overwrite else run.check_new()
    run.check_same(config)
    run.check_resumable()
    if different := list(different_values(_deciding(run.read_json("versions.json")), _deciding(versions()))):
        raise ValueError(f"{run.path} was started with another version: {'; '.join(different)}")
    return None


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
