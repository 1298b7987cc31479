"""The campaign of faults: what it draws, what its faults do to samples, and what it calls a failure."""

import dataclasses
import json
import math
from unittest.mock import Mock

import numpy as np
import pytest

from e2efly.flight.link import StreamLink
from e2efly.flight.sight.image_source import Frame
from e2efly.policy.odometry import Sample
from tests.faults import blocks
from tests.faults.campaign import STRUCK_IN, Scenario, beyond
from tests.faults.campaign_rules import Span, judge
from tests.faults.faulty import FaultyImages, FaultyLink
from tests.faults.injected_fliers import mirrored as mirrored_image
from tests.faults.injected_fliers import miscalibrated, negative, transposed
from tests.faults.injected_poses import conjugated, mirrored, north_east_down, scalar_last, velocity_as
from tests.faults.injection import Rule
from tests.faults.injections import FAILSAFE_S, KINDS, NO_POWER, Strike
from tests.faults.scenarios import CASES, drawn
from tests.faults.stage import Trace

SEEDS = range(240)
YAW = 0.6
SAMPLE = Sample(
    3.0, np.array([1.0, 2.0, 3.0]), np.array([math.cos(YAW / 2), 0.0, 0.0, math.sin(YAW / 2)]), 3.0,
    np.array([0.1, 0.2, 0.3]), np.array([0.4, 0.5, 0.6]),
)  # fmt: skip
STEP_S = 0.01


def trace(height: list[float], motor: float | list[float] = 0.6, throttle: float = 0.4) -> Trace:
    """Of heights of the feet, m, at each control step; the centre of mass is 0.05 m above them."""
    z, count = np.array(height), len(height)
    climb = np.diff(z, prepend=z[0]) / STEP_S
    return Trace(
        time=[STEP_S * i for i in range(count)],
        position=[np.array([0.0, 0.0, h + 0.05]) for h in z],
        velocity=[np.array([0.0, 0.0, v]) for v in climb],
        tilt=[0.0] * count,
        armed=[True] * count,
        throttle=[throttle] * count,
        motor=[motor] * count if isinstance(motor, float) else motor,
    )


def broken(of: Trace, spans: tuple[Span, ...] = (), *, planned: float = 0.0, ended: bool = True) -> list[str]:
    """The rules that a flight breaks."""
    return [str(v.rule) for v in judge(of, 0.05, planned, 0.0, list(spans), ended)[1] if not v.beyond]


def line(begin: float, end: float, speed: float) -> list[float]:
    """Heights of a climb or a descent at a speed, m/s."""
    return np.linspace(begin, end, max(round(abs(end - begin) / speed / STEP_S), 2)).tolist()


STANDS = [0.0] * 50


def test_a_gentle_landing_breaks_no_rule() -> None:
    flight = line(2.0, 0.0, 0.6) + STANDS
    assert broken(trace(flight)) == []


def test_motors_off_in_the_air_are_found_at_the_height_where_they_went_off() -> None:
    flight = line(2.0, 1.2, 0.6) + line(1.2, 0.0, 1.4) + STANDS
    running = round(0.8 / 0.6 / STEP_S)
    figures, violations = judge(
        trace(flight, [0.6] * running + [0.0] * (len(flight) - running)), 0.05, 0.0, 0.0, [], True
    )
    assert figures["off_height"] == pytest.approx(1.2, abs=0.02)
    assert [v.rule for v in violations] == [Rule.OFF]
    assert violations[0].after == pytest.approx(0.8 / 0.6, abs=0.02)


def test_a_closed_throttle_is_motors_off_although_the_firmware_turns_them_to_level() -> None:
    assert broken(trace(line(1.0, 0.0, 1.0) + STANDS, throttle=0.0)) == ["motors off"]


def test_a_climb_is_counted_from_where_the_fault_found_it_or_from_the_hover_it_was_to_come_to() -> None:
    flight = line(0.0, 2.4, 1.0) + line(2.4, 0.0, 1.0) + STANDS
    assert broken(trace(flight)) == ["climb"]
    assert broken(trace(flight), planned=0.7) == []


def test_a_fast_touch_counts_from_low_only() -> None:
    assert broken(trace(line(2.0, 0.0, 1.6) + STANDS)) == ["touch"]
    assert broken(trace(line(3.5, 0.0, 1.6) + STANDS)) == []


def test_standing_with_open_throttle_and_never_ending_are_failures() -> None:
    assert broken(trace([0.0] * 350)) == ["armed on the ground"]
    assert broken(trace([0.0] * 250)) == []
    assert broken(trace([1.0] * 250), ended=False) == ["does not end"]


