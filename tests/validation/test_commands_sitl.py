"""A commander outside flies the real firmware in each of the five modes, and what goes wrong ends in HOVER."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from e2efly.flight.pilot.flight_state import Mode, Reason
from e2efly.logs.flight_log import read_log
from e2efly.logs.telemetry import Telemetry
from e2efly.validation import firmware_program
from e2efly.validation.rig import Rig
from e2efly.vehicles.gravity import GRAVITY
from tests.faults.commanders import FAULTS, HOME, STEP, TIMEOUT, VEHICLE, Field, at
from tests.flight.command_streams import Loopback


@pytest.fixture(scope="module")
def field(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Field]:
    folder = tmp_path_factory.mktemp("commands")
    rig = Rig(firmware_program.chosen(), folder, VEHICLE, latency=0.03, seed=4)
    with Telemetry(folder / "flight.mcap") as log, Loopback() as link, rig:
        rig.sleep(0.5)
        flight = Field(rig, link, log)
        try:
            assert flight.session.take_off(1.0)
            yield flight
            assert flight.session.land()
        finally:
            flight.session.close()
    read = read_log(folder / "flight.mcap")
    assert flight.flown
    assert {m["mode"] for m in read["commander"].values} >= flight.flown
    assert "policy: commander" in {m["source"] for m in read["command"].values}


def test_before_the_pilot_s_switch_nothing_is_commanded_and_without_commands_nothing_takes_over(field: Field) -> None:
    place = field.position
    field.command(0.5, at(2.0, 0.0, 2.0))
    assert field.mode is Mode.HOVER
    assert np.linalg.norm(field.position - place) < 0.1
    field.session.fly(0.5)
    field.rig.set(mission="policy")
    field.session.fly(0.5)
    assert field.mode is Mode.HOVER
    (reason,) = field.reasons
    assert reason.startswith("policy: no good command for 1.0")


@pytest.mark.whole
def test_positions_of_a_square_are_reached_with_their_heading(field: Field) -> None:
    field.hand_over(HOME)
    for x, y in ((0.6, 0.0), (0.6, 0.6), (0.0, 0.6), (0.0, 0.0)):
        field.command(4.0, at(x, y, 1.5, yaw=0.6))
        assert field.mode is Mode.POLICY, field.reasons
        assert np.linalg.norm(field.position - [x, y, 1.5]) < 0.1
        assert field.yaw == pytest.approx(0.6, abs=0.05)


def test_a_velocity_is_held_at_an_altitude_while_the_heading_turns(field: Field) -> None:
    field.hand_over(HOME)
    field.command(2.5, lambda _: {"mode": "velocity", "velocity": [0.5, -0.3], "altitude": 1.6})
    begun = field.yaw
    field.command(1.0, lambda _: {"mode": "velocity", "velocity": [0.5, -0.3], "altitude": 1.6, "yaw_rate": 0.5})
    assert field.mode is Mode.POLICY, field.reasons
    np.testing.assert_allclose(field.velocity, [0.5, -0.3, 0.0], atol=0.08)
    assert field.position[2] == pytest.approx(1.6, abs=0.08)
    assert math.remainder(field.yaw - begun, math.tau) == pytest.approx(0.5, abs=0.2)
    field.command(2.0, lambda _: {"mode": "velocity", "velocity": [-0.5, 0.3, -0.1]})
    np.testing.assert_allclose(field.velocity, [-0.5, 0.3, -0.1], atol=0.08)


def test_an_acceleration_changes_the_velocity_by_as_much(field: Field) -> None:
    field.hand_over(HOME)
    field.command(2.5, lambda _: {"mode": "velocity", "velocity": [0.0, 0.0, 0.0]})
    field.command(0.4, lambda _: {"mode": "acceleration", "acceleration": [1.0, 0.0, 0.0]})
    before = field.velocity
    field.command(0.8, lambda _: {"mode": "acceleration", "acceleration": [1.0, 0.0, 0.0]})
    np.testing.assert_allclose((field.velocity - before) / 0.8, [1.0, 0.0, 0.0], atol=0.25)


def test_an_attitude_is_held(field: Field) -> None:
    field.hand_over(HOME)
    field.command(1.2, lambda _: {"mode": "attitude", "thrust": GRAVITY, "attitude": [0.1, -0.05, 0.4]})
    assert field.mode is Mode.POLICY, field.reasons
    w, x, y, z = (float(q) for q in np.asarray(field.rig.state.quaternion))
    roll, pitch = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)), math.asin(2 * (w * y - z * x))
    assert (roll, pitch) == (pytest.approx(0.1, abs=0.03), pytest.approx(-0.05, abs=0.03))
    assert field.yaw == pytest.approx(0.4, abs=0.08)


def test_body_rates_are_flown(field: Field) -> None:
    field.hand_over(HOME)
    field.command(0.8, lambda _: {"mode": "ctbr", "thrust": GRAVITY, "body_rate": [0.0, 0.0, 1.0]})
    assert field.mode is Mode.POLICY, field.reasons
    np.testing.assert_allclose(np.asarray(field.rig.state.body_rate), [0.0, 0.0, 1.0], atol=0.2)
    field.command(0.3, lambda _: {"mode": "ctbr", "thrust": GRAVITY, "body_rate": [0.5, 0.0, 0.0]})
    assert float(np.asarray(field.rig.state.body_rate)[0]) == pytest.approx(0.5, abs=0.2)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("fault", FAULTS)
def test_a_faulty_commander_ends_in_hover_within_the_time_out_and_moves_nothing(field: Field, fault: str) -> None:
    commands, reason = FAULTS[fault]
    hold = at(*field.rest())
    field.hand_over(hold)
    place, refused = field.position, field.stream.refused
    assert field.strike(fault) <= TIMEOUT + 2 * STEP + 1e-6
    assert field.mode is Mode.HOVER
    (said,) = field.reasons
    assert said.startswith(f"{Reason.POLICY}: no good command")
    assert reason in said
    assert (field.stream.refused > refused) == (commands is not None and fault != "late")
    field.command(1.0, hold)  # good again: the switch must be moved first
    assert field.mode is Mode.HOVER
    assert field.reasons[0] == Reason.LOCKED
    assert np.linalg.norm(field.position - place) < 0.3


@pytest.mark.whole
def test_the_fence_and_the_sticks_end_it_as_they_end_a_policy(field: Field) -> None:
    field.hand_over(HOME)
    field.rig.set(roll=0.5)
    field.command(0.2, HOME)
    assert field.mode is Mode.HOVER
    assert any(reason.startswith(Reason.STICK_INPUT) for reason in field.reasons)
    field.rig.set(roll=0.0)
    field.hand_over(HOME)
    field.command(6.0, lambda _: {"mode": "velocity", "velocity": [0.0, 0.0, -1.5]})
    assert field.mode is Mode.HOVER
    assert field.position[2] > 0.1
    ends = [why for _, mode, why in field.session.flown.changes if mode == Mode.HOVER]
    assert ends[-1][0].startswith(Reason.GUARD)
