"""Racing on any track: the tracks that are drawn, what the policy is shown of them, and how a race is judged."""

import dataclasses
import itertools
import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.commands.eval import parse as parse_eval
from e2efly.commands.train import parse as parse_train
from e2efly.config import NetworkConfig
from e2efly.courses.gates import Tracks
from e2efly.courses.random_tracks import CLEAR, CLUTTERED, FEWEST, LOWEST, RACING, TrackStyle, random_tracks
from e2efly.courses.tracks import load_track, track_names
from e2efly.environment import Env, random_key
from e2efly.learning.networks import Actor, Weights
from e2efly.learning.onnx_export import contract_of, export_policy
from e2efly.policy.contract import Contract
from e2efly.policy.goal import Shape
from e2efly.policy.loader import load_policy
from e2efly.runs import presets
from e2efly.tasks.race import RaceConfig
from e2efly.tasks.race.any_goal import AnyRaceMemory
from e2efly.tasks.race.any_world import AnyRace
from e2efly.tasks.race.goal import RaceRoute
from e2efly.tasks.route import course_for, fields_of
from e2efly.tasks.task import at_rest, make_task
from e2efly.validation import evaluation
from e2efly.validation.candidate import candidate
from e2efly.validation.starts import draw_starts
from e2efly.vehicles.loading import load_vehicle

SHAPE = Shape(0.05, 0.12)
ANY = presets.preset("race", "bptt", "any_track")


def drawn(n: int, seed: int = 0, style: TrackStyle = RACING) -> Tracks:
    u = np.random.default_rng(seed).random((n, *style.numbers()), np.float32)
    return random_tracks(u, style)


def shift(track: Tracks, gate: int, by: float) -> np.ndarray:
    """(n, 3) so far behind a gate of each world, along its axis, m."""
    g = track.gates
    axis = np.stack([g.cos[:, gate], g.sin[:, gate], 0 * g.cos[:, gate]], axis=-1)
    return g.position[:, gate] + by * axis


def task(track: str = "any", laps: int = 1) -> AnyRace:
    made = make_task(RaceConfig(track=track, laps=laps, shows_more=True), SHAPE, 1 / 30)
    assert isinstance(made, AnyRace)
    return made


def test_tracks_are_the_same_on_both_libraries() -> None:
    u = np.random.default_rng(1).random((50, *RACING.numbers()), np.float32)
    ours, theirs = random_tracks(u), jax.jit(random_tracks)(jnp.asarray(u))
    assert isinstance(ours.gates.position, np.ndarray)
    np.testing.assert_array_equal(ours.count, theirs.count)
    np.testing.assert_array_equal(ours.closed, theirs.closed)
    np.testing.assert_allclose(ours.gates.position, theirs.gates.position, atol=2e-3)
    np.testing.assert_allclose(ours.gates.half, theirs.gates.half, atol=1e-5)


@pytest.mark.parametrize("style", [RACING, CLUTTERED])
def test_tracks_are_as_they_are_described(style: TrackStyle) -> None:
    tracks = drawn(2000, style=style)
    count, g = tracks.count, tracks.gates
    assert set(count) == set(range(FEWEST, style.most + 1))
    assert (0.4 if style is RACING else 0.3) < tracks.closed.mean() < 0.6
    there = np.arange(style.most) < count[:, None]
    assert (2 * g.half).min() >= style.opening[0] - 1e-6
    assert (2 * g.half).max() <= style.opening[1] + 1e-6
    gates = g.position[:, :-1]
    assert (gates[..., 2] - g.half[..., 1])[there].min() >= LOWEST - 1e-4
    assert gates[there][:, 2].max() <= style.top[1]
    assert gates[~there][:, 2].max() < -100
    assert g.start[:, 2].min() >= 0.8 - 1e-6
    # every manoeuvre is there: turns of up to half a circle, gates above each other, climbs
    yaw = np.arctan2(g.sin, g.cos)
    turns = np.abs(np.angle(np.exp(1j * np.diff(yaw, axis=1))))
    turn = turns[there[:, 1:]]
    step = np.diff(gates, axis=1)[there[:, 1:]]
    flat = np.linalg.norm(step[:, :2], axis=-1)
    if style is CLUTTERED:
        assert turns[there[:, 1:] & ~tracks.closed[:, None]].max() <= 2.1 + 1e-6
        assert flat[~np.repeat(tracks.closed, count - 1)].min() > 0.7 * style.leg[0] - 1e-3
        return
    assert turn.max() > 3.1
    stacked = (flat < 1.01) & (np.abs(step[:, 2]) > 1.2) & (turn > 2.7)
    assert 0.03 < stacked.mean() < 0.12
    assert (step[stacked, 2] > 0).any()
    assert (step[stacked, 2] < 0).any()
    assert 0.05 < ((flat > 3) & (np.abs(step[:, 2]) > 0.3 * flat)).mean() < 0.4


