"""What the controller's messages say of arming, receiver and switches, and what one message alone cannot change."""

from dataclasses import dataclass, field

import pytest

from e2efly.flight.betaflight.allowed_modes import ANGLE, ARM, FAILSAFE, OVERRIDE
from e2efly.flight.betaflight.client import Client, Reply
from e2efly.flight.betaflight.instruments import Instruments, Reading
from e2efly.flight.betaflight.messages import Rc, StatusEx
from e2efly.flight.pilot.flight_state import Mission
from e2efly.flight.settings import FlightSettings
from tests.flight.test_msp_client import Wire

TURTLE, BEEPER, FUTURE = 35, 13, 99
BOXES = (ARM, OVERRIDE, FAILSAFE, ANGLE, TURTLE, BEEPER, FUTURE)
LOW, MIDDLE, HIGH = 1000, 1500, 2000


@dataclass(frozen=True)
class Info:
    """What `Instruments` needs to know of a controller."""

    box_ids: tuple[int, ...] = BOXES
    api: tuple[int, int] = (1, 46)
    rate_profile: int = 0


@dataclass
class Bench:
    """A controller whose messages the test writes: one of each, and one reading, per step of 33 ms."""

    now: float = 1.0
    client: Client = field(default_factory=lambda: Client(Wire()))

    def __post_init__(self) -> None:
        self.instruments = Instruments(self.client, FlightSettings())

    def read(
        self,
        *on: int,
        mission: int = MIDDLE,
        roll: int = 1500,
        channels: int = 12,
        disabled: tuple[str, ...] = (),
        land: bool = False,
        rates: int = 0,
    ) -> Reading:
        self.now += 0.033
        boxes = sum(1 << BOXES.index(box) for box in on)
        status = StatusEx(1e-3, boxes, 0.1, rates, disabled)
        sticks = [1500] * 7 + [mission, roll, 1500, 1500, 1500]
        for code, message in ((StatusEx.CODE, status), (Rc.CODE, Rc(tuple(sticks[:channels])))):
            self.client.latest[code] = Reply(message, self.now, 0.005)
        reading = self.instruments.read(self.now, Info(), land=land)  # type: ignore[arg-type]
        again = self.instruments.read(self.now + 0.01, Info(), land=land)  # type: ignore[arg-type]
        assert (again.armed, again.pilot) == (reading.armed, reading.pilot)  # the same messages: nothing new is said
        return reading


@pytest.fixture
def flying() -> Bench:
    """Armed, under override, heard, the mission switch in its middle."""
    bench = Bench()
    bench.read(ARM, OVERRIDE)
    reading = bench.read(ARM, OVERRIDE)
    assert reading.armed and reading.override
    assert reading.pilot is not None and reading.pilot.mission is Mission.HOVER
    return bench


def test_one_status_without_the_arm_bit_ends_no_flight_two_do(flying: Bench) -> None:
    assert flying.read(OVERRIDE).armed
    assert flying.read(ARM, OVERRIDE).armed
    assert flying.read(OVERRIDE).armed
    assert not flying.read(OVERRIDE).armed


def test_one_status_with_the_arm_bit_arms_nothing() -> None:
    bench = Bench()
    assert not bench.read(OVERRIDE).armed
    assert not bench.read(ARM, OVERRIDE).armed
    assert not bench.read(OVERRIDE).armed


@pytest.mark.parametrize("lost", [{"on": (ARM, OVERRIDE, FAILSAFE)}, {"disabled": ("RXLOSS",)}, {"channels": 6}])
def test_one_message_alone_loses_no_receiver_two_do(flying: Bench, lost: dict) -> None:
    on, rest = lost.get("on", (ARM, OVERRIDE)), {k: v for k, v in lost.items() if k != "on"}
    assert flying.read(*on, **rest).pilot is not None
    assert flying.read(ARM, OVERRIDE).pilot is not None
    assert flying.read(*on, **rest).pilot is not None
    assert flying.read(*on, **rest).pilot is None


