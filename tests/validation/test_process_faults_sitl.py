"""Faults of the bridge's own process, in real time: one process flies, another is the world."""

from collections.abc import Callable
from pathlib import Path

import pytest

from e2efly.validation import firmware_program
from tests.conftest import NetworkTrace
from tests.faults import process_faults


@pytest.fixture(scope="module", autouse=True)
def built() -> None:
    """The firmware is there before the test looks at what its processes say to the network."""
    firmware_program.build()


@pytest.mark.parametrize("fault", process_faults.FAULTS)
def test_the_bridges_process_fails(
    fault: str, policy_of: Callable[..., Path], tmp_path: Path, network: NetworkTrace
) -> None:
    outcome = process_faults.strike(fault, policy_of("hover"), tmp_path)
    assert outcome.problems == ()
    assert outcome.touch_speed < 2.5
    assert outcome.touch_tilt < 0.35
    assert outcome.largest_tilt < 1.5
    if fault != "disk full":
        assert outcome.reaction < 2.0  # stated is a tenth of a second: a busy machine measures more
    assert network.left() == []  # in all of a flight, watchdog included
