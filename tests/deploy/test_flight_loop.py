"""The control loop: its end, its word to the operator, and what the watchdog is told on the ground."""

from types import SimpleNamespace
from typing import Any

import pytest

from e2efly.deploy.flight_loop import fly, plan_of
from e2efly.deploy.flight_state import Flight, Mode
from e2efly.deploy.throttle_map import ThrottleMap
from e2efly.vehicles import load_vehicle
from tests.deploy.test_sticks import STICKS


class Clock:
    """Time that passes by sleeping alone."""

    def __init__(self) -> None:
        self.time = 100.0

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.time += max(seconds, 0.0)


class Grounded:
    """A bridge on the ground, which counts its control steps."""

    worker = None
    odometry = None
    client = SimpleNamespace(link=SimpleNamespace(connections=1))
    land_now = False
    inputs = SimpleNamespace(armed=False)

    def __init__(self, *reasons: str) -> None:
        self.flight, self.steps = Flight(Mode.INIT, reasons=reasons), 0

    def tick(self, now: float, lateness: float, slack: float) -> None:
        del lateness, slack
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


class Standing:
    """A bridge whose vehicle stands on the ground, armed for the first steps."""

    def __init__(self, mode: Mode, armed_steps: int) -> None:
        self.flight = SimpleNamespace(mode=mode, reasons=())
        self.armed_steps, self.ticks = armed_steps, 0
        self.client = SimpleNamespace(link=SimpleNamespace(connections=1))
        self.land_now, self.worker, self.odometry, self.height = False, None, None, 0.0
        self.sent = SimpleNamespace(throttle=0.0)
        self.map, self.sticks = ThrottleMap.of(load_vehicle("vis_r")), STICKS
        self.flying = False

    @property
    def inputs(self) -> Any:
        return SimpleNamespace(armed=self.ticks < self.armed_steps, voltage=None)

    def tick(self, now: float, late: float, slack: float) -> None:
        self.ticks += 1


@pytest.mark.parametrize("mode", [Mode.INIT, Mode.DONE])
def test_it_ends_on_the_ground_only_when_the_pilot_has_disarmed(mode: Mode) -> None:
    """A bridge that left an armed vehicle would leave its motors to the throttle stick, which rests in its middle."""
    said: list[str] = []
    bridge = Standing(mode, 250)
    fly(bridge, 100.0, say=said.append, stop=lambda: True, clock=Clock())  # type: ignore[arg-type]
    assert bridge.ticks == 250
    assert any("disarm, then this ends" in line for line in said)
    disarmed = Standing(mode, 0)
    fly(disarmed, 100.0, say=said.append, stop=lambda: True, clock=Clock())  # type: ignore[arg-type]
    assert disarmed.ticks == 0


def test_on_the_ground_the_watchdog_keeps_the_throttle_of_an_armed_vehicle_closed() -> None:
    plan = plan_of(Standing(Mode.INIT, 1))  # type: ignore[arg-type]
    assert plan.flying and plan.throttle == ((0.0, 1000),)
    assert not plan_of(Standing(Mode.INIT, 0)).flying  # type: ignore[arg-type]