@pytest.mark.parametrize(("switch", "mission"), [(LOW, Mission.LAND), (HIGH, Mission.POLICY)])
def test_one_message_moves_no_mission_switch_two_do(flying: Bench, switch: int, mission: Mission) -> None:
    seen = [flying.read(ARM, OVERRIDE, mission=at).pilot for at in (switch, MIDDLE, switch, switch)]
    assert [pilot and pilot.mission for pilot in seen] == [Mission.HOVER, Mission.HOVER, Mission.HOVER, mission]


@pytest.mark.parametrize(("switch", "then"), [(MIDDLE, Mission.HOVER), (LOW, Mission.LAND)])
def test_the_pilot_stops_the_policy_by_one_message(flying: Bench, switch: int, then: Mission) -> None:
    for _ in range(2):
        flying.read(ARM, OVERRIDE, mission=HIGH)
    seen = [flying.read(ARM, OVERRIDE, mission=switch).pilot for _ in range(2)]
    assert [pilot and pilot.mission for pilot in seen] == [Mission.HOVER, then]


def test_override_sticks_and_the_operator_are_believed_at_once(flying: Bench) -> None:
    reading = flying.read(ARM, roll=1900)
    assert not reading.override
    assert reading.pilot is not None and reading.pilot.roll == 0.8
    reading = flying.read(ARM, OVERRIDE, land=True)
    assert reading.pilot is not None and reading.pilot.mission is Mission.LAND


def test_its_failsafe_is_what_it_said_last_and_not_what_a_silent_link_leaves_unknown(flying: Bench) -> None:
    for _ in range(2):
        lost = flying.read(ARM, OVERRIDE, FAILSAFE)
    assert lost.failsafe and lost.pilot is None
    for _ in range(2):
        heard = flying.read(ARM, OVERRIDE)
    assert not heard.failsafe
    silent = flying.instruments.read(flying.now + 5.0, Info(), land=False)  # type: ignore[arg-type]
    assert silent.pilot is None and silent.link_problem and not silent.failsafe


def test_a_mode_that_is_on_and_not_known_to_be_harmless_is_named() -> None:
    bench = Bench()
    assert bench.read(ARM, OVERRIDE, BEEPER).meddling == ()
    assert bench.read(ARM, ANGLE).meddling == ()  # the pilot has the sticks
    named = {TURTLE: "FLIP OVER AFTER CRASH (mode 35)", FUTURE: "mode 99"}
    for box, name in named.items():
        for others in ((), (ARM,), (ARM, OVERRIDE)):
            assert bench.read(box, *others).meddling == (f"{name} is on; accepted: off while the bridge flies",)
    assert bench.read(OVERRIDE, ANGLE).meddling == ("ANGLE (mode 1) is on; accepted: off while the bridge flies",)


def test_a_rate_profile_whose_rates_were_not_read_is_named() -> None:
    """A switch of the pilot's may change it at any time, by `adjrange`."""
    (said,) = Bench().read(OVERRIDE, rates=2).meddling
    assert said == "rateprofile is 2; accepted: 0, whose rates were read: switch back, or start again"


def test_a_vehicle_that_was_armed_in_turtle_mode_must_be_armed_again() -> None:
    """Firmware up to 4.5 keeps the motors reversed after the switch has left the mode."""
    bench = Bench()
    for on in ((TURTLE,), (TURTLE,), (OVERRIDE,), (ARM, OVERRIDE), (ARM, OVERRIDE)):
        reading = bench.read(*on)
    said = "FLIP OVER AFTER CRASH (mode 35) was on while arming; accepted: disarm, switch it off, arm again"
    assert (reading.meddling, reading.armed_with) == ((), (said,))
    for _ in range(90):
        assert bench.read(ARM, OVERRIDE).armed_with == (said,)
    for _ in range(90):  # disarmed for three seconds
        reading = bench.read(OVERRIDE)
    for _ in range(2):
        reading = bench.read(ARM, OVERRIDE)
    assert reading.armed and reading.armed_with == ()


def test_one_message_alone_leaves_nothing_behind(flying: Bench) -> None:
    assert flying.read(ARM, OVERRIDE, TURTLE).meddling
    assert flying.read(ARM, OVERRIDE).armed_with == ()
