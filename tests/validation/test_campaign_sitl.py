"""A flight of the campaign through the real firmware, and each of its faults at work."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from e2efly.flight.betaflight.messages import RawImu
from e2efly.policy.loader import load_policy
from e2efly.tasks.hover.goal import HoverRoute
from e2efly.tasks.route import course_for
from e2efly.validation import firmware_program
from e2efly.validation.rig import Rig
from e2efly.vehicles.loading import load_vehicle
from tests.faults.campaign import Scenario, fly
from tests.faults.injections import COUNTS, KINDS, Faults, Strike
from tests.faults.scenarios import CASES
from tests.faults.stage import LATENCY_S, TARGET, Gear, Stage


def test_poses_that_end_in_a_take_off_break_no_rule(policy_of: Callable[..., Path], tmp_path: Path) -> None:
    scenario = Scenario("", "takeoff", (Strike("poses: none", 0.6),), 0.7)
    flown = fly(scenario, load_policy(policy_of("hover")), load_vehicle("vis_r"), firmware_program.chosen(), tmp_path)
    assert flown.violations == ()
    assert flown.ended
    assert 0.2 < flown.touch_speed < 1.5
    assert flown.climb == 0.0  # it never came to its hover
    assert flown.changes[0][1] == "land"


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(
    "name",
    [
        "accelerometer z times 0.93, poses lost with it",
        "accelerometer z times 0.97, poses lost 3 s later",
        "accelerometer z times -1, poses lost with it",
        "accelerometer z times -1 on the ground, poses lost in flight",
        "poses: NED and FRD from the ground, pose only",
        "poses: z mirrored from the ground, with velocity",
        "poses: quaternion conjugated from the ground, with velocity",
        "poses: velocity negated from the ground",
        "poses: velocity zero from the ground",
        "poses: 5 Hz from the ground",
        "poses: 0.15 s late from the ground",
        "link: silent for 3 s in a quiet hover",
        "link: 55 ms late, poses lost",
        "link: seven answers of ten spoilt, poses lost",
        "accelerometer frozen, receiver silent for 0.5 s with it",
    ],
)
def test_what_ended_badly_once_breaks_no_rule(name: str, policy_of: Callable[..., Path], tmp_path: Path) -> None:
    """Each of these climbed away, fell, touched too fast, or stood armed for as long as it was watched."""
    (scenario,) = (case for case in CASES if case.name == name)
    flown = fly(scenario, load_policy(policy_of("hover")), load_vehicle("vis_r"), firmware_program.chosen(), tmp_path)
    assert flown.violations == ()
    assert flown.ended


@pytest.mark.whole
@pytest.mark.parametrize("shift", [0.0, 0.13, 0.26, 0.52])
def test_what_drifted_while_nothing_was_heard_stops_there_and_lands(
    shift: float, policy_of: Callable[..., Path], tmp_path: Path
) -> None:
    """It does not fly back to where it was: it would touch the ground on its way, at up to 2 m/s."""
    scenario = Scenario("", "hover", (Strike("link: silent", 2.0 + shift, 3.0),), 0.8)
    flown = fly(scenario, load_policy(policy_of("hover")), load_vehicle("vis_r"), firmware_program.chosen(), tmp_path)
    assert flown.violations == ()
    assert flown.touch_speed < 0.8
    assert flown.ended


def test_every_kind_can_strike_and_end(policy_of: Callable[..., Path], tmp_path: Path) -> None:
    policy, vehicle = load_policy(policy_of("hover")), load_vehicle("vis_r")
    goal = course_for(policy.contract, vehicle, HoverRoute(target=TARGET))
    with Rig(firmware_program.chosen(), tmp_path, vehicle, latency=LATENCY_S) as rig:
        stage = Stage(rig, policy, goal, gear=Gear(watched=True, log=tmp_path / "flight.mcap"))
        stage.fly(0.2)
        gravity = stage.session.autopilot.client.latest[RawImu.CODE].message.acceleration
        np.testing.assert_allclose(gravity, (0, 0, COUNTS), atol=1)
        faults, random = Faults(stage), np.random.default_rng(0)
        faults.attach()
        stage.each = faults.each
        for name, kind in KINDS.items():
            faults.begin(Strike(name, 0.0, 0.05, kind.draw(random)))
            stage.fly(0.02)
        stage.fly(0.1)
        assert not stage.link.silent
        assert not stage.link.gone
        assert not stage.stopped
        assert rig.heard
        stage.end()
        assert stage.log is not None
        assert stage.log.failed


def test_a_bridge_that_stands_still_in_hover_is_landed_by_the_watchdog(
    policy_of: Callable[..., Path], tmp_path: Path
) -> None:
    scenario = Scenario("", "hover", (Strike("bridge: stopped", 0.0, 0.5),), 0.7)
    flown = fly(scenario, load_policy(policy_of("hover")), load_vehicle("vis_r"), firmware_program.chosen(), tmp_path)
    assert flown.violations == ()
    assert flown.ended
    assert "the watchdog has taken over" in flown.reasons[0]
