"""The runtime: it shows the policy what the training's environment showed, when it is due, and refuses the rest."""

import dataclasses
import itertools
import math
import os
import re
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import EnvConfig, ImuConfig, TaskConfig
from e2efly.courses import defaults
from e2efly.courses.tracks import load_track
from e2efly.environment import Env, EnvState, random_key
from e2efly.learning.onnx_export import contract_of
from e2efly.policy.contract import Contract
from e2efly.policy.loader import Policy, load_policy
from e2efly.policy.odometry import Odometry
from e2efly.policy.runtime import Envelope, Imu, Runtime, RuntimeState, act, begin, check, due, outside
from e2efly.runs import presets
from e2efly.tasks import TASKS
from e2efly.tasks.hover.goal import HoverRoute
from e2efly.tasks.race.goal import RaceRoute
from e2efly.tasks.route import Route, course_for, fields_of
from e2efly.tasks.track.goal import TrackRoute
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle_domain import drawn_domain
from tests.policy.made import made

VEHICLE = load_vehicle("vis_r")
START = 5000.0
"""When the flights begin, s on the monotonic clock."""
CLOSE = 2e-5
"""Float32 of a trajectory of some 10 m and 10 s."""


def make(folder: Path, task: TaskConfig, config: EnvConfig | None = None) -> tuple[Env, Path]:
    """An environment, and a policy of it that about hovers but answers to what it sees."""
    preset = presets.preset(task.name, "ppo")
    preset = dataclasses.replace(preset, task=task, env=config or preset.env)
    env = Env.of(task, preset.reward, preset.env)
    return env, made(folder / "policy.onnx", 0.05, env, preset)


