"""The policy's thread: whatever the policy does, the control loop goes on in time and hears why."""

import dataclasses
import math
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest

from e2efly.policy import runtime
from e2efly.policy import worker as worker_module
from e2efly.policy.loader import load_policy
from e2efly.policy.odometry import Odometry
from e2efly.policy.onnx_file import sealed
from e2efly.policy.runtime import Imu, Runtime, act, begin, outside
from e2efly.policy.worker import PolicyWorker, Sensed
from e2efly.tasks.route import course_for
from e2efly.vehicles.loading import load_vehicle
from tests.policy.made import made
from tests.waiting import until

VEHICLE = load_vehicle("vis_r")
START = 5000.0
PATIENCE = 10.0
"""How long a step waits for a policy that answers at once, s: longer than a busy machine needs."""


@pytest.fixture(scope="module")
def policy_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A policy that about hovers."""
    return made(tmp_path_factory.mktemp("policy") / "policy.onnx", 0.05)


def flight(path: Path) -> Runtime:
    policy = load_policy(path)
    return Runtime.of(policy, course_for(policy.contract, VEHICLE), VEHICLE)


@pytest.fixture(scope="module")
def hovering(policy_file: Path) -> Runtime:
    return flight(policy_file)


Workers = Callable[..., PolicyWorker]


@pytest.fixture
def workers(hovering: Runtime) -> Iterator[Workers]:
    made: list[PolicyWorker] = []

    def make(timeout: float = PATIENCE, of: Runtime = hovering) -> PolicyWorker:
        made.append(PolicyWorker(of, timeout))
        made[-1].start(STILL, START)
        return made[-1]

    yield make
    for worker in made:
        worker.close()


ZERO = np.zeros(3)
STILL = Odometry(START, np.array([0.0, 0.0, 1.0]), ZERO, np.array([1.0, 0, 0, 0]), ZERO)


def misbehave(monkeypatch: pytest.MonkeyPatch, act: Callable[..., Any]) -> None:
    monkeypatch.setattr(worker_module, "act", act)


def test_it_decides_when_due_on_a_grid_without_drift(workers: Workers) -> None:
    worker, decided = workers(), []
    period = worker.runtime.period
    random = np.random.default_rng(0)
    for k in range(300):  # a loop of 100 Hz that is late by up to 4 ms
        now = START + 0.01 * k + random.uniform(0, 0.004)
        if worker.step(Sensed(STILL), now, 0.005):
            decided.append(now - START)
    assert worker.problem is None and worker.state is not None
    assert len(decided) == math.ceil(3.0 / period)
    late = np.array(decided) - period * np.arange(len(decided))
    assert late.min() >= -0.005 - 1e-9 and late.max() <= 0.01
    assert worker.state.slots - worker.state.steps == 0


def test_a_policy_that_is_told_no_place_sees_the_controllers_own_attitude(workers: Workers) -> None:
    assert not workers().unplaced
    policy = load_policy("race_eyes")
    blind = Runtime.of(policy, course_for(policy.contract, VEHICLE), VEHICLE, imu=True, images=True)
    worker, tilted = workers(of=blind), np.array([0.8, 0.6, 0.0, 0.0])
    images = [np.zeros(image.shape, np.float32) for image in worker.images]
    assert worker.unplaced
    assert worker.step(Sensed(STILL, Imu(ZERO, ZERO), images, None, tilted), START, 0.0), worker.problem
    assert worker.decision is not None
    np.testing.assert_allclose(worker.decision.observation[policy.contract.slices["attitude"]], tilted)


def test_where_nobody_knows_the_place_the_task_judges_nothing_and_ends_in_time() -> None:
    policy = load_policy("race_eyes")
    course = dataclasses.replace(course_for(policy.contract, VEHICLE), duration=0.5)
    lost = dataclasses.replace(Runtime.of(policy, course, VEHICLE, imu=True, images=True), placed=False)
    far = dataclasses.replace(STILL, position=np.array([900.0, 0.0, -50.0]))
    assert outside(lost, far, START) == ()
    assert outside(dataclasses.replace(lost, placed=True), far, START)
    assert any("speed" in why for why in outside(lost, dataclasses.replace(far, velocity=np.full(3, 9.0)), START))
    images, state = [np.zeros(image.shape, np.float32) for image in policy.contract.images], begin(lost, STILL, START)
    for k in range(16):
        assert not state.done and not state.failure
        state, decision = act(lost, state, far, START + k * lost.period, Imu(ZERO, ZERO), images=images)
        assert decision.position is None
    assert state.done and state.outcome is None


def test_between_two_questions_the_last_decision_stands(workers: Workers) -> None:
    worker = workers()
    assert worker.decision is None
    assert worker.step(Sensed(STILL), START, 0.0)
    first = worker.decision
    assert first is not None and np.isfinite(first.command).all()
    assert not worker.step(Sensed(STILL), START + 0.5 * worker.runtime.period, 0.0)
    assert worker.decision is first
    assert worker.step(Sensed(STILL), START + worker.runtime.period, 0.0)
    assert worker.decision is not first


def test_a_policy_of_nan_is_a_problem_and_decides_nothing(policy_file: Path, tmp_path: Path, workers: Workers) -> None:
    """A real network whose outputs become NaN once the vehicle is away from the level, still start it is tried at."""
    model = onnx.load(str(policy_file))
    node = next(node for node in model.graph.node if "action" in node.output)
    node.output[0] = "before"
    sizes = [onnx.helper.make_node("Gather", ["observation", "column"], ["away"], axis=1),
             onnx.helper.make_node("Sub", ["one", "away"], ["left"]),
             onnx.helper.make_node("Log", ["left"], ["logarithm"]),
             onnx.helper.make_node("Mul", ["logarithm", "zero"], ["nothing"]),
             onnx.helper.make_node("Add", ["before", "nothing"], ["action"])]  # fmt: skip
    model.graph.node.extend(sizes)
    for name, value in (("one", 1.0), ("zero", 0.0)):
        model.graph.initializer.append(onnx.numpy_helper.from_array(np.array(value, np.float32), name))
    model.graph.initializer.append(onnx.numpy_helper.from_array(np.array([0]), "column"))
    path = tmp_path / "policy.onnx"
    path.write_bytes(sealed(model.SerializeToString()))
    worker = workers(of=flight(path))
    course = worker.runtime.course
    at_goal = np.asarray(course.goal.goal(course.memory, np.zeros(1)))[0]
    worker.start(dataclasses.replace(STILL, position=at_goal), START)
    assert worker.step(Sensed(dataclasses.replace(STILL, position=at_goal)), START, 0.0), worker.problem
    decision = worker.decision
    away = dataclasses.replace(STILL, position=at_goal - 3.0)
    assert not worker.step(Sensed(away), START + worker.runtime.period, 0.0)
    assert worker.problem is not None and "nan" in worker.problem
    assert worker.decision is decision


def test_an_odometry_of_nan_is_a_problem(workers: Workers) -> None:
    worker = workers()
    assert not worker.step(Sensed(dataclasses.replace(STILL, velocity=np.array([0, math.nan, 0]))), START, 0.0)
    assert worker.problem is not None and "velocity" in worker.problem
    assert worker.readiness(dataclasses.replace(STILL, position=np.full(3, math.nan)), START)


@pytest.mark.parametrize(
    "error", [ValueError("no such thing"), RuntimeError(), MemoryError("full"), ZeroDivisionError()]
)
def test_whatever_a_policy_raises_is_a_problem(
    error: Exception, workers: Workers, monkeypatch: pytest.MonkeyPatch
) -> None:
    def act(*_: Any, **__: Any) -> None:
        raise error

    worker = workers()
    misbehave(monkeypatch, act)
    assert not worker.step(Sensed(STILL), START, 0.0)
    assert worker.problem == (str(error) or type(error).__name__)
    # the flight is over for it; the next one begins afresh
    worker.stop()
    assert worker.state is None and worker.decision is None and not worker.done
    assert not worker.step(Sensed(STILL), START + 1.0, 0.0)
    misbehave(monkeypatch, runtime.act)
    assert worker.readiness(STILL, START + 2.0) is None
    worker.start(STILL, START + 2.0)
    assert worker.problem is None and worker.step(Sensed(STILL), START + 2.0, 0.0)


def test_a_slow_policy_is_late_then_busy_and_never_holds_up_the_loop(
    workers: Workers, monkeypatch: pytest.MonkeyPatch
) -> None:
    go_on, asked = threading.Event(), []

    def act(*args: Any, **named: Any) -> Any:
        asked.append(args)
        go_on.wait(30.0)
        return runtime.act(*args, **named)

    worker = workers(timeout=0.02)
    misbehave(monkeypatch, act)
    began = time.perf_counter()
    assert not worker.step(Sensed(STILL), START, 0.0)
    assert worker.problem is not None and worker.problem.startswith("late: no answer within ")
    assert worker.decision is None
    for k in range(1, 50):  # asked on: nothing is queued behind it, and nothing is waited for
        assert not worker.step(Sensed(STILL), START + k, 0.0)
        assert worker.problem == "late: it is still busy with an earlier question"
    assert time.perf_counter() - began < 5.0
    assert len(asked) == 1
    assert worker.readiness(STILL, START) == "it is still busy with an earlier question"
    worker.stop()
    go_on.set()
    until(lambda: worker.readiness(STILL, START) is None)
    assert worker.state is None and worker.decision is None  # what it said too late is not taken
    worker.timeout = PATIENCE
    worker.start(STILL, START + 60)
    assert worker.step(Sensed(STILL), START + 60, 0.0) and worker.problem is None


def test_it_may_not_take_over_outside_of_its_envelope(workers: Workers) -> None:
    worker = workers()
    worker.stop()
    assert worker.readiness(STILL, START) is None
    fast = worker.readiness(dataclasses.replace(STILL, velocity=np.array([9.0, 0, 0])), START)
    assert fast is not None and "speed is 9 m/s" in fast


def test_a_goal_that_can_no_longer_be_reached_is_a_problem_and_one_that_is_reached_is_done(
    workers: Workers, monkeypatch: pytest.MonkeyPatch
) -> None:
    worker = workers()
    asked = worker_module.act
    said = {"failure": "gate 2 missed"}

    def answer(*question: Any, **images: Any) -> Any:
        state, decision = asked(*question, **images)
        return dataclasses.replace(state, **said), decision

    monkeypatch.setattr(worker_module, "act", answer)
    assert not worker.done
    assert worker.step(Sensed(STILL), START, 0.0)
    assert worker.problem == "gate 2 missed"
    said = {"done": True}
    assert worker.step(Sensed(STILL), START + worker.runtime.period, 0.0)
    assert worker.done


def test_a_policy_that_never_answers_does_not_keep_the_program_from_ending() -> None:
    code = """
import threading
from types import SimpleNamespace
from e2efly.policy import worker as worker_module
worker_module.act = lambda *_, **__: threading.Event().wait()
worker_module.due = lambda *_: 0.0
worker = worker_module.PolicyWorker(None, 0.01)
worker.state = SimpleNamespace()
assert not worker.step(worker_module.Sensed(None), 1.0, 0.0)
assert worker.problem.startswith("late"), worker.problem
worker.close()
"""
    assert subprocess.run([sys.executable, "-c", code], timeout=60, check=False).returncode == 0