def test_what_nobody_on_board_can_help_is_told_apart() -> None:
    fall = trace(line(2.0, 0.0, 3.0) + STANDS, 0.0)
    _, violations = judge(fall, 0.05, 0.0, 0.0, [Span(0.0, math.inf, NO_POWER)], True)
    assert {v.rule: v.beyond for v in violations} == {Rule.OFF: NO_POWER.why, Rule.TOUCH: NO_POWER.why}
    silent = Scenario("", "hover", (Strike("link: silent", 1.0, 2.0),))
    assert [(s.begin, s.end) for s in beyond(silent, 10.0)] == [(11.0, 13.0)]
    reboot = Scenario("", "hover", (Strike("controller: reboots", 1.0, 2.0),))
    assert [(s.begin, s.end) for s in beyond(reboot, 10.0)] == [(11.0, math.inf)]
    assert beyond(Scenario("", "hover", (Strike("poses: none"),)), 0.0) == []


def test_a_climb_that_goes_on_when_the_bridge_has_the_motors_again_is_its_own() -> None:
    silent = tuple(beyond(Scenario("", "hover", (Strike("link: silent", 0.0, 2.5),)), 0.0))
    carried = line(0.0, 2.5, 1.0)
    assert broken(trace(carried + line(2.5, 0.0, 1.0) + STANDS), silent) == []
    assert broken(trace(carried + line(2.5, 4.4, 1.0) + line(4.4, 0.0, 1.0) + STANDS), silent) == []
    short = line(0.0, 1.9, 1.0) + line(1.9, 2.3, 1.0)  # what passes the limit after it is not the bridge's alone
    begun = tuple(beyond(Scenario("", "hover", (Strike("link: silent", 0.0, 1.9),)), 0.0))
    assert broken(trace(short + line(2.3, 0.0, 1.0) + STANDS), begun) == []
    assert broken(trace(carried + line(2.5, 4.7, 1.0) + line(4.7, 0.0, 1.0) + STANDS), silent) == ["climb"]


def test_the_receivers_silence_excuses_nothing_before_the_firmwares_failsafe() -> None:
    silent = Scenario("", "hover", (Strike("receiver: silent", 1.0, 2.0),))
    assert [(s.begin, s.end) for s in beyond(silent, 10.0)] == [(11.0 + FAILSAFE_S, 13.0)]


def test_a_second_bridge_is_no_excuse_where_it_was_there_before_the_take_off() -> None:
    strikes = (Strike("second bridge: waits on the ground", 0.0, 1.0, {"share": 0.1}),)
    assert beyond(Scenario("", "init", strikes), 0.0) == []
    assert len(beyond(Scenario("", "hover", strikes), 0.0)) == 1


def test_faults_of_two_fliers_cannot_be_flown_together() -> None:
    strikes = (Strike("images: none"), Strike("commands: jump"))
    with pytest.raises(ValueError, match="strikes need commands and sight to fly; accepted: one of them"):
        Scenario("", "policy", strikes)


def test_a_seed_is_always_the_same_flight_and_survives_json() -> None:
    for seed in SEEDS:
        scenario = drawn(seed)
        assert scenario == drawn(seed)
        assert Scenario.of(json.loads(json.dumps(dataclasses.asdict(scenario)))) == scenario


def test_the_campaign_draws_pairs_and_triples_of_every_kind_in_every_mode() -> None:
    scenarios = [drawn(seed) for seed in SEEDS]
    assert {len(s.strikes) for s in scenarios} == {2, 3}
    assert {s.mode for s in scenarios} == {str(mode) for mode in STRUCK_IN}
    assert {strike.kind for s in scenarios for strike in s.strikes} == set(KINDS)
    assert all(list(s.strikes) == sorted(s.strikes, key=lambda strike: strike.at) for s in scenarios)


def test_a_block_of_seeds_is_published_by_one_state_of_the_package_alone() -> None:
    used, first = blocks.next_of((), "aaa", "2026-01-01")
    assert (first.seeds, used) == (range(10_000, 10_500), (first,))
    assert blocks.next_of(used, "aaa", "2026-01-02") == (used, first)  # it was killed, and goes on
    used, second = blocks.next_of(used, "bbb", "2026-01-03")
    assert second.seeds == range(10_500, 11_000)
    assert blocks.used_in(json.loads(json.dumps(blocks.told(used)))) == used == (first, second)


def test_seeds_that_are_not_published_yet_are_not_for_work() -> None:
    used, _ = blocks.next_of((), "aaa", "2026-01-01")
    assert blocks.problem_of(range(9_000, 10_000), ()) is None
    assert blocks.problem_of([10_499], used) is None
    for seeds, known in (([3, 10_000], ()), (range(9_999, 10_001), ()), ([10_500], used), ([-1], ())):
        assert "accepted: 0 to" in str(blocks.problem_of(seeds, known))


