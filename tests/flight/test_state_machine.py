"""Who flies when, and why: every transition, every reason, and what no sequence of inputs may bring about."""

import dataclasses
import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from e2efly.flight.pilot.fence import RIGHTING, fence_problem, moved, stopping
from e2efly.flight.pilot.flight_state import AIRBORNE, DRIFTED, Flight, Inputs, Mission, Mode, Pilot, Reason, Target
from e2efly.flight.pilot.hover import blind_time
from e2efly.flight.pilot.landing import BEYOND_S, FAST, FOUND_S, SLOWED_S, has_stood
from e2efly.flight.pilot.refusals import take_off_refusals
from e2efly.flight.pilot.state_machine import AHEAD, FALLEN_S, LONGEST_STEP, NEAR_GROUND, step
from e2efly.flight.settings import Fence, FlightSettings
from e2efly.policy.odometry import Odometry, tilt_of, yaw_of
from e2efly.vehicles.gravity import GRAVITY

SETTINGS = FlightSettings()
DT = 0.01
ELSEWHERE = FlightSettings(follow_distance=100.0)
"""For what is looked at far from where the flight was."""
START = 5000.0
"""s on the clock."""
LAND, HOVER, POLICY = Pilot(Mission.LAND), Pilot(Mission.HOVER), Pilot(Mission.POLICY)


def at(z: float = 0.05, x: float = 0.0, y: float = 0.0, velocity: Any = (0, 0, 0), roll: float = 0.0) -> Odometry:
    quaternion = np.array([math.cos(roll / 2), math.sin(roll / 2), 0.0, 0.0])
    return Odometry(START, np.array([x, y, z], float), np.array(velocity, float), quaternion, np.zeros(3))


GOOD = Inputs(odometry=at(), armed=True, override=True, pilot=LAND, voltage=4.0, attitude_error=0.0)
"""Ready for take-off, but for the mission switch."""


def having(inputs: Inputs = GOOD, **changes: Any) -> Inputs:
    return dataclasses.replace(inputs, **changes)


def flown(flight: Flight, inputs: Inputs, seconds: float = DT, settings: FlightSettings = SETTINGS) -> Flight:
    for _ in range(round(seconds / DT)):
        flight = step(settings, flight, inputs, (flight.now or START) + DT)
    return flight


def reached(mode: Mode, flight: Flight, inputs: Inputs, *more: Any, **named: Any) -> Flight:
    flight = flown(flight, inputs, *more, **named)
    assert flight.mode is mode
    return flight


def ready() -> Flight:
    flight = flown(Flight(), GOOD)
    assert flight.reasons == (Reason.WAITING,)
    return flight


def taking_off() -> Flight:
    return reached(Mode.TAKEOFF, ready(), having(pilot=HOVER))


UP = having(pilot=HOVER, odometry=at(1.05))


def hovering() -> Flight:
    return reached(Mode.HOVER, taking_off(), UP, 6.0)


AWAY = having(UP, pilot=POLICY)


def policy_flying() -> Flight:
    return reached(Mode.POLICY, hovering(), AWAY)


def landing() -> Flight:
    return reached(Mode.LAND, hovering(), having(UP, pilot=LAND))


BLIND = having(UP, odometry_problem="too old")
DEAF = having(BLIND, deaf=True)
"""Nor can the accelerometer tell flight from standing: a blind landing ends in time."""


def sinking() -> Flight:
    flight = flown(hovering(), BLIND)
    assert flight.mode is Mode.LAND and flight.blind
    return flight


def with_pilot() -> Flight:
    return reached(Mode.PILOT, hovering(), having(UP, override=False))


def done() -> Flight:
    return reached(Mode.DONE, landing(), having(pilot=LAND), 6.0)


def said(flight: Flight, reason: Reason) -> bool:
    return any(text == reason or text.startswith(f"{reason}: ") for text in flight.reasons)


def refused(**changes: Any) -> Callable[[], Flight]:
    """A take-off that is asked for with something amiss."""

    def run() -> Flight:
        flight = flown(ready(), having(**{"pilot": HOVER, **changes}))
        assert flight.mode is Mode.INIT and flight.target is None
        return flight

    return run


def kept_out(**changes: Any) -> Callable[[], Flight]:
    """A policy that is asked for with something amiss: it does not begin, and one that flies ends in a hover."""

    def run() -> Flight:
        flight = reached(Mode.HOVER, hovering(), having(AWAY, **changes), settings=ELSEWHERE)
        stopped = flown(policy_flying(), having(AWAY, **changes), settings=ELSEWHERE)
        assert stopped.mode is Mode.HOVER and stopped.lock
        assert {why.split(":")[0] for why in flight.reasons} == {why.split(":")[0] for why in stopped.reasons}
        return stopped

    return run


def landed_from(begin: Callable[[], Flight], **changes: Any) -> Callable[[], Flight]:
    def run() -> Flight:
        flight = reached(Mode.LAND, begin(), having(UP, **changes))
        return flight

    return run


