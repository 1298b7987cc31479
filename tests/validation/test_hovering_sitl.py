"""The hover controllers fly the real firmware: take-off, hover in wind, landing, by the bridge."""

from collections.abc import Iterator

import numpy as np
import pytest

from e2efly.flight.betaflight.autopilot import check_hover
from e2efly.flight.betaflight.client import SCHEDULE, Client
from e2efly.flight.betaflight.controller import identify
from e2efly.flight.betaflight.messages import MotorTelemetry
from e2efly.flight.link import open_link
from e2efly.flight.pilot.flight_state import Mode
from e2efly.flight.pilot.hovering import hover_controller
from e2efly.validation import firmware_program
from e2efly.validation.bridge_session import FlownSession, Session, rehearsal_settings
from e2efly.validation.rig import Rig
from e2efly.vehicles.loading import load_vehicle
from tests.validation.speeds import SpeedLink

VEHICLE, LATENCY = load_vehicle("vis_r"), 0.03
WIND = np.array([3.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    with Rig(firmware_program.chosen(), tmp_path_factory.mktemp("hovering"), VEHICLE, latency=LATENCY, seed=4) as rig:
        rig.sleep(0.5)
        yield rig


def error(flown: FlownSession, last: float) -> float:
    """Mean distance to the goal in the last `last` s of the hover, m."""
    steps = [i for i in flown.where(Mode.HOVER) if flown.time[i] >= flown.time[-1] - last]
    return float(np.mean([np.linalg.norm(flown.position[i] - flown.goal[i]) for i in steps]))


@pytest.mark.whole
@pytest.mark.parametrize("name", ["pid", "geometric", "indi", "mpc"])
def test_it_takes_off_holds_its_place_in_wind_and_lands(rig: Rig, name: str) -> None:
    rig.state, rig.wind = rig.world.at_rest(), np.zeros(3)
    link = open_link(rig.sitl.msp)
    settings, hover = rehearsal_settings(1.5), hover_controller(name, VEHICLE, LATENCY + 0.01)
    autopilot = rig.autopilot(settings, hover, link=SpeedLink(link, rig) if name == "indi" else link)
    session = Session(rig, settings, hover=hover, autopilot=autopilot)
    try:
        assert session.take_off(3.0), session.bridge.flight.reasons
        assert error(session.flown, 1.0) < 0.06
        rig.wind = WIND
        session.fly(8.0)
        assert session.bridge.flight.mode is Mode.HOVER, session.bridge.flight.reasons
        assert error(session.flown, 2.0) < 0.05
        assert session.bridge._hovering != session.bridge.hover.begin()
        if name == "indi":
            told = session.autopilot.client.message(MotorTelemetry.CODE, rig.now(), 0.1)
            assert told.speed == pytest.approx(np.asarray(rig.state.rotor_speed), rel=0.1)
        rig.wind = np.zeros(3)
        assert session.land(), session.bridge.flight.reasons
        assert session.bridge._hovering == session.bridge.hover.begin()  # of an earlier mode nothing is left
    finally:
        session.close()


def test_firmware_that_measures_no_speeds_is_refused_by_name(rig: Rig) -> None:
    client = Client(open_link(rig.sitl.msp), dict(SCHEDULE))
    try:
        info = identify(client, 3.0, clock=rig)
    finally:
        client.link.close()
    with pytest.raises(ValueError, match=r"--hover is 'indi', which needs the speeds of the rotors"):
        check_hover("indi", hover_controller("indi", VEHICLE, LATENCY), info)
