"""What the controller's sensors tell without poses: after silence, after wrong poses, by a broken accelerometer."""

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest

from e2efly.flight.attitude import Attitude
from e2efly.flight.pilot.inertial import BURIED, Inertial, Measurement, alone, carry, measure, see
from e2efly.flight.pilot.touch import LAGS
from e2efly.policy.odometry import Odometry
from e2efly.vehicles.gravity import GRAVITY

DT = 0.02
"""Between two measurements, s."""
COUNTS = 2048.0 / GRAVITY
LEVEL = Attitude(0.0, 0.0, 0.0)
DOUBT = 0.05
"""How far the throttle map may be off, m/s^2."""


def measurement(
    force: float,
    thrust: float | None = GRAVITY,
    *,
    now: float = 0.0,
    jitter: float = 0.0,
    climb: float | None = None,
    acts: bool = True,
    delivered: bool = True,
) -> Measurement:
    counts = COUNTS * np.array([jitter, 0.0, force])
    told, thrusts = (None, ()) if thrust is None else ((thrust, DOUBT), (thrust,) * len(LAGS))
    return Measurement(
        counts, np.zeros(3), LEVEL, told, thrusts, now, acts=acts, delivered=delivered, standing=thrust is None,
        flying=thrust is not None, climb=climb,
    )  # fmt: skip


def pose(time: float, height: float = 2.0, climb: float = 0.0) -> Odometry:
    return Odometry(time, np.array([0, 0, height]), np.array([0, 0, climb]), np.array([1.0, 0, 0, 0]), np.zeros(3))


def seen(inertial: Inertial, now: float, height: float = 2.0, climb: float = 0.0) -> Inertial:
    return see(inertial, pose(now, height, climb), now, moved=True, trusted=True, turned=0.0, latest=0.03)


def at_rest() -> Inertial:
    return measure(Inertial(), measurement(GRAVITY, None), 0.0)


def hovering(until: float = 3.0, *, factor: float = 1.0, climb: float = 0.0) -> Inertial:
    """A quiet hover with good poses; the accelerometer tells `factor` of the force, the poses tell `climb`, m/s."""
    inertial, now = at_rest(), 0.0
    while now < until:
        now += DT
        told = measurement(factor * GRAVITY, jitter=0.01 * math.sin(now), climb=climb)
        inertial = seen(measure(inertial, told, now), now, climb=climb)
    return inertial


def climb_of(inertial: Inertial) -> float:
    return inertial.reckoned.climb


def test_after_a_silence_the_held_command_counts_unless_the_others_are_known_to_have_come() -> None:
    """They were lowered during one second of it. The force afterwards is that of the new ones in both cases."""
    inertial, now, low = hovering(), 3.0, 0.8 * GRAVITY
    while now < 4.0:
        now += DT
        inertial = carry(inertial, LEVEL, (low, DOUBT), now, held=(GRAVITY, DOUBT))
    assert climb_of(inertial) == pytest.approx(low - GRAVITY, abs=0.15)  # m/s, after the second
    after = measure(inertial, measurement(low, low, delivered=False), now + DT)
    assert climb_of(after) == pytest.approx(0.0, abs=0.15)
    acknowledged = measure(inertial, measurement(low, low), now + DT)
    assert climb_of(acknowledged) == pytest.approx(low - GRAVITY, abs=0.15)


@pytest.mark.parametrize("acts", [False, True])
def test_a_silence_in_which_the_velocity_changed_teaches_nothing(acts: bool) -> None:
    """Held at much thrust for a second, it climbs, and then neither its new velocity nor its throttle is a measure."""
    before = hovering(factor=0.97)
    inertial, now = before, 3.0 + 1.0
    for _ in range(40):
        now += DT
        thrust = GRAVITY if acts else 0.8 * GRAVITY
        told = measurement(0.97 * GRAVITY, thrust, now=now, jitter=0.01 * math.sin(now), climb=3.0, acts=acts)
        inertial = seen(measure(inertial, told, now), now, climb=3.0)
    assert inertial.scale.value == pytest.approx(before.scale.value, abs=0.01)
    assert inertial.share == pytest.approx(before.share, abs=0.01)
    if not acts:
        assert inertial.share == before.share and inertial.touch.sums == before.touch.sums