CASES: dict[Reason, list[Callable[[], Flight]]] = {
    Reason.NO_ODOMETRY: [
        refused(odometry=None),
        refused(odometry_problem="too old"),
        refused(odometry=dataclasses.replace(at(), velocity=np.array([0, math.nan, 0]))),
        *(landed_from(begin, odometry=None) for begin in (taking_off, hovering, policy_flying)),
        *(landed_from(begin, odometry_problem="too old") for begin in (taking_off, hovering, policy_flying)),
        lambda: flown(landing(), BLIND),
        lambda: flown(with_pilot(), BLIND),
    ],
    Reason.MOVING: [refused(odometry=at(velocity=(0.2, 0, 0)))],
    Reason.NOT_ON_GROUND: [refused(odometry=at(0.5)), refused(odometry=at(-0.5))],
    Reason.TILTED: [refused(odometry=at(roll=0.5)), refused(odometry=at(roll=math.pi))],
    Reason.BATTERY_LOW: [
        refused(voltage=3.4),
        refused(voltage=math.nan),
        lambda: flown(policy_flying(), having(AWAY, voltage=3.4)),
        *(landed_from(begin, voltage=3.4, pilot=HOVER) for begin in (taking_off, hovering)),
    ],
    Reason.BATTERY_UNKNOWN: [refused(voltage=None), kept_out(voltage=None)],
    Reason.STICKS: [refused(pilot=Pilot(Mission.HOVER, yaw=-0.2))],
    Reason.NO_PILOT: [
        refused(pilot=None),
        *(landed_from(begin, pilot=None) for begin in (taking_off, hovering, policy_flying)),
    ],
    Reason.MISSION_NOT_LOW: [lambda: flown(Flight(), having(pilot=HOVER))],
    Reason.NOT_ARMED: [refused(armed=False)],
    Reason.NO_OVERRIDE: [refused(override=False)],
    Reason.SETTINGS: [refused(settings_problems=("rates_type is QUICK",))],
    Reason.LINK: [
        refused(link_problem="cut"),
        *(landed_from(begin, link_problem="cut") for begin in (taking_off, hovering, policy_flying)),
    ],
    Reason.ATTITUDE: [refused(attitude_error=0.3), refused(attitude_error=None), refused(attitude_error=math.nan)],
    Reason.ACCELEROMETER: [
        refused(accelerometer_problem="it shows [0, 0, -512]"),
        *(landed_from(begin, accelerometer_problem="z") for begin in (taking_off, hovering)),
        lambda: flown(policy_flying(), having(AWAY, accelerometer_problem="z")),
    ],
    Reason.MOTION: [refused(motion_problem="they move otherwise")],
    Reason.SENSING: [refused(sensing_problem="hold is 90 ms"), kept_out(sensing_problem="velocity_lag is 60 ms")],
    Reason.OUTSIDE_FENCE: [
        refused(odometry=at(x=5.0)),
        refused(odometry=at(y=-5.0)),
        kept_out(odometry=at(1.0, x=3.1)),
        kept_out(odometry=at(0.1)),
        kept_out(odometry=at(1.0, velocity=(0, -7.0, 0))),
        kept_out(odometry=at(1.0, roll=1.5)),
    ],
    Reason.WAITING: [ready],
    Reason.MISSION: [taking_off, policy_flying, landing, lambda: flown(policy_flying(), UP)],
    Reason.REACHED: [hovering],
    Reason.STICK_INPUT: [kept_out(pilot=Pilot(Mission.POLICY, pitch=0.2))],
    Reason.POLICY: [kept_out(policy_problem="action is nan")],
    Reason.POLICY_DONE: [
        lambda: flown(policy_flying(), having(AWAY, policy_done=True)),
        lambda: flown(policy_flying(), having(AWAY, policy_done=True, policy_lands=True, odometry=at(0.1))),
    ],
    Reason.NOT_CLIMBING: [lambda: flown(taking_off(), having(pilot=HOVER), 7.6)],
    Reason.CRASHED: [
        *(
            lambda begin=begin: flown(begin(), having(UP, odometry=at(0.05, roll=1.3)), FALLEN_S + 2 * DT)
            for begin in (taking_off, hovering, landing)
        ),
        lambda: flown(
            policy_flying(),
            having(AWAY, odometry=at(0.3, roll=1.3)),
            FALLEN_S + 2 * DT,
            dataclasses.replace(SETTINGS, fence=dataclasses.replace(SETTINGS.fence, tilt=3.0)),
        ),
    ],
    Reason.DEADLINES: [kept_out(missed_deadlines=3)],
    Reason.GUARD: [
        kept_out(odometry=at(2.0, x=2.0, velocity=(4.0, 0, 0))),
        kept_out(odometry=at(1.0, velocity=(0, 0, -3.0))),
    ],
    Reason.LANDED: [done, lambda: flown(sinking(), DEAF, blind_time(1.0) + 0.1)],
    Reason.TOUCHED: [lambda: flown(sinking(), having(BLIND, stands=True))],
    Reason.DISARMED: [
        *(
            lambda begin=begin: flown(begin(), having(UP, armed=False, pilot=POLICY))
            for begin in (taking_off, hovering, policy_flying, landing, sinking, with_pilot)
        ),
        lambda: flown(done(), having(armed=False)),
    ],
    Reason.OVERRIDE_OFF: [
        lambda begin=begin: flown(begin(), having(UP, override=False))
        for begin in (taking_off, hovering, policy_flying, landing, sinking, ready, done)
    ],
    Reason.OVERRIDE_ON: [
        lambda: flown(with_pilot(), UP),
        lambda: flown(with_pilot(), BLIND),
    ],
    Reason.LOCKED: [lambda: flown(policy_flying(), having(AWAY, policy_problem="late"), 2 * DT)],
}


@pytest.mark.parametrize("reason", Reason)
def test_every_reason_is_given_where_it_holds(reason: Reason) -> None:
    for case in CASES[reason]:  # a reason without a case fails
        flight = case()
        assert said(flight, reason), flight


def test_every_unmet_condition_is_named_at_once() -> None:
    odometry = at(0.6, x=9.0, velocity=(1, 0, 0), roll=0.6)
    amiss = Inputs(odometry, None, "cut", pilot=Pilot(Mission.POLICY, 1.0), voltage=3.0, settings_problems=("a", "b"),
                   attitude_error=1.0)  # fmt: skip
    flight = flown(Flight(), amiss)
    assert len(flight.reasons) == 13
    for reason in (Reason.MOVING, Reason.NOT_ON_GROUND, Reason.TILTED, Reason.OUTSIDE_FENCE, Reason.LINK):
        assert said(flight, reason)
    assert "settings: a" in flight.reasons and "settings: b" in flight.reasons
    everything = flown(Flight(), Inputs())
    assert len(everything.reasons) == 5  # what is not known is a refusal, too


def test_nothing_is_blamed_that_another_condition_explains() -> None:
    """As `--check` asks: no step was flown."""
    assert take_off_refusals(SETTINGS, Flight(), having(armed=False)) == (Reason.NOT_ARMED,)  # the switch is low
    tilted = having(odometry=at(roll=0.5), accelerometer_problem="29 deg from the body's z axis")
    (only,) = take_off_refusals(SETTINGS, Flight(), tilted)
    assert only.startswith(Reason.TILTED)
    blind = take_off_refusals(SETTINGS, Flight(), having(odometry=None, attitude_error=None))
    assert blind == (f"{Reason.NO_ODOMETRY}: none came yet",)  # there is nothing to compare attitudes with


def test_a_whole_flight() -> None:
    flight = policy_flying()
    assert flight.target is None
    flight = flown(flight, UP)
    assert (flight.mode, flight.target) == (Mode.HOVER, Target((0.0, 0.0, 1.05), 0.0))
    flight = flown(flown(flight, UP), AWAY)
    assert flight.mode is Mode.POLICY  # the switch has left its position: it may fly again
    flight = reached(Mode.LAND, flight, having(UP, pilot=LAND), 3 * DT)
    flight = reached(Mode.DONE, flight, having(odometry=at(0.05)), 6.0)
    assert flown(flight, having(pilot=HOVER), 1.0).mode is Mode.DONE  # until disarmed
    flight = reached(Mode.INIT, flight, having(armed=False, pilot=HOVER))
    assert flown(flight, having(pilot=HOVER), 1.0).mode is Mode.INIT  # the switch was not low since
    assert flown(flown(flight, GOOD), having(pilot=HOVER)).mode is Mode.TAKEOFF


def test_only_the_mission_switch_starts_a_flight() -> None:
    for amiss in ({"armed": False}, {"override": False}, {"voltage": None}, {"odometry": None}, {"pilot": None}):
        flight = flown(ready(), having(**{"pilot": HOVER, **amiss}), 0.1)
        flight = flown(flight, having(pilot=HOVER), 1.0)  # all is well now, but nobody has asked since
        assert flight.mode is Mode.INIT and said(flight, Reason.MISSION_NOT_LOW)
        assert flown(flown(flight, GOOD), having(pilot=HOVER)).mode is Mode.TAKEOFF


def test_a_take_off_to_the_policy_position_hovers_until_asked_again() -> None:
    flight = flown(ready(), having(pilot=POLICY))
    flight = flown(flight, AWAY, 6.0)
    assert flight.mode is Mode.HOVER and said(flight, Reason.LOCKED)
    flight = flown(flight, UP)
    assert flown(flight, AWAY).mode is Mode.POLICY


def test_the_target_waits_for_a_vehicle_that_stays_behind() -> None:
    """To catch up, it would climb fast, and a controller that is not reached from then on would go on with it."""
    flight = flown(taking_off(), having(pilot=HOVER, odometry=at(0.05)), 3.0)
    assert flight.target is not None and flight.target.position[2] == pytest.approx(0.05 + AHEAD)


def test_the_target_rises_to_the_height_and_slows_down_before() -> None:
    flight, heights, climbs = taking_off(), [], []
    while flight.mode is Mode.TAKEOFF:
        target = flight.target
        heights.append(target.position[2])
        climbs.append(target.climb)
        flight = flown(flight, having(pilot=HOVER, odometry=at(target.position[2])))
    assert flight.mode is Mode.HOVER
    rise = np.diff(heights)
    assert rise.max() <= SETTINGS.takeoff_speed * DT + 1e-9 and rise.min() >= 0
    np.testing.assert_allclose(rise, np.array(climbs[1:]) * DT, atol=1e-3)
    assert climbs[-1] < 0.05
    assert flight.target is not None and flight.target.position[2] == pytest.approx(1.05)


