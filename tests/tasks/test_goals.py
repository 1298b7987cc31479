"""Goals: what flight is shown and how it is judged is what training shows and judges."""

import dataclasses
import itertools
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import PayloadConfig
from e2efly.control import Quat
from e2efly.courses import defaults
from e2efly.courses.tracks import load_track
from e2efly.environment import Env, random_key
from e2efly.flight.pilot.fence import check_course
from e2efly.flight.settings import Fence
from e2efly.learning.onnx_export import contract_of
from e2efly.policy.contract import Contract
from e2efly.policy.goal import Course, Shape
from e2efly.policy.odometry import Odometry
from e2efly.runs import presets
from e2efly.tasks import TASKS, company
from e2efly.tasks.hover.goal import HoverRoute
from e2efly.tasks.land.goal import LandRoute
from e2efly.tasks.race import RaceConfig
from e2efly.tasks.race.world import Race
from e2efly.tasks.route import course_for, goal_notes, goal_of, route_of
from e2efly.tasks.task import at_rest
from e2efly.validation.starts import course_of
from e2efly.vehicles.loading import load_vehicle

VEHICLE = load_vehicle("vis_r")
PERIOD = 0.02


def contract(task: str, **env: Any) -> Contract:
    config = presets.preset(task, "ppo")
    config = dataclasses.replace(config, env=dataclasses.replace(config.env, **env))
    return contract_of(Env.of(config.task, config.reward, config.env), config)


@pytest.fixture(scope="module")
def contracts() -> dict[str, Contract]:
    return {task: contract(task) for task in TASKS}


def course(contract: Contract, **options: Any) -> Course:
    return course_for(contract, VEHICLE, route_of(contract)(outside=True, **options))


def at(position: Any) -> Odometry:
    zero = np.zeros(3)
    return Odometry(0.0, np.asarray(position, float), zero, np.array([1.0, 0, 0, 0]), zero)


class Flown:
    """A flight through points of the room, a control step from one to the next."""

    def __init__(self, course: Course, path: Any) -> None:
        self.course, self.memory, self.done, self.failure, self.time = course, course.memory, False, "", 0.0
        bodies = [at(point).seen_from(course.origin).batch for point in path]
        for before, after in itertools.pairwise(bodies):
            self.time += PERIOD
            out_of_time = np.array([self.time >= course.duration])
            memory, outcome = course.goal.advance(self.memory, before, after, np.array([self.time]), out_of_time)
            self.done |= course.goal.done(outcome) or bool(out_of_time[0])
            if outcome.terminated[0] and not self.done:
                self.failure = self.failure or course.goal.failure(self.memory, outcome)
            self.memory = memory
        self.body = bodies[-1]

    def shown(self, time: float | None = None) -> np.ndarray:
        """What the policy is shown, as points of the task's world."""
        now = np.array([self.time if time is None else time])
        row = self.course.goal.observe(self.memory, now, self.body)[0]
        return row.reshape(-1, 3) + self.body.position[0]

    def goal(self, time: float | None = None) -> np.ndarray:
        """Where to be, in the room."""
        now = np.array([self.time if time is None else time])
        return self.course.origin.points(self.course.goal.goal(self.memory, now)[0])


def through(name: str, count: int, gap: float = 0.2) -> np.ndarray:
    """Points just before and behind the first `count` gates, over as many laps as it takes."""
    track = load_track(name)
    order = np.arange(count) % len(track.position)
    forward = gap * np.stack([np.cos(track.yaw), np.sin(track.yaw), 0 * track.yaw], -1)[order]
    middle = track.position[order]
    return np.stack([middle - forward, middle + forward], axis=1).reshape(-1, 3)