def test_named_flights_have_names_of_their_own() -> None:
    assert len({case.name for case in CASES}) == len(CASES)


def test_what_is_unknown_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match=r"kind is 'poses: purple'; accepted: .*poses: none"):
        Strike("poses: purple")
    with pytest.raises(ValueError, match=r"mode is 'pilot'; accepted: init, takeoff, hover, policy, land"):
        Scenario("", "pilot", ())
    with pytest.raises(ValueError, match=r"height is -1; accepted"):
        Scenario("", "hover", (), -1)


def test_axes_are_mirrored_in_position_and_velocity() -> None:
    up = mirrored("z")(SAMPLE)
    assert up.position.tolist() == [1.0, 2.0, -3.0]
    assert up.velocity is not None
    assert up.velocity.tolist() == [0.1, 0.2, -0.3]
    np.testing.assert_allclose(mirrored("yaw")(SAMPLE).quaternion, SAMPLE.quaternion * (1, 1, 1, -1), atol=1e-12)


def test_north_east_down_of_a_level_vehicle_is_level_and_twice_is_nothing() -> None:
    turned = north_east_down()(SAMPLE)
    assert turned.position.tolist() == [2.0, 1.0, -3.0]
    w, x, y, z = turned.quaternion
    assert (x, y) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert math.remainder(2 * math.atan2(z, w) - (math.pi / 2 - YAW), math.tau) == pytest.approx(0.0, abs=1e-9)
    again = north_east_down()(turned)
    np.testing.assert_allclose(again.position, SAMPLE.position)
    assert abs(float(again.quaternion @ SAMPLE.quaternion)) == pytest.approx(1.0)


def test_quaternions_in_other_orders() -> None:
    w, x, y, z = SAMPLE.quaternion
    assert scalar_last()(SAMPLE).quaternion.tolist() == [x, y, z, w]
    assert conjugated()(SAMPLE).quaternion.tolist() == [w, -x, -y, -z]


def test_velocity_negated_zero_or_absent() -> None:
    assert velocity_as("absent")(SAMPLE).velocity is None
    assert velocity_as("absent")(SAMPLE).body_rate is None
    for how, share in (("negated", -1.0), ("zero", 0.0)):
        changed = velocity_as(how)(SAMPLE)
        assert changed.velocity is not None
        np.testing.assert_allclose(changed.velocity, share * np.array([0.1, 0.2, 0.3]))


def test_images_keep_their_shape_and_say_something_else() -> None:
    image = np.arange(12.0).reshape(3, 4)
    assert mirrored_image("columns")(image)[0].tolist() == [3, 2, 1, 0]
    assert mirrored_image("rows")(image)[0].tolist() == [8, 9, 10, 11]
    assert transposed()(image)[0].tolist() == [0, 4, 4, 8]
    assert negative()(image)[0].tolist() == [11, 10, 9, 8]
    np.testing.assert_array_equal(miscalibrated(1.0, 0.0, 1.0)(image), image)
    assert miscalibrated(2.0, 0.0, 0.5)(image)[1].tolist() == [2.5, 2.5, 3.0, 3.0]


def test_late_images_say_when_they_were_taken_or_do_not() -> None:
    source = Mock(read=lambda now: [Frame(now, np.zeros((2, 2)))] if now < 0.05 else [])
    for stamped, said in ((True, 0.0), (False, 0.3)):
        camera = FaultyImages(source)
        camera.delay, camera.stamped = 0.3, stamped
        assert camera.read(0.0) == []
        assert [frame.time for frame in camera.read(0.3)] == [said]


def test_a_pulled_plug_breaks_the_link_until_it_is_back() -> None:
    port = Mock(connected=lambda: True, read=lambda: b"", write=len)
    link = FaultyLink(StreamLink("port", lambda: port), np.random.default_rng(0))
    link.poll(0.0)
    link.gone = True
    assert link.alive
    link.receive()
    assert not link.alive
    assert link.reason == "port: Input/output error"
    for now in (1.0, 2.0, 3.0):
        link.poll(now)
    assert link.reason == "port: No such file or directory"
    link.gone = False
    link.poll(6.0)
    assert (link.alive, link.connections) == (True, 2)


def test_standing_with_the_throttle_that_a_silent_link_left_open_counts_from_its_return() -> None:
    silent = Scenario("", "hover", (Strike("link: silent", 0.0, 2.0),))
    assert broken(trace([0.0] * 450), tuple(beyond(silent, 0.0))) == []
    assert broken(trace([0.0] * 550), tuple(beyond(silent, 0.0))) == ["armed on the ground"]
