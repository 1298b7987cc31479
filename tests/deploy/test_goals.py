"""Goals: the same as the training's tasks show, and judged as they judge."""

import dataclasses
import itertools
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly import presets
from e2efly.courses.tracks import load_track
from e2efly.deploy.contract import Contract
from e2efly.deploy.goal_options import GoalOptions, goal_for
from e2efly.deploy.goals import GatesGoal, Goal, HoverGoal, LandGoal, ReferenceGoal
from e2efly.deploy.odometry import Odometry
from e2efly.env import Env
from e2efly.learn.export import contract_of
from e2efly.tasks import TASKS
from e2efly.tasks.race import RaceConfig
from e2efly.tasks.race.world import Race
from e2efly.tasks.task import Shape, at_rest
from e2efly.vehicles import load_vehicle

VEHICLE = load_vehicle("vis_r")
START = 100.0


def contract(task: str, **env: Any) -> Contract:
    config = presets.preset(task, "ppo")
    config = dataclasses.replace(config, env=dataclasses.replace(config.env, **env))
    return contract_of(Env.of(config.task, config.reward, config.env), config)


@pytest.fixture(scope="module")
def contracts() -> dict[str, Contract]:
    return {task: contract(task) for task in ("hover", "land", "track", "race")}


def at(position: Any) -> Odometry:
    zero = np.zeros(3)
    return Odometry(0.0, np.asarray(position, float), zero, np.array([1.0, 0, 0, 0]), zero)


def fly(goal: Goal, path: Any) -> Any:
    """The goal's state after a flight through points."""
    state = goal.start(at(path[0]), START)
    for a, b in itertools.pairwise(path):
        state = goal.advance(state, at(a), at(b), START)
    return state


def through(name: str, count: int, gap: float = 0.2) -> np.ndarray:
    """Points just before and behind the first `count` gates, over as many laps as it takes."""
    track = load_track(name)
    order = np.arange(count) % len(track.position)
    forward = gap * np.stack([np.cos(track.yaw), np.sin(track.yaw), 0 * track.yaw], -1)[order]
    middle = track.position[order]
    return np.stack([middle - forward, middle + forward], axis=1).reshape(-1, 3)


def test_the_defaults_are_the_trainings(contracts: dict[str, Contract]) -> None:
    options = GoalOptions()
    hover, land, track, race = (TASKS[name].training() for name in ("hover", "land", "track", "race"))
    suites = track.criteria()
    assert options.target == hover.target
    for name in ("centre", "radius", "circle_rate", "lemniscate_speed"):
        assert {getattr(suite, name) for suite in suites.values()} == {getattr(options, name)}
    assert options.reference in suites
    assert options.track == race.track
    assert options.laps == next(iter(race.criteria().values())).laps
    for name, config in (("hover", hover), ("land", land), ("track", track), ("race", race)):
        assert goal_for(contracts[name], options, VEHICLE).fence == config.fence


def test_the_contract_chooses_the_goal(contracts: dict[str, Contract]) -> None:
    kinds = {name: type(goal_for(c, GoalOptions(), VEHICLE)) for name, c in contracts.items()}
    assert kinds == {"hover": HoverGoal, "land": LandGoal, "track": ReferenceGoal, "race": GatesGoal}


def test_hovering_and_landing(contracts: dict[str, Contract]) -> None:
    options = GoalOptions(target=(1.0, 2.0, 3.0), origin=(10.0, 0.0, 0.5), origin_yaw=np.pi / 2)
    hover = goal_for(contracts["hover"], options, VEHICLE)
    state = fly(hover, [[0, 0, 1], [8, 1, 3.5]])
    np.testing.assert_allclose(hover.targets(state, START), [[8.0, 1.0, 3.5]], atol=1e-12)
    np.testing.assert_allclose(hover.position(state, START), [8.0, 1.0, 3.5], atol=1e-12)
    assert (hover.done(state), hover.failed(state)) == (False, "")
    land = goal_for(contracts["land"], GoalOptions(pad=(1.0, 0.0, 0.0), origin=(0.0, 0.0, 0.5)), VEHICLE)
    stands = 0.5 + VEHICLE.feet_height
    np.testing.assert_allclose(land.targets(fly(land, [[0, 0, 2]]), START), [[1.0, 0.0, stands]])
    assert not land.done(fly(land, [[1, 0, 2], [1, 0, stands + 0.01]]))
    assert land.done(fly(land, [[1, 0, 2], [1, 0, stands], [1, 0, stands + 0.1]]))  # bounced
    assert land.done(fly(land, [[1, 0, stands - 0.01]]))