def test_heights_count_from_the_ground_wherever_the_world_has_its_origin() -> None:
    fence = Fence(low=(-3, -3, -1.2), high=(3, 3, 3))
    settings = dataclasses.replace(SETTINGS, ground_height=-1.3, fence=fence)
    stands = having(odometry=at(-1.25))
    flight = flown(Flight(home=-1.3), stands, settings=settings)
    assert flight.reasons == (Reason.WAITING,)
    flight = flown(flight, having(stands, pilot=HOVER), settings=settings)
    up = having(pilot=HOVER, odometry=at(-0.25))
    assert flown(flight, having(up, odometry=at(-0.5)), 6.0, settings).mode is Mode.TAKEOFF
    flight = flown(flight, up, 6.0, settings)
    assert flight.mode is Mode.HOVER and flight.target is not None
    assert flight.target.position[2] == pytest.approx(-0.25)
    flight = flown(flight, having(up, pilot=POLICY), settings=settings)
    touched = having(pilot=POLICY, odometry=at(-1.2), policy_done=True)
    assert flown(flight, touched, settings=settings).mode is Mode.LAND
    assert flown(flight, having(touched, odometry=at(-0.25)), settings=settings).mode is Mode.HOVER


def test_a_policy_that_lands_may_go_under_the_floor_of_the_fence() -> None:
    low = having(AWAY, odometry=at(0.1, velocity=(0, 0, -0.5)))
    assert flown(policy_flying(), low).mode is Mode.HOVER
    assert flown(policy_flying(), having(low, policy_lands=True)).mode is Mode.POLICY


def test_landing_sinks_slowly_and_ends_when_it_stands() -> None:
    flight = landing()
    later = flown(flight, having(UP, pilot=LAND), 1.0)
    assert later.target.position[2] == pytest.approx(flight.target.position[2] - SETTINGS.land_speed)
    assert later.target.climb == -SETTINGS.land_speed
    # nobody comes back from a landing by the mission switch
    assert flown(later, UP, 0.1).mode is Mode.LAND
    # moving, or still for too short a time: not yet
    moving = having(odometry=at(velocity=(0, 0, -0.2)))
    assert flown(later, moving, 6.0).mode is Mode.LAND
    assert flown(flown(later, moving, 6.0), having(odometry=at()), 1.1).mode is Mode.DONE
    still = flown(flown(flown(later, moving, 6.0), having(odometry=at()), 0.5), moving)
    assert flown(still, having(odometry=at()), 0.9).mode is Mode.LAND
    # the target stays within reach: an updraught ends, and it is no stone
    lifted = flown(later, having(odometry=at(4.0, velocity=(0, 0, 1.0))))
    assert lifted.target is not None and lifted.target.position[2] >= 3.3


NOWHERE = having(AWAY, placeless=True)
"""A policy that is told no place, by poses that drift."""
RACING = at(-7.0, x=500.0, velocity=(9.0, 0, -2.0))


def racing() -> Flight:
    return reached(Mode.POLICY, reached(Mode.POLICY, hovering(), NOWHERE), having(NOWHERE, odometry=RACING), 1.0)


def test_without_a_place_no_fence_ends_a_policy_and_its_end_is_a_short_hover() -> None:
    ended = having(NOWHERE, odometry=RACING, pilot=HOVER)
    flight = reached(Mode.HOVER, racing(), ended)
    assert flight.target is not None
    x, y, z = flight.target.position
    assert 505 < x < 512 and (y, z) == (0.0, -7.0), "it brakes where it is, wherever the fence is, and dives no deeper"
    flight = reached(Mode.HOVER, flight, ended, 4.9)
    flight = reached(Mode.LAND, flight, ended, 0.3)
    assert flight.blind and flight.misled == DRIFTED and said(flight, Reason.NO_ODOMETRY)
    assert flight.lost is not None and flight.lost[1] == SETTINGS.fence.high[2] - flight.home, "it may be as high"
    still = having(ended, odometry=at(0.05))
    flight = reached(Mode.LAND, flight, still, 2.0)
    assert flight.blind, "no such pose is believed again in this landing"
    flight = reached(Mode.DONE, flight, having(still, stands=True))
    assert said(flight, Reason.TOUCHED)
    flight = reached(Mode.INIT, flight, having(still, stands=True, armed=False), 0.1)
    assert flight.misled is None


@pytest.mark.parametrize("pilot", [LAND, None])
def test_without_a_place_it_brakes_before_it_lands(pilot: Pilot | None) -> None:
    asked = having(NOWHERE, odometry=RACING, pilot=pilot)
    flight = reached(Mode.HOVER, racing(), asked)
    flight = reached(Mode.HOVER, flight, asked, 2.0)
    slow = having(asked, odometry=at(-7.0, x=510.0, velocity=(0.5, 0, 0)))
    assert reached(Mode.LAND, flight, slow).blind
    assert reached(Mode.LAND, flight, asked, 1.2).blind, "for a time"
    lame = having(asked, accelerometer_problem="its numbers do not change")
    assert reached(Mode.LAND, flight, lame).blind, "not by sensors that are wrong"


def test_without_a_place_whatever_else_is_wrong_the_height_is_not_believed() -> None:
    flight = flown(racing(), having(NOWHERE, odometry=RACING, motion_problem="late", heading_error=2.0))
    assert flight.mode is Mode.LAND and flight.blind and flight.misled == DRIFTED and flight.turned is None


def test_without_a_place_it_hovers_for_seconds_and_lands_blind_for_any_reason() -> None:
    waits = having(UP, placeless=True)
    flight = reached(Mode.HOVER, reached(Mode.POLICY, hovering(), NOWHERE), waits)
    flight = reached(Mode.HOVER, flight, waits, 4.9)
    assert reached(Mode.LAND, flight, waits, 0.3).blind
    asked = reached(Mode.LAND, flight, having(waits, pilot=LAND))
    assert asked.blind and said(asked, Reason.MISSION)


def test_without_a_place_only_the_throttle_stick_tells_whether_a_vehicle_that_is_handed_over_flies() -> None:
    flown_by_hand = having(UP, placeless=True, override=False)
    for odometry in (at(), at(1.05), at(7.0, velocity=(3, 0, 0))):
        flight = reached(Mode.PILOT, hovering(), flown_by_hand)
        back = having(UP, odometry=odometry, placeless=True)
        sinks = reached(Mode.LAND, flight, back)
        assert sinks.blind and said(sinks, Reason.OVERRIDE_ON)
        down = dataclasses.replace(HOVER, throttle=-1.0)
        assert reached(Mode.INIT, flight, having(back, pilot=down)).blind is False


@pytest.mark.parametrize(
    ("force", "rate", "lies"),
    [((9.0, 0, 3.0), 0.0, True), ((0, 0, 9.8), 0.0, False), ((9.0, 0, 3.0), 2.0, False), ((18.0, 0, 3.0), 0.0, False)],
)
def test_without_a_place_a_vehicle_on_its_side_is_known_by_its_sensors(
    force: tuple[float, ...], rate: float, lies: bool
) -> None:
    tipped = dataclasses.replace(at(3.0, velocity=(1.0, 0, 0), roll=1.3), body_rate=np.array([rate, 0, 0]))
    inputs = having(NOWHERE, odometry=tipped, force=np.array(force))
    flight = flown(racing(), inputs, 0.7)
    assert (flight.mode is Mode.DONE and said(flight, Reason.CRASHED)) is lies


