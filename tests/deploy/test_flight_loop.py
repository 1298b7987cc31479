"""The control loop's word to the operator: whatever hears it, the loop goes on."""

from types import SimpleNamespace
from typing import Any

import pytest

from e2efly.deploy.flight_loop import fly
from e2efly.deploy.flight_state import Flight, Mode


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
