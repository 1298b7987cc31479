"""The rows of the stress and another vehicle through the real firmware, beside the training simulator."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import e2efly
from e2efly.validation.plant_stress import stress
from e2efly.validation.stress import stress as in_training

ROWS = ("nominal", "mass x1.25", "thrust falls by 15 %", "wind 3 m/s", "delay +20 ms", "motor lag x2")
CLOSE = 0.12
"""Largest difference of a mean final error, m: the bridge learns its throttle map in a take-off, to a hundredth."""


@pytest.mark.whole
def test_the_firmware_meets_the_rows(policy_of: Callable[..., Path]) -> None:
    policy = policy_of("hover")
    found, wanted = (
        each.flown for each in (stress(policy, "betaflight", 1, rows=ROWS), in_training(policy, 1, rows=ROWS))
    )
    error = {row: float(np.mean(found[row]["hover"].final_error)) for row in ROWS}
    for row in ROWS:
        assert error[row] == pytest.approx(float(np.mean(wanted[row]["hover"].final_error)), abs=CLOSE), row
    assert error["mass x1.25"] > error["nominal"] + 0.8
    assert error["thrust falls by 15 %"] > error["nominal"] + 0.4
    assert error["wind 3 m/s"] > error["nominal"] + 0.01


@pytest.mark.whole
@pytest.mark.parametrize(("controller", "low", "high"), [("policy", 0.8, 1.1), ("plant", -0.1, 0.1)])
def test_the_throttle_map_is_of_the_vehicle_that_the_controller_believes_in(
    controller: str, low: float, high: float, policy_of: Callable[..., Path], heavy: str
) -> None:
    """20 % more mass: this controller's gain is 2 m/s^2 per m."""
    found = e2efly.validate(policy_of("hover"), "betaflight", 2, vehicle=heavy, controller=controller)  # type: ignore[arg-type]
    flown = found.criteria["hover"]
    deeper = flown.flown.final_error - flown.trained.final_error
    assert np.all((low < deeper) & (deeper < high)), deeper
    assert not any(flight.fault for flight in flown.flights)