def test_gates_keep_clear_of_the_lines_between_others() -> None:
    """By another formula than the sampler's: points along each line."""
    tracks, near = drawn(300), 0
    for world in range(300):
        track = tracks.track(world)
        points = np.vstack([track.start, track.position, *([track.position[:1]] if track.closed else [])])
        gates = np.arange(len(track.position))
        for i, (a, b) in enumerate(itertools.pairwise(points)):
            line = a + np.linspace(0, 1, 200)[:, None] * (b - a)
            others = track.position[(gates != i % len(gates)) & (gates != i - 1)]
            if len(others):
                near += np.linalg.norm(line[:, None] - others, axis=-1).min() < CLEAR - 0.05
    assert near <= 10


@pytest.mark.parametrize("track", ["any", *track_names()])
def test_a_whole_race(track: str) -> None:
    """Through the middle of every gate in order: each is a goal, the last one the end, nothing is struck."""
    race = task(track)
    _, memory = race.start(random_key(3), 40)
    count, zero, none = np.asarray(memory.tracks.count), jnp.zeros(40), jnp.zeros(40, bool)
    advance = jax.jit(race.advance)
    for gate in range(count.max()):
        states = (at_rest(jnp.asarray(shift(memory.tracks, gate, by))) for by in (-0.2, 0.2))
        live = gate < count
        memory, out = advance(memory, *states, zero, none)
        np.testing.assert_array_equal(np.asarray(out.arrived)[live], True)
        np.testing.assert_array_equal(np.asarray(out.success)[live], (gate == count - 1)[live])
        np.testing.assert_array_equal(np.asarray(out.crashed)[live], False)