@pytest.mark.parametrize("kind", ["circle", "lemniscate"])
def test_a_curve_begins_where_it_is_told_and_is_held_at_its_end(contracts: dict[str, Contract], kind: str) -> None:
    options = GoalOptions(reference=kind, centre=(1.0, 0.0, 2.0), radius=1.5, phase=0.4, duration=7.3)
    goal = goal_for(contracts["track"], options, VEHICLE)
    state = goal.start(at([0, 0, 1]), START)
    rate = 0.2 * np.pi if kind == "circle" else 3.0 / (1.5 * np.sqrt(2))
    t = np.array([0.0, 0.33, 5.0, 7.3])
    a = 0.4 + rate * t
    x, y = (np.cos(a), np.sin(a)) if kind == "circle" else (np.sin(a), np.sin(2 * a) / 2)
    wanted = np.stack([1 + 1.5 * x, 1.5 * y, 0 * x + 2], -1)
    np.testing.assert_allclose([goal.position(state, START + s) for s in t], wanted, atol=1e-3)
    ahead = goal.targets(state, START + 0.33)
    assert ahead.shape == (10, 3)
    np.testing.assert_allclose(ahead[7], goal.position(state, START + 1.03), atol=1e-9)
    np.testing.assert_array_equal(goal.targets(state, START + 7.1)[3:], [goal.position(state, START + 99.0)] * 7)
    assert not goal.done(goal.advance(state, at([0, 0, 1]), at([0, 0, 1]), START + 7.2))
    assert goal.done(goal.advance(state, at([0, 0, 1]), at([0, 0, 1]), START + 7.31))


def test_a_users_path(contracts: dict[str, Contract], tmp_path: Path) -> None:
    path = tmp_path / "mine.csv"
    t = np.arange(0, 6.01, 0.25)
    path.write_text("t,x,y,z\n" + "\n".join(f"{a + 3},{np.sin(a)},{a},2" for a in t))
    goal = goal_for(contracts["track"], GoalOptions(reference=str(path), origin=(0.0, 0.0, -1.0)), VEHICLE)
    state = goal.start(at([0, 0, 1]), START)
    np.testing.assert_allclose(goal.position(state, START + 2.6), [np.sin(2.6), 2.6, 1.0], atol=2e-3)
    assert goal.done(goal.advance(state, at([0, 0, 1]), at([0, 0, 1]), START + 6.0))


def test_gates_are_counted_over_laps(contracts: dict[str, Contract]) -> None:
    goal = goal_for(contracts["race"], GoalOptions(laps=2), VEHICLE)
    track = load_track("four_gates")
    for count in (0, 1, 3, 4, 7, 8, 9):
        state = fly(goal, through("four_gates", count)) if count else goal.start(at([0, 0, 1]), START)
        order = [count % 4, (count + 1) % 4]
        assert (state.passed, goal.done(state), goal.failed(state)) == (count, count >= 8, "")
        np.testing.assert_allclose(goal.targets(state, START), track.position[order], rtol=1e-6)
        np.testing.assert_allclose(goal.position(state, START), track.position[order[0]], rtol=1e-6)
    endless = goal_for(contracts["race"], GoalOptions(laps=0), VEHICLE)
    assert not endless.done(fly(endless, through("four_gates", 13)))


def test_behind_the_last_gate_of_an_open_track_it_goes_straight_on(contracts: dict[str, Contract]) -> None:
    goal = goal_for(contracts["race"], GoalOptions(track="s_shaped", laps=0), VEHICLE)
    track = load_track("s_shaped")
    on = track.position[-1] + [3.0, 0.0, 0.0]
    state = fly(goal, through("s_shaped", 3))
    np.testing.assert_allclose(goal.targets(state, START), [track.position[-1], on], rtol=1e-6)
    assert not goal.done(state)
    state = fly(goal, [*through("s_shaped", 4), [19.0, -1.0, 1.5], [0.0, 0.0, 1.5], *through("s_shaped", 1)])
    np.testing.assert_allclose(goal.targets(state, START), [on, on], rtol=1e-6)
    assert (state.passed, goal.done(state), goal.failed(state)) == (4, True, "")


@pytest.mark.parametrize(
    ("path", "passed", "failure"),
    [
        ([[3.9, 4.0, 2.5], [4.1, 4.0, 2.5]], 0, "gate 1 of lap 1 missed"),
        ([[3.9, 4.0, 1.55], [4.1, 4.0, 1.55]], 0, "gate 1 of lap 1 missed"),
        ([[4.1, 4.55, 1.0], [3.9, 4.55, 1.0]], 0, "frame struck on the way to gate 1 of lap 1"),
        ([[4.1, 4.0, 1.0], [3.9, 4.0, 1.0]], 0, ""),
        ([[3.9, 4.0, 2.5], [4.1, 4.0, 2.5], [3.9, 4.0, 1.0], [4.1, 4.0, 1.0]], 1, "gate 1 of lap 1 missed"),
        ([*through("four_gates", 4), [3.9, 4.55, 1.0], [4.1, 4.55, 1.0]], 4, "gate 1 of lap 2 missed"),
    ],
)
def test_misses_and_blows_are_named(contracts: dict[str, Contract], path: Any, passed: int, failure: str) -> None:
    goal = goal_for(contracts["race"], GoalOptions(), VEHICLE)
    state = fly(goal, path)
    assert (state.passed, goal.failed(state)) == (passed, failure)


