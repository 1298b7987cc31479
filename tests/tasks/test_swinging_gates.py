"""Gates that swing: where they are, what the policy is shown, and how they are judged, against crossings by hand."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import EnvConfig, RewardConfig
from e2efly.courses.gates import Gates
from e2efly.courses.tracks import load_track
from e2efly.environment import Env, random_key
from e2efly.tasks.race import RaceConfig
from e2efly.tasks.race.goal import RaceGoal
from e2efly.tasks.race.swinging import SwingingMemory
from e2efly.tasks.race.world import Race
from e2efly.tasks.race_duel import RaceDuelConfig
from e2efly.tasks.task import Shape, at_rest
from e2efly.validation.starts import course_of

SHAPE = Shape(0.05, 0.12)
RACE = Race.of(RaceConfig(swing=1.0), SHAPE)  # gate 0 at (4, 4, 1) along x, opening 1 m, frame 0.1 m
FOUR_S = 2 * np.pi / 4


def memory(n: int, begun: float) -> SwingingMemory:
    """Gate 0 swings 1 m to either side, from the middle to the left, in 4 s: at 1 s it is at (4, 5, 1)."""
    still = np.zeros((n, 4), np.float32)
    sine, rate = still.copy(), still + np.float32(FOUR_S)
    sine[:, 0] = 1.0
    return SwingingMemory(*map(jnp.asarray, (np.zeros(n, np.int32), still, sine, rate, np.full(n, begun, np.float32))))


STEPS = {  # end of the step, s: place before and after; whether the gate is passed
    "where it is at its left": (1.0, 1 / 30, [3.9, 5.0, 1.0], [4.1, 5.0, 1.0], True),
    "where it stands on the track, but no longer is": (1.0, 1 / 30, [3.9, 4.0, 1.0], [4.1, 4.0, 1.0], False),
    "into its frame": (1.0, 1 / 30, [3.9, 5.5, 1.0], [4.1, 5.5, 1.0], False),
    "where it is at its right": (3.0, 1 / 30, [3.9, 3.0, 1.0], [4.1, 3.0, 1.0], True),
    "half way, as it is in the middle of the step": (1.0, 1.0, [3.5, 4.5, 1.0], [4.5, 4.5, 1.0], True),
    "half way, as it is at the end": (1.0, 1.0, [3.5, 5.0, 1.0], [4.5, 5.0, 1.0], False),
    "half way, as it was before": (1.0, 1.0, [3.5, 4.0, 1.0], [4.5, 4.0, 1.0], False),
    "along with it": (1.0, 1.0, [3.5, 4.2, 1.0], [4.5, 5.2, 1.0], True),
}


@pytest.mark.parametrize("name", STEPS)
def test_crossings_of_a_gate_that_moves(name: str) -> None:
    end, length, a, b, passes = STEPS[name]
    before, after = (at_rest(jnp.asarray([x], jnp.float32)) for x in (a, b))
    moved, out = RACE.advance(memory(1, end - length), before, after, jnp.array([end]), jnp.zeros(1, bool))
    assert bool(out.arrived[0]) is passes
    assert bool(out.crashed[0]) is not passes
    assert int(moved.passed[0]) == passes
    assert float(moved.time[0]) == np.float32(end)
    beside = float(out.signals["overhang"][0, 0])  # what the reward is told: how far the sphere is outside
    assert (beside < 0) is passes


def test_the_policy_is_shown_where_the_gates_are_now_and_cameras_see_them_there() -> None:
    state, begun = RACE.start(random_key(3), 50)
    time = jnp.linspace(0.0, 11.0, 50)
    shown = np.asarray(RACE.observe(begun, time, state)).reshape(50, 2, 3)
    track = load_track("four_gates")
    offset = np.asarray(begun.offsets(time))
    left = np.stack([-np.sin(track.yaw), np.cos(track.yaw), 0 * track.yaw], -1)
    there = track.position + offset[..., None] * left
    np.testing.assert_allclose(shown, there[:, :2] - np.asarray(state.position)[:, None], atol=1e-5)
    seen = RACE.scene(begun).solids["gate"].position(time)
    np.testing.assert_allclose(seen, there, atol=1e-5)
    last = dataclasses.replace(begun, passed=begun.passed + 3)
    np.testing.assert_allclose(RACE.targets(last, time), there[:, [3, 0]], atol=1e-5)
    amplitude, period = np.hypot(begun.cosine, begun.sine), 2 * np.pi / np.asarray(begun.rate)
    assert 0.9 < amplitude.max() <= 1.0 + 1e-6
    assert amplitude.min() < 0.1
    assert 3.0 - 1e-5 <= period.min() < 3.3 < 7.7 < period.max() <= 8.0 + 1e-5


def test_gates_that_stand_still_cost_nothing() -> None:
    """The program is the one without the option, and no array of the state is there for it."""
    still = Race.of(RaceConfig(swing_period=(1.0, 2.0)), SHAPE)
    state, passed = still.start(random_key(0), 4)
    assert passed.shape == (4,)
    moving, _ = RACE.start(random_key(0), 4)
    np.testing.assert_array_equal(state.position, moving.position)

    def program(race: Race) -> str:
        arguments = (passed, state, state, jnp.zeros(4), jnp.zeros(4, bool))
        return str(jax.make_jaxpr(race.advance)(*arguments))

    assert "sin" not in program(still)
    swinging = jax.make_jaxpr(RACE.advance)(memory(4, 0.0), state, state, jnp.zeros(4), jnp.zeros(4, bool))
    assert "sin" in str(swinging)


def test_a_flight_judges_them_as_the_training_does() -> None:
    env = Env.of(RaceConfig(swing=1.0, laps=1), RewardConfig({"progway": 1.0, "fitlog": 4.0}), EnvConfig())
    state, _ = env.reset(random_key(1), 8)
    reached, out = jax.jit(lambda s: env.step(s, jnp.zeros((8, 4))))(state)
    assert np.isfinite(out.reward).all()
    row = jax.tree.map(lambda x: np.asarray(x[:1]), reached.memory)
    flown = course_of(env.task, row, np.zeros(3))
    assert type(flown.goal) is RaceGoal
    assert isinstance(flown.goal.gates, Gates)
    theirs = env.task.observe(reached.memory, reached.time, reached.vehicle)[:1]
    body = jax.tree.map(lambda x: np.asarray(x[:1]), reached.vehicle)
    ours = flown.goal.observe(flown.memory, np.asarray(reached.time[:1]), body)
    assert isinstance(ours, np.ndarray)
    np.testing.assert_allclose(ours, theirs, atol=1e-5)


def test_what_cannot_swing_is_refused() -> None:
    for options in (RaceConfig(track="any", swing=0.5), RaceConfig(shows_more=True, swing=0.5)):
        with pytest.raises(ValueError, match=r"task.swing is 0.5; accepted: 0 with task.track any"):
            options.check(30.0, 0.05)
    with pytest.raises(ValueError, match=r"task.swing is 0.5; accepted: 0, as the gates of a duel"):
        RaceDuelConfig(swing=0.5).check(30.0, 0.05)