@pytest.mark.whole
def test_what_ends_a_race_badly() -> None:
    race = task()
    _, memory = race.start(random_key(4), 30)
    tracks, zero, none = memory.tracks, jnp.zeros(30), jnp.zeros(30, bool)
    half, gates = np.asarray(tracks.gates.half[:, 0]), tracks.gates
    advance = jax.jit(race.advance)

    def outcome(before: np.ndarray, after: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        moved, out = advance(memory, *(at_rest(jnp.asarray(x, jnp.float32)) for x in (before, after)), zero, none)
        return np.asarray(moved.passed), np.asarray(out.crashed)

    before, after = (np.asarray(shift(tracks, 0, by)) for by in (-0.2, 0.2))
    left = np.stack([-gates.sin[:, 0], gates.cos[:, 0], 0 * half[:, 0]], axis=-1)
    for size, way in ((half[:, :1], left), (half[:, 1:], np.array([0.0, 0.0, 1.0]))):
        assert outcome(before + (size - 0.13) * way, after + (size - 0.13) * way)[0].all()
        for edge in (size - 0.11, size + 0.05, size + 0.5):  # frame, frame, beside it
            passed, crashed = outcome(before + edge * way, after + edge * way)
            assert crashed.all()
            assert not passed.any()
    passed, crashed = outcome(after, before)  # backward through the opening
    assert not passed.any()
    assert not crashed.any()
    leg = np.linalg.norm(np.asarray(tracks.gates.position[:, 0] - tracks.gates.start), axis=-1)
    for beyond, lost in ((9.0, False), (11.0, True)):
        far = np.asarray(shift(tracks, 0, 0.0)) - (leg + beyond)[:, None] * np.asarray(
            shift(tracks, 0, 1.0) - shift(tracks, 0, 0.0)
        )
        assert (outcome(far, far)[1] == lost).all()


def test_the_policy_is_shown_the_next_three_gates() -> None:
    tracks = Tracks.of(load_track("s_shaped"), RACING.most)
    closed = Tracks.of(load_track("four_gates"), RACING.most)
    goal = task("s_shaped")
    body = at_rest(jnp.asarray([[1.0, 2.0, 7.0]]))
    for made, passed, gates in ((tracks, 1, [1, 2, 3]), (tracks, 3, [3, 3, 3]), (closed, 7, [3, 0, 1])):
        seen = np.asarray(goal.observe(AnyRaceMemory(made, np.array([passed])), jnp.zeros(1), body))[0]
        centre, axis, opening = seen[:9].reshape(3, 3), seen[9:18].reshape(3, 3), seen[18:24]
        g = made.gates
        onward = np.array([0, 1, 2])[:, None] if gates == [3, 3, 3] else 0.0
        wanted = g.position[0, gates] - [1.0, 2.0, 7.0] + 3.0 * onward * axis
        np.testing.assert_allclose(centre, wanted, atol=1e-5)
        np.testing.assert_allclose(axis[:, 0], g.cos[0, gates], atol=1e-6)
        np.testing.assert_allclose(axis[:, 1], g.sin[0, gates], atol=1e-6)
        np.testing.assert_array_equal(opening, 1.0)
        assert seen[24] == 3.0  # the height, where it is more than that


def test_nothing_tells_where_the_track_stands_or_which_gate_it_is() -> None:
    """Moved sideways, with gates before it: the policy is shown the same."""
    race, tracks = task(), drawn(20, 5)
    far = np.float32([30.0, -20.0, 0.0])
    moved = dataclasses.replace(tracks.gates, position=tracks.gates.position + far)
    body = at_rest(jnp.asarray(shift(tracks, 0, -1.0)))
    there = dataclasses.replace(body, position=body.position + far)
    memory = AnyRaceMemory(tracks, np.zeros(20, int))
    seen = race.observe(memory, jnp.zeros(20), body)
    again = race.observe(AnyRaceMemory(dataclasses.replace(tracks, gates=moved), tracks.count), jnp.zeros(20), there)
    np.testing.assert_allclose(np.asarray(seen)[tracks.closed], np.asarray(again)[tracks.closed], atol=1e-4)


def test_the_way_is_straight_before_a_gate_and_leads_around_from_behind_it() -> None:
    race = task("s_shaped")  # gate 0 at (4, 1, 1.5) along x
    _, memory = race.start(random_key(0), 5)
    places = jnp.asarray([[1.0, 1.0, 1.5], [4.0, 3.0, 1.5], [5.0, 1.0, 1.5], [4.001, 3.0, 1.5], [14.0, 1.0, 1.5]])
    _, out = race.advance(memory, at_rest(places), at_rest(places), jnp.zeros(5), jnp.zeros(5, bool))
    np.testing.assert_allclose(out.signals["way"], [3.0, 2.0, 2.0, 2.0005, 13.0], atol=2e-3)
    np.testing.assert_allclose(out.signals["way"], out.signals["previous_way"], atol=1e-6)


def test_no_step_of_the_way_is_charged_for_passing_a_gate() -> None:
    """What is gained from the start to the last gate is the length of the way, wherever steps end."""
    race = task("s_shaped")
    track = load_track("s_shaped")
    places = [track.position[0] - [3.1, 0.0, 0.0]]
    for gate in track.position:  # straight to each gate and 0.35 m through it
        places += [gate - np.array([0.25, 0.0, 0.0]), gate + np.array([0.35, 0.0, 0.0])]
    _, memory = race.start(random_key(0), 1)
    gained, last = 0.0, len(places) - 1
    for i in range(last):
        before, after = (at_rest(jnp.asarray(x[None], jnp.float32)) for x in places[i : i + 2])
        memory, out = race.advance(memory, before, after, jnp.zeros(1), jnp.zeros(1, bool))
        gained += float(out.signals["previous_way"][0] - out.signals["way"][0])
    legs = np.linalg.norm(np.diff(track.position, axis=0), axis=-1).sum()
    assert bool(out.success[0])
    # off by what the straight lines above cut or add at each corner, and by the way behind the last gate
    assert gained == pytest.approx(3.1 + legs + 0.35, abs=0.1)


def test_what_stands_out_is_measured_where_the_plane_is_crossed() -> None:
    race = task("s_shaped")  # gate 0 at (4, 1, 1.5) along x, opening 1 m, sphere 0.12 m
    _, memory = race.start(random_key(0), 4)
    before = jnp.asarray([[3.9, 1.2, 1.5], [3.5, 0.4, 1.5], [3.0, 1.0, 1.5], [4.1, 1.0, 1.5]])
    after = jnp.asarray([[4.1, 1.2, 1.5], [4.5, 1.4, 2.5], [3.5, 1.0, 1.5], [3.9, 1.0, 1.5]])
    _, out = race.advance(memory, at_rest(before), at_rest(after), jnp.zeros(4), jnp.zeros(4, bool))
    over = np.asarray(out.signals["overhang"])
    np.testing.assert_allclose(over[:2, :2], [[0.2 - 0.38, -0.38], [0.1 - 0.38, 0.5 - 0.38]], atol=1e-4)
    assert over[2:, :2].max() < -10  # neither before the plane nor backward
    np.testing.assert_allclose(over[:, 2], 0.25 - np.asarray(after)[:, 2], atol=1e-6)  # and the ground


@pytest.mark.parametrize("track", ["four_gates", "s_shaped"])
def test_a_race_on_one_track_has_the_same_signals(track: str) -> None:
    """At every gate, the last of a closed and of an open track included."""
    shown, plain = task(track, laps=0), make_task(RaceConfig(track=track, laps=0), SHAPE, 1 / 30)
    rng, gates = np.random.default_rng(0), load_track(track)
    _, memory = shown.start(random_key(0), 30)
    for passed in range(len(gates.yaw)):
        near = gates.position[passed] + rng.uniform(-1, 1, (30, 3))
        before, after = (at_rest(jnp.asarray(near + step, jnp.float32)) for step in rng.uniform(-0.5, 0.5, (2, 30, 3)))
        count = jnp.full(30, passed, jnp.int32)
        still = jnp.zeros(30), jnp.zeros(30, bool)
        _, one = shown.advance(dataclasses.replace(memory, passed=count), before, after, *still)
        _, other = plain.advance(count, before, after, *still)
        for name in ("way", "previous_way", "overhang"):
            np.testing.assert_allclose(one.signals[name], other.signals[name], atol=1e-5)


@pytest.fixture(scope="module")
def contract() -> Contract:
    return contract_of(Env.of(ANY.task, ANY.reward, ANY.env), ANY)


@pytest.mark.parametrize("track", ["four_gates", "s_shaped"])
def test_flight_is_shown_and_judged_as_training_is(contract: Contract, track: str) -> None:
    course = course_for(contract, load_vehicle("vis_r"), RaceRoute(track=track))
    assert course.goal.fields == fields_of(contract) == contract.observation[:4]
    race, rng = task(track), np.random.default_rng(0)
    _, memory = race.start(random_key(0), 1)
    advance, observe = jax.jit(race.advance), jax.jit(race.observe)
    here, at = course.memory, [course.start, *load_track(track).position]
    for a, b in itertools.pairwise(at):
        for _ in range(20):
            before, after = (x + rng.normal(0, 0.5, 3) for x in (a, b))
            steps = [at_rest(jnp.asarray(x[None], jnp.float32)) for x in (before, after)]
            bodies = [jax.tree.map(lambda x: np.asarray(x, float), step) for step in steps]
            shown = course.goal.observe(here, np.zeros(1), bodies[0])
            np.testing.assert_allclose(observe(memory, jnp.zeros(1), steps[0]), shown, atol=1e-5)
            memory, wanted = advance(memory, *steps, jnp.zeros(1), jnp.zeros(1, bool))
            here, found = course.goal.advance(here, *bodies, np.zeros(1), np.zeros(1, bool))
            np.testing.assert_array_equal(here.passed, memory.passed)
            np.testing.assert_array_equal(found.crashed, wanted.crashed)
            np.testing.assert_array_equal(found.success, wanted.success)
    assert here.passed[0] > 0


def test_starts_of_validation_have_tracks_of_their_own() -> None:
    starts = draw_starts(Env.of(ANY.task, ANY.reward, ANY.env), 3, 0)
    tracks = [course.memory.tracks for course in starts.courses]
    assert len({float(t.gates.position[0, 0, 0]) for t in tracks}) == 3
    assert isinstance(tracks[0].gates.position, np.ndarray)
    np.testing.assert_array_equal(starts.drawn["count"], [t.count[0] for t in tracks])
    rows = json.loads(json.dumps(evaluation.course_rows(ANY.task, starts.drawn, 3)))  # as a report says them
    for row, track in zip(rows, tracks, strict=True):
        said, count = row["course"], int(track.count[0])
        assert (said["count"], said["closed"]) == (count, bool(track.closed[0]))
        wanted = track.track(0)
        np.testing.assert_allclose(said["position"][:count], wanted.position, atol=1e-5)
        np.testing.assert_allclose(said["opening"][:count], wanted.opening, atol=1e-5)


def test_the_command_line_finds_the_preset_by_the_track() -> None:
    assert parse_train(["race", "--task.track", "any"]).config == ANY
    ppo = parse_train(["race", "--task.track", "any", "--algo", "ppo"]).config
    assert (ppo.algo.name, ppo.task) == ("ppo", ANY.task)
    usual = parse_train(["race"]).config
    assert isinstance(usual.task, RaceConfig)
    assert usual.task.track == "four_gates"
    shown = [(f.name, f.size) for f in Env.of(usual.task, usual.reward, usual.env).task.fields]
    assert shown == [("gates", 6)]  # the zoo's policies are shown this


def test_a_lone_policy_is_judged_on_tracks_of_any_kind(contract: Contract, tmp_path: Path) -> None:
    file = tmp_path / "lone.onnx"
    actor = Actor.of(contract.observation, (), NetworkConfig((8,)))
    weights = actor.init(np.random.default_rng(0), np.zeros(4))
    assert isinstance(weights, Weights)
    export_policy(file, weights, actor, dataclasses.replace(contract, memory_size=0))
    assert load_policy(file).contract.task == "race"
    assert candidate(file).task.criteria()["race"] == dataclasses.replace(ANY.task, laps=1)
    asked = parse_eval([str(file), "--task.track", "s_shaped", "--task.position", "0.2"])
    assert asked.task == {"track": "s_shaped", "position": 0.2}
    found = candidate(file, task=asked.task)
    assert "task.track s_shaped (not any)" in found.notes[0]
    env = found.environment(found.task)
    assert isinstance(env.task, AnyRace)
    assert env.task.given is not None
    assert int(env.task.given.count[0]) == 4
    with pytest.raises(ValueError, match="unknown track 's_shap'; did you mean 's_shaped'"):
        found.environment(dataclasses.replace(found.task, track="s_shap"))
