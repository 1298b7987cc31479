"""Flights of a bridge over MAVLink: PX4 and ArduCopter as they are documented, over our rigid body."""

import contextlib
import dataclasses
import functools
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from e2efly.commands.fly import Fly
from e2efly.commands.fly import run as fly_command
from e2efly.flight.autopilots import open_autopilot
from e2efly.flight.link import open_link
from e2efly.flight.mavlink.copter_gains import NAMES, copter_gains, gain_rows
from e2efly.flight.mavlink.dialect import ARDUPILOT, PX4, MavlinkDialect, dialect_of, release_row
from e2efly.flight.mavlink.mavlink import Mavlink
from e2efly.flight.pilot.hovering import hover_controller
from e2efly.flight.row import problems
from e2efly.flight.settings import FlightSettings
from e2efly.policy.loader import load_policy
from e2efly.validation.bridge_session import Session, rehearsal_settings
from e2efly.validation.rehearsal import LINK_S, whole_course, whole_flight
from e2efly.vehicles.loading import load_vehicle
from tests.flight.mavlink_peer import COPTER_VALUES, PX4_VALUES, MavlinkRig
from tests.validation.link_faults import Fault, flown
from tests.validation.mavlink_faults import FAULTS

VEHICLE = load_vehicle("vis_r")
KINDS = ("px4", "copter")
SETTINGS = dataclasses.replace(rehearsal_settings(1.2), battery_unknown=False)
WRONG = {
    "COM_OF_LOSS_T": 1.0, "COM_OBL_RC_ACT": 0, "NAV_RCL_ACT": 2, "COM_RCL_EXCEPT": 4, "COM_RC_IN_MODE": 4,
    "MAV_FWDEXTSP": 0, "MC_AIRMODE": 0, "MC_BAT_SCALE_EN": 1, "THR_MDL_FAC": 1.5, "BAT1_N_CELLS": 0,
    "GUID_OPTIONS": 8, "ATC_RATE_FF_ENAB": 0, "GUID_TIMEOUT": 3.0,
    "FS_GCS_ENABLE": 0, "FS_GCS_TIMEOUT": 10.0, "FS_THR_ENABLE": 1,
    "FS_OPTIONS": 4, "ATC_ANGLE_BOOST": 1, "PILOT_THR_FILT": 1.0, "MOT_THST_EXPO": -0.5, "MOT_BAT_VOLT_MAX": 16.8,
    "ATC_ACCEL_R_MAX": 1100, "ATC_ACCEL_P_MAX": 1100, "ATC_ACCEL_Y_MAX": 270,
}  # fmt: skip
"""Defaults, as far as they forbid a flight, and other values that do."""


@pytest.fixture(params=KINDS)
def rig(request: pytest.FixtureRequest) -> MavlinkRig:
    return MavlinkRig(request.param, VEHICLE, latency=0.02, seed=1)


def hovering(rig: MavlinkRig) -> Session:
    session = Session(rig, SETTINGS, hover=hover_controller("geometric", VEHICLE, 0.03))
    assert problems(session.autopilot.check(VEHICLE, SETTINGS, None)) == ()
    assert session.take_off(2.0), session.bridge.flight.reasons
    return session


def test_it_takes_off_holds_its_place_and_lands(rig: MavlinkRig) -> None:
    session = hovering(rig)
    session.fly(3.0)
    target = session.bridge.flight.target
    assert target is not None
    assert np.linalg.norm(np.subtract(target.position, rig.state.position)) < 0.02
    assert session.bridge.map.scale == pytest.approx(1.0, abs=0.01)  # the curve of thrust is inverted
    assert session.bridge.inputs.voltage == pytest.approx(15.6 / 4)
    assert session.bridge.estimate.inertial.scale.value == pytest.approx(1.0, abs=0.02)
    assert session.land(), session.bridge.flight.reasons
    assert rig.log[-1] == "disarmed" and not any("failsafe" in line for line in rig.log)
    assert (rig.poses_seen > 300) is rig.px4  # its estimator wants them; ArduCopter's VISO_TYPE is 0


@pytest.mark.whole
@pytest.mark.parametrize(("kind", "name"), [("px4", "race"), ("copter", "land")])
def test_a_policy_flies_its_whole_flight(kind: str, name: str) -> None:
    policy = load_policy(name)
    rig = MavlinkRig(kind, VEHICLE, latency=max(policy.contract.latency_of(VEHICLE) - LINK_S, 0.0), seed=1)
    flight = whole_flight(rig, policy, whole_course(policy, VEHICLE), 3, None, [], None)
    assert flight.complete and flight.success, (flight.told, flight.reasons)


