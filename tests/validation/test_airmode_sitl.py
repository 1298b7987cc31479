"""AIRMODE and its like on the real firmware: what the bridge reads, what it refuses, and why."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from e2efly.flight.betaflight.messages import set_raw_rc
from e2efly.flight.betaflight.settings_check import examine
from e2efly.flight.betaflight.settings_messages import PidAdvanced
from e2efly.flight.pilot.flight_state import Mode
from e2efly.flight.row import problems
from e2efly.validation import firmware_program, rig
from e2efly.validation.bridge_session import Session, rehearsal_settings
from e2efly.validation.rig import Rig
from e2efly.vehicles.loading import load_vehicle

VEHICLE = load_vehicle("vis_r")
LOW = 0.15
"""A throttle far below half, 0 to 1."""


def session_of(folder: Path, monkeypatch: pytest.MonkeyPatch, *lines: str) -> Iterator[Session]:
    """A bridge on firmware that is set by `SETTINGS` and further lines, and told what forbids a take-off."""
    prepare = rig.prepare
    monkeypatch.setattr(rig, "prepare", lambda sitl, settings: prepare(sitl, (*settings, *lines)))
    with Rig(firmware_program.chosen(), folder, VEHICLE) as running:
        session = Session(running, rehearsal_settings(1.0))
        session.bridge.settings_problems = problems(examine(session.autopilot.info, VEHICLE, session.settings))
        yield session
        session.close()


@pytest.fixture
def on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Session]:
    yield from session_of(tmp_path, monkeypatch)


@pytest.fixture
def off(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Session]:
    yield from session_of(tmp_path, monkeypatch, "feature -AIRMODE")


@pytest.fixture
def bent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Session]:
    lines = ("throttle_boost=7", "motor_output_limit=91", "thrust_linear=21")
    launch = "aux 4 49 10 1400 1600 0 0"  # LAUNCH CONTROL, on a switch of its own, which is on
    yield from session_of(tmp_path, monkeypatch, *(f"set {line}" for line in lines), launch)


def torque_at_low_throttle(session: Session) -> float:
    """Largest difference of two motors while a held body is asked to roll as fast as it can, 0 to 1."""
    running, mid = session.rig, session.autopilot.sticks.centre
    running.set(override=True)
    closed = session.autopilot.sticks.arrange((mid, mid, mid, 1000), ())
    rolling = session.autopilot.sticks.channels_of(LOW, (10.0, 0.0, 0.0), ()).channels
    _send(session, closed, 0.3)
    running.set(armed=True)
    _send(session, closed, 0.5)
    running.held = True
    _send(session, rolling, 0.5)
    return float(np.ptp(running.sitl.motors()))


def _send(session: Session, channels: tuple[int, ...], seconds: float) -> None:
    for _ in range(round(seconds / 0.01)):
        session.rig.sleep(0.01)
        session.autopilot.client.poll(session.rig.now())
        session.autopilot.client.set_raw_rc(set_raw_rc(channels), session.rig.now())


def test_with_airmode_it_takes_off(on: Session) -> None:
    assert "AIRMODE" in on.autopilot.info.features
    assert on.bridge.settings_problems == ()
    assert on.take_off()


@pytest.mark.whole
def test_without_airmode_it_is_refused_by_name_before_it_is_armed(off: Session) -> None:
    assert "AIRMODE" not in off.autopilot.info.features
    refusal = "feature AIRMODE is off; needed: on: torque goes before thrust at any throttle (feature AIRMODE)"
    assert off.bridge.settings_problems == (refusal,)
    off.fly(0.5)
    assert any(refusal in reason for reason in off.bridge.flight.reasons)
    assert not off.take_off()
    assert off.bridge.flight.mode is Mode.INIT
    assert off.rig.state.position[2] < 0.2


def test_airmode_is_what_gives_torque_at_low_throttle(on: Session) -> None:
    assert torque_at_low_throttle(on) > 0.8


def test_without_airmode_torque_at_low_throttle_is_scaled_down(off: Session) -> None:
    assert torque_at_low_throttle(off) < 0.7


def test_what_bends_the_throttle_is_read_and_refused(bent: Session) -> None:
    assert bent.autopilot.info.pid_advanced == PidAdvanced(0, 7, 91, 0, 21)
    named = [problem.split()[0] for problem in bent.bridge.settings_problems]
    assert named == ["motor_output_limit", "throttle_boost", "thrust_linear"]
    bent.fly(0.5)
    assert any("LAUNCH CONTROL (mode 49) is on" in reason for reason in bent.bridge.flight.reasons)