def test_a_landing_begins_where_the_vehicle_can_stop_and_no_higher_than_it_is() -> None:
    fast = having(odometry=at(1.0, velocity=(2.0, 0, 0)), pilot=None)
    flight = flown(policy_flying(), having(AWAY, pilot=None, odometry=fast.odometry))
    assert flight.target.position[0] == pytest.approx(2.0 * 0.15 + 2.0**2 / (2 * 6.0))
    waiting = flown(flight, fast, 1.0)  # first it stops, then it sinks
    assert waiting.target is not None and waiting.target.position[2] == 1.0 and waiting.target.climb == 0.0
    touched = flown(policy_flying(), having(AWAY, policy_done=True, policy_lands=True, odometry=at(0.1)))
    assert touched.target is not None and touched.target.position[2] == 0.1
    found = flown(flown(touched, BLIND), having(UP, odometry=at(0.15)), FOUND_S + 2 * DT)
    assert found.target is not None and found.target.position[2] == pytest.approx(0.15, abs=0.01)


def test_a_landing_in_a_gust_does_not_wait_for_ever() -> None:
    gust = having(UP, pilot=LAND, odometry=at(1.05, velocity=(0.8, 0, 0)))
    waiting = flown(flown(hovering(), gust), gust, SLOWED_S - 0.1)
    assert waiting.target is not None and waiting.target.position[2] == pytest.approx(1.05, abs=0.01)
    sinking = flown(waiting, gust, 1.0)
    assert sinking.target is not None and sinking.target.position[2] < 0.8


def test_odometry_that_leads_astray_is_not_believed_again_before_the_vehicle_stands() -> None:
    spiral = having(UP, odometry=at(1.05, x=1.6))
    astray = flown(hovering(), spiral)
    assert astray.mode is Mode.LAND and astray.blind and said(astray, Reason.NO_ODOMETRY)
    assert "does not go where it is sent" in astray.reasons[0]
    for begin in (lambda: flown(taking_off(), UP), lambda: flown(landing(), having(UP, pilot=LAND))):
        assert flown(begin(), spiral).misled
    assert flown(astray, UP, 0.5).blind  # not even back at its target
    by_hand = reached(Mode.PILOT, astray, having(spiral, override=False))
    assert flown(by_hand, spiral).blind  # handed over in the air
    stands = flown(by_hand, having(spiral, override=False, odometry=at(x=1.6)), 0.1)
    assert flown(stands, having(odometry=at(x=1.6))).mode is Mode.INIT
    assert not flown(flown(astray, DEAF, blind_time(1.1) + 0.1), DEAF).misled


def test_what_drifts_while_the_link_is_silent_is_seen_and_braked_once_it_is_heard() -> None:
    """Its commands did not arrive: that it did not go where it was sent is no fault of the odometry."""
    silent = having(UP, link_problem="no answer within 0.25 s", silent=True)
    drifting = flown(flown(hovering(), silent, 0.5), having(silent, odometry=at(1.05, x=1.6, velocity=(2.0, 0, 0))))
    assert drifting.mode is Mode.LAND and not drifting.misled and not drifting.blind
    heard = flown(drifting, having(UP, odometry=at(1.05, x=1.6, velocity=(2.0, 0, 0))))
    assert not heard.blind and heard.target is not None
    assert heard.target.position[2] == pytest.approx(1.05, abs=0.01)  # first it stops, then it sinks


def test_a_heading_that_the_flight_shows_to_be_wrong_ends_it() -> None:
    wrong = having(UP, heading_error=-1.6)
    for flight in (taking_off(), hovering()):
        astray = flown(flight, wrong)
        assert astray.mode is Mode.LAND and astray.blind and astray.turned == -1.6
        assert said(astray, Reason.NO_ODOMETRY) and "its heading is wrong by -92 deg" in astray.reasons[0]
    assert flown(landing(), having(wrong, pilot=LAND)).blind
    assert flown(hovering(), having(UP, heading_error=0.6), 1.0).mode is Mode.HOVER  # it still finds its target
    for newer in (-1.8, 0.05):  # the newest that is known: it is what the brake goes by
        assert flown(astray, having(UP, heading_error=newer)).turned == newer
    later = flown(astray, UP, 0.5)
    assert later.blind and later.turned == -1.6
    policy = flown(policy_flying(), having(AWAY, heading_error=2.0))  # the fence watches it; the hover is told at once
    assert policy.mode is Mode.POLICY and not policy.misled and policy.turned is None
    assert flown(policy, having(UP, heading_error=2.0), 0.05).mode is Mode.LAND
    by_hand = flown(astray, having(wrong, override=False), 0.1)
    assert by_hand.mode is Mode.PILOT and by_hand.misled
    assert flown(with_pilot(), having(wrong, override=False)).turned is None
    lost = flown(flown(policy_flying(), having(AWAY, heading_error=2.0)), having(AWAY, odometry_problem="too old"))
    assert lost.blind and lost.turned is None  # nothing has tripped: the brake goes by the heading as it is
    assert flown(later, DEAF, blind_time(1.1) + 0.1).turned is None


def test_far_from_the_target_is_no_sign_as_long_as_it_comes_nearer() -> None:
    fast = having(UP, odometry=at(1.05, x=-2.5, velocity=(4.0, 0, 0)))
    flight = flown(flown(policy_flying(), having(AWAY, odometry=fast.odometry)), fast)
    assert flight.mode is Mode.HOVER and flight.target is not None and flight.target.position[0] > -0.8
    for x in (-2.0, -1.0, 0.0, 1.5, 2.9):  # shoots past it
        flight = flown(flight, having(UP, odometry=at(1.05, x=x, velocity=(4.0, 0, 0))))
    assert flight.mode is Mode.HOVER


def test_the_pilots_stick_may_move_the_target_ahead_of_the_vehicle() -> None:
    pulled = having(UP, pilot=Pilot(Mission.HOVER, pitch=1.0))
    flight = flown(hovering(), pulled, 2.0)  # the vehicle hangs back, as in a wind
    assert flight.mode is Mode.HOVER and flight.target is not None and flight.target.position[0] > 1.2
    assert flown(flight, UP, 1.0).mode is Mode.HOVER


def test_a_moment_on_its_side_is_no_crash() -> None:
    flight = hovering()
    for _ in range(10):
        flight = flown(flight, having(UP, odometry=at(1.05, roll=1.3)), FALLEN_S - 2 * DT)
        flight = flown(flight, having(UP, odometry=at(1.05, roll=1.3, velocity=(0, 0, -1))))
    assert flight.mode is Mode.HOVER


def test_odometry_lost_sinks_blind_and_found_lands_from_there() -> None:
    flight = flown(landing(), having(UP, pilot=LAND), 2.0)
    lost = flown(flight, BLIND)
    assert lost.blind and lost.target is None
    assert lost.since == lost.now  # the blind descent begins here, however long the landing has been under way
    assert flown(lost, DEAF, blind_time(1.0) - 0.1).mode is Mode.LAND
    assert flown(lost, having(UP, odometry=at(0.8)), FOUND_S - DT).blind
    found = flown(lost, having(UP, odometry=at(0.8)), FOUND_S + 2 * DT)
    assert not found.blind and found.target is not None
    assert found.target.position == pytest.approx((0.0, 0.0, 0.8), abs=0.01)
    assert flown(found, having(odometry=at()), 6.0).mode is Mode.DONE


@pytest.mark.parametrize("gone", [0.12, 0.4])
def test_odometry_that_comes_and_goes_lets_a_landing_end_and_no_throttle_be_cut_in_the_air(gone: float) -> None:
    def flickering(flight: Flight, height: float, seconds: float, sinks: float = 0.0) -> Flight:
        odometry = at(height)
        for k in range(round(seconds / DT)):
            lost = k * DT % 0.5 < gone
            if not lost:
                odometry = dataclasses.replace(at(height - sinks * k * DT), time=flight.now)
            flight = flown(flight, having(UP, odometry=odometry, odometry_problem="too old" if lost else None))
        return flight

    assert flickering(sinking(), 4.0, 20.0, sinks=0.15).mode is Mode.LAND
    assert flickering(sinking(), 0.6, 6.0).mode is Mode.DONE  # on a table: sent down, it stays where it is
    assert flickering(sinking(), 0.05, 3.0).mode is Mode.DONE
    assert flickering(flown(taking_off(), BLIND), 0.05, 3.0).mode is Mode.DONE


