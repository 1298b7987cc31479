"""Flights of a bridge with a Crazyflie: its firmware as it is documented, over our rigid body."""

import contextlib
import dataclasses
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from typing import Any

import numpy as np
import pytest

from e2efly.commands.fly import Fly
from e2efly.commands.fly import run as fly_command
from e2efly.flight.crazyflie.crazyflie_autopilot import Crazyflie
from e2efly.flight.crazyflie.crazyflie_needs import NEEDS
from e2efly.flight.pilot.flight_state import Mode, Reason
from e2efly.flight.pilot.hovering import hover_controller
from e2efly.flight.row import problems
from e2efly.policy.loader import load_policy
from e2efly.validation.bridge_session import Session, rehearsal_settings
from e2efly.validation.rehearsal import LINK_S, parked, whole_course, whole_flight
from e2efly.vehicles.loading import load_vehicle
from tests.faults.fault_run import TOUCH_SPEED
from tests.flight.crazyflie_peer import PARAMETERS, CrazyflieRig
from tests.flight.peer_rig import STEP_S
from tests.validation.crazyflie_faults import FAULTS
from tests.validation.link_faults import FaultEnd, flown
from tests.waiting import free_port

VEHICLE = load_vehicle("crazyflie")
SETTINGS = dataclasses.replace(rehearsal_settings(1.0), battery_unknown=False)
WRONG = {
    "stabilizer.controller": 2, "stabilizer.estimator": 0, "stabilizer.stop": 1, "supervisor.prefltTimeout": 1000,
    "locSrv.extPosStdDev": 0.5, "locSrv.extQuatStdDev": 0.0,
}  # fmt: skip


def hovering(rig: CrazyflieRig, seconds: float = 1.0) -> Session:
    session = Session(rig, SETTINGS, hover=hover_controller("geometric", VEHICLE, 0.03))
    assert problems(session.autopilot.check(VEHICLE, SETTINGS, None)) == ()
    assert session.take_off(seconds), session.bridge.flight.reasons
    return session


def test_it_takes_off_holds_its_place_and_lands() -> None:
    rig = CrazyflieRig(VEHICLE, latency=0.02, seed=1)
    session = hovering(rig, 2.0)
    session.fly(3.0)
    target = session.bridge.flight.target
    assert target is not None
    assert np.linalg.norm(np.subtract(target.position, rig.state.position)) < 0.02
    assert session.bridge.map.scale == pytest.approx(1.0, abs=0.05)  # thrust is linear in what is sent
    assert session.bridge.inputs.voltage == pytest.approx(3.95)
    assert session.bridge.estimate.inertial.scale.value == pytest.approx(1.0, abs=0.02)
    assert rig.poses_seen > 300 and rig.pose_seen is not None
    assert rig.pose_seen[:3] == pytest.approx(rig.state.position, abs=0.05)
    assert rig.pose_seen[6] == pytest.approx(1.0, abs=0.01)  # w is the last
    assert session.land(), session.bridge.flight.reasons
    assert rig.log == ["flying"] and session.bridge.flight.mode is Mode.INIT


def test_a_platform_that_must_be_armed_is_armed_by_the_pilots_word_alone() -> None:
    rig = CrazyflieRig(VEHICLE, latency=0.02, needs_arming=True, protocol=11, values={"supervisor.prefltTimeout": 5000})
    session = Session(rig, SETTINGS, hover=hover_controller("geometric", VEHICLE, 0.03))
    session.fly(1.0)
    assert rig.supervisor == "passed" and Reason.NOT_ARMED in session.bridge.flight.reasons
    rig.set(armed=True)
    session.fly(0.5)
    assert rig.supervisor == "ready" and session.bridge.flight.reasons == (Reason.WAITING,)
    session.fly(6.0)  # no take-off follows: it disarms itself, and is not armed again by the same word
    assert rig.supervisor == "passed" and not session.bridge.inputs.armed
    rig.set(armed=False)
    session.fly(0.2)
    assert session.take_off(1.0), session.bridge.flight.reasons
    assert session.land() and rig.supervisor == "passed"


