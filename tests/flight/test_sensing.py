"""A policy is not flown by poses and velocities that its training did not cover: in the check and in flight."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from e2efly.commands import fly_check
from e2efly.config.domain import Domain, Extent
from e2efly.flight.betaflight.controller import identify
from e2efly.flight.bridge import Bridge
from e2efly.flight.pilot import estimate
from e2efly.flight.pilot.delay_watch import DelayWatch, felt
from e2efly.flight.pilot.estimate import StateEstimate
from e2efly.flight.pilot.flight_state import Flight, Mission, Mode, Pilot, Reason, Target
from e2efly.flight.pilot.sensing import BORNE, REMEDIES, WATCHED_S, sensed, sensing_problem
from e2efly.flight.pose.conditions import Checks
from e2efly.flight.pose.sources.imu_alone import ImuSource
from e2efly.policy.contract import SENSING
from e2efly.policy.odometry import Sample
from tests.flight.test_bridge_silence import DT, World
from tests.flight.test_delay_watch import quaternions
from tests.flight.test_lag_watch import KINDS, Stream, stream
from tests.flight.test_msp_client import controller, recorded


def covering(**most: float) -> Domain:
    """A training that covered this, and the usual otherwise: no lags, an age of 60 ms, 30 Hz."""
    usual = dict.fromkeys(SENSING, 0.0) | {"pose_age": 0.06, "hold": 1 / 30} | most
    return tuple(Extent(name, SENSING[name], 0.0, high) for name, high in usual.items())


def known(of: Stream, *, own: bool = True, age: float = 0.01, mode: Mode = Mode.INIT) -> StateEstimate:
    """The estimate after a stream whose poses come `age` s late, with a gyro at 50 Hz. `own`: with velocities."""
    told, turning = StateEstimate(Checks(), 1.0), np.gradient(of.angle, of.time, axis=0)
    rows = zip(of.time.tolist(), of.position, of.velocity, quaternions(of.angle), of.body_rate, turning, strict=True)
    for step, (time, place, velocity, attitude, rate, gyro) in enumerate(rows):
        given = {"velocity": velocity, "body_rate": rate} if own else {}
        sample = Sample(100 + time + age, place, attitude, time, **given)
        told = estimate.see(told, [sample], Flight(mode), None, 100 + time + age)
        if step % 2 == 0:
            x, y, z = gyro.tolist()
            told = replace(told, delays=felt(told.delays, 100 + time, (x, y, z)))
        told = estimate.compare(told, mode, measure=step % 50 == 0)
    return told


HAND = KINDS["carried and turned by hand"]


@pytest.mark.parametrize("own", [True, False])
@pytest.mark.parametrize("kind", KINDS)
def test_clean_poses_are_never_refused(kind: str, own: bool) -> None:
    for seed in range(3):
        told = known(stream(KINDS[kind], seed, 0.0), own=own)
        assert sensing_problem(told, covering()) is None
        assert {part.name for part in sensed(told)} == set(BORNE) == set(REMEDIES)


@pytest.mark.parametrize(("lag", "covered", "refused"), [(0.06, 0.0, True), (0.06, 0.08, False), (0.015, 0.0, False)])
def test_a_velocity_that_is_later_than_in_training_is_refused_by_name(
    lag: float, covered: float, refused: bool
) -> None:
    of = stream(HAND, 0, lag)
    told = known(replace_rates(of, stream(HAND, 0, 0.0)))
    problem = sensing_problem(told, covering(velocity_lag=covered))
    assert (problem is not None) is refused
    if problem is not None:
        assert problem.startswith("velocity_lag is 60 ms (within ") or problem.startswith("velocity_lag is 59 ms (with")
        assert "accepted: up to 25 ms, as the policy's training covers" in problem
        assert "--env.estimate.velocity-lag" in problem and "--flight.untrained-sensing" in problem


def replace_rates(of: Stream, other: Stream) -> Stream:
    """A stream with the body rates of another."""
    return Stream(of.time, of.position, of.velocity, of.angle, other.body_rate)


def test_a_late_body_rate_is_refused_apart() -> None:
    of, clean = stream(HAND, 0, 0.05), stream(HAND, 0, 0.0)
    problem = sensing_problem(known(Stream(of.time, of.position, clean.velocity, of.angle, of.body_rate)), covering())
    assert problem is not None and problem.startswith("body_rate_lag is") and "velocity_lag" not in problem


@pytest.mark.parametrize(("age", "refused"), [(0.01, False), (0.05, False), (0.09, True), (0.12, True)])
def test_poses_older_than_in_training_are_refused(age: float, refused: bool) -> None:
    told = known(stream(HAND, 1, 0.0), age=0.0)
    late = DelayWatch(tuple((time - age, rate) for time, rate in told.delays.rates), told.delays.angles)
    told = estimate.compare(replace(told, delays=late, delay=None), Mode.INIT, measure=True)
    problem = sensing_problem(told, covering())
    assert told.delay is not None and told.delay.seconds == pytest.approx(age, abs=4e-3)
    assert (problem is not None and problem.startswith("pose_age is")) is refused


def with_holes(of: Stream, hole: float, times: int) -> Stream:
    kept = np.ones(len(of.time), bool)
    for k in range(times):
        kept &= (of.time < 1.5 + 0.5 * k) | (of.time > 1.5 + 0.5 * k + hole)
    return Stream(*(x[kept] for x in vars(of).values()))


@pytest.mark.parametrize(("hole", "times", "refused"), [(0.08, 2, True), (0.08, 1, False), (0.03, 3, False)])
def test_holes_that_come_again_are_refused(hole: float, times: int, refused: bool) -> None:
    told = known(with_holes(stream(HAND, 2, 0.0), hole, times), mode=Mode.HOVER)
    problem = sensing_problem(told, covering())
    assert (problem is not None and "hold is" in problem) is refused
    assert sensing_problem(told, covering(hold=0.1)) is None


def test_a_pose_that_is_repeated_is_a_hole_in_flight_and_none_of_a_vehicle_that_stands() -> None:
    of = stream(HAND, 3, 0.0)
    held = np.arange(len(of.time))
    held[200:209], held[300:309] = 200, 300
    repeated = Stream(of.time, of.position[held], of.velocity, of.angle[held], of.body_rate)
    assert "hold is" in (sensing_problem(known(repeated, mode=Mode.HOVER), covering()) or "")
    assert "hold is" not in (sensing_problem(known(repeated), covering()) or "")


def test_of_a_file_that_declares_nothing_nothing_is_refused() -> None:
    told = known(stream(HAND, 0, 0.08))
    assert sensing_problem(told, None) is None
    assert sensing_problem(told, covering()) is not None
    only = tuple(part for part in covering() if part.name == "pose_age")
    assert sensing_problem(told, only) is None


@dataclass
class Slow(World):
    """Poses that come every 60 ms."""

    every: float = 0.06
    mission: Mission = Mission.HOVER
    last: float = field(default=-math.inf)

    def read(self, now: float, *of: object, **more: object) -> object:
        if of:
            reading: Any = super().read(now, *of, **more)
            return replace(reading, pilot=Pilot(self.mission))
        if now - self.last < self.every - 1e-6:
            return []
        self.last = now
        return [self.pose(now)]

    def describe(self) -> str:
        return "slow poses"


class Trained:
    """A policy that never acts, of a training that covered this sensing."""

    name, images, decision, problem, state, lands, done, native_id = "policy", (), None, None, None, False, False, None
    unplaced = False

    def __init__(self, sensing: Domain | None) -> None:
        self.sensing = sensing

    def __getattr__(self, _: str) -> Callable[..., None]:
        return lambda *_, **__: None


def slow(sensing: Domain | None, *, untrained: bool = False) -> Slow:
    with controller(recorded) as client:
        world = Slow(identify(client, 10.0))
    world.bridge.worker = Trained(sensing)  # type: ignore[assignment]
    world.bridge.settings = replace(world.bridge.settings, untrained_sensing=untrained)
    return world


@pytest.mark.parametrize(
    ("sensing", "untrained", "refused"),
    [(covering(), False, True), (covering(), True, False), (covering(hold=0.07), False, False), (None, False, False)],
)
def test_a_policy_is_not_begun_by_poses_with_holes_that_its_training_did_not_have(
    sensing: Domain | None, untrained: bool, refused: bool
) -> None:
    world = slow(sensing, untrained=untrained)
    world.fly(2.0)
    assert any(why.startswith(Reason.SENSING) for why in world.bridge.flight.reasons) is refused
    world.armed = True
    begun = Flight(Mode.HOVER, now=world.now, since=world.now)
    world.bridge.flight = replace(begun, target=Target((0.0, 0.0, 1.0), 0.0))
    world.fly(1.0)
    assert world.bridge.flight.mode is Mode.HOVER  # it refuses the policy, and hovers by the same poses
    world.mission = Mission.POLICY
    world.fly(0.1)
    flight = world.bridge.flight
    assert flight.mode is (Mode.HOVER if refused else Mode.POLICY)
    assert any(why.startswith(f"{Reason.SENSING}: hold is 60 ms") for why in flight.reasons) is refused


@pytest.mark.parametrize("told", [True, False])
def test_a_policy_that_lives_by_the_controllers_attitude_is_not_begun_without_it(
    told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    world = slow(None)
    monkeypatch.setattr(world.bridge.worker, "unplaced", True, raising=False)
    world.every = DT
    world.fly(2.0)
    world.armed = True
    world.bridge.flight = replace(
        Flight(Mode.HOVER, now=world.now, since=world.now), target=Target((0.0, 0.0, 1.0), 0.0)
    )
    world.fly(0.5)
    if not told:
        monkeypatch.setattr(world.bridge.autopilot, "attitude", lambda *_: None)
    world.mission = Mission.POLICY
    world.fly(0.05)
    assert world.bridge.flight.mode is (Mode.POLICY if told else Mode.HOVER)
    assert any("has told no attitude" in why for why in world.bridge.flight.reasons) is not told


def test_poses_that_drift_are_for_a_policy_that_is_told_no_place() -> None:
    world = slow(None)
    old = world.bridge

    def bridge(worker: Any) -> Bridge:
        return Bridge(old.autopilot, ImuSource(), old.vehicle, old.settings, worker=worker)

    for worker in (None, Trained(None)):
        with pytest.raises(ValueError, match=r"the pose source is imu, .* told neither place nor velocity"):
            bridge(worker)
    unplaced = Trained(None)
    unplaced.unplaced = True
    assert bridge(unplaced).placeless and not old.placeless


@pytest.mark.parametrize(("since", "judged"), [(0.0, True), (WATCHED_S, False)])
def test_the_first_seconds_of_a_policy_s_flight_are_judged_and_no_later_ones(since: float, judged: bool) -> None:
    world, found = slow(covering()), []
    world.every = DT
    world.fly(2.0)
    world.armed, world.mission, world.every = True, Mission.POLICY, 0.06
    for _ in range(15):
        world.bridge.flight = Flight(Mode.POLICY, now=world.now, since=world.now - since)
        world.fly(DT)
        found += [world.bridge.inputs.sensing_problem]
        world.bridge.flight = Flight(Mode.HOVER, now=world.now, target=Target((0.0, 0.0, 1.0), 0.0))
        world.fly(9 * DT)
    assert any(found) is judged


@pytest.mark.parametrize(("sensing", "code"), [(covering(), 1), (covering(hold=0.2), 0)])
def test_the_check_shows_what_was_measured_and_refuses_what_was_not_covered(
    sensing: Domain, code: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    world = slow(sensing)

    def sleep(seconds: float) -> None:
        world.now += seconds

    monkeypatch.setattr(fly_check, "time", SimpleNamespace(monotonic=lambda: world.now, sleep=sleep))
    contract: Any = SimpleNamespace(sensing=sensing, observation_latency_range_s=(0, 0), latency_range_s=(0, 0.06))
    assert fly_check.look(world.bridge, world, Console(width=500), (), None, contract) == code  # type: ignore[arg-type]
    said = capsys.readouterr().out
    assert "hold" in said and "ms without a new pose, twice or more; the policy is for up to" in said
    assert (f"- {Reason.SENSING}: hold is" in said) is (code == 1)