@pytest.mark.parametrize(
    ("task", "options"),
    [("hover", {}), ("hover_aware", {}), ("land", {}), ("land_visual", {}), ("track", {}),
     ("track", {"reference": "lemniscate"})],
)  # fmt: skip
def test_the_usual_flight_fits_into_a_small_room_and_into_the_training(
    contracts: dict[str, Contract], task: str, options: dict[str, Any]
) -> None:
    """Half a metre to each wall of 4x4 m, and to a ceiling of 2.5 m."""
    route = route_of(contracts[task])(**options)
    placed = course_for(contracts[task], VEHICLE, route)
    check_course(Fence(low=(-1.5, -1.5, 0.2), high=(1.5, 1.5, 2.0)), placed)
    assert placed.box[1, 2] == defaults.FLOWN_HEIGHT
    assert goal_notes(contracts[task], route) == []


def test_a_course_that_leaves_the_fence_is_refused_with_its_size(contracts: dict[str, Contract]) -> None:
    """Whatever is outside: a target, an opening's corner, the start; not the pad, which lies under each fence."""
    fence = Fence(low=(-3.0, -3.0, 0.2), high=(3.0, 3.0, 3.0))
    for task, options, size in (
        ("hover", {"target": (0.0, 3.1, 1.2)}, "0.6 x 0.4 x 0.2 m, x 0.00 to 0.60, y 2.70 to 3.10, z 1.00 to 1.20"),
        ("track", {"radius": 3.5}, "7.0 x 6.9 x 0.0 m"),
        (
            "race_clutter",
            {"track": "room_6", "scale": 1.0, "origin": (0.7, 0.0, 0.0)},
            "4.8 x 4.4 x 1.4 m, x -1.70 to 3.10",
        ),
        ("race", {}, "10.0 x 9.0 x 2.0 m"),
    ):
        with pytest.raises(ValueError, match=f"the course needs {size}") as refused:
            check_course(fence, course(contracts[task], **options))
        assert "(-3.0, -3.0, 0.2) to (3.0, 3.0, 3.0)" in str(refused.value)
    check_course(fence, course(contracts["race_clutter"], track="room_6", scale=1.0))
    check_course(fence, course(contracts["race_clutter_room"]))
    check_course(fence, course(contracts["land"], origin=(0.0, 0.0, -0.1)))


def test_a_policy_that_commands_positions_flies_where_it_was_trained() -> None:
    absolute = contract("hover", command_mode="position")
    assert course_for(absolute, VEHICLE).points == [defaults.TARGET]
    with pytest.raises(ValueError, match=r"goal\.target is .*1\.2\); accepted: \(0\.0, 0\.0, 3\.0\)"):
        course_for(absolute, VEHICLE, HoverRoute())


def test_every_task_says_what_flight_needs_without_jax() -> None:
    code = "from e2efly.tasks import TASKS\nfrom e2efly.tasks.route import *\n"
    code += "for t in TASKS.values(): goal_of(t); load(t.route)().course(Shape(0.1, 0.2), 0.02).goal.fields\n"
    code += "import sys; assert not {'jax', 'jaxlib'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_contract_chooses_the_goal(contracts: dict[str, Contract]) -> None:
    for name, policy in contracts.items():
        goal = course(policy).goal
        assert issubclass(goal_of(TASKS[name]), type(goal))  # a vehicle of avoid_together flies a lane of its own
        assert [field.name for field in goal.fields] == [field.name for field in policy.observation][: len(goal.fields)]


def test_hovering_and_landing(contracts: dict[str, Contract]) -> None:
    placed = course(contracts["hover"], target=(1.0, 2.0, 3.0), origin=(10.0, 0.0, 0.5), origin_yaw=np.pi / 2)
    hover = Flown(placed, [[9, 0, 1], [8, 1, 3.5]])
    np.testing.assert_allclose(hover.shown(), [[1.0, 2.0, 3.0]], atol=1e-12)
    np.testing.assert_allclose(hover.body.position, [[1.0, 2.0, 3.0]], atol=1e-12)
    np.testing.assert_allclose(hover.goal(), [8.0, 1.0, 3.5], atol=1e-12)
    assert (hover.done, hover.failure) == (False, "")
    assert Flown(placed, [[9, 0, 1], [15, 1, 3.5]]).failure == "the task has failed, 7.00 m from its goal"
    pad = course(contracts["land"], pad=(1.0, 0.0, 0.0), origin=(0.0, 0.0, 0.5))
    stands = 0.5 + VEHICLE.feet_height
    np.testing.assert_allclose(Flown(pad, [[0, 0, 2]]).goal(), [1.0, 0.0, stands])
    assert not Flown(pad, [[1, 0, 2], [1, 0, stands + 0.01]]).done
    assert Flown(pad, [[1, 0, 2], [1, 0, stands - 0.001], [1, 0, stands + 0.1]]).done  # bounced
    off = Flown(pad, [[2, 0, 2], [2, 0, stands - 0.01]])
    assert (off.done, off.failure) == (True, "")  # landed beside the pad: it must not climb again
    assert Flown(pad, [[1, 0, 2], [1, 7, 2]]).failure == "the task has failed, 7.00 m from its goal"