@pytest.fixture(scope="module")
def hovering(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make(tmp_path_factory.mktemp("hover"), TASKS["hover"].training())[1]


@pytest.fixture(scope="module")
def policy(hovering: Path) -> Policy:
    return load_policy(hovering)


@pytest.fixture(scope="module")
def runtime(policy: Policy) -> Runtime:
    return Runtime.of(policy, course_for(policy.contract, VEHICLE, HoverRoute(target=defaults.TARGET)), VEHICLE)


def odometry(state: EnvState, row: int, time: float = START) -> Odometry:
    v = state.vehicle
    return Odometry(time, *(np.asarray(x[row]) for x in (v.position, v.velocity, v.quaternion, v.body_rate)))


def still(position: Any = (0.0, 0.0, 2.0), **changes: Any) -> Odometry:
    zero = np.zeros(3)
    return dataclasses.replace(
        Odometry(START, np.asarray(position, float), zero, np.array([1.0, 0, 0, 0]), zero), **changes
    )


TRAINED: dict[str, Any] = {"centre": defaults.CENTRE, "radius": defaults.RADIUS}


def route_to(task: TaskConfig, state: EnvState, row: int) -> Route | None:
    """The route that leads along what the environment drew."""
    name = task.name
    if name == "track":
        (x, y, _), (vx, _, _) = np.asarray(state.memory.reference.knots)[row, 0, :2] - np.array([[0, 0, 3], [0, 0, 0]])
        if task.reference == "circle":  # type: ignore[union-attr]
            return TrackRoute(circle_rate=defaults.CIRCLE_RATE, phase=math.atan2(y, x), **TRAINED)
        phase = math.atan2(x / 2, vx / (2 * 3 / (2 * math.sqrt(2))))
        return TrackRoute(reference="lemniscate", lemniscate_speed=defaults.LEMNISCATE_SPEED, phase=phase, **TRAINED)
    if name == "hover":
        return HoverRoute(target=defaults.TARGET)
    return RaceRoute(laps=0) if name == "race" else None


def compare(decision: Any, state: RuntimeState, wanted: np.ndarray, contract: Contract) -> None:
    for name, part in contract.slices.items():
        atol = 0.0 if name not in ("position_error", "reference", "gates") else CLOSE
        np.testing.assert_allclose(decision.observation[part], wanted[part], rtol=1e-6, atol=atol, err_msg=name)
    assert decision.observation.dtype == np.float32
    assert state.slots - state.steps == 0


def test_the_sign_of_the_pose_sources_quaternion_does_not_matter(runtime: Runtime) -> None:
    """q and -q are one attitude: the exported network answers the same."""
    turned = np.array([0.6, 0.0, 0.0, -0.8])
    (_, one), (_, other) = (
        act(runtime, begin(runtime, at, START), at, START)
        for at in (still((1.0, 0.0, 2.0), quaternion=q) for q in (turned, -turned))
    )
    assert np.abs(one.action).max() > 0
    np.testing.assert_array_equal(one.action, other.action)


SUITES = {
    **TASKS["hover"].training().criteria(),
    **TASKS["land"].training().criteria(),
    **TASKS["track"].training().criteria(),
    "race": TASKS["race"].training(),
}


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(("name", "imu"), [*((name, False) for name in SUITES), ("hover", True)])
def test_it_sees_in_flight_what_the_environment_shows(name: str, imu: bool, tmp_path: Path) -> None:
    """The policy flies the environment through the runtime, for a whole episode."""
    task = SUITES[name]
    env, path = make(tmp_path, task, EnvConfig(imu=ImuConfig(observed=imu), action_latency=(0.03, 0.08)))
    loaded, n, steps = load_policy(path), 2, round(float(env.task.episode_s) / env.control_period)
    contract = loaded.contract
    state, observation = jax.jit(env.reset, static_argnums=1)(random_key(3), n)
    courses = [course_for(contract, VEHICLE, route_to(task, state, row)) for row in range(n)]
    flights = [Runtime.of(loaded, course, VEHICLE, 30.0, imu=imu) for course in courses]
    begun = [begin(flight, odometry(state, row), START) for row, flight in enumerate(flights)]
    advance = jax.jit(partial(env.step, restart=False))
    for k in range(steps):
        actions = []
        for row, flight in enumerate(flights):
            now = START + k * env.control_period
            assert due(flight, begun[row]) == pytest.approx(now, abs=1e-9)
            measured = None
            if state.imu is not None:
                measured = Imu(np.asarray(state.imu.gyroscope[row]), np.asarray(state.imu.accelerometer[row]))
            begun[row], decision = act(flight, begun[row], odometry(state, row, now), now, measured)
            compare(decision, begun[row], np.asarray(observation[row]), contract)
            np.testing.assert_allclose(decision.position, env.task.goal(state.memory, state.time)[row], atol=CLOSE)
            actions.append(decision.action)
        state, out = advance(state, jnp.asarray(np.stack(actions)))
        observation = out.final_observation
    assert [b.steps for b in begun] == [steps] * n
    travelled = np.linalg.norm(np.asarray(state.vehicle.position) - [odo.position for odo in [still()] * n], axis=-1)
    assert travelled.max() > 0.3


@pytest.mark.parametrize("track", ["four_gates", "s_shaped"])
def test_it_counts_gates_in_flight_as_the_environment_does(track: str, tmp_path: Path) -> None:
    """The vehicle is carried along the track, over two laps of the closed one; once it flies past a gate."""
    task = dataclasses.replace(TASKS["race"].training(), track=track)
    env, path = make(tmp_path, task)
    loaded, course = load_policy(path), load_track(track)
    flight = Runtime.of(loaded, course_for(loaded.contract, VEHICLE, RaceRoute(track=track, laps=0)), VEHICLE)
    forward = np.stack([np.cos(course.yaw), np.sin(course.yaw), 0 * course.yaw], -1)
    laps = 2 if course.closed else 1
    middle = np.tile(course.position, (laps, 1))
    forward = np.tile(forward, (laps, 1))
    past = [middle[0] - forward[0] + [0, 0, 1.5], middle[0] + forward[0] + [0, 0, 1.5]]  # over the first gate
    corners = np.stack([middle - forward, middle + 0.5 * forward], axis=1).reshape(-1, 3)
    corners = np.vstack([course.start, past, past[:1], corners])
    points = np.vstack([np.linspace(a, b, 7)[:-1] for a, b in itertools.pairwise(corners)])
    state, _ = env.reset(random_key(0), 1)
    state = carried(env, state, points[0])
    run = begin(flight, odometry(state, 0), START)
    judge, observe = jax.jit(env.task.advance), jax.jit(env._observe)
    outcomes, failures = [], []
    for k, point in enumerate(points):
        before, state = state, carried(env, state, point)
        time = state.time + env.control_period * (k > 0)
        memory, outcome = judge(state.memory, before.vehicle, state.vehicle, time, time > 1e9)
        state = dataclasses.replace(state, memory=memory, time=time)
        now = START + k * env.control_period
        run, decision = act(flight, run, odometry(state, 0, now), now)
        racing = course.closed or int(memory[0]) < len(middle)  # behind the end of an open track there is no training
        if racing:
            compare(decision, run, np.asarray(observe(state)[0]), loaded.contract)
        actions = jnp.concatenate([jnp.asarray(decision.action)[None, None], state.actions[:, :-1]], axis=1)
        state = dataclasses.replace(state, actions=actions)
        outcomes.append(racing and bool(outcome.crashed[0]))
        failures.append(run.failure)
        assert run.task[0] == int(memory[0])
    assert run.task[0] == len(middle)
    assert sum(outcomes) == 1
    assert failures[: outcomes.index(True)] == [""] * outcomes.index(True)
    assert set(failures[outcomes.index(True) :]) == {"gate 1 of lap 1 missed"}
    assert not run.done  # what has missed a gate has not done its task, whatever comes after


def carried(env: Env, state: EnvState, point: np.ndarray) -> EnvState:
    position = jnp.asarray(point, jnp.float32)[None]
    return dataclasses.replace(state, vehicle=dataclasses.replace(state.vehicle, position=position))


def test_a_decision_is_the_policys(runtime: Runtime) -> None:
    state = begin(runtime, still(), START)
    state, first = act(runtime, state, still(), START)
    policy = runtime.policy
    np.testing.assert_array_equal(first.action, policy.act(first.observation)[0])
    np.testing.assert_allclose(first.command, policy.command(first.action), rtol=1e-12)
    assert (first.mode, first.late_s) == ("ctbr", 0.0)
    assert 0 < first.inference_s < 10
    part = policy.contract.slices["past_actions"]
    np.testing.assert_allclose(first.observation[part], [*policy.contract.hover_action] * 2, rtol=1e-6)
    seen = first.observation.copy()
    _, second = act(runtime, state, still((0.0, 1.0, 2.0)), START + 1 / 30)
    np.testing.assert_array_equal(second.observation[part], [*first.action, *first.observation[part][:4]])
    np.testing.assert_array_equal(first.observation, seen)  # what was decided is not written over
    again = act(runtime, state, still((0.0, 1.0, 2.0)), START + 1 / 30)[1]
    np.testing.assert_array_equal(again.observation, second.observation)  # nothing but the state is remembered


def test_it_is_due_on_a_grid_that_does_not_drift(runtime: Runtime) -> None:
    """Late answers neither move the grid nor pile up questions: what was missed is counted."""
    state, period = begin(runtime, still(), START), 1 / 30
    grid = []
    for late, missed in ((0.0, 0), (0.4, 0), (0.99, 0), (1.2, 1), (0.0, 1), (3.7, 4), (0.0, 4)):
        when = due(runtime, state)
        grid.append((when - START) / period)
        state, decision = act(runtime, state, still(), when + late * period)
        assert decision.late_s == pytest.approx(late * period, abs=1e-9)
        assert state.slots - state.steps == missed
        assert due(runtime, state) > when + late * period
    np.testing.assert_allclose(grid, [0, 1, 2, 3, 5, 6, 10], atol=1e-6)
    assert state.steps == 7


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"position": np.array([np.nan, 0, 1])}, "field 'position_error' is .*accepted: finite"),
        ({"velocity": np.array([0, np.inf, 1])}, "field 'velocity' is .*accepted: finite"),
        ({"quaternion": np.zeros(4)}, "field 'attitude' is .*accepted: a unit quaternion"),
        ({"body_rate": np.array([1e39, 0, 0])}, "field 'body_rate' is .*accepted: finite"),
    ],
)
@pytest.mark.filterwarnings("ignore:overflow encountered in cast")
def test_broken_odometry_is_named(runtime: Runtime, changes: dict[str, Any], message: str) -> None:
    state = begin(runtime, still(), START)
    with pytest.raises(ValueError, match=message):
        act(runtime, state, still(**changes), START)