@pytest.mark.parametrize("fault", FAULTS[:1])
def test_when_the_process_dies_the_autopilot_lands(rig: MavlinkRig, fault: Fault) -> None:
    end = flown(rig, hovering(rig), fault)
    assert end.good, end.told


@pytest.mark.whole
@pytest.mark.parametrize("i", range(1, len(FAULTS)), ids=lambda i: FAULTS[i].name)
def test_a_fault_ends_as_documented(i: int) -> None:
    """On one of the two autopilots each; `benchmarks/mavlink.py` flies all on both."""
    rig = MavlinkRig(KINDS[i % 2], VEHICLE, latency=0.02, seed=1)
    end = flown(rig, hovering(rig), FAULTS[i])
    assert end.good, end.told


def test_without_the_failsafe_the_vehicle_would_stay_in_the_air() -> None:
    """What `check` refuses is what keeps it up: the judge can tell."""
    rig = MavlinkRig("copter", VEHICLE, latency=0.02, values={"FS_GCS_ENABLE": 0})
    session = Session(rig, SETTINGS, hover=hover_controller("geometric", VEHICLE, 0.03))
    said = problems(session.autopilot.check(VEHICLE, SETTINGS, None))
    assert any("FS_GCS_ENABLE is 0: nothing" in line for line in said)
    assert session.take_off(1.0)
    assert not flown(rig, session, FAULTS[0]).good


@pytest.mark.parametrize(("dialect", "values"), [(PX4, PX4_VALUES), (ARDUPILOT, COPTER_VALUES)])
def test_each_parameter_that_would_harm_is_named_with_its_line(
    dialect: MavlinkDialect, values: dict[str, float]
) -> None:
    assert all(need.row(values).good for need in dialect.needs)
    judged = [need for need in dialect.needs if need.name in WRONG]
    assert len(judged) >= len(dialect.needs) - 1
    for need in judged:
        row = need.row(values | {need.name: WRONG[need.name]})
        assert not row.good and row.setting == need.name
        if need.mend:
            assert row.mend == (f"param set {need.name} {need.mend}",)
            assert need.row(values | {need.name: float(need.mend)}).good
        missing = need.row({name: value for name, value in values.items() if name != need.name})
        assert missing.good is need.optional and "not told" in missing.value


@pytest.mark.parametrize("values", [{"GUID_OPTIONS": 8}, {"RC_OPTIONS": 32}])
def test_arducopter_is_armed_in_its_mode_only_if_two_options_allow_it(values: dict[str, float]) -> None:
    """As ArduCopter 4.6.3 did; with RC_OPTIONS 32, the throttle stick has to be low."""
    rig = MavlinkRig("copter", VEHICLE, latency=0.02, values=values)
    session = Session(rig, SETTINGS, hover=hover_controller("geometric", VEHICLE, 0.03))
    rig.set(override=True)
    session.fly(0.3)
    rig.set(armed=True)
    session.fly(0.5)
    assert not rig.armed
    rig.set(armed=False, throttle=-1.0)
    session.fly(0.3)
    rig.set(armed=True)
    session.fly(0.5)
    assert rig.armed is ("RC_OPTIONS" in values)


def test_what_its_estimator_and_its_rate_loop_lack_is_shown_and_forbids_nothing() -> None:
    told = dict(COPTER_VALUES) | copter_gains(VEHICLE)
    rows = gain_rows(VEHICLE, told)
    assert set(copter_gains(VEHICLE)) == set(NAMES)
    assert all(row.good and row.told for row in rows)
    slow = {row.setting: row for row in gain_rows(VEHICLE, told | {"ATC_RAT_PIT_P": 0.135, "INS_GYRO_FILTER": 20})}
    look = [name for name, row in slow.items() if not row.told]
    assert look == ["ATC_RAT_PIT_P, ATC_RAT_PIT_I, ATC_RAT_PIT_D", "INS_GYRO_FILTER"]
    assert slow["INS_GYRO_FILTER"].mend == ("param set INS_GYRO_FILTER 80",) and problems(slow.values()) == ()
    row = ARDUPILOT.poses_row(told | {"VISO_TYPE": 1, "EK3_SRC1_POSXY": 6, "EK3_SRC1_VELXY": 6, "EK3_SRC1_YAW": 1})
    assert row.good and not row.told and row.mend[-1] == "param set EK3_SRC1_YAW 6" and len(row.mend) == 3
    assert PX4.poses_row(PX4_VALUES).told and "drifts" in ARDUPILOT.poses_row(told).value