def test_without_poses_the_share_follows_a_battery_that_sags_but_no_accelerometer_that_jumps() -> None:
    def share(force: Callable[[float], float], acts: bool = True) -> float:
        inertial, now = hovering(), 3.0
        for _ in range(200):
            now += DT
            noise = 0.3 * math.sin(40 * now)  # of the rotors
            told = measurement(GRAVITY * force(now - 3.0) + noise, now=now, jitter=0.01 * math.sin(now), acts=acts)
            inertial = measure(inertial, told, now)
        return inertial.share

    assert share(lambda time: 1 - 0.03 * time) == pytest.approx(0.89, abs=0.02)
    assert share(lambda time: 1 - 0.03 * time, acts=False) == pytest.approx(1.0, abs=0.005)
    assert share(lambda time: 1.0) == pytest.approx(1.0, abs=0.01)
    for step in (0.9, 1.1):
        assert share(lambda time, step=step: 1.0 if time < 1 else step) == pytest.approx(1.0, abs=0.015)


def test_a_pause_between_two_measurements_is_no_silence() -> None:
    inertial = hovering()
    inertial = carry(inertial, LEVEL, (0.8 * GRAVITY, DOUBT), 3.05, held=(GRAVITY, DOUBT))
    by_what_was_sent = climb_of(inertial)
    assert by_what_was_sent < -0.05
    assert climb_of(measure(inertial, measurement(GRAVITY, 0.8 * GRAVITY, delivered=False), 3.06)) == by_what_was_sent


def test_poses_that_come_during_a_silence_begin_the_reckoning_of_what_was_held_anew() -> None:
    inertial, now = hovering(), 3.0
    while now < 4.0:
        now += DT
        inertial = carry(inertial, LEVEL, (0.8 * GRAVITY, DOUBT), now, held=(GRAVITY, DOUBT))
    inertial = seen(inertial, now, climb=-0.7)
    assert inertial.held is not None and inertial.held.newest == inertial.reckoned
    after = measure(inertial, measurement(GRAVITY, 0.8 * GRAVITY, delivered=False), now + DT)
    assert climb_of(after) == pytest.approx(-0.7, abs=0.05)


def test_wrong_poses_teach_no_scale() -> None:
    """Poses that begin to tell a climb that is not: what the last second taught is forgotten, if they were wrong."""
    inertial, now = hovering(factor=0.95), 3.0
    good = inertial.scale.value
    assert good == pytest.approx(1 / 0.95, abs=0.01)
    for k in range(40):
        now += DT
        told = measurement(0.95 * GRAVITY, jitter=0.01 * math.sin(now), climb=1.5 * k * DT)
        inertial = seen(measure(inertial, told, now), now, climb=1.5 * k * DT)
    assert inertial.scale.value > good + 0.05
    assert alone(inertial, wrong=False).scale == inertial.scale
    forgotten = alone(inertial, wrong=True)
    assert forgotten.scale.value == pytest.approx(good, abs=0.02)
    assert climb_of(forgotten) < climb_of(inertial) - 0.3  # and their newest speeds count no more