class Broken:
    def run(self, *_: Any) -> None:
        raise RuntimeError("bad allocation")


def test_whatever_the_network_raises_is_a_value_error(runtime: Runtime, policy: Policy) -> None:
    broken = dataclasses.replace(runtime, policy=Policy(policy.contract, Broken()))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="the policy failed: bad allocation"):
        act(broken, begin(broken, still(), START), still(), START)


def _field(contract: Contract, name: str, /, **changes: Any) -> Contract:
    fields = [dataclasses.replace(f, **changes) if f.name == name else f for f in contract.observation]
    return dataclasses.replace(contract, observation=tuple(fields))


LIGHT = drawn_domain(dataclasses.replace(VEHICLE, name="light", mass=0.6, rotor_thrust_max=4.1), "ctbr", {"mass": 0.1})
REFUSED: list[tuple[Callable[[Contract], Contract], str]] = [
    (
        lambda c: dataclasses.replace(c, vehicle_hash="0" * 16, vehicles=None),
        "vehicle 'vis_r' has hash .*; accepted: 0000",
    ),
    (
        lambda c: dataclasses.replace(c, vehicle_hash="0" * 16, vehicles=LIGHT),
        "mass of vehicle 'vis_r' is 0.75 kg, 25 % more than the 0.6 kg of 'vis_r'; accepted: 0.54 to 0.66 kg",
    ),
    (lambda c: dataclasses.replace(c, control_rate_hz=100.0), "control_rate is 30.0 Hz; accepted: 100 Hz"),
    (
        lambda c: dataclasses.replace(c, action=dataclasses.replace(c.action, mode="rotor_thrust")),
        "action.mode of the policy is 'rotor_thrust'; accepted: 'ctbr' or 'attitude' or",
    ),
    (lambda c: _field(c, "velocity", name="air_speed"), "observation field 'air_speed': nothing on board"),
    (lambda c: _field(c, "velocity", frame="body"), "observation field 'velocity' has size 3, frame 'body'"),
    (lambda c: _field(c, "body_rate", unit="deg/s"), "observation field 'body_rate' has .* unit 'deg/s'; accepted: 3"),
    (
        lambda c: _field(c, "position_error", unit="cm"),
        "observation field 'position_error' has .*accepted: 3, 'world' and 'm'",
    ),
    (lambda c: _field(c, "past_actions", size=7), "observation field 'past_actions' has size 7, .*accepted: 4, 'none'"),
    (
        lambda c: _field(c, "velocity", name="gates", unit="m"),
        "observation field 'gates': nothing on board says it",
    ),
    (
        lambda c: _field(c, "body_rate", name="gyroscope"),
        "observation field 'gyroscope': there is no IMU; accepted: a policy without, or an IMU",
    ),
]