def test_unknown_versions_and_autopilots_are_refused_by_name(rig: MavlinkRig) -> None:
    assert problems([release_row(PX4, (1, 12, 3))]) == ("firmware is PX4 1.12.3; needed: PX4 1.14 to 1.16",)
    assert problems([release_row(ARDUPILOT, (4, 5, 0))]) == ()
    with pytest.raises(ValueError, match=r"HEARTBEAT tells number 4; accepted: 12 \(PX4\), 3 \(ArduCopter\)"):
        dialect_of(4)
    rig.wire.down = False
    with pytest.raises(TimeoutError, match=r"no heartbeat of an autopilot within 0.5 s; accepted: MAVLink 2"):
        Mavlink.connect(rig.wire, FlightSettings(), 0.5, rig)


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def served() -> Iterator[int]:
    """PX4 in real time, which sends to the port of this machine that is given."""
    rig, ended = MavlinkRig("px4", VEHICLE), threading.Event()
    port = free_port()

    def run() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
            line.bind(("127.0.0.1", 0))
            line.connect(("127.0.0.1", port))
            line.setblocking(False)
            rig.wire.delay, start = 0.0, time.monotonic()
            while not ended.wait(0.002):
                with contextlib.suppress(OSError):  # nobody listens yet, or nothing came
                    rig.wire.send(line.recv(65536))
                rig.sleep(max(time.monotonic() - start - (rig.time - 1.0), 0.0))
                if data := rig.wire.receive():
                    with contextlib.suppress(OSError):
                        line.send(data)

    thread = threading.Thread(target=run)
    thread.start()
    yield port
    ended.set()
    thread.join()


def test_over_udp_the_check_lists_what_matters(served: int, capsys: pytest.CaptureFixture[str]) -> None:
    link = f"mavlink:udp:127.0.0.1:{served}"
    code = fly_command(Fly(vehicle="vis_r", link=link, pose=f"udp:{free_port()}", check=True))
    told = capsys.readouterr().out
    assert code == 1  # there are no poses
    for words in ("PX4 1.15.4", "COM_OBL_RC_ACT", "4: Land", "EKF2_EV_CTRL 15", "3.90 V per cell", "mission low"):
        assert words in told, told


def test_a_datagram_port_hears_the_first_that_sends_alone() -> None:
    port = free_port()
    link = open_link(f"udp:127.0.0.1:{port}")
    link.poll(0.0)
    assert not link.alive
    datagrams = socket.AF_INET, socket.SOCK_DGRAM
    with socket.socket(*datagrams) as first, socket.socket(*datagrams) as other:
        first.settimeout(5.0)
        first.sendto(b"one", ("127.0.0.1", port))
        time.sleep(0.05)
        link.poll(0.1)
        assert link.alive and link.receive() == b"one"
        other.sendto(b"two", ("127.0.0.1", port))
        first.sendto(b"three", ("127.0.0.1", port))
        time.sleep(0.05)
        assert link.receive() == b"three"
        link.send(b"back")
        assert first.recv(100) == b"back"
    link.close()


OWN = """
from e2efly.flight.mavlink.mavlink import Mavlink
from e2efly.flight.mavlink.station import Station
from tests.validation.test_mavlink import bench


class Own(Mavlink):
    def __init__(self, text, settings):
        super().__init__(Station(bench().wire), settings, bench())


class Half:
    def __init__(self, text, settings):
        self.text = text
"""


@functools.cache
def bench() -> MavlinkRig:
    return MavlinkRig("px4", VEHICLE)


def test_an_autopilot_of_ones_own_is_a_reference_to_a_file(tmp_path: Path) -> None:
    file, hover = tmp_path / "own.py", ("geometric", hover_controller("geometric", VEHICLE, 0.03))
    file.write_text(OWN)
    own, watchdog = open_autopilot(f"{file}:Own:text", VEHICLE, SETTINGS, hover, watched=True, excited=False)
    assert watchdog is None and own.versions["firmware"] == "PX4 1.15.4"
    with pytest.raises(ValueError, match=r"Half has no versions, .* accepted: all of versions"):
        open_autopilot(f"{file}:Half", VEHICLE, SETTINGS, hover, watched=True, excited=False)