def test_nothing_has_landed_while_the_link_is_down() -> None:
    silent = having(UP, link_problem="no answer", silent=True, odometry=at(0.79))
    flight = flown(hovering(), silent, 20.0)
    assert flight.mode is Mode.LAND and not flight.blind and flight.target is not None
    assert not has_stood(SETTINGS, flight, silent.odometry)  # nor is the throttle closed
    stands = dataclasses.replace(at(), time=flight.now)
    assert has_stood(SETTINGS, flown(flight, having(silent, odometry=stands), 0.4), stands) is False
    for _ in range(200):
        stands = dataclasses.replace(at(), time=flight.now)
        flight = flown(flight, having(silent, odometry=stands))
    assert has_stood(SETTINGS, flight, stands) and flight.mode is Mode.LAND
    flight = flown(hovering(), silent, 20.0)
    assert (
        flight.target.position[2] == 0.79 and flight.target.climb < -0.2
    )  # it sinks, in case only the answers are lost
    again = flown(flight, having(silent, link_problem=None), 0.5)
    assert again.target is not None and again.target.position[2] < 0.7 and again.mode is Mode.LAND
    assert flown(sinking(), having(BLIND, link_problem="no answer", silent=True), 60.0).mode is Mode.LAND
    assert flown(sinking(), having(BLIND, link_problem="no answer", silent=True, stands=True), 1.0).mode is Mode.LAND


def test_the_clock_of_a_blind_landing_stands_while_the_link_is_silent() -> None:
    silent = having(DEAF, link_problem="no answer", silent=True)
    longest = blind_time(1.0)
    half = flown(sinking(), DEAF, longest / 2)
    for _ in range(20):  # silent every other tenth of a second, it pauses and does not begin anew
        half = flown(half, silent, 0.1)
    assert flown(half, DEAF, longest / 2 - 0.3).mode is Mode.LAND
    assert flown(half, DEAF, longest / 2 + 0.3).mode is Mode.DONE
    flickering = sinking()
    for _ in range(round(longest / 0.1) - 2):
        flickering = flown(flown(flickering, silent, 0.1), DEAF, 0.1)
    assert flickering.mode is Mode.LAND
    assert flown(flickering, DEAF, 0.6).mode is Mode.DONE


def test_what_is_reckoned_far_under_the_ground_has_landed_but_not_while_the_link_is_silent() -> None:
    assert flown(sinking(), having(DEAF, buried=True)).mode is Mode.DONE
    assert (
        flown(sinking(), having(BLIND, buried=True), 1.0).mode is Mode.LAND
    )  # an accelerometer that works is waited for
    assert flown(sinking(), having(DEAF, buried=True, link_problem="no answer", silent=True), 1.0).mode is Mode.LAND
    assert flown(landing(), having(UP, pilot=LAND, buried=True)).mode is Mode.LAND  # the poses know better


def test_over_home_it_has_landed_only_where_something_is_felt_to_carry_it() -> None:
    still = having(UP, pilot=LAND, odometry=at(0.6))
    held = flown(landing(), still, 20.0)
    assert held.mode is Mode.LAND and held.target is not None
    assert held.target.position[2] < -5.0  # it is pressed down until it is felt
    assert flown(held, having(still, stands=True)).mode is Mode.DONE


def test_poses_that_contradict_the_sensors_count_as_lost() -> None:
    wrong = having(UP, motion_problem="they move otherwise than the accelerometer feels, by 0.9 m/s")
    for begin in (taking_off, hovering, policy_flying):
        flight = flown(begin(), having(wrong, pilot=POLICY if begin is policy_flying else HOVER))
        assert flight.mode is Mode.LAND and flight.blind and "by 0.9 m/s" in flight.reasons[0]
        assert flown(flight, UP, 2.0).blind  # until it has landed
    low = having(wrong, pilot=LAND, odometry=at(0.05 + NEAR_GROUND / 2))
    assert not flown(landing(), low).blind  # that is the shock of the ground
    touches = having(low, pilot=POLICY, policy_lands=True)
    assert flown(policy_flying(), touches).mode is Mode.POLICY  # and so it is where a policy lands
    assert flown(policy_flying(), having(touches, policy_lands=False)).blind
    assert flown(flown(with_pilot(), having(wrong, override=False)), UP).blind


def test_a_blind_landing_ends_for_good() -> None:
    """A vehicle that may lie on its side must not start its motors because it is seen again."""
    over = reached(Mode.DONE, sinking(), DEAF, blind_time(1.0) + 0.1)
    assert flown(over, UP, 1.0).mode is Mode.DONE


@pytest.mark.parametrize("seen", [BLIND, having(UP, pilot=LAND, odometry=at())])
def test_nothing_has_landed_while_the_accelerometer_shows_that_it_flies(seen: Inputs) -> None:
    """Whatever the poses say, and whatever time has passed: they may be those of another vehicle."""
    begun = sinking() if seen is BLIND else landing()
    flies = reached(Mode.LAND, begun, having(seen, stands=False), 60.0)
    assert flown(flies, having(seen, stands=True), 6.0).mode is Mode.DONE


def test_a_landing_from_high_above_is_over_soon_and_arrives_slowly() -> None:
    height, climb = 27.0, 0.0
    flight = dataclasses.replace(landing(), target=Target((0.0, 0.0, height), 0.0))
    begun, steps = flight.now, []
    while flight.mode is Mode.LAND and flight.now - begun < 60.0:
        odometry = dataclasses.replace(at(height, velocity=(0, 0, climb)), time=flight.now)
        flight = flown(flight, having(UP, pilot=LAND, odometry=odometry), settings=ELSEWHERE)
        climb = flight.target.climb if flight.target is not None and height > flight.home else 0.0
        height = max(height + climb * DT, flight.home)
        steps.append((height, climb))
    assert flight.mode is Mode.DONE and flight.now - begun < 20.0
    assert min(climb for height, climb in steps if height < 2.0) == -SETTINGS.land_speed
    assert min(climb for _, climb in steps) >= -FAST


TOP = blind_time(SETTINGS.fence.high[2] - hovering().home)
CLIMBING = having(DEAF, odometry=at(1.05, velocity=(0, 0, 4.0)))
LOST: dict[str, tuple[Callable[[], Flight], Inputs, float]] = {
    "whose accelerometer is not sure": (sinking, BLIND, 2 * blind_time(1.0) + BEYOND_S),
    "from an unknown height": (hovering, having(DEAF, odometry=None, odometry_problem=None), TOP),
    "from a height that is no number": (hovering, having(DEAF, odometry=at(math.nan), odometry_problem=None), TOP),
    "that begins in a climb": (lambda: flown(hovering(), CLIMBING), CLIMBING, blind_time(1.0, 4.0)),
}


@pytest.mark.parametrize("name", LOST)
def test_a_blind_landing_is_given_its_time_and_no_more(name: str) -> None:
    begin, lost, longest = LOST[name]
    assert flown(begin(), lost, longest - 0.2).mode is Mode.LAND
    assert flown(begin(), lost, longest + 0.2).mode is Mode.DONE