@pytest.mark.parametrize(("change", "message"), REFUSED)
def test_what_cannot_fly_is_refused_by_name(
    policy: Policy, change: Callable[[Contract], Contract], message: str
) -> None:
    shown = fields_of(policy.contract)
    assert check(policy.contract, VEHICLE, shown, 30.0) == ()
    reasons = check(change(policy.contract), VEHICLE, shown, 30.0)
    assert len(reasons) == 1
    assert re.match(message, reasons[0])


def test_all_reasons_are_given_at_once(policy: Policy) -> None:
    goal, config = course_for(policy.contract, VEHICLE), presets.preset("race", "ppo")
    race = course_for(contract_of(Env.of(config.task, config.reward, config.env), config), VEHICLE)
    with pytest.raises(ValueError, match=r"mass of vehicle 'vis_h'(.|\n)*control_rate is 50(.|\n)*envelope.tilt is -1"):
        Runtime.of(policy, goal, load_vehicle("vis_h"), 50.0, envelope=Envelope(tilt=-1.0))
    with pytest.raises(ValueError, match=r"observation shows .*; accepted: with gates, as its task is 'hover'"):
        Runtime.of(policy, race, VEHICLE)


def test_a_policy_that_sees_an_imu_needs_its_measurements(tmp_path: Path) -> None:
    path = make(tmp_path, TASKS["hover"].training(), EnvConfig(imu=ImuConfig(observed=True)))[1]
    policy = load_policy(path)
    goal = course_for(policy.contract, VEHICLE)
    with pytest.raises(ValueError, match=r"'gyroscope': there is no IMU(.|\n)*'accelerometer': there is no IMU"):
        Runtime.of(policy, goal, VEHICLE)
    runtime = Runtime.of(policy, goal, VEHICLE, imu=True)
    with pytest.raises(ValueError, match="'gyroscope': there is no measurement"):
        act(runtime, begin(runtime, still(), START), still(), START)


