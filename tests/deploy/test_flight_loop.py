"""The loop's end, and what the watchdog is told on the ground."""

from types import SimpleNamespace
from typing import Any

import pytest

from e2efly.deploy.flight_loop import fly, plan_of
from e2efly.deploy.flight_state import Mode
from e2efly.deploy.throttle_map import ThrottleMap
from e2efly.vehicles import load_vehicle
from tests.deploy.test_sticks import STICKS


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


class Clock:
    now_s = 0.0

    def now(self) -> float:
        return self.now_s

    def sleep(self, seconds: float) -> None:
        self.now_s += max(seconds, 0.0)


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
