"""The filter through the real firmware: a commander that flies at the wall neither breaches the fence nor is ended."""

import dataclasses
import json
import math
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from e2efly.commands.fly_report import FlyReport, run
from e2efly.flight.pilot.flight_state import Mode, Reason
from e2efly.flight.settings import Fence
from e2efly.logs.telemetry import Telemetry
from e2efly.validation import firmware_program
from e2efly.validation.bridge_session import Session, rehearsal_settings
from e2efly.validation.rig import Rig
from e2efly.vehicles.gravity import GRAVITY
from tests.faults.commanders import VEHICLE, Commands, Field, at
from tests.flight.command_streams import Loopback

FENCE = Fence(low=(-2.5, -2.5, 0.4), high=(2.5, 2.5, 3.5), speed=5.0, tilt=1.2)
SETTINGS = dataclasses.replace(rehearsal_settings(1.5), fence=FENCE)
CENTRE = at(0.0, 0.0, 1.5)


def leaning(roll: float, pitch: float) -> Commands:
    thrust = GRAVITY / (math.cos(roll) * math.cos(pitch))
    return lambda _: {"mode": "attitude", "thrust": thrust, "attitude": [roll, pitch, 0.0]}


def falling(_: float) -> dict:
    return {"mode": "attitude", "thrust": 4.0, "attitude": [0.0, 0.0, 0.0]}


@pytest.fixture(scope="module", params=[True, False], ids=["filter", "switch"])
def field(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Field, Path]]:
    folder = tmp_path_factory.mktemp("filter")
    log = folder / "flight.mcap"
    with ExitStack() as open_:
        rig = Rig(firmware_program.chosen(), folder, VEHICLE, latency=0.05, seed=2)
        telemetry, link = open_.enter_context(Telemetry(log)), open_.enter_context(Loopback())
        open_.enter_context(rig)
        rig.sleep(0.5)
        flight = Field(rig, link, telemetry)
        flight.session.close()
        flight.session = Session(rig, SETTINGS, commands=link, log=telemetry, filtered=request.param)
        open_.callback(flight.session.close)
        assert flight.session.take_off(1.0)
        yield flight, log


@pytest.mark.whole
@pytest.mark.parametrize(
    "commands", [leaning(0.0, 0.6), leaning(-0.5, 0.0), falling], ids=["wall in x", "wall in y", "floor"]
)
def test_a_commander_that_flies_at_a_wall_is_kept_inside(field: tuple[Field, Path], commands: Commands) -> None:
    flight, _ = field
    session = flight.session
    flight.rig.set(mission="hover")
    session.fly(3.0)
    x, y, z = (float(p) for p in np.clip(flight.position, np.add(FENCE.low, 0.3), np.subtract(FENCE.high, 0.3)))
    flight.hand_over(at(x, y, z))
    flight.command(4.0, CENTRE)
    keeper = session.bridge.keeper
    if keeper is not None:
        assert keeper.change is None  # in the middle of the room nothing is changed
    begun, changed = len(session.flown.time), []

    def watched(time: float) -> dict:
        changed.append(keeper is not None and keeper.change is not None)
        return commands(time)

    flight.command(3.0, watched)
    places = np.array(session.flown.position[begun:])
    if keeper is None:
        assert flight.mode is Mode.HOVER
        assert flight.reasons[0].startswith((Reason.GUARD, Reason.OUTSIDE_FENCE, Reason.LOCKED))
        return
    assert flight.mode is Mode.POLICY, flight.reasons
    assert (places > FENCE.low).all() and (places < FENCE.high).all()
    assert (np.linalg.norm(session.flown.velocity[begun:], axis=1) < FENCE.speed).all()
    assert np.mean(changed[-100:]) > 0.3  # at the wall it lets one command pass and changes the next
    flight.command(4.0, CENTRE)  # and it flies on
    assert flight.mode is Mode.POLICY, flight.reasons
    assert np.linalg.norm(flight.position - [0.0, 0.0, 1.5]) < 0.3


@pytest.mark.whole
def test_the_report_shows_where_it_stepped_in(
    field: tuple[Field, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flight, log = field
    assert flight.session.land()
    assert run(FlyReport(log, out=tmp_path)) == 0
    found = json.loads((tmp_path / "summary.json").read_text())["filter"]
    if flight.session.bridge.keeper is None:
        assert found is None
        return
    assert {"x high", "y high", "floor"} <= {row["limit"] for row in found["stepped_in"]}
    assert 0 < found["commands"] < found["of"]
    assert "the filter changed" in capsys.readouterr().out
