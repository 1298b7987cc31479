"""Steps of docs/hardware.md, "Bring-up", on the real firmware: the simulated vehicle does what the reader is to see."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from e2efly.flight.betaflight.settings_check import examine
from e2efly.flight.pilot.flight_state import Mode, Reason
from e2efly.flight.settings import FlightSettings
from e2efly.validation import firmware_program, rig
from e2efly.validation.bridge_session import Session
from e2efly.validation.rig import Rig
from e2efly.vehicles.loading import load_vehicle
from tests.docs.pages import DOCS

VEHICLE = load_vehicle("vis_r")
SETTINGS = replace(FlightSettings(), battery_unknown=True)
NEAR, SOON = 0.1, 0.1
"""How far from where it should be a vehicle may hover, m, and how soon a mode changes, s."""


def typed() -> tuple[str, ...]:
    """The lines that the guide has the reader type, without the last one, `save`."""
    block = (
        (DOCS / "hardware.md").read_text(encoding="utf-8").split("## Betaflight's settings")[1].split("| setting")[0]
    )
    lines = [line.split("#")[0].strip() for line in block.splitlines() if line.startswith("    ")]
    assert lines[-1] == "save"
    return tuple(lines[:-1])


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    """A controller that has the guide's lines, and what else the rig needs: gains, simulated sensors, FAILSAFE."""
    own = ("aux 3 27", "set p_", "set i_", "set d_", "set acc_calibration", "set small_angle")
    tuned = tuple(line for line in rig.SETTINGS if line.startswith(own))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rig, "SETTINGS", (*typed(), *tuned))
        with Rig(firmware_program.chosen(), tmp_path_factory.mktemp("guide"), VEHICLE, latency=0.05) as running:
            yield running


def test_a_controller_that_no_bridge_has_fed_is_not_to_be_armed_with_override_high(room: Rig) -> None:
    """Before the first frame since power-up: why the battery goes in with override low."""
    room.held = True
    room.set(armed=False, override=True)
    room.sleep(1.0)
    room.set(armed=True)
    room.sleep(0.3)
    races = float(room.sitl.motors().max()) > 0.8
    room.set(armed=False, override=False)
    room.sleep(SOON)
    assert not room.sitl.motors().any()  # the kill switch
    room.held = False
    release = room.sitl.firmware.release
    assert races or release is not firmware_program.PACKAGED
    assert not races or release.override_timeout is None  # later firmware hands such an override back


def test_without_the_transmitter_the_motors_stop_within_a_second(room: Rig) -> None:
    room.held = True
    room.set(armed=True)
    room.sleep(0.5)
    room.set(throttle=0.0)
    room.sleep(0.5)
    assert room.sitl.motors().min() == pytest.approx(0.5, abs=0.1)  # the stick in its middle
    room.heard = False
    room.sleep(1.0)
    assert not room.sitl.motors().any()
    room.heard = True
    room.sleep(1.0)
    assert not room.sitl.motors().any()  # until ARM was low
    room.set(armed=False, throttle=-1.0)
    room.sleep(1.0)
    room.held = False


@pytest.mark.whole
def test_the_first_flight_is_within_the_numbers_of_the_guide(room: Rig) -> None:
    session = Session(room, replace(SETTINGS, takeoff_height=0.6))
    rows = examine(session.autopilot.info, VEHICLE, SETTINGS)
    assert [row for row in rows if not row.good] == []  # the lines leave nothing to correct
    room.set(override=True, throttle=0.0)
    session.fly(1.0)
    assert session.bridge.flight.reasons == (Reason.NOT_ARMED,)
    room.set(armed=True)
    session.fly(0.5)
    assert session.bridge.flight.reasons == (Reason.WAITING,)
    start = room.state.position + np.array([0, 0, 0.6])
    room.set(mission="hover")
    assert session.fly(3.0, session.in_mode(Mode.HOVER))
    session.fly(2.0)
    assert _farthest(session, start, 1.0) < NEAR
    room.set(roll=1.0)  # reposition: a second of full stick
    session.fly(1.0)
    room.set(roll=0.0)
    session.fly(1.5)
    assert room.state.position - start == pytest.approx((0, -0.8, 0), abs=0.2)
    room.set(override=False, throttle=0.2)  # takeover
    assert session.fly(SOON, session.in_mode(Mode.PILOT))
    session.fly(0.3)
    left = np.array(room.state.position)
    room.set(override=True, throttle=0.0)
    assert session.fly(SOON, session.in_mode(Mode.HOVER))
    assert _farthest(session, left, 1.0) < NEAR
    room.set(mission="land")
    assert session.fly(5.0, session.in_mode(Mode.DONE))
    assert np.linalg.norm(room.state.position[:2] - left[:2]) < NEAR
    assert 0.8 < session.bridge.map.scale < 1.15
    room.set(armed=False)
    session.fly(0.3)
    room.set(override=False)
    session.close()


def _farthest(session: Session, place: np.ndarray, seconds: float) -> float:
    """The largest distance from a place in the next `seconds`, m."""
    begin = len(session.flown.position)
    session.fly(seconds)
    return float(np.linalg.norm(np.array(session.flown.position[begin:]) - place, axis=1).max())
