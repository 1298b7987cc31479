"""Several vehicles of a world on plants, in lockstep."""

from collections.abc import Callable
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from e2efly.commands.cli import run
from e2efly.environment import UNSEEN, random_key
from e2efly.environment.episodes import trace
from e2efly.policy.observation import Company
from e2efly.policy.others import FAR
from e2efly.validation.duels import duel
from e2efly.validation.evaluation import SEED, act_of
from e2efly.validation.plant import RigidState
from e2efly.validation.plant_flight import nearest
from e2efly.validation.plant_stress import stress
from e2efly.validation.plant_validation import validate
from e2efly.vehicles.loading import load_vehicle


def at(x: float) -> RigidState:
    return RigidState(np.array([x, 0.0, 1.0]), np.array([-x, 0.0, 0.0]), np.eye(4)[0], np.zeros(3))


def test_the_nearest_come_first_and_who_is_not_there_is_far() -> None:
    found = nearest(at(0.0), [at(3.0), at(-1.0), at(2.0)], 2)
    assert found is not None
    np.testing.assert_array_equal(found.position[0, :, 0], [-1.0, 2.0])
    np.testing.assert_array_equal(found.velocity[0, :, 0], [1.0, -2.0])
    few = nearest(at(0.0), [at(3.0)], 2)
    assert few is not None and few.position[0, 1, 2] == 1.0 + FAR
    assert nearest(at(0.0), [at(3.0)], 0) is None


def test_a_world_flies_on_a_plant_as_in_the_environment(policy_of: Callable[..., Path]) -> None:
    """What each observes of the others, too."""
    found = validate(policy_of("swap"), "simulator", 3, task={"agents": 4, "side": 4.0, "episode_s": 3.0})
    compared, (suite,) = found.criteria["swap"], found.candidate.task.criteria().values()
    assert len(compared.flights) == 4  # a whole world
    needs = found.candidate.policy.contract.others
    assert needs == Company(2, ("others", "others_velocity"), 0.1, 7.141, 5.0)  # of its training, with a side of 5 m
    env = found.candidate.at_home.environment(suite)
    n = env.whole(250)
    states, _, _, out = trace(env, act_of(found.candidate.policy), random_key(SEED, UNSEEN, 0), n, 60)
    for i, flight in enumerate(compared.flights):
        assert not flight.fault
        np.testing.assert_allclose(flight.position[1:61], states.position[:, i], atol=2e-3)
        np.testing.assert_allclose(flight.observation[1:61], out.final_observation[:, i], atol=2e-2)


def test_vehicles_of_a_world_do_not_pass_through_each_other_in_mujoco(policy_of: Callable[..., Path]) -> None:
    """The hand-made policy flies straight to its place, through whoever is in the way."""
    task = {"agents": 8, "side": 4.0, "height": 0.0, "collisions_end": False, "episode_s": 4.0}
    nearest = {}
    for plant in ("simulator", "mujoco"):
        found = validate(policy_of("swap"), plant, 8, task=task, seed=2).criteria["swap"]
        assert not any(flight.fault for flight in found.flights)
        there = np.stack([flight.position for flight in found.flights])
        pairs = combinations(range(8), 2)
        nearest[plant] = min(float(np.linalg.norm(there[i] - there[j], axis=-1).min()) for i, j in pairs)
    touch = 2 * load_vehicle("vis_r").radius
    assert nearest["simulator"] < 0.7 * touch and 0.85 * touch < nearest["mujoco"] < 1.02 * touch


def test_worlds_of_several_are_refused_where_one_flies_alone(policy_of: Callable[..., Path]) -> None:
    with pytest.raises(ValueError, match=r"task.agents is 8; accepted for --stress: a task with one vehicle"):
        stress(policy_of("swap"), "simulator", 1)
    with pytest.raises(ValueError, match=r"--plant is 'betaflight' and task.agents 8; accepted: .*'mujoco'.*at once"):
        validate(policy_of("swap"), "betaflight", 8)


def test_two_policies_race(policy_of: Callable[..., Path]) -> None:
    """Each is given what it observes: the rival sees no others, and more of its last actions."""
    policy, rival = str(policy_of("race_duel")), str(policy_of("race", past_actions=3))
    there = duel(policy, rival, 4, task={"laps": 1, "episode_s": 3.0}, seed=1)
    assert there.time.shape == (4, 2) and np.all(there.touched[:, 0] == there.touched[:, 1])
    alike = duel(policy, policy, 4, task={"laps": 1, "episode_s": 3.0}, seed=1)
    np.testing.assert_array_equal(there.out, alike.out)  # the hand-made controller reads neither
    with pytest.raises(ValueError, match=r"--rival observes position_error \(3\); accepted: gates \(6\), others"):
        duel(policy, str(policy_of("hover")), 4)
    with pytest.raises(ValueError, match=r"--rival is given for a policy of hover; accepted: a policy of race_"):
        duel(str(policy_of("hover")), policy, 4)


def test_what_a_race_between_policies_does_not_use_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["eval", "race_duel", "--rival", "race", "--controller", "plant", "--env.wind", "3"]) == 2
    told = " ".join(capsys.readouterr().err.split())
    assert (
        "--env, --controller is given with --rival; accepted: --task, --episodes, --seed, --device and --json" in told
    )
    assert run(["eval", "race_duel", "--rival", "race", "--episodes", "0"]) == 2
    assert "--episodes is 0; accepted: more than 0" in capsys.readouterr().err
