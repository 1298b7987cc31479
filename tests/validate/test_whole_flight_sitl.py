"""Whole flights and starts through the real firmware; the policies are a hand-made linear controller."""

from collections.abc import Callable
from pathlib import Path

import pytest

from e2efly.deploy.goal_options import GoalOptions, goal_for
from e2efly.deploy.policy import load_policy
from e2efly.deploy.state_machine import Mode
from e2efly.deploy.telemetry import Telemetry
from e2efly.device import compute_at_once
from e2efly.validate import firmware
from e2efly.validate.rehearsal import rehearse
from e2efly.vehicles import load_vehicle

compute_at_once()


@pytest.fixture(scope="module")
def built() -> firmware.Firmware:
    """Built from its package the first time, which takes a minute or two."""
    return firmware.build()


def test_take_off_hover_policy_landing_with_nobodys_help(
    built: firmware.Firmware, policy_of: Callable[..., Path], tmp_path: Path
) -> None:
    policy, vehicle = load_policy(policy_of("hover")), load_vehicle("vis_r")
    goal = goal_for(policy.contract, GoalOptions(target=(0.0, 0.0, 2.5)), vehicle)
    with Telemetry(tmp_path / "flight.mcap") as log:
        flight = rehearse(built, policy, goal, vehicle, seed=1, log=log)
    assert flight.complete, flight.reasons
    assert flight.modes == (
        Mode.INIT, Mode.TAKEOFF, Mode.HOVER, Mode.POLICY, Mode.HOVER, Mode.LAND, Mode.DONE, Mode.INIT,
    )  # fmt: skip
    assert flight.hover_error < 0.10
    assert flight.policy_error < 0.15  # it is no trained policy
    assert not log.problems
    touch = flight.flown.position[-1]
    assert touch[2] == pytest.approx(vehicle.feet_height, abs=0.01)
    assert flight.flown.tilt_cosine[-1] == pytest.approx(1.0, abs=0.01)
