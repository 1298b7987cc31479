"""Steps through the real firmware, and the simulator aligned with them."""

from pathlib import Path

import numpy as np
import pytest

from e2efly.alignment.alignment import align
from e2efly.alignment.checks import checked
from e2efly.validation import firmware_program
from e2efly.validation.rehearsal import LINK_S
from e2efly.validation.rig import Rig
from e2efly.vehicles.loading import load_vehicle
from tests.validation.steps import QUICKER, SIZES, fly_steps

VEHICLE = load_vehicle("vis_r")


@pytest.mark.whole
def test_the_simulator_is_aligned_with_the_firmware(tmp_path: Path) -> None:
    """A rate loop that is quicker than the file's, which held-out time shows."""
    with Rig(firmware_program.chosen(), tmp_path, VEHICLE, settings=QUICKER) as rig:
        record, steps = fly_steps(rig, (1.0,))
    assert [(s.channel, s.size) for s in steps] == list(enumerate(SIZES))
    sent = record.streams["command"]
    for step in steps:
        at = int(np.flatnonzero(sent.time == step.time)[0])
        rest = 9.81 if step.channel == 0 else 0.0
        assert np.isclose(sent.values[at, step.channel], rest + step.size)
        assert np.isclose(sent.values[at - 1, step.channel], rest)
    found = align(VEHICLE, checked([record], VEHICLE), VEHICLE.latency - LINK_S)
    gain = next(e for e in found.estimates if e.name == "rate_gain").value
    assert np.all(gain > 1.2 * VEHICLE.rate_gain) and np.all(gain < 3 * VEHICLE.rate_gain)
    assert 0 <= found.delay[1] < 0.015
    for signal in ("roll_rate", "pitch_rate", "yaw_rate", "attitude"):
        assert found.after[signal] < 0.7 * found.before[signal], signal
