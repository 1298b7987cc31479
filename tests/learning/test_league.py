"""The league: who flies which vehicle, who is a member, and that nothing is learned from what opponents do."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.learning import league
from e2efly.learning.algorithm import make_algorithm
from tests.learning.probe import Probe
from tests.learning.test_algorithms import ACTOR, BPTT_CONFIG, learn, learned_action

WITH_TWO = dataclasses.replace(BPTT_CONFIG, league=2)


@dataclasses.dataclass(frozen=True)
class Together(Probe):
    """A probe with two vehicles in a world."""

    agents: int = 2


def test_in_every_second_world_all_but_the_first_are_opponents() -> None:
    flown = league.flown_by_opponents(12, 3)
    assert flown.tolist() == [False] * 3 + [False, True, True] + [False] * 3 + [False, True, True]


def test_members_join_one_after_another_and_stay() -> None:
    size, members = 3, league.founded({"w": np.zeros(2)}, 3)
    for progress in np.linspace(0.0, 1.0, 13):
        newest = league.seat(jnp.float32(progress), size)
        members = league.joined(members, {"w": jnp.full(2, progress)}, newest)
    np.testing.assert_allclose(members["w"][:, 0], [0.25, 7 / 12, 1.0], atol=1e-6)


def test_opponents_are_the_members_so_far() -> None:
    members = {"w": jnp.arange(4.0)}
    keys = jax.random.split(jax.random.key(0), 200)
    drawn = jax.vmap(lambda key: league.opponent(members, key, jnp.int32(2))["w"])(keys)
    assert set(np.asarray(drawn).tolist()) == {0.0, 1.0, 2.0}


def test_a_policy_learns_beside_its_past_selves() -> None:
    _, state, _ = learn(Together(), WITH_TWO, 150, devices=1)
    _, alone, _ = learn(Probe(), BPTT_CONFIG, 150, devices=1)
    np.testing.assert_allclose(learned_action(state), learned_action(alone), atol=0.05)
    newest = jax.tree.map(lambda x: x[1], state.parameters.league)
    for ours, theirs in zip(jax.tree.leaves(state.parameters.learner), jax.tree.leaves(newest), strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_a_league_of_one_vehicle_is_refused() -> None:
    env: Any = dataclasses.replace(Together(), agents=1)
    with pytest.raises(ValueError, match=r"algo.league is 2; accepted: 0, or a task with several vehicles in a world"):
        make_algorithm(WITH_TWO, ACTOR).init(env, WITH_TWO, 0)