@pytest.mark.parametrize("kind", ["circle", "lemniscate"])
def test_a_curve_begins_where_it_is_told_and_is_held_at_its_end(contracts: dict[str, Contract], kind: str) -> None:
    placed = course(contracts["track"], reference=kind, centre=(1.0, 0.0, 2.0), radius=1.5, phase=0.4, duration=7.3)
    flown = Flown(placed, [[0, 0, 1]])
    rate = defaults.FLOWN_CIRCLE_RATE if kind == "circle" else defaults.FLOWN_LEMNISCATE_SPEED / (1.5 * np.sqrt(2))
    t = np.array([0.0, 0.33, 5.0, 7.3])
    a = 0.4 + rate * t
    x, y = (np.cos(a), np.sin(a)) if kind == "circle" else (np.sin(a), np.sin(2 * a) / 2)
    wanted = np.stack([1 + 1.5 * x, 1.5 * y, 0 * x + 2], -1)
    np.testing.assert_allclose([flown.goal(s) for s in t], wanted, atol=1e-3)
    np.testing.assert_allclose(placed.start, flown.goal(0.0))
    ahead = flown.shown(0.33)
    assert ahead.shape == (10, 3)
    np.testing.assert_allclose(ahead[7], flown.goal(1.03), atol=1e-6)
    np.testing.assert_allclose(flown.shown(7.1)[3:], [flown.goal(99.0)] * 7, rtol=1e-12)
    assert placed.duration == 7.3


def test_a_users_path(contracts: dict[str, Contract], tmp_path: Path) -> None:
    path = tmp_path / "mine.csv"
    t = np.arange(0, 6.01, 0.25)
    path.write_text("t,x,y,z\n" + "\n".join(f"{a + 3},{np.sin(a)},{a},2" for a in t))
    placed = course(contracts["track"], reference=str(path), origin=(0.0, 0.0, -1.0))
    np.testing.assert_allclose(Flown(placed, [[0, 0, 1]]).goal(2.6), [np.sin(2.6), 2.6, 1.0], atol=2e-3)
    assert placed.duration == pytest.approx(6.0)


