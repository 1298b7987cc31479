"""The verdict on recorded flights is the one that the environment passes on its own episodes."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest

from e2efly.config import RewardConfig, TaskConfig
from e2efly.environment import UNSEEN, Env, random_key
from e2efly.environment.episodes import run_stepwise
from e2efly.policy.loader import load_policy
from e2efly.policy.runtime import Runtime
from e2efly.tasks import TASKS
from e2efly.validation.evaluation import BATCH as EVAL_BATCH
from e2efly.validation.evaluation import act_of
from e2efly.validation.plant import RigidState
from e2efly.validation.plant_flight import Trajectory
from e2efly.validation.plants.simulator import SimulatorPlant
from e2efly.validation.starts import BATCH, Starts, draw_starts
from e2efly.validation.task_verdict import judge
from e2efly.vehicles.loading import load_vehicle
from tests.validation.alone import fly

N = 4
SEED = 1_000_000
SUITES = {name: suite for task in TASKS.values() for name, suite in task.training().criteria().items()}


def env_of(suite: TaskConfig) -> Env:
    return Env.of(suite, RewardConfig({"prog2": 1.0}))


def flown(path: Path, env: Env, starts: Starts, seconds: float) -> list[Trajectory]:
    """Each start in the training simulator, by the runtime."""
    policy, vehicle = load_policy(path), load_vehicle("vis_r")
    plant = SimulatorPlant(vehicle)
    latency = policy.contract.latency_s
    return [
        fly(Runtime.of(policy, course, vehicle), plant, start, seconds, latency)
        for start, course in zip(starts.states, starts.courses, strict=True)
    ]


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(
    ("name", "seconds", "sink", "good"),
    [("hover", 5.0, 0.0, N), ("land", 5.0, 0.08, 1), ("circle", 3.0, 0.0, N), ("race", 3.0, 0.0, 0)],
)
def test_flights_of_the_runtime_are_judged_as_episodes(
    name: str, seconds: float, sink: float, good: int, policy_of: Callable[..., Path]
) -> None:
    suite = dataclasses.replace(SUITES[name], episode_s=seconds)
    suite = dataclasses.replace(suite, mean_error=2.0) if name == "circle" else suite  # what the controller can do
    path, env = policy_of(suite.name, sink), env_of(suite)
    settle = float(getattr(suite, "settle_s", 0.0))
    starts = draw_starts(env, N, SEED)
    verdicts = judge(env, starts, flown(path, env, starts, float(suite.episode_s)), settle)

    key, steps = random_key(SEED, UNSEEN, 0), env.episode_steps
    found, _ = run_stepwise(env, act_of(load_policy(path)), key, EVAL_BATCH, steps, settle)
    wanted = jax.tree.map(lambda x: x[:N], found)
    np.testing.assert_array_equal(verdicts.success, wanted.success)
    np.testing.assert_array_equal(verdicts.crashed, wanted.crashed)
    assert verdicts.success.sum() >= good
    for field in ("duration", "final_error", "mean_error", "top_speed", "mean_speed", "top_rate", "roughness"):
        np.testing.assert_allclose(getattr(verdicts, field), getattr(wanted, field), atol=1e-3, err_msg=field)


def test_starts_are_those_of_eval_and_do_not_depend_on_their_number() -> None:
    assert BATCH == EVAL_BATCH
    env = env_of(SUITES["circle"])
    few, many = draw_starts(env, 3, SEED), draw_starts(env, BATCH + 2, SEED)
    state, _ = jax.jit(lambda key: env.reset(key, BATCH))(random_key(SEED, UNSEEN, 0))
    for i in range(3):
        # to rounding: two compilations of the same draw
        np.testing.assert_allclose(few.states[i].position, np.asarray(state.vehicle.position)[i], atol=1e-6)
        np.testing.assert_array_equal(few.states[i].position, many.states[i].position)
    assert not np.array_equal(many.states[BATCH].position, many.states[0].position)
    assert len(many) == len(many.courses) == BATCH + 2
    # the goal of a start is its own reference
    course = few.courses[2]
    wanted = np.asarray(env.task.observe(state.memory, state.time, state.vehicle))[2]
    shown = course.goal.observe(course.memory, np.zeros(1), few.states[2].odometry(0.0).batch)
    np.testing.assert_allclose(shown[0], wanted, atol=1e-5)


def straight(env: Env, points: np.ndarray, steps: int) -> tuple[Starts, Trajectory]:
    """A flight at even speed through points, with the first start's memory."""
    at = np.linspace(0, len(points) - 1, steps + 1)
    position = np.stack([np.interp(at, np.arange(len(points)), column) for column in points.T], axis=-1)
    zero = np.zeros((steps + 1, 3))
    still, time = np.tile([1.0, 0, 0, 0], (steps + 1, 1)), env.control_period * np.arange(steps + 1)
    action = np.zeros((steps, 4))
    starts = draw_starts(env, 1, SEED)
    begin = RigidState(position[0], zero[0], still[0], zero[0])
    flight = Trajectory(time, position, zero, still, zero, np.zeros((steps, 1)), action, action, action[:, :3])
    return dataclasses.replace(starts, states=(begin,)), flight


def gates(env: Any, sideways: float = 0.0) -> np.ndarray:
    """Before and behind each gate, in order."""
    g = env.task.gates
    forward = np.stack([g.cos, g.sin, np.zeros(len(g.cos))], axis=-1)
    left = np.stack([-g.sin, g.cos, np.zeros(len(g.cos))], axis=-1)
    centre = np.asarray(g.position)[:-1] + sideways * left
    return np.stack([centre - forward, centre + forward], axis=1).reshape(-1, 3)


def test_a_lap_through_all_gates_is_a_success_and_beside_them_is_not() -> None:
    env = env_of(SUITES["race"])
    starts, lap = straight(env, gates(env), 200)
    through = judge(env, starts, [lap])
    assert through.success.tolist() == [True]
    assert through.duration[0] < 200 * env.control_period  # ends at the last gate
    starts, past = straight(env, gates(env, 0.45), 200)
    beside = judge(env, starts, [past])
    assert (beside.success.tolist(), beside.crashed.tolist()) == ([False], [True])


def test_a_flight_that_broke_off_is_no_success_but_one_that_had_succeeded_stays_one() -> None:
    env = env_of(SUITES["race"])
    starts, lap = straight(env, gates(env), 200)

    def cut(steps: int) -> Trajectory:
        rows = {
            f.name: getattr(lap, f.name)
            for f in dataclasses.fields(lap)
            if f.name not in ("success", "failure", "fault", "estimate")
        }
        states = ("time", "position", "velocity", "quaternion", "body_rate")
        return Trajectory(**{n: x[: steps + (n in states)] for n, x in rows.items()}, fault="it broke")

    assert judge(env, starts, [cut(199)]).success.tolist() == [True]
    for steps in (0, 1, 100):
        verdict = judge(env, starts, [cut(steps)])
        assert (verdict.success.tolist(), verdict.crashed.tolist()) == ([False], [False])
        assert verdict.duration[0] == pytest.approx(steps * env.control_period)


def test_flights_that_do_not_fit_are_refused() -> None:
    env = env_of(SUITES["race"])
    starts, lap = straight(env, gates(env), 200)
    with pytest.raises(ValueError, match="2 flights for 1 starts; accepted: one flight a start"):
        judge(env, starts, [lap, lap])
    with pytest.raises(ValueError, match=r"flights\[0\] has a control period of 0.02.*; accepted: the task's, 0.033"):
        judge(env, starts, [dataclasses.replace(lap, time=0.02 * np.arange(201))])