def test_a_gate_does_not_count_when_a_frame_is_struck_in_the_same_step(contracts: dict[str, Contract]) -> None:
    goal = goal_for(contracts["race"], GoalOptions(track="j_shaped"), VEHICLE)
    state = fly(goal, [[3.9, 0.0, 1.5], [8.1, 0.55, 1.5]])  # through gate 1 into the frame of gate 2
    assert (state.passed, goal.failed(state)) == (0, "frame struck on the way to gate 1 of lap 1")


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
    goal = goal_for(contracts["race"], GoalOptions(track=name), VEHICLE)
    begun = goal.start(at(a[0]), START)
    states = [
        goal.advance(dataclasses.replace(begun, passed=int(k)), at(x), at(y), START)
        for k, x, y in zip(passed, a, b, strict=True)
    ]
    assert 20 < np.sum(memory > passed) < n
    assert 20 < np.sum(out.crashed) < n
    np.testing.assert_array_equal([state.passed for state in states], memory)
    np.testing.assert_array_equal([goal.failed(state) != "" for state in states], out.crashed)
    np.testing.assert_array_equal([goal.done(state) for state in states], out.success)


@pytest.mark.parametrize(
    ("task", "options", "message"),
    [
        ("hover", {"target": (0.0, np.nan, 1.0)}, r"goal\.target is \(0.0, nan, 1.0\); accepted: finite"),
        ("hover", {"target": (0.0, 0.0, 1e30)}, r"goal\.target is \(0.0, 0.0, 1e\+30\); accepted: .*at most 10000 in"),
        ("land", {"pad": (-1e5, 0.0, 0.0)}, r"goal\.pad is .*at most 10000 in size"),
        ("hover", {"origin": (0.0, 2e4, 0.0)}, r"goal\.origin is .*at most 10000 in size"),
        ("race", {"laps": 10**400}, r"goal\.laps is 1000.*at most 10000 in size"),
        ("hover", {"target": (0.0, 1.0)}, r"goal\.target is \(0.0, 1.0\); accepted: three numbers"),
        ("hover", {"target": (0.0, 0.0, 0.0)}, r"goal\.target: its lowest centre of mass is 0.000 m"),
        ("hover", {"origin": (0.0, 0.0, -3.5)}, r"goal\.target: its lowest centre of mass is -0.500 m"),
        (
            "hover",
            {"laps": 3},
            r"goal\.laps is 3, but the policy's task is 'hover'; accepted: origin, origin_yaw, target",
        ),
        ("land", {"target": (1.0, 0.0, 1.0)}, r"goal\.target is .*but the policy's task is 'land'"),
        ("track", {"reference": "circel"}, "unknown reference 'circel'; did you mean 'circle'"),
        ("track", {"reference": "polynomial"}, "unknown reference 'polynomial'.*or the path of a .csv file"),
        ("track", {"reference": "nowhere.csv"}, "reference 'nowhere.csv' cannot be read"),
        (
            "track",
            {"reference": "nowhere.csv", "phase": 1.0},
            r"goal\.phase is 1.0, but .* 'nowhere.csv'; accepted: or",
        ),
        ("track", {"lemniscate_speed": 2.0}, r"goal\.lemniscate_speed is 2.0, but .* the reference 'circle'"),
        ("track", {"radius": 0.0}, r"goal\.radius is 0.0; accepted: 0.001 or more"),
        ("track", {"lemniscate_speed": 1e-300, "reference": "lemniscate"}, r"goal\.lemniscate_speed is 1e-300; acc"),
        ("track", {"duration": 1e9}, r"goal\.duration is .*; accepted: 0.001 to 3600 s"),
        ("track", {"circle_rate": 0.0}, r"goal\.circle_rate is 0.0"),
        ("track", {"centre": (0.0, 0.0, 0.0)}, r"goal\.reference: its lowest centre of mass is 0.000 m"),
        ("race", {"track": "four_gate"}, "unknown track 'four_gate'; did you mean 'four_gates'"),
        ("race", {"track": "s_shaped", "laps": 2}, r"goal\.laps is 2; accepted: 0 or 1, as track 's_shaped'"),
        ("race", {"laps": -1}, r"goal\.laps is -1; accepted: 0 or more"),
        ("race", {"origin": (0.0, 0.0, -0.6)}, r"goal\.track: the lowest opening is -0.100 m"),
    ],
)
def test_bad_options_are_named(
    contracts: dict[str, Contract], task: str, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        goal_for(contracts[task], GoalOptions(**options), VEHICLE)


def test_policies_of_other_tasks_and_fields_are_refused(contracts: dict[str, Contract]) -> None:
    other = dataclasses.replace(contracts["hover"], task="perch")
    with pytest.raises(ValueError, match=r"unknown task of the policy 'perch' .*there are: hover, land, race, track"):
        goal_for(other, GoalOptions(), VEHICLE)
    odd = dataclasses.replace(contracts["race"], observation=contracts["hover"].observation)
    with pytest.raises(ValueError, match=r"observation of the policy is .*accepted: with 'gates' of size 6"):
        goal_for(odd, GoalOptions(), VEHICLE)


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
            assert goal_for(policy, GoalOptions(**option), VEHICLE).field == "position_error"
            continue
        with pytest.raises(ValueError, match=f"goal.{next(iter(option))} is .*as the policy commands {mode} in the"):
            goal_for(policy, GoalOptions(**option), VEHICLE)
