"""Gain, delay and lag of the thrust are found from steps of the thrust, with and without the accelerometer's filter."""

from pathlib import Path

import numpy as np
import pytest

from e2efly.alignment.thrust_response import lagged, thrust_response
from e2efly.logs.recording import Record, Stream

LAG, DELAY, GAIN = 0.04, 0.031, 0.9
FINE = 0.0005


def stepped(size: float, filtered: float, rate: float, noise: float) -> Record:
    """Pairs of steps of the thrust, at 100 Hz, and the specific force of rotors that follow with a lag."""
    time, fine = np.arange(0, 20, 0.01), np.arange(0, 20, FINE)
    phase = time % 2.0
    asked = 9.81 + size * np.where(phase < 0.2, 1.0, np.where(phase < 0.4, -1.0, 0.0)) * (-1) ** (time // 2)
    held = asked[np.clip(np.floor((fine - DELAY) / 0.01 + 1e-9).astype(int), 0, None)]
    force = GAIN * lagged(np.sqrt(held), LAG, FINE) ** 2
    for _ in range(2):
        force = lagged(force, filtered, FINE)
    seen = np.arange(0, 20, 1 / rate)
    felt = np.zeros((len(seen), 3))
    felt[:, 2] = np.interp(seen, fine, force) + noise * np.random.default_rng(0).standard_normal(len(seen))
    command = np.column_stack([asked, np.zeros((len(time), 3))])
    streams = {"command": Stream(time, command), "specific_force": Stream(seen, felt)}
    return Record(Path("steps.csv"), {**streams, "body_rate": Stream(seen, np.zeros((len(seen), 3)))})


def test_of_an_unfiltered_accelerometer() -> None:
    found = thrust_response([stepped(3.0, 0.0, 250.0, 0.2)], 0.025)
    assert found is not None and found.reason == ""
    assert found.lag[0] == pytest.approx(LAG, rel=0.05) and abs(found.lag[0] - LAG) < 3 * found.lag[1]
    assert found.delay[0] == pytest.approx(DELAY, abs=0.002)
    assert found.gain[0] == pytest.approx(GAIN, rel=0.005) and found.filter < 0.001


def test_of_an_accelerometer_that_is_filtered_and_seldom_reported_with_a_delay_that_is_known() -> None:
    found = thrust_response([stepped(3.0, 0.011, 50.0, 0.05)], 0.025, delay=DELAY)
    assert found is not None and found.reason == ""
    assert found.lag[0] == pytest.approx(LAG, rel=0.1)
    assert found.filter == pytest.approx(0.011, rel=0.3)


def test_a_hover_shows_the_gain_alone_and_a_log_without_thrust_nothing() -> None:
    found = thrust_response([stepped(0.2, 0.0, 250.0, 0.2)], 0.025)
    assert found is not None and "m/s^2 rms within a second, needed 0.5" in found.reason
    assert found.gain[0] == pytest.approx(GAIN, rel=0.03)  # as well as the accelerometer's bias is known
    assert thrust_response([stepped(0.0, 0.0, 250.0, 0.2)], 0.025) is None
