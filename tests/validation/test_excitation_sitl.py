"""The excitation flight through the real firmware, on a body that is not the file's; what identification sees."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from e2efly.alignment.alignment import align
from e2efly.alignment.checks import checked
from e2efly.alignment.identification import driver_of
from e2efly.commands.align import pose_delay_of
from e2efly.flight.betaflight.autopilot import EXCITATION_SCHEDULE
from e2efly.flight.excitation import ExcitationOptions, InPlace, StepsOptions, excitation
from e2efly.flight.pilot.fence import fence_problem
from e2efly.flight.pilot.flight_state import Mission, Mode, Reason
from e2efly.flight.settings import Fence
from e2efly.logs.blackbox import read_blackbox
from e2efly.logs.blackbox_merge import setpoint_delay, with_blackboxes
from e2efly.logs.readers import read_flights
from e2efly.logs.telemetry import Telemetry
from e2efly.validation import firmware_program
from e2efly.validation.bridge_session import Session, rehearsal_settings
from e2efly.validation.rig import Rig
from e2efly.vehicles.loading import load_vehicle
from tests.validation.firmware_excitation import Excited, fly_excited

FILE = load_vehicle("vis_r")
BODY = dataclasses.replace(FILE, mass=0.85, inertia=FILE.inertia * 1.2, motor_time_constant=0.045, latency=0.05)
SETTINGS = dataclasses.replace(rehearsal_settings(1.2), fence=Fence(low=(-4.0, -4.0, 0.2), high=(4.0, 4.0, 4.5)))
SHORT = ExcitationOptions(seconds=10.0)


def flown(log: Path, options: InPlace) -> Excited:
    """A complete flight, with its log and its blackbox."""
    with Telemetry(log) as telemetry:
        flight = fly_excited(
            firmware_program.chosen(), FILE, BODY, SETTINGS, options=options, log=telemetry, folder=log.parent,
            blackbox=True,
        )  # fmt: skip
    assert flight.complete
    return flight


@pytest.mark.whole
def test_it_ends_by_itself_and_its_log_and_blackbox_are_read_together(tmp_path: Path) -> None:
    log = tmp_path / "flight.mcap"
    flight = flown(log, SHORT)
    changes = {mode: (at, reasons) for at, mode, reasons in flight.flown.changes}
    begun = changes["policy"][0]
    (ended,) = [at for at, mode, reasons in flight.flown.changes if Reason.POLICY_DONE in reasons]
    assert ended - begun == pytest.approx(SHORT.seconds, abs=0.05)
    steps = flight.flown.where(Mode.POLICY)
    assert np.all(np.abs(np.array(flight.flown.position)[steps, :2]) < 4.0)
    # as it is: motor outputs, too few for torques, drive the simulation, and the delay shows
    alone = checked(read_flights(log), BODY)
    assert driver_of(alone) == "motor_and_rate"
    assert flight.blackbox is not None
    boxes = read_flights(flight.blackbox)
    (whole,) = checked(with_blackboxes([*read_flights(log), *boxes]), BODY)
    assert driver_of([whole]) == "motor"
    assert whole.streams["motor"].rate == pytest.approx(1000, rel=0.05)
    (exact,) = with_blackboxes([flight.truth, *boxes])
    link, age = setpoint_delay(exact), flight.truth.pose_age
    assert link is not None
    assert age is not None
    assert age == pytest.approx(BODY.latency - 0.01, abs=0.006)
    for record in (alone[0], whole):
        late = setpoint_delay(record)
        assert late is not None
        assert record.pose_age is not None
        assert late + record.pose_age == pytest.approx(link + age, abs=0.006)


@pytest.mark.whole
def test_the_pilots_switch_ends_it_at_once(tmp_path: Path) -> None:
    acts, course = excitation(FILE, SETTINGS, SHORT)
    with Rig(firmware_program.chosen(), tmp_path, FILE, latency=0.03) as rig:
        rig.sleep(0.5)
        autopilot = rig.autopilot(SETTINGS, schedule=EXCITATION_SCHEDULE)
        session = Session(rig, SETTINGS, policy=acts, course=course, autopilot=autopilot)
        try:
            assert session.take_off(1.0)
            rig.set(mission="policy")
            assert session.fly(0.5, session.in_mode(Mode.POLICY))
            assert not session.fly(2.0, session.in_mode(Mode.HOVER, Mode.LAND))
            rig.set(mission="hover")
            bridge = session.bridge
            while bridge.inputs.pilot is not None and bridge.inputs.pilot.mission is Mission.POLICY:
                assert bridge.flight.mode is Mode.POLICY
                session.step()
            assert bridge.flight.mode is Mode.HOVER  # in the very step that heard it
            assert bridge.sent.source == "hover"
            session.fly(2.0)
            assert bridge.odometry is not None
            assert fence_problem(SETTINGS.fence, bridge.odometry) is None
            assert session.land()
        finally:
            session.close()


@pytest.mark.whole
def test_steps_are_flown_and_aligned_by_the_log_of_the_bridge_alone(tmp_path: Path) -> None:
    """The delay by the rig's clock within 3 ms, the motor lag within its sigma; the blackbox has the loop's terms."""
    log = tmp_path / "flight.mcap"
    flight = flown(log, StepsOptions(count=2))
    assert flight.blackbox is not None
    (exact,) = with_blackboxes([flight.truth, *read_flights(flight.blackbox)])
    link, age = setpoint_delay(exact), flight.truth.pose_age
    assert link is not None
    assert age is not None
    records = checked(read_flights(log), FILE)
    found = align(FILE, records, pose_delay_of(None, records)[0])
    assert found.measured
    values = {e.name: e for e in found.estimates}
    assert float(values["latency"].value) == pytest.approx(link + age, abs=0.003)
    lag = values["motor_time_constant"]
    assert abs(float(lag.value) - BODY.motor_time_constant) < 2.5 * float(lag.sigma) < 0.4 * BODY.motor_time_constant
    assert found.after["roll_rate"] + found.after["pitch_rate"] < found.before["roll_rate"] + found.before["pitch_rate"]
    (box,) = read_blackbox(flight.blackbox, tuning=True)
    assert set(box.terms) >= {"P", "I", "D"}
    assert box.unfiltered is not None