def test_gates_are_counted_over_laps(contracts: dict[str, Contract]) -> None:
    placed = course(contracts["race"], laps=2)
    track = load_track("four_gates")
    for count in (0, 1, 3, 4, 7, 8, 9):
        flown = Flown(placed, through("four_gates", count) if count else [[0, 0, 1]])
        order = [count % 4, (count + 1) % 4]
        assert (flown.memory[0], flown.done, flown.failure) == (count, count >= 8, "")
        np.testing.assert_allclose(flown.shown(), track.position[order], rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(flown.goal(), track.position[order[0]], rtol=1e-6)
    assert not Flown(course(contracts["race"], laps=0), through("four_gates", 13)).done


def test_an_open_track_ends_at_its_last_gate(contracts: dict[str, Contract]) -> None:
    placed = course(contracts["race"], track="s_shaped", laps=0)
    track = load_track("s_shaped")
    on = track.position[-1] + [3.0, 0.0, 0.0]
    flown = Flown(placed, through("s_shaped", 3))
    np.testing.assert_allclose(flown.shown(), [track.position[-1], on], rtol=1e-6)
    assert not flown.done
    assert Flown(placed, through("s_shaped", 4)).done


@pytest.mark.parametrize(
    ("path", "passed", "failure"),
    [
        ([[3.9, 4.0, 2.5], [4.1, 4.0, 2.5]], 0, "gate 1 of lap 1 missed"),
        ([[3.9, 4.0, 1.55], [4.1, 4.0, 1.55]], 0, "gate 1 of lap 1 missed"),
        ([[4.1, 4.55, 1.0], [3.9, 4.55, 1.0]], 0, "frame struck on the way to gate 1 of lap 1"),
        ([[4.1, 4.0, 1.0], [3.9, 4.0, 1.0]], 0, ""),
        ([[3.9, 4.0, 2.5], [4.1, 4.0, 2.5], [3.9, 4.0, 1.0], [4.1, 4.0, 1.0]], 1, "gate 1 of lap 1 missed"),
        ([[0.0, 0.0, 1.0], [0.0, 0.0, 0.01]], 0, "the task has failed, 5.74 m from its goal, gate 1 of lap 1"),
    ],
)
def test_misses_and_blows_are_named(contracts: dict[str, Contract], path: Any, passed: int, failure: str) -> None:
    flown = Flown(course(contracts["race"]), path)
    assert (flown.memory[0], flown.failure) == (passed, failure)


def test_the_second_lap_counts_from_its_first_gate(contracts: dict[str, Contract]) -> None:
    path = [*through("four_gates", 4), [3.9, 4.55, 1.0], [4.1, 4.55, 1.0]]
    assert Flown(course(contracts["race"], laps=2), path).failure == "gate 1 of lap 2 missed"


def test_a_gate_does_not_count_when_a_frame_is_struck_in_the_same_step(contracts: dict[str, Contract]) -> None:
    flown = Flown(course(contracts["race"], track="j_shaped"), [[3.9, 0.0, 1.5], [8.1, 0.55, 1.5]])
    assert (flown.memory[0], flown.failure) == (0, "frame struck on the way to gate 1 of lap 1")


@pytest.mark.parametrize("roll", [0.6, -0.6])
def test_a_slit_is_passed_banked_and_struck_level(contracts: dict[str, Contract], roll: float) -> None:
    placed = course(contracts["gap"], slit_roll=roll, slit_yaw=0.5)
    np.testing.assert_allclose(placed.start, [-3 * np.cos(0.5), -3 * np.sin(0.5), 2.0])

    def fly(bank: float, aside: float = 0.0) -> Flown:
        turn = Quat.of_euler(np.array(bank), np.array(0.0), np.array(0.5)).stack()
        ahead, left = np.array([np.cos(0.5), np.sin(0.5), 0.0]), np.array([-np.sin(0.5), np.cos(0.5), 0.0])
        line = [np.array([0.0, 0.0, 2.0]) + s * ahead + aside * left for s in np.arange(-1.0, 2.01, 0.05)]
        flown = Flown(placed, [line[0]])
        rows = [dataclasses.replace(at(p), quaternion=turn, velocity=ahead * 0.05 / PERIOD).batch for p in line]
        for before, after in itertools.pairwise(rows):
            memory, outcome = placed.goal.advance(flown.memory, before, after, np.zeros(1), np.array([False]))
            flown.done |= placed.goal.done(outcome)
            if outcome.terminated[0] and not flown.done:
                flown.failure = flown.failure or placed.goal.failure(flown.memory, outcome)
            flown.memory = memory
            if outcome.terminated[0]:
                break
        return flown

    assert (fly(roll).done, fly(roll).failure) == (True, "")
    assert (fly(0.0).done, fly(0.0).failure) == (False, "wall or ground struck")
    assert fly(-roll).failure == "wall or ground struck"
    assert fly(roll, aside=4.5).failure == "the slit was missed"


def test_what_to_look_at_circles_the_target(contracts: dict[str, Contract]) -> None:
    placed = course(contracts["hover_aware"], target=(1.0, 0.0, 2.0), look_at=(1.0, 4.0, 2.5), turn_rate=0.5)
    flown = Flown(placed, [[1.0, 0.0, 2.0]])
    np.testing.assert_allclose(flown.shown(0.0), [[1.0, 0.0, 2.0], [1.0, 4.0, 2.5]], atol=1e-12)
    np.testing.assert_allclose(flown.shown(np.pi)[1], [-3.0, 0.0, 2.5], atol=1e-12)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("task", [name for name, task in TASKS.items() if "world" in vars(task)])
def test_what_training_shows_and_judges_flight_shows_and_judges(task: str) -> None:
    """The same code in NumPy and float64: fields, errors and verdicts of 64 vehicles that fly until they fail."""
    config = presets.preset(task, "ppo")
    measured = dataclasses.replace(config.env, payload=PayloadConfig())  # in flight nothing measures a load
    env = Env.of(next(iter(config.task.criteria().values())), config.reward, measured)
    n, world = 64, env.task
    state, _ = jax.jit(env.reset, static_argnums=1)(random_key(0), n)
    lean = course_of(world, jax.tree.map(np.asarray, state.memory), np.zeros(3)).goal
    memory, step = lean.state(jax.tree.map(np.asarray, state.memory)), jax.jit(partial(env.step, restart=False))
    judge, seen, noise = jax.jit(world.advance), jax.jit(world.observe), np.random.default_rng(0)
    lost, ends = np.zeros(n, bool), 0
    for k in range(40):
        before = state.vehicle
        action = np.clip(
            np.asarray(env.hover) + noise.normal(0.0, 0.5, (n, 4)) + (k > 25) * np.array([1, 0, 0, 0]), -1, 1
        )
        reached, _ = step(state, jnp.asarray(action, jnp.float32))
        late = jnp.full(n, k == 39)
        _, wanted = judge(state.memory, before, reached.vehicle, reached.time, late)
        bodies = [jax.tree.map(lambda x: np.asarray(x, np.float64), body) for body in (before, reached.vehicle)]
        time = np.asarray(reached.time, np.float64)
        memory, outcome = lean.advance(memory, *bodies, time, np.asarray(late))
        assert all(isinstance(getattr(outcome, f), np.ndarray) for f in ("terminated", "success", "crashed", "error"))
        np.testing.assert_allclose(outcome.error, wanted.error, atol=2e-4)
        if lean.neighbours:
            near = company.nearest(reached.vehicle, env.agents, lean.neighbours)
            memory = lean.among(memory, jax.tree.map(np.asarray, near))
        row = lean.observe(memory, time, bodies[1])
        np.testing.assert_allclose(row, seen(reached.memory, reached.time, reached.vehicle), atol=2e-4)
        if config.env.cameras or env.agents > 1:  # what only cameras see, and others, strike in training alone
            assert not np.any(outcome.crashed & ~np.asarray(wanted.crashed) & ~lost)
        else:
            for part in ("terminated", "success", "arrived", "crashed"):
                same = getattr(outcome, part) == np.asarray(getattr(wanted, part))
                assert np.mean(same | lost) == 1.0, (part, k)
        lost |= np.asarray(wanted.terminated)
        ends += int(np.sum(wanted.terminated))
        state = dataclasses.replace(reached)
    assert ends > 0 or task in ("avoid", "hall", "race_clutter")


@pytest.mark.parametrize("name", ["four_gates", "circle_3d", "s_shaped", "j_shaped"])
def test_gates_are_judged_as_in_training(contracts: dict[str, Contract], name: str) -> None:
    """Steps about each gate, of all lengths: what counts there counts here, what crashes there fails here."""
    n, rng, track = 1000, np.random.default_rng(0), load_track(name)
    passed = rng.integers(0, len(track.position), n)
    middle = track.position[passed] + rng.uniform(-0.7, 0.7, (n, 3))
    step = rng.normal(0.0, 0.4, (n, 3))
    a, b = (x.astype(np.float32) for x in (middle - step, middle + step))
    race = Race.of(RaceConfig(track=name, laps=1, fence=1e9), Shape(-1e9, VEHICLE.radius))
    memory, out = jax.jit(race.advance)(
        jnp.asarray(passed, jnp.int32),
        at_rest(jnp.asarray(a)),
        at_rest(jnp.asarray(b)),
        jnp.zeros(n),
        jnp.zeros(n, bool),
    )
    goal = dataclasses.replace(
        course(contracts["race"], track=name).goal, shape=Shape(-1e9, VEHICLE.radius), config=RaceConfig(fence=1e9)
    )
    body = [dataclasses.replace(at(x[0]), position=x.astype(np.float64)) for x in (a, b)]
    memory_here, here = goal.advance(passed, *body, np.zeros(n), np.zeros(n, bool))
    assert 20 < np.sum(memory > passed) < n
    assert 20 < np.sum(out.crashed) < n
    np.testing.assert_array_equal(memory_here, memory)
    np.testing.assert_array_equal(here.crashed, out.crashed)
    np.testing.assert_array_equal(here.success, out.success)


@pytest.mark.parametrize(
    ("task", "options", "message"),
    [
        ("hover", {"target": (0.0, np.nan, 1.0)}, r"goal\.target is \(0.0, nan, 1.0\); accepted: 3 numbers, -1"),
        ("hover", {"target": (0.0, 0.0, 0.0)}, r"goal\.target: its lowest point is 0.000 m"),
        ("hover", {"origin": (0.0, 0.0, -1.7)}, r"goal\.target: its lowest point is -0.500 m"),
        ("track", {"reference": "circel"}, "unknown reference 'circel'; did you mean 'circle'"),
        ("track", {"reference": "polynomial"}, "unknown reference 'polynomial'.*or the path of a .csv file"),
        ("track", {"reference": "nowhere.csv"}, "reference 'nowhere.csv' cannot be read"),
        (
            "track",
            {"reference": "nowhere.csv", "phase": 1.0},
            r"goal\.phase is 1.0, but has no effect here; accepted: origin, origin_yaw, outside, reference",
        ),
        ("track", {"lemniscate_speed": 2.0}, r"goal\.lemniscate_speed is 2.0, but has no effect"),
        ("track", {"circle_rate": 0.0}, r"goal\.circle_rate is 0.0"),
        ("track", {"centre": (0.0, 0.0, 0.0)}, r"goal\.reference: its lowest point is 0.000 m"),
        ("race", {"track": "four_gate"}, "unknown track 'four_gate'; did you mean 'four_gates'"),
        ("race", {"track": "s_shaped", "laps": 2}, r"goal\.laps is 2; accepted: 0 or 1, as track 's_shaped'"),
        ("race", {"origin": (0.0, 0.0, -0.6)}, r"goal\.track: its lowest point is -0.100 m"),
    ],
)
def test_bad_options_are_named(
    contracts: dict[str, Contract], task: str, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        course(contracts[task], **options)


def test_policies_of_other_tasks_and_routes_are_refused(contracts: dict[str, Contract]) -> None:
    other = dataclasses.replace(contracts["hover"], task="perch")
    with pytest.raises(
        ValueError, match=r"unknown task 'perch'.*there are: avoid, avoid_together, dodge, gap, hall, hover"
    ):
        course_for(other, VEHICLE)
    with pytest.raises(ValueError, match="goal is a LandRoute; accepted: a HoverRoute, for task 'hover'"):
        course_for(contracts["hover"], VEHICLE, LandRoute())


def test_a_policy_that_commands_in_world_axes_is_not_moved_to_others() -> None:
    for mode, option, fine in (
        ("ctbr", {"origin_yaw": 1.0, "origin": (1.0, 0.0, 0.0)}, True),
        ("velocity", {"origin": (1.0, 0.0, 0.0)}, True),
        ("velocity", {"origin_yaw": 1.0}, False),
        ("attitude", {"origin_yaw": 1.0}, False),
        ("position", {"origin": (1.0, 0.0, 0.0)}, False),
        ("position", {"origin_yaw": 1.0}, False),
    ):
        policy = contract("hover", command_mode=mode)
        if fine:
            assert course(policy, **option).goal.fields[0].name == "position_error"
            continue
        with pytest.raises(ValueError, match=f"goal.{next(iter(option))} is .*as the policy commands {mode} in the"):
            course(policy, **option)