def test_the_link_alone_lands_with_odometry_and_disarming_counts_when_heard() -> None:
    cut = having(UP, link_problem="cut", armed=False, override=False)
    flight = flown(hovering(), cut)
    assert flight.mode is Mode.LAND and not flight.blind  # armed and override are unknown, not off
    assert flown(done(), having(cut)).mode is Mode.DONE
    assert flown(with_pilot(), having(cut, override=True)).mode is Mode.PILOT


class TestHandingOver:
    """The pilot flies by hand, and gives the vehicle back."""

    def test_in_the_air_it_hovers_where_it_is(self) -> None:
        flight = flown(with_pilot(), having(AWAY, odometry=at(2.0, x=1.0)))
        assert (flight.mode, flight.target) == (Mode.HOVER, Target((1.0, 0.0, 2.0), 0.0))
        assert flown(flight, having(AWAY, odometry=at(2.0, x=1.0))).mode is Mode.HOVER  # not at once to the policy

    def test_while_the_pilot_flies_the_target_follows_and_may_be_lost(self) -> None:
        away = having(UP, override=False, odometry=at(2.0, x=1.0))
        assert flown(with_pilot(), away).target == Target((1.0, 0.0, 2.0), 0.0)
        assert flown(with_pilot(), having(away, odometry_problem="too old")).target is None

    def test_without_odometry_it_lands_blind(self) -> None:
        flight = flown(with_pilot(), BLIND)
        assert flight.mode is Mode.LAND and flight.blind

    def test_on_the_ground_the_motors_stay_off(self) -> None:
        flight = flown(with_pilot(), having(override=False), 1.0)
        flight = flown(flight, having(pilot=HOVER))
        assert flight.mode is Mode.INIT and said(flight, Reason.OVERRIDE_ON)
        assert flown(flight, having(pilot=HOVER), 1.0).mode is Mode.INIT

    @pytest.mark.parametrize("begin", [ready, done])
    def test_taken_off_by_hand_it_is_not_let_fall(self, begin: Callable[[], Flight]) -> None:
        by_hand = having(UP, override=False)
        flight = flown(begin(), having(override=False), 0.5)
        assert flight.mode is begin().mode  # standing: it stays
        flight = reached(Mode.PILOT, flight, by_hand)
        assert flown(flight, UP).mode is Mode.HOVER

    def test_a_bridge_that_starts_in_flight_lets_the_pilot_fly(self) -> None:
        reached(Mode.PILOT, Flight(home=SETTINGS.ground_height), having(UP, override=False))

    def test_a_table_is_no_flight(self) -> None:
        table = having(odometry=at(0.9), armed=False, override=False)
        flight = flown(flown(Flight(), table), having(table, armed=True), 0.5)
        assert flight.mode is Mode.INIT and flight.home == 0.9


def test_sticks_move_the_hover_in_the_heading_of_the_vehicle_and_no_farther_than_the_fence() -> None:
    settings = dataclasses.replace(SETTINGS, reposition_speed=1.0, stick_deadband=0.2)
    for stick, change in (
        ({"pitch": 1.0}, (0, 0.1, 0, 0)),
        ({"roll": 1.0}, (0.1, 0, 0, 0)),
        ({"throttle": -1.0}, (0, 0, -0.1, 0)),
        ({"yaw": 1.0}, (0, 0, 0, -0.1)),
        ({"pitch": 0.6}, (0, 0.05, 0, 0)),
        ({"pitch": -0.2, "roll": 0.1, "throttle": 0.2, "yaw": -0.2}, (0, 0, 0, 0)),
    ):
        target = Target((0.5, 0.5, 1.0), math.pi / 2)  # looks along world y
        to = moved(settings, target, Pilot(Mission.HOVER, **stick), 0.1)
        np.testing.assert_allclose((*to.position, to.yaw), np.add((0.5, 0.5, 1.0, math.pi / 2), change), atol=1e-9)
    flight = hovering()
    for _ in range(100):
        flight = flown(flight, having(UP, pilot=Pilot(Mission.HOVER, pitch=1.0, throttle=1.0)), 0.1, ELSEWHERE)
    assert flight.target.position == (SETTINGS.fence.high[0], 0.0, SETTINGS.fence.high[2])


@hypothesis_settings(deadline=None)
@given(
    st.tuples(*[st.floats(-10, 10)] * 3), st.tuples(*[st.floats(-1, 1)] * 4), st.floats(-4, 4), st.floats(0, 0.1)
)  # fmt: skip
def test_sticks_never_lead_out_of_the_fence_nor_make_the_target_jump(
    start: tuple[float, float, float], sticks: tuple[float, ...], yaw: float, dt: float
) -> None:
    fence = SETTINGS.fence
    to = moved(SETTINGS, Target(start, yaw), Pilot(Mission.HOVER, *sticks), dt)
    for low, high, before, after in zip(fence.low, fence.high, start, to.position, strict=True):
        assert min(low, before) <= after <= max(high, before)
        assert abs(after - before) <= math.sqrt(2) * SETTINGS.reposition_speed * dt + 1e-9
    assert -math.pi <= to.yaw <= math.pi


def test_behind_a_filter_the_guard_ends_a_policy_outside_alone() -> None:
    near = having(AWAY, odometry=at(z=1.5, x=2.5, velocity=(3.0, 0.0, 0.0)))
    outside = having(AWAY, odometry=at(z=1.5, x=3.05))
    (ended,) = flown(policy_flying(), near).reasons
    assert ended.startswith(Reason.GUARD)
    assert flown(policy_flying(), having(near, filtered=True)).mode is Mode.POLICY
    (ended,) = flown(policy_flying(), having(outside, filtered=True)).reasons
    assert ended.startswith(Reason.OUTSIDE_FENCE)


@hypothesis_settings(deadline=None)
@given(
    st.tuples(*[st.floats(-2.9, 2.9)] * 2, st.floats(0.3, 4.4)), st.tuples(*[st.floats(-3.4, 3.4)] * 3)
)  # fmt: skip
def test_the_guard_takes_over_while_braking_still_stops_inside(
    position: tuple[float, ...], velocity: tuple[float, ...]
) -> None:
    """What the guard lets fly, brakes inside the fence after the reaction time; simulated, not by its formula."""
    fence = Fence(tilt=3.0)
    odometry = dataclasses.replace(at(), position=np.array(position), velocity=np.array(velocity))
    problem = fence_problem(fence, odometry)
    p, v, dt = np.array(position), np.array(velocity), 1e-3
    inside = True
    for i in range(800):
        inside = inside and bool((np.array(fence.low) - 0.01 <= p).all() and (p <= np.array(fence.high) + 0.01).all())
        p = p + v * dt
        if i * dt >= fence.reaction:
            v = np.sign(v) * np.maximum(np.abs(v) - fence.braking * dt, 0)
    assert inside or problem
    if problem:
        assert problem.startswith((Reason.GUARD, Reason.OUTSIDE_FENCE))
    target = stopping(fence, odometry)
    assert all(a < x < b for a, x, b in zip(fence.low, target.position, fence.high, strict=True))
    if not problem:
        np.testing.assert_allclose(target.position, p, atol=0.11)


@hypothesis_settings(deadline=None)
@given(st.floats(0.3, 2.5), st.floats(-3.0, 0.0), st.floats(0.0, 0.1), st.floats(0.0, 9.8), st.floats(0.0, 1.0))
def test_the_guard_counts_what_passes_before_the_braking(
    height: float, climb: float, age: float, thrust: float, roll: float
) -> None:
    """A vehicle that falls on until it brakes still stops above the floor; simulated, not by the guard's formula."""
    fence = Fence()
    quaternion = np.array([math.cos(roll / 2), math.sin(roll / 2), 0.0, 0.0])
    odometry = dataclasses.replace(
        at(), position=np.array([0.0, 0.0, height]), velocity=np.array([0.0, 0.0, climb]), quaternion=quaternion
    )
    problem = fence_problem(fence, odometry, age=age, force=np.array([0.0, 0.0, thrust]))
    falls, z, v, dt = thrust * math.cos(roll) - GRAVITY, height, climb, 1e-3
    for i in range(1500):
        z += v * dt
        v = v + falls * dt if i * dt < age + fence.reaction else min(v + fence.braking * dt, 0.0)
    assert problem or z > fence.low[2] - 0.01


