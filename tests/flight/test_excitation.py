"""The excitation flight, which the bridge flies as a policy: inside the fence, whatever the vehicle, and so long."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from e2efly.control.manoeuvres import (
    CHIRPED,
    KICK,
    PULSE,
    SWEEP,
    THRUST,
    ManoeuvreRoom,
    chirps,
    fastest,
    kick_for,
    kicks,
    length_for,
)  # fmt: skip
from e2efly.flight.excitation import ExcitationOptions, InPlace, StepsOptions, excitation
from e2efly.flight.pilot.fence import fence_problem
from e2efly.flight.settings import Fence, FlightSettings
from e2efly.policy.odometry import Odometry
from e2efly.policy.runtime import Runtime, act, begin
from e2efly.validation.plant import Delay, Plant, RigidState
from e2efly.validation.plants import find_plant
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle

FILE = load_vehicle("vis_r")
SETTINGS = FlightSettings()


def far_off(seed: int) -> Vehicle:
    """A vehicle as far from the file as `benchmarks/identify.py` draws them, at the ends of its ranges."""
    sign = np.random.default_rng(seed).choice([-1.0, 1.0], 8)
    thrust = 1 + 0.12 * sign[0]
    return dataclasses.replace(
        FILE,
        mass=FILE.mass * (1 + 0.2 * sign[1]),
        thrust_map=FILE.thrust_map * thrust,
        rotor_thrust_max=FILE.rotor_thrust_max * thrust,
        inertia=FILE.inertia * (1 + 0.3 * sign[2]),
        motor_time_constant=FILE.motor_time_constant * (1 + 0.4 * sign[3]),
        drag_quadratic=FILE.drag_quadratic * (1 + 0.5 * sign[4]),
        rate_gain=FILE.rate_gain * (1 + 0.3 * sign[5]),
        latency=0.08 if sign[6] > 0 else 0.02,
    )


def flown(body: Vehicle, options: InPlace, settings: FlightSettings = SETTINGS) -> tuple[list[Odometry], np.ndarray]:
    """Motion and command at every control step, from a hover beside the middle until it is over."""
    acts, course = excitation(FILE, settings, options)
    runtime = Runtime.of(acts, course, FILE)
    plant: Plant = find_plant("mujoco")(FILE)
    plant.meet(body)
    start = (0.5, -0.5, settings.ground_height + settings.takeoff_height)
    plant.reset(RigidState(np.array(start), np.zeros(3), np.eye(4)[0], np.zeros(3)))
    delay = Delay.of(body.latency, np.array([GRAVITY, 0.0, 0.0, 0.0]))
    # the throttle map has learned in the hover before: thrust over mass is nearly what was asked for
    scale = np.array([body.mass * FILE.thrust_map[0] / (FILE.mass * body.thrust_map[0]), 1.0, 1.0, 1.0])
    state, motions, commands = begin(runtime, plant.state.odometry(0.0), 0.0), [], []
    for k in range(round(acts.schedule.seconds / runtime.period) + 10):
        now, then = k * runtime.period, (k + 1) * runtime.period
        odometry = plant.state.odometry(now)
        state, decision = act(runtime, state, odometry, now)
        if state.done:
            break
        motions.append(odometry)
        commands.append(decision.command)
        delay = delay.send(decision.command, now)
        delay, parts = delay.until(now, then)
        for command, held in parts:
            plant.step(command * scale, held)
    assert state.done
    return motions, np.array(commands)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("seed", [0, 1])
def test_it_stays_inside_the_fence_with_a_vehicle_that_is_not_the_files(seed: int) -> None:
    motions, commands = flown(far_off(seed), ExcitationOptions(seconds=30.0))
    assert len(motions) == pytest.approx(3000, abs=1)  # and ends by itself
    assert {problem for m in motions if (problem := fence_problem(SETTINGS.fence, m))} == set()
    velocity = np.array([m.velocity for m in motions])
    assert np.all(np.abs(velocity[:, :2]).max(0) > 1.8)  # lines that show a drag, in this room
    assert np.all(np.ptp(commands[:, 1:], axis=0) > 3.0)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("seed", [0, 1])
def test_steps_are_what_was_asked_for_from_a_hover_at_the_place_and_end_by_themselves(seed: int) -> None:
    """Three pairs of each command, both signs first; nothing else is commanded meanwhile."""
    options = StepsOptions()
    motions, commands = flown(far_off(seed), options)
    assert {problem for m in motions if (problem := fence_problem(SETTINGS.fence, m))} == set()
    length, rest = round(100 * options.length), round(100 * 0.2)
    for channel, size in ((0, options.thrust), (1, options.rate), (2, options.rate), (3, options.rate)):
        others = [i for i in (1, 2, 3) if i != channel]
        found = []
        for k in range(1, len(commands) - 2 * length - rest):
            pair, before = commands[k : k + 2 * length], commands[k - rest + 2 : k]
            change = pair[:, channel] - before[-1, channel] if len(before) else np.zeros(2 * length)
            wanted = size * np.repeat([1.0, -1.0], length)
            bare = len(before) and not np.ptp(before, axis=0).any() and not np.any(commands[k : k + 2 * length, others])
            if bare and any(np.allclose(change, sign * wanted, atol=1e-5) for sign in (1, -1)):
                found.append((k, np.sign(change[0])))
        assert [sign for _, sign in found] == [1.0, -1.0, 1.0]
        for k, _ in found:
            assert np.linalg.norm(motions[k].position - np.mean([m.position for m in motions], 0)) < 0.6
            assert np.linalg.norm(motions[k].velocity) < 0.4


def test_a_larger_room_is_flown_faster() -> None:
    wide = dataclasses.replace(SETTINGS, fence=Fence(low=(-12.0, -12.0, 0.2), high=(12.0, 12.0, 6.0), speed=8.0))
    short = ExcitationOptions(seconds=15.0)
    slow, fast = (np.array([m.velocity for m in flown(FILE, short, settings)[0]]) for settings in (SETTINGS, wide))
    assert np.abs(fast[:, :2]).max() > 1.5 * np.abs(slow[:, :2]).max()


@pytest.mark.parametrize(
    ("fence", "said"),
    [
        ({"low": (-0.5, -3.0, 0.2), "high": (0.5, 3.0, 4.5)}, "are -0.5 and 0.5 in x, which leaves 0.4 m"),
        ({"low": (-3.0, -1.0, 0.2), "high": (3.0, 1.0, 4.5)}, "in y"),
        ({"low": (-3.0, -3.0, 0.2), "high": (3.0, 3.0, 1.5)}, "0.6 m over the ground; accepted for excitation: 1 m"),
        ({"speed": 1.0}, "flight.fence.speed is 1; accepted for excitation: 1.5 m/s or more"),
        ({"tilt": 0.5}, "flight.fence.tilt is 0.5; accepted for excitation: 0.75 rad or more"),
    ],
)
def test_a_fence_without_room_is_refused_by_name(fence: dict[str, object], said: str) -> None:
    settings = dataclasses.replace(SETTINGS, fence=dataclasses.replace(Fence(), **fence))
    with pytest.raises(ValueError, match=said):
        excitation(FILE, settings, ExcitationOptions())


@pytest.mark.parametrize(
    ("fence", "options", "said"),
    [
        ({"low": (-1.0, -3.0, 0.2), "high": (1.0, 3.0, 4.5)}, {}, r"in x, .* for steps: .* or smaller --steps.rate"),
        ({"high": (3.0, 3.0, 2.0)}, {}, "in z"),
        ({"tilt": 0.6}, {}, "flight.fence.tilt is 0.6; accepted for steps: 0.7 rad or more, or smaller --steps.rate"),
        ({}, {"length": 0.5}, "accepted for steps"),
        ({}, {"rate": 7.0}, r"steps\.rate is 7"),
        ({"tilt": 3.0}, {"rate": 4.0, "length": 0.5}, r"steps\.rate times steps\.length is 2; accepted: up to 1 rad"),
    ],
)
def test_steps_without_room_are_refused_by_name(fence: dict[str, object], options: dict[str, Any], said: str) -> None:
    settings = dataclasses.replace(SETTINGS, fence=dataclasses.replace(Fence(), **fence))
    with pytest.raises(ValueError, match=said):
        excitation(FILE, settings, StepsOptions(**options))


def test_options_out_of_range_are_refused_by_name() -> None:
    with pytest.raises(ValueError, match=r"excitation\.seconds is 5"):
        excitation(FILE, SETTINGS, ExcitationOptions(seconds=5.0))


def test_the_speed_is_stopped_from_within_the_room() -> None:
    room = excitation(FILE, SETTINGS, ExcitationOptions())[0].room
    still = ManoeuvreRoom(room.low, room.high, 1e9, 0.0)
    assert np.allclose(still.stop(room.low, np.ones(3)), room.low)
    lengths = np.array([2.0, 5.0, 20.0])
    back = [length_for(v, room.braking, room.reaction) for v in fastest(lengths, room.braking, room.reaction)]
    assert np.allclose(back, lengths)


def test_a_chirp_sweeps_each_axis_alone() -> None:
    time = np.arange(0.0, 12.0, 0.001)
    found = np.array([[*rates, push] for rates, push in (chirps(t, 12.0) for t in time)])
    for axis, size in enumerate((*CHIRPED, THRUST)):
        own = (time >= 3.0 * axis) & (time < 3.0 * (axis + 1))
        assert np.all(found[~own, axis] == 0)
        assert found[own, axis].max() == pytest.approx(size, rel=1e-3)
        rises = time[own][1:][(found[own, axis][:-1] < 0) & (found[own, axis][1:] >= 0)]
        periods = np.diff(rises)
        assert 1 / periods[0] < 3 * SWEEP[0] and 1 / periods[-1] == pytest.approx(SWEEP[1], rel=0.15)


def test_a_kick_undoes_its_climb() -> None:
    time = np.arange(0.0, 4.4, 0.001)
    pushed = np.array([kicks(t, 12.0) for t in time])
    begun = time[1:][(pushed[:-1] <= 0) & (pushed[1:] > 0)]
    assert np.diff(begun) == pytest.approx(1.1, abs=2e-3)
    assert len(begun) == 4
    climb = np.cumsum(pushed) * 0.001
    assert climb.max() == pytest.approx(12.0 * PULSE, rel=0.02)
    assert abs(climb[-1]) < 0.02


def test_a_kick_shows_the_top_of_the_thrust_and_stops_within_the_room() -> None:
    wide = ManoeuvreRoom(np.zeros(3), np.array([10.0, 10.0, 10.0]), 3.5, 0.45)
    assert GRAVITY + kick_for(FILE, wide) == pytest.approx(KICK * 4 * FILE.thrust_range[1] / FILE.mass)
    low = ManoeuvreRoom(np.zeros(3), np.array([10.0, 10.0, 1.0]), 3.5, 0.45)
    assert kick_for(FILE, low) * PULSE == pytest.approx(low.fastest[2])