@pytest.mark.parametrize("frozen", [True, False])
def test_what_is_far_under_the_ground_and_was_not_seen_for_long_is_buried(frozen: bool) -> None:
    inertial, now = hovering(), 3.0
    while now < 6.0:
        now += DT
        jitter = 0.0 if frozen else 0.01 * math.sin(now)
        inertial = measure(
            inertial, measurement(GRAVITY, (0.9 + 0.05 * math.sin(9 * now)) * GRAVITY, jitter=jitter), now
        )
        inertial = carry(inertial, LEVEL, (0.9 * GRAVITY, DOUBT), now)
    reckoned = inertial.reckoned
    assert reckoned is not None
    deep = dataclasses.replace(reckoned, height=-BURIED - 0.1)
    inertial = dataclasses.replace(inertial, reckonings=dataclasses.replace(inertial.reckonings, newest=deep))
    assert inertial.frozen is frozen
    assert inertial.buried(0.0, now)
    assert not inertial.buried(-0.2, now)
    recent = dataclasses.replace(deep, since=now - 1.0)
    inertial = dataclasses.replace(inertial, reckonings=dataclasses.replace(inertial.reckonings, newest=recent))
    assert not inertial.buried(0.0, now)


def test_an_accelerometer_that_is_unlike_the_thrust_or_silent_leaves_the_reckoning_to_the_throttle() -> None:
    for force, at in ((2.0 * GRAVITY, 3.0), (0.0, 3.0), (GRAVITY, 2.8)):
        inertial = dataclasses.replace(hovering(), force=np.array([0.0, 0.0, force]), time=at)
        inertial = carry(inertial, LEVEL, (0.9 * GRAVITY, DOUBT), 3.05, held=(0.9 * GRAVITY, DOUBT))
        assert inertial.reckoned.velocity[2] == pytest.approx(-0.1 * GRAVITY * 0.05, abs=0.01)


def test_what_a_fall_taught_does_not_outlast_it() -> None:
    """The scale that a vehicle learned while it tumbled ended its next take-off."""
    fallen = hovering(factor=0.9)
    assert fallen.scale.value > 1.05 and fallen.watch.moved >= 0.0
    again = fallen.at_rest()
    assert again.scale.value == 1.0 and again.share == 1.0 and not again.learned and not again.frozen
    assert again.rest_problem is None and again.watch.felt == () and again.touch.sums == ()


def test_a_pause_of_the_poses_in_which_the_velocity_changed_teaches_no_scale() -> None:
    inertial, now = hovering(factor=0.97), 3.0
    before = inertial.scale.value
    for k in range(80):
        now += DT
        told = measurement(0.97 * GRAVITY, now=now, jitter=0.01 * math.sin(now), climb=None if k < 40 else 2.0)
        inertial = measure(inertial, told, now)
    assert inertial.scale.value == pytest.approx(before, abs=0.01)


@pytest.mark.parametrize(
    ("scale", "accelerometer", "throttle", "told"),
    [
        (1.0, 1.0, 1.0, False), (1.0, 1.1, 1.0, False), (1.0, 1.0, 1.15, False), (1.0, 0.9, 1.1, False),
        (0.5, 1.0, 1.0, True), (0.3, 1.0, 1.0, True), (0.01, 1.05, 1.05, True),
    ],
)  # fmt: skip
def test_scaled_poses_are_told_in_a_take_off_from_one_wrong_sensor(
    scale: float, accelerometer: float, throttle: float, told: bool
) -> None:
    """The vehicle climbs faster and faster, until its poses show the wanted speed."""
    inertial, climb, problems = hovering().at_rest(), 0.0, []
    for k in range(100):
        now = 3.0 + (k + 1) * DT
        thrust = GRAVITY + min(1.5, 1.5 * k * DT)
        climb += (thrust - GRAVITY) * DT
        inertial = carry(inertial, LEVEL, (throttle * thrust, DOUBT), now)
        inertial = measure(inertial, measurement(accelerometer * thrust, throttle * thrust), now)
        inertial = seen(inertial, now, climb=scale * climb)
        problems.append(inertial.climbs_faster)
    assert any(problems) is told
    begun = alone(inertial, wrong=True)
    assert climb_of(begun) == pytest.approx(climb, abs=0.1) or not told or accelerometer != 1.0