@hypothesis_settings(deadline=None)
@given(st.floats(0.0, math.pi), st.floats(2.0, 8.0), st.floats(-4.0, -0.01), st.floats(5.0, 30.0), st.floats(0.0, 0.1))
def test_the_guard_foresees_a_dive_whose_thrust_turns_with_the_vehicle(
    pitch: float, rate: float, climb: float, thrust: float, age: float
) -> None:
    """A split-S: integrated in steps of 0.1 ms, while the nose comes up."""
    fence = Fence(low=(-100.0, -100.0, 0.2), high=(100.0, 100.0, 100.0), speed=100.0, tilt=3.2)
    quaternion = Rotation.from_euler("y", pitch).as_quat(scalar_first=True)
    odometry = dataclasses.replace(
        at(), velocity=np.array([3.0, 0.0, climb]), quaternion=quaternion, body_rate=np.array([0.0, -rate, 0.0])
    )
    wait, dt = age + fence.reaction + tilt_of(quaternion) / RIGHTING, 1e-4
    t = np.arange(0.0, wait, dt) + dt / 2
    falls = thrust * np.cos(pitch - rate * t) - GRAVITY
    gain, way = falls.sum() * dt, (falls * (wait - t)).sum() * dt
    then = climb + min(gain, 0.0)
    needed = -(climb * wait + min(way, 0.0)) + then**2 / (2 * fence.braking)
    for height, stops in ((0.2 + needed + 0.02, True), (0.2 + needed - 0.02, False)):
        placed = dataclasses.replace(odometry, position=np.array([0.0, 0.0, height]))
        problem = fence_problem(fence, placed, age=age, force=np.array([0.0, 0.0, thrust]))
        assert height < fence.low[2] or (problem is None) is stops


def test_where_a_fence_reaches_below_the_ground_nobody_is_sent_there() -> None:
    fence = Fence(low=(-9.0, -9.0, -9.0), high=(9.0, 9.0, 9.0))
    dives = dataclasses.replace(at(), position=np.array([0.0, 0.0, 1.0]), velocity=np.array([0.0, 0.0, -4.0]))
    assert stopping(fence, dives).position[2] < 0
    assert stopping(fence, dives, ground=0.5).position[2] > 1.0  # it brakes as hard as it can


@hypothesis_settings(deadline=None)
@given(st.floats(0.4, 1.5), st.floats(-4.0, -1.0))
def test_who_cannot_stop_inside_is_sent_back(height: float, climb: float) -> None:
    """The hover controller brakes as hard as it can only if its target is behind the vehicle."""
    fence = Fence()
    odometry = dataclasses.replace(at(), position=np.array([0.0, 0.0, height]), velocity=np.array([0.0, 0.0, climb]))
    target = stopping(fence, odometry)
    if fence_problem(fence, odometry):
        assert target.position[2] > height or target.position[2] == pytest.approx(fence.high[2] - 0.1)
    else:
        assert fence.low[2] < target.position[2] <= height


@hypothesis_settings(deadline=None)
@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
def test_heading_and_tilt(yaw: float, pitch: float, roll: float) -> None:
    turned = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    q = turned.as_quat(scalar_first=True)
    assert tilt_of(q) == pytest.approx(math.acos(max(-1.0, min(1.0, turned.apply([0, 0, 1])[2]))), abs=1e-6)
    assert math.cos(yaw_of(q) - yaw) == pytest.approx(1.0)


# What no sequence of inputs may bring about

EDGES = {
    Mode.INIT: {Mode.TAKEOFF, Mode.PILOT},
    Mode.TAKEOFF: {Mode.HOVER, Mode.LAND, Mode.PILOT, Mode.DONE},
    Mode.HOVER: {Mode.POLICY, Mode.LAND, Mode.PILOT, Mode.DONE},
    Mode.POLICY: {Mode.HOVER, Mode.LAND, Mode.PILOT, Mode.DONE},
    Mode.LAND: {Mode.PILOT, Mode.DONE},
    Mode.PILOT: {Mode.HOVER, Mode.LAND, Mode.INIT, Mode.DONE},
    Mode.DONE: {Mode.INIT, Mode.PILOT},
}
PLACES = st.builds(
    at,
    st.sampled_from([0.0, 0.05, 0.2, 0.6, 1.05, 2.0, 5.0, -1.0, math.nan, math.inf]),
    st.sampled_from([0.0, 0.0, 1.0, 2.9, 4.0, math.nan]),
    velocity=st.sampled_from([(0, 0, 0), (0, 0, 0), (0, 0, 0.3), (3.0, 0, 0), (0, 9.0, 0), (0, 0, -math.inf)]),
    roll=st.sampled_from([0.0, 0.0, 0.2, 0.5, 1.5, math.pi]),
)
NEWS = st.fixed_dictionaries(
    {},
    optional={
        "odometry": PLACES | st.none(),
        "odometry_problem": st.sampled_from([None, None, "too old"]),
        "link_problem": st.sampled_from([None, None, None, "cut"]),
        "armed": st.sampled_from([True, True, False]),
        "override": st.sampled_from([True, True, False]),
        "pilot": st.none()
        | st.builds(Pilot, st.sampled_from(Mission))
        | st.builds(Pilot, st.sampled_from(Mission), *[st.sampled_from([0.0, 0.0, 0.3, -1.0])] * 4),
        "voltage": st.sampled_from([4.0, 4.0, 3.0, None, math.nan]),
        "attitude_error": st.sampled_from([0.0, 0.0, 0.5, None, math.nan]),
        "silent": st.booleans(),
        "accelerometer_problem": st.sampled_from([None, None, None, "zero"]),
        "motion_problem": st.sampled_from([None, None, None, "mirrored"]),
        "stands": st.sampled_from([None, False, False, True]),
        "deaf": st.booleans(),
        "buried": st.sampled_from([False, False, False, True]),
        "heading_error": st.sampled_from([None, None, None, 0.2, -1.5, 3.1]),
        "policy_problem": st.sampled_from([None, None, "late"]),
        "policy_done": st.booleans(),
        "policy_lands": st.booleans(),
        "missed_deadlines": st.sampled_from([0, 0, 5]),
    },
)
"""What changes at a step; nearly every flight gets into the air, as it begins in one of the modes."""
PASSES = st.sampled_from([DT] * 6 + [1.0, 3600.0, -5.0, 0.0])
BEGUN = {
    ready: GOOD,
    taking_off: having(pilot=HOVER),
    hovering: UP,
    policy_flying: AWAY,
    landing: having(UP, pilot=LAND),
    sinking: BLIND,
    with_pilot: having(UP, override=False),
    done: GOOD,
}


@cache
def begun(begin: Callable[[], Flight]) -> Flight:
    return begin()


@pytest.mark.whole
@hypothesis_settings(max_examples=600, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.sampled_from([*BEGUN, Flight]), st.lists(st.tuples(NEWS, PASSES), max_size=25))
def test_no_sequence_of_inputs_breaks_the_rules(
    begin: Callable[[], Flight], story: list[tuple[dict[str, Any], float]]
) -> None:
    flight, inputs = begun(begin), BEGUN.get(begin, GOOD)
    for news, passes in story:
        before, inputs_before = flight, inputs
        inputs = dataclasses.replace(inputs, **news)
        inputs = dataclasses.replace(inputs, stands=None if inputs.deaf else inputs.stands)
        flight = step(SETTINGS, before, inputs, before.now + passes)
        check_rules(before, flight, inputs, inputs_before)


