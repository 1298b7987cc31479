"""The rig itself: the real firmware, its world and its virtual time."""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from e2efly.flight.betaflight.client import SCHEDULE, Client
from e2efly.flight.betaflight.controller import ControllerInfo, identify
from e2efly.flight.betaflight.messages import AttitudeReply, Rc, StatusEx, set_raw_rc
from e2efly.flight.betaflight.sticks import Sticks, sticks_of
from e2efly.flight.link import open_link
from e2efly.flight.pilot.throttle_map import ThrottleMap
from e2efly.validation import firmware_program
from e2efly.validation.rig import Rig
from e2efly.validation.world import FlownBody
from e2efly.vehicles.loading import load_vehicle

VEHICLE = load_vehicle("vis_r")
ARM, ANGLE = 0, 1
REAR_RIGHT, FRONT_RIGHT, REAR_LEFT, FRONT_LEFT = range(4)


class Bench:
    """The firmware under MSP override, and the hand that moves its sticks."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.client = Client(open_link(rig.sitl.msp), dict(SCHEDULE))
        self.info: ControllerInfo = identify(self.client, 3.0, clock=rig)
        self.sticks: Sticks = sticks_of(self.info)

    def send(self, seconds: float, throttle: float | None, rates: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
        """Sticks at 100 Hz; throttle None: closed."""
        mid = self.sticks.centre
        channels = self.sticks.arrange((mid, mid, mid, 1000), ())
        if throttle is not None:
            channels = self.sticks.channels_of(throttle, rates, ()).channels
        for _ in range(round(seconds / 0.01)):
            self.rig.sleep(0.01)
            self.client.poll(self.rig.now())
            self.client.set_raw_rc(set_raw_rc(channels), self.rig.now())

    def listen(self, seconds: float) -> None:
        """Ask and send no sticks."""
        for _ in range(round(seconds / 0.01)):
            self.rig.sleep(0.01)
            self.client.poll(self.rig.now())

    def arm(self) -> None:
        """Hand over, and arm."""
        self.rig.set(override=True)
        self.send(0.3, None)
        self.rig.set(armed=True)
        self.send(0.5, None)

    def said(self, kind: type) -> object:
        message = self.client.message(kind.CODE, self.rig.now(), 0.2)  # type: ignore[attr-defined]
        assert message is not None
        return message

    @property
    def armed(self) -> bool:
        return ARM in self.modes

    @property
    def angle(self) -> bool:
        return ANGLE in self.modes

    @property
    def modes(self) -> frozenset[int]:
        status = self.said(StatusEx)
        assert isinstance(status, StatusEx)
        return status.active(self.info.box_ids)


@pytest.fixture(scope="module")
def standing(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    with Rig(firmware_program.chosen(), tmp_path_factory.mktemp("firmware"), VEHICLE) as rig:
        bench = Bench(rig)
        yield bench
        bench.client.link.close()


@pytest.fixture
def bench(standing: Bench) -> Iterator[Bench]:
    """On the ground, armed, in override, throttle closed; afterwards disarmed."""
    rig = standing.rig
    rig.state = rig.world.at_rest()
    standing.arm()
    yield standing
    rig.held = False
    rig.set(armed=False)
    standing.send(0.3, None)


def test_it_is_armed_by_the_pilots_switch_alone(standing: Bench) -> None:
    standing.rig.set(armed=False, override=True)
    standing.send(0.4, None)
    assert not standing.armed
    standing.rig.set(armed=True)
    standing.send(0.4, None)
    assert standing.armed
    standing.rig.set(armed=False)
    standing.send(0.4, None)
    assert not standing.armed


def test_it_is_not_armed_with_the_throttle_open(standing: Bench) -> None:
    standing.rig.set(armed=False, override=True)
    standing.send(0.3, 0.3)
    standing.rig.set(armed=True)
    standing.send(0.3, 0.3)
    assert not standing.armed
    standing.rig.set(armed=False)
    standing.send(0.3, None)


@pytest.mark.parametrize(
    ("axis", "more", "less"),
    [
        (0, (REAR_LEFT, FRONT_LEFT), (REAR_RIGHT, FRONT_RIGHT)),  # the right side goes down
        (1, (REAR_RIGHT, REAR_LEFT), (FRONT_RIGHT, FRONT_LEFT)),  # the nose goes down
        (2, (REAR_RIGHT, FRONT_LEFT), (FRONT_RIGHT, REAR_LEFT)),  # the nose goes left: reaction torque is upward
    ],
)
def test_the_right_motors_answer_a_body_rate(bench: Bench, axis: int, more: tuple, less: tuple) -> None:
    rig = bench.rig
    rig.state = replace(rig.state, position=np.array([0.0, 0.0, 2.0]))
    rig.held = True  # the body does not follow, so the motors go on pushing
    bench.send(0.2, 0.4)
    rates = [0.0, 0.0, 0.0]
    rates[axis] = 1.0
    bench.send(0.2, 0.4, (rates[0], rates[1], rates[2]))
    motors = rig.sitl.motors()
    assert min(motors[list(more)]) > max(motors[list(less)]) + 0.02


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_body_follows_a_step_of_its_rate(bench: Bench, axis: int, sign: float) -> None:
    rig = bench.rig
    rig.state = replace(rig.state, position=np.array([0.0, 0.0, 5.0]))
    rig.held = True
    bench.send(0.3, 0.4)
    rig.held = False
    rates = [0.0, 0.0, 0.0]
    rates[axis] = sign * 1.5
    bench.send(0.05, 0.4)
    bench.send(0.25, 0.4, (rates[0], rates[1], rates[2]))
    turned = rig.state.body_rate * sign
    assert 1.0 < turned[axis] < 2.2
    assert np.abs(np.delete(turned, axis)).max() < 0.35


@pytest.mark.parametrize(("roll", "pitch"), [(0.4, 0.0), (0.0, 0.3), (-0.3, -0.2)])
def test_the_firmware_tells_the_attitude_that_the_world_has(standing: Bench, roll: float, pitch: float) -> None:
    rig = standing.rig
    rig.set(armed=False)
    q = np.array([math.cos(pitch / 2), 0.0, math.sin(pitch / 2), 0.0])  # R = Ry(pitch) Rx(roll)
    r = np.array([math.cos(roll / 2), math.sin(roll / 2), 0.0, 0.0])
    w, x, y, z = q[0] * r[0], q[0] * r[1], q[2] * r[0], -q[2] * r[1]
    still = np.zeros(3)
    rig.state = FlownBody(np.array([0.0, 0.0, 1.0]), still, np.array([w, x, y, z]), still, np.zeros(4))
    rig.held = True
    standing.send(3.0, None)
    attitude = standing.said(AttitudeReply)
    rig.held = False
    rig.state = rig.world.at_rest()
    standing.send(2.0, None)
    assert isinstance(attitude, AttitudeReply)
    assert (attitude.roll, attitude.pitch) == (pytest.approx(roll, abs=0.03), pytest.approx(pitch, abs=0.03))


def test_it_hovers_where_thrust_equals_weight(bench: Bench) -> None:
    """The world's motors: at the throttle that carries the weight by the vehicle file nothing is left over."""
    rig = bench.rig
    rig.state = replace(rig.state, position=np.array([0.0, 0.0, 3.0]))
    rig.held = True
    share = ThrottleMap.of(VEHICLE).throttle(9.81)
    bench.send(0.4, share)
    rig.held = False
    before = rig.state.velocity[2]
    rotors = np.full(4, rig.world.full_speed * float(np.mean(rig.sitl.motors())))
    rig.state = replace(rig.state, rotor_speed=rotors)
    bench.send(0.2, share)
    assert abs(rig.state.velocity[2] - before) / 0.2 < 0.2


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("override_failsafe", [False, True])
def test_a_silent_msp_is_held_or_handed_back_as_the_version_is_said_to(tmp_path: Path, override_failsafe: bool) -> None:
    """Why the bridge has a watchdog: where the last sticks are held, only the override switch ends them."""
    settings = (f"set msp_override_failsafe={'ON' if override_failsafe else 'OFF'}",)
    with Rig(firmware_program.chosen(), tmp_path, VEHICLE, settings=settings) as rig:
        bench = Bench(rig)
        timeout = bench.info.release.override_timeout
        bench.arm()
        idle = rig.sitl.motors().mean()
        bench.send(0.5, 0.15, (0.0, 0.0, 0.3))
        sent = bench.said(Rc)
        assert isinstance(sent, Rc) and not bench.angle
        bench.client.link.close()
        rig.sleep(0.25 if timeout is None else timeout - 0.05)
        lowest = float(rig.sitl.motors().mean())
        assert lowest > idle + 0.05
        for _ in range(50):
            rig.sleep(0.1)
            lowest = min(lowest, float(rig.sitl.motors().mean()))
        assert (lowest > idle + 0.05) == (timeout is None)
        bench = Bench(rig)
        bench.listen(0.2)
        held = bench.said(Rc)
        assert bench.armed and isinstance(held, Rc)
        assert (held.channels[:4] == sent.channels[:4], bench.angle) == (timeout is None, timeout is not None)
        rig.set(override=False)
        bench.listen(0.5)
        assert rig.sitl.motors().mean() < idle + 0.02 and bench.angle
        bench.client.link.close()