def test_nothing_turns_before_the_pilot_says_so() -> None:
    rig = CrazyflieRig(VEHICLE)
    autopilot = rig.autopilot(SETTINGS)
    rig.set(mission="hover")
    for _ in range(50):
        rig.sleep(0.01)
        autopilot.poll(rig.now())
        assert not autopilot.read(rig.now(), land=False, sends=True, grounded=True).armed
        autopilot.send(rig.now(), 0.6, (0.0, 0.0, 0.0))
    assert rig.supervisor == "ready" and rig.standing
    with pytest.raises(ValueError, match=r"accepted: finite numbers"):
        autopilot.send(rig.now(), float("nan"), (0.0, 0.0, 0.0))


@pytest.mark.whole
@pytest.mark.parametrize("name", ["hover", "land", "race", "gap"])
def test_a_policy_flies_its_whole_flight(name: str) -> None:
    policy = load_policy(f"crazyflie/{name}")
    rig = CrazyflieRig(VEHICLE, latency=max(policy.contract.latency_of(VEHICLE) - LINK_S, 0.0), seed=3)
    flight = whole_flight(rig, policy, whole_course(policy, VEHICLE), 3, None, [], None)
    assert flight.complete and flight.success, (flight.told, flight.reasons)


def struck(fault: str, **rig_is: Any) -> tuple[CrazyflieRig, FaultEnd]:
    """Fly into a fault by its name."""
    (known,) = (one for one in FAULTS if one.name == fault)
    with closing(hovering(CrazyflieRig(VEHICLE, latency=0.02, seed=1, watched=known.watched, **rig_is))) as session:
        rig: Any = session.rig
        return rig, flown(rig, session, known)


def test_when_the_process_dies_it_is_landed_for() -> None:
    rig, end = struck("the bridge's process dies")
    assert end.good, end.told
    assert rig.log == ["flying", "failsafe: landing", "landed", "ready"]


def test_without_a_watchdog_it_levels_and_falls() -> None:
    """This is what the firmware does. The check says so, and nothing here softens it."""
    rig, end = struck("without a watchdog, the process dies")
    assert end.good, end.told
    assert rig.log == ["flying", "failsafe: set-points", "level", "locked"]


@pytest.mark.whole
@pytest.mark.parametrize("fault", [fault.name for fault in FAULTS])
def test_a_fault_ends_as_documented(fault: str) -> None:
    _, end = struck(fault)
    assert end.good, end.told


def test_one_that_knows_no_position_is_landed_level_where_it_drifts_to() -> None:
    rig, end = struck("the bridge's process dies", values={"stabilizer.estimator": 1})
    assert end.good, end.told
    assert rig.poses_seen == 0


def test_a_landing_is_asked_for_until_it_is_answered_and_on_the_ground_never() -> None:
    """Handed over without a landing, the high-level commander would stop the motors in the air."""
    rig = CrazyflieRig(VEHICLE, latency=0.02, seed=1, watched=True)
    with closing(hovering(rig)) as session:
        rig.plan(session.bridge)
        rig.wire.down = False
        rig.sleep(0.4)
        assert "failsafe: landing" in rig.log and rig._streamed  # no answer: set-points keep their priority
        rig.wire.down = True
        rig.sleep(0.1)
        assert not rig._streamed
        rig.sleep(10.0)
        assert rig.standing and rig.log[-1] == "ready" and "locked" not in rig.log
    rig = CrazyflieRig(VEHICLE, latency=0.02, seed=1, watched=True)
    with closing(Session(rig, SETTINGS, hover=hover_controller("geometric", VEHICLE, 0.03))) as session:
        rig.set(armed=True)
        session.fly(0.5)
        assert session.bridge.inputs.armed
        rig.plan(session.bridge)
        rig.sleep(3.0)
        assert rig.standing and "failsafe: landing" not in rig.log


@pytest.mark.whole
def test_one_that_races_is_landed_through_a_radio_that_loses_packets() -> None:
    policy = load_policy("crazyflie/race")
    course = whole_course(policy, VEHICLE)
    rig = CrazyflieRig(VEHICLE, latency=0.02, seed=3, watched=True)
    rig.state = parked(rig.world, course, 3)
    hover = hover_controller("geometric", VEHICLE, 0.03)
    with closing(Session(rig, SETTINGS, policy=policy, course=course, hover=hover)) as session:
        assert session.take_off(1.0), session.bridge.flight.reasons
        rig.set(mission="policy")
        session.fly(3.0)
        rig.plan(session.bridge)
        assert np.linalg.norm(rig.state.velocity) > 1.5 and session.bridge.flight.mode is Mode.POLICY
        rig.wire.loss = 0.3
        fastest = 0.0
        for _ in range(8000):
            if not rig.standing:
                fastest = -float(rig.state.velocity[2])
            rig.sleep(STEP_S)
        assert rig.standing and fastest < TOUCH_SPEED
        assert rig.log[1:] == ["failsafe: landing", "landed", "ready"]