def check_rules(before: Flight, flight: Flight, inputs: Inputs, inputs_before: Inputs) -> None:
    seen = inputs.odometry is not None and not inputs.odometry_problem and bool(
        np.isfinite(np.concatenate([inputs.odometry.position, inputs.odometry.velocity])).all()
    )  # fmt: skip
    seen = seen and not flight.misled
    heard = not inputs.link_problem
    assert flight.mode is before.mode or flight.mode in EDGES[before.mode]
    assert flight.reasons or flight == Flight()
    # the pilot's switches
    if heard and not inputs.override:
        assert flight.mode not in AIRBORNE
    if heard and not inputs.armed:
        assert flight.mode in (Mode.DONE, Mode.INIT)
    if flight.mode is Mode.TAKEOFF and before.mode is Mode.INIT:
        assert inputs_before.pilot is not None and inputs_before.pilot.mission is Mission.LAND
        assert heard and inputs.armed and inputs.override and seen
        assert inputs.voltage == 4.0 and inputs.attitude_error == 0.0
        assert not inputs.accelerometer_problem and not inputs.motion_problem
    # what flies on good odometry flies on good odometry only
    if flight.mode in (Mode.TAKEOFF, Mode.HOVER, Mode.POLICY):
        assert seen and heard and (inputs.pilot is not None or before.mode is Mode.PILOT)
    if flight.mode is Mode.LAND:
        waiting = before.mode is Mode.LAND and before.blind and flight.found_since is not None
        assert flight.blind is not seen or (seen and flight.blind and waiting)
        assert flight.blind is (flight.target is None)
        assert flight.lost is not None or not flight.blind
    else:
        assert (flight.target is not None) is (
            flight.mode in (Mode.TAKEOFF, Mode.HOVER) or (flight.mode is Mode.PILOT and seen)
        )
    # nothing ends in the air for the sake of a link that is silent
    if before.mode in AIRBORNE and flight.mode is Mode.DONE and not heard and inputs.silent:
        assert said(flight, Reason.CRASHED)
    # nor does a landing while the accelerometer shows that the vehicle flies
    if before.mode in AIRBORNE and flight.mode is Mode.DONE and inputs.stands is False:
        assert said(flight, Reason.CRASHED) or said(flight, Reason.DISARMED)
    if flight.target is not None:
        assert np.isfinite((*flight.target.position, flight.target.yaw)).all()
    if flight.mode is Mode.POLICY:
        assert inputs.odometry is not None and inputs.pilot is not None
        assert inputs.pilot.mission is Mission.POLICY and inputs.pilot.deflection <= SETTINGS.stick_deadband
        assert fence_problem(SETTINGS.fence, inputs.odometry, floor=not inputs.policy_lands) is None
        assert not inputs.policy_problem and inputs.missed_deadlines == 0
        assert inputs.voltage == 4.0
    # time: whatever the clock does, a step is a step
    assert flight.now - flight.since >= -1e-6 or flight.mode is Mode.INIT
    if flight.mode is before.mode and before.now and flight.blind is before.blind:
        assert -1e-6 <= (flight.now - flight.since) - (before.now - before.since) <= LONGEST_STEP + 1e-6
    if flight.mode is before.mode is not Mode.PILOT and flight.target is not None and before.target is not None:
        rise = flight.target.position[2] - before.target.position[2]
        assert rise <= SETTINGS.reposition_speed * LONGEST_STEP + 1e-9 or flight.mode is Mode.LAND


def test_a_jump_of_the_clock_neither_ends_a_landing_nor_a_take_off() -> None:
    for jump in (3600.0, -3600.0):
        on_ground = flown(landing(), having(odometry=at()), 4.5)
        assert on_ground.still_since is not None
        jumped = step(SETTINGS, on_ground, having(odometry=at()), on_ground.now + jump)
        assert jumped.mode is Mode.LAND
        assert flown(jumped, having(odometry=at()), 2.0).mode is Mode.DONE
        jumped = step(SETTINGS, taking_off(), having(pilot=HOVER), START + jump)
        assert jumped.mode is Mode.TAKEOFF
        assert flown(jumped, having(pilot=HOVER), 8.0).mode in (Mode.LAND, Mode.DONE)
        lost = sinking()
        jumped = step(SETTINGS, lost, DEAF, lost.now + jump)
        assert jumped.mode is Mode.LAND
        assert flown(jumped, DEAF, blind_time(1.1)).mode is Mode.DONE


def seen_at(flight: Flight, seconds: float, where: Odometry, **changes: Any) -> Flight:
    """The flight after this time, with poses that go on."""
    for _ in range(round(seconds / DT)):
        now = flight.now + DT
        inputs = having(UP, odometry=dataclasses.replace(where, time=now), **changes)
        flight = step(SETTINGS, flight, inputs, now)
    return flight


@pytest.mark.parametrize(("stands", "ends"), [(None, True), (True, True), (False, False)])
def test_a_hover_that_stands_where_it_took_off_lands(stands: bool | None, ends: bool) -> None:
    """Its battery is too weak to lift it again: it would stand with open throttle."""
    flight = seen_at(hovering(), 1.5, at(0.06), stands=stands)
    assert (flight.mode in (Mode.LAND, Mode.DONE)) is ends
    assert seen_at(flight, 1.2, at(0.06), stands=stands).mode is (Mode.DONE if ends else Mode.HOVER)
    assert seen_at(hovering(), 5.0, at(0.3), stands=stands).mode is Mode.HOVER


@pytest.mark.parametrize("stands", [True, None])
def test_a_landing_ends_where_it_is_felt_to_stand_though_the_poses_drift(stands: bool | None) -> None:
    flight = landing()
    for k in range(round(1.5 / DT)):
        flight = seen_at(flight, DT, at(0.4 + 0.002 * k, velocity=(0.15, 0.0, 0.2)), pilot=LAND, stands=stands)
    assert (flight.mode is Mode.DONE) is (stands is True)


def test_the_time_that_a_hover_stayed_at_its_place_is_not_that_of_the_landing() -> None:
    flight = seen_at(hovering(), 5.0, at(2.0))
    lost = having(UP, odometry=dataclasses.replace(at(2.0), time=flight.now), odometry_problem="jump")
    assert flown(flight, lost, 1.0).mode is Mode.LAND


@pytest.mark.parametrize(("stands", "ends"), [(None, True), (False, False)])
def test_a_take_off_that_does_not_lift_ends_soon(stands: bool | None, ends: bool) -> None:
    """It would stand with open throttle. Poses that hardly move are no ground if the vehicle is felt to fly."""
    flight = taking_off()
    for k in range(round(2.7 / DT)):
        inputs = having(pilot=HOVER, odometry=dataclasses.replace(at(), time=flight.now + DT), stands=stands)
        flight = step(SETTINGS, flight, inputs, flight.now + DT)
        assert flight.mode is Mode.TAKEOFF or k * DT > 2.3
    assert (flight.mode is Mode.DONE) is ends
    assert not ends or said(flight, Reason.NOT_CLIMBING)


@pytest.mark.parametrize("deaf", [True, False])
def test_the_clock_of_a_blind_landing_stands_while_the_controller_flies_its_failsafe(deaf: bool) -> None:
    """It may climb: motors that stop when its receiver comes back would stop high above the ground."""
    flight = reached(Mode.LAND, sinking(), having(DEAF if deaf else BLIND, failsafe=True), 30.0)
    assert flown(flight, having(DEAF), 0.5).mode is Mode.LAND
    assert flown(flight, having(DEAF), 20.0).mode is Mode.DONE