def test_a_dead_link_leaves_a_vehicle_that_levels_itself(bench: Bench) -> None:
    """At once where the sticks are handed back; elsewhere with the pilot's override switch."""
    rig = bench.rig
    rig.state = replace(rig.state, position=np.array([0.0, 0.0, 6.0]))
    rig.held = True
    bench.send(0.3, 0.5)
    rig.held = False
    rig.set(throttle=0.0)
    bench.send(0.4, 0.5, (2.0, 0.0, 0.0))
    tilted = math.acos(1 - 2 * float(rig.state.quaternion[1] ** 2 + rig.state.quaternion[2] ** 2))
    assert tilted > 0.4 and not bench.angle
    rig.sleep(0.4)
    if bench.info.release.override_timeout is None:
        rig.set(override=False)
    rig.sleep(0.6)
    assert math.acos(1 - 2 * float(rig.state.quaternion[1] ** 2 + rig.state.quaternion[2] ** 2)) < 0.12
    rig.set(throttle=-1.0, override=True)


def test_two_at_once_have_ports_of_their_own_and_move_alike(tmp_path: Path) -> None:
    with (
        Rig(firmware_program.chosen(), tmp_path / "a", VEHICLE, seed=1) as a,
        Rig(firmware_program.chosen(), tmp_path / "b", VEHICLE, seed=1) as b,
    ):
        assert abs(a.sitl.base - b.sitl.base) >= 12
        for changes, seconds in (({"armed": True}, 0.4), ({"throttle": 0.4, "roll": 0.3}, 0.8)):
            for rig in (a, b):
                rig.set(**changes)
            for _ in range(round(seconds / 0.02)):
                for rig in (a, b):
                    rig.sleep(0.02)
        assert a.now() == pytest.approx(b.now(), abs=0.5)
        assert a.state.position[2] > 0.2 and a.state.position[1] < -0.005
        np.testing.assert_allclose(a.state.position, b.state.position, atol=0.02)
        np.testing.assert_allclose(a.state.quaternion, b.state.quaternion, atol=0.02)


def test_without_power_the_motors_stop_and_time_goes_on(tmp_path: Path) -> None:
    with Rig(firmware_program.chosen(), tmp_path, VEHICLE) as rig:
        bench = Bench(rig)
        bench.arm()
        assert bench.armed
        bench.send(0.5, 0.7)
        assert rig.state.velocity[2] > 0.1
        before = rig.now()
        rig.power(False)
        rig.sleep(1.5)
        assert rig.now() == pytest.approx(before + 1.5, abs=0.01)
        assert rig.state.position[2] == pytest.approx(VEHICLE.feet_height, abs=1e-3)
        rig.power(True)
        assert rig.now() >= before + 1.5
        rig.sleep(3.0)
        bench.client.poll(rig.now())
        bench.client.link.close()
        again = Bench(rig)
        again.send(0.5, None)
        assert not again.armed  # a switch that was on before the boot arms nothing
        again.client.link.close()