def test_the_envelope(runtime: Runtime) -> None:
    """Target (0, 0, 3), fence 6 m."""

    def tilted(angle: float) -> np.ndarray:
        return np.array([math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0])

    assert outside(runtime, still((0.0, 5.9, 3.0), quaternion=tilted(0.78)), START) == ()
    assert outside(runtime, still((0.0, 6.1, 3.0)), START) == ("distance is 6.1 m from the goal; accepted: at most 6",)
    assert outside(runtime, still(velocity=np.array([0, 3.0, 4.1])), START) == (
        "speed is 5.08 m/s; accepted: at most 5",
    )
    assert outside(runtime, still(quaternion=-tilted(0.8)), START) == ("tilt is 0.8 rad; accepted: at most 0.785",)
    assert len(outside(runtime, still((np.nan, 0, 0), velocity=np.full(3, np.nan)), START)) == 2
    assert len(outside(runtime, still(quaternion=tilted(3.1)), START, begin(runtime, still(), START))) == 1
    near = dataclasses.replace(runtime, envelope=Envelope(distance=0.5))
    assert len(outside(near, still((0.0, 0.0, 2.4)), START)) == 1


def test_a_race_begins_where_its_track_does_and_heads_as_it_says(tmp_path: Path) -> None:
    """Training begins nowhere else: four_gates at (0, 0, 1.5), heading 45 degrees."""
    policy = load_policy(make(tmp_path, TASKS["race"].training(), EnvConfig())[1])
    runtime = Runtime.of(policy, course_for(policy.contract, VEHICLE), VEHICLE)

    def begins(x: float, yaw: float) -> tuple[str, ...]:
        turned = np.array([math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)])
        return outside(runtime, still((x, 0.0, 1.5), quaternion=turned), START)

    assert begins(1.4, 0.5) == begins(-1.4, 1.1 - 2 * math.pi) == ()
    assert begins(1.6, math.pi / 4) == ("distance is 1.6 m from the start; accepted: at most 1.5",)
    assert begins(0.0, 0.0) == ("heading is 0.785 rad from the start's, 45 deg; accepted: at most 0.35",)
    flying = begin(runtime, still(), START)
    assert outside(runtime, still((3.0, 0.0, 1.5)), START, flying) == ()


def test_flying_imports_no_jax_and_no_simulator(hovering: Path) -> None:
    code = f"""
import sys
import numpy as np
from e2efly.tasks.route import course_for
from e2efly.policy.odometry import Odometry
from e2efly.policy.loader import load_policy
from e2efly.policy.runtime import Runtime, act, begin
from e2efly.vehicles.loading import load_vehicle
policy, vehicle = load_policy({str(hovering)!r}), load_vehicle("vis_r")
runtime = Runtime.of(policy, course_for(policy.contract, vehicle), vehicle)
still = Odometry(0.0, np.ones(3), np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(3))
act(runtime, begin(runtime, still, 0.0), still, 0.0)
print(*sys.modules)
"""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    out = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    loaded = out.stdout.split()
    assert {name.split(".")[1] for name in loaded if name.startswith("e2efly.")} == {
        "config", "control", "courses", "policy", "tasks", "vehicles",
    }  # fmt: skip
    assert not {"jax", "jaxlib", "jaxtyping", "onnx", "optax", "scipy", "matplotlib"} & set(loaded)
