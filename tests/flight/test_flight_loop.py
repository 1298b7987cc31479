"""The control loop: its word to the operator, its end, and what the watchdog is told on the ground."""

from types import SimpleNamespace
from typing import Any

import pytest

from e2efly.flight.descent_plan import plan_of
from e2efly.flight.flight_loop import fly
from e2efly.flight.pilot.flight_state import Flight, Mode
from e2efly.flight.pilot.inertial import Inertial
from e2efly.flight.pilot.throttle_map import ThrottleMap
from e2efly.vehicles.loading import load_vehicle
from tests.flight.test_sticks import STICKS


class Clock:
    """Time that passes by sleeping alone."""

    def __init__(self) -> None:
        self.time = 100.0

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.time += max(seconds, 0.0)


class Grounded:
    """A bridge on the ground, armed for the first steps, which counts them."""

    worker = odometry = None
    land_now = flying = False
    height = 0.0
    autopilot = SimpleNamespace(connections=1)
    sent = SimpleNamespace(throttle=0.0)
    estimate = SimpleNamespace(inertial=Inertial())

    def __init__(self, *reasons: str, mode: Mode = Mode.INIT, armed_steps: int = 0) -> None:
        self.flight, self.armed_steps, self.steps = Flight(mode, reasons=reasons), armed_steps, 0
        self.map = ThrottleMap.of(load_vehicle("vis_r"))

    @property
    def inputs(self) -> Any:
        return SimpleNamespace(armed=self.steps < self.armed_steps, voltage=None)

    def tick(self, now: float, lateness: float, slack: float) -> None:
        del now, lateness, slack
        self.steps += 1


def looped(bridge: Any, say: Any, seconds: float) -> int:
    clock = Clock()
    end = clock.now() + seconds
    return fly(bridge, 100.0, say=say, stop=lambda: clock.now() > end, clock=clock).rounds


@pytest.mark.parametrize("error", [BrokenPipeError("gone"), OSError(5, "EIO"), UnicodeEncodeError("a", "b", 0, 1, "c")])
def test_an_exception_of_whoever_speaks_ends_no_loop(error: Exception) -> None:
    def say(line: str) -> None:
        raise error

    bridge = Grounded("not armed")
    assert looped(bridge, say, 3.0) == bridge.steps == pytest.approx(300, abs=2)


def test_reasons_from_outside_forge_no_line() -> None:
    said: list[str] = []
    looped(Grounded("no good odometry: key '\x1b[2K\nPOLICY: all is well\ud800'", "not armed"), said.append, 2.5)
    lines = [line for text in said for line in text.split("\n")]
    assert all(line.isprintable() for line in lines)
    assert not any(line.startswith("POLICY") for line in lines)
    assert said[1].split("\n") == [
        "INIT:", r"  - no good odometry: key '\x1b[2K\nPOLICY: all is well\ud800'", "  - not armed",
    ]  # fmt: skip


def test_a_change_is_told_with_its_numbers_and_once_although_they_change() -> None:
    said: list[str] = []
    bridge = Grounded(mode=Mode.DONE)
    step = bridge.tick

    def tick(now: float, lateness: float, slack: float) -> None:
        step(now, lateness, slack)
        bridge.flight = Flight(Mode.DONE, reasons=(f"policy: no good command for {bridge.steps} s",))

    bridge.tick = tick
    looped(bridge, said.append, 0.5)
    assert said == ["DONE: policy: no good command for 1 s"]


@pytest.mark.parametrize("mode", [Mode.INIT, Mode.DONE])
def test_it_ends_on_the_ground_only_when_the_pilot_has_disarmed(mode: Mode) -> None:
    """A bridge that left an armed vehicle would leave its motors to the throttle stick, which rests in its middle."""
    said: list[str] = []
    bridge = Grounded(mode=mode, armed_steps=250)
    looped(bridge, said.append, -1.0)
    assert bridge.steps == 250
    assert any("disarm, then this ends" in line for line in said)
    disarmed = Grounded(mode=mode)
    looped(disarmed, said.append, -1.0)
    assert disarmed.steps == 0


def test_a_bridge_that_the_watchdog_has_replaced_ends_when_it_is_asked_to_and_says_so() -> None:
    """Armed or not: it has no more say in the flight, and the watchdog lands on without it."""
    said: list[str] = []
    watchdog: Any = SimpleNamespace(taken_over="", follow=lambda bridge: None)
    bridge, clock = Grounded(mode=Mode.LAND, armed_steps=10**6), Clock()

    def stop() -> bool:
        assert clock.now() < 110.0
        if clock.now() > 101.5:
            watchdog.taken_over = "the bridge has been silent for 60 ms"
        return clock.now() > (104.0 if watchdog.taken_over else 101.0)

    fly(bridge, 100.0, watchdog=watchdog, say=said.append, stop=stop, clock=clock)
    assert bridge.steps == pytest.approx(400, abs=2)
    assert any("silent for 60 ms; it keeps the link until its landing is over" in line for line in said)


def test_on_the_ground_the_watchdog_keeps_the_throttle_of_an_armed_vehicle_closed() -> None:
    armed: Any = Grounded(armed_steps=1)
    plan = plan_of(armed, STICKS)
    assert plan.flying and plan.throttle == ((0.0, 1000),)
    disarmed: Any = Grounded()
    assert not plan_of(disarmed, STICKS).flying