def test_each_parameter_that_would_harm_is_named() -> None:
    usual = {name: value for name, (_, value) in PARAMETERS.items()}
    assert all(need.row(usual).good for need in NEEDS)
    for name, value in WRONG.items():
        (need,) = (need for need in NEEDS if need.name == name)
        assert not need.row(usual | {name: value}).good
        missing = need.row({other: was for other, was in usual.items() if other != name})
        assert missing.good is need.optional and missing.value == "not told"


def test_old_and_silent_ones_are_refused_by_name() -> None:
    with pytest.raises(ValueError, match=r"speaks CRTP 9; accepted: 10 or later \(firmware 2025.09\)"):
        CrazyflieRig(VEHICLE, protocol=9).autopilot(SETTINGS)
    newer = CrazyflieRig(VEHICLE, protocol=13).autopilot(SETTINGS)
    said = problems(newer.check(VEHICLE, SETTINGS, None))
    assert said == ("firmware is Crazyflie 2.1 2026.08, CRTP 13; needed: CRTP 10 to 12 (firmware 2025.09 to 2026.08)",)
    rig = CrazyflieRig(VEHICLE)
    rig.wire.down = False
    with pytest.raises(TimeoutError, match=r"no answer within 0.5 s; accepted: firmware 2025.09"):
        Crazyflie.connect(rig.wire, VEHICLE, SETTINGS, rig.wish, 0.5, rig)


def test_tables_are_read_through_a_radio_that_loses_packets() -> None:
    rig = CrazyflieRig(VEHICLE)
    rig.wire.loss = 0.4
    autopilot = rig.autopilot(SETTINGS)
    assert problems(autopilot.check(VEHICLE, SETTINGS, None)) == ()


@pytest.fixture
def served() -> Iterator[int]:
    """A Crazyflie in real time behind UDP, one packet in each datagram."""
    rig, ended = CrazyflieRig(VEHICLE), threading.Event()
    line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    line.bind(("127.0.0.1", 0))
    line.setblocking(False)

    def run() -> None:
        rig.wire.delay, start, peer = 0.0, time.monotonic(), None
        while not ended.wait(0.002):
            with contextlib.suppress(OSError):  # nothing more came
                while True:
                    data, peer = line.recvfrom(64)
                    rig.wire.send(bytes([len(data)]) + data)
            rig.sleep(max(time.monotonic() - start - (rig.time - 1.0), 0.0))
            told = rig.wire.receive()
            while told and peer is not None:
                packet, told = told[1 : 1 + told[0]], told[1 + told[0] :]
                with contextlib.suppress(OSError):
                    line.sendto(packet, peer)

    thread = threading.Thread(target=run)
    thread.start()
    yield int(line.getsockname()[1])
    ended.set()
    thread.join()
    line.close()


def test_over_udp_the_check_lists_what_matters(served: int, capsys: pytest.CaptureFixture[str]) -> None:
    link = f"crazyflie:udp:127.0.0.1:{served}"
    code = fly_command(Fly(vehicle="crazyflie", link=link, pose=f"udp:{free_port()}", check=True))
    told = capsys.readouterr().out
    assert code == 1  # there are no poses
    for words in (
        "Crazyflie 2.1 2026.08, CRTP 12", "motors stop and it falls", "has the firmware land it", "1: PID",
        "3.95 V per cell",
    ):  # fmt: skip
        assert words in told, told


def test_a_hover_that_needs_the_speeds_of_the_rotors_is_refused(served: int) -> None:
    with pytest.raises(ValueError, match=r"a Crazyflie tells none; accepted: geometric, mpc or pid"):
        fly_command(Fly(vehicle="crazyflie", link=f"crazyflie:udp:127.0.0.1:{served}", hover="indi", check=True))
