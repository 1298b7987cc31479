"""What goes wrong on the companion computer: clocks, processes that stand still, disk, port, a second bridge."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from e2efly.flight.betaflight.codec import encode
from e2efly.flight.betaflight.instruments import CLOSED, PROBE
from e2efly.flight.betaflight.messages import set_raw_rc
from tests.faults.faults import wall_clock
from tests.faults.faulty import sticks
from tests.faults.injected_poses import stepped
from tests.faults.injection import Excuse, Injection, Kind, held, one_of, uniform
from tests.faults.stage import Stage

STOOD = (0.05, 2.0)
"""For how long a process stands still, s."""


def _stopped(bridge: bool, watchdog: bool) -> Callable[[Stage], Injection]:
    """SIGSTOP, and SIGCONT in the end."""

    def begin(stage: Stage) -> Injection:
        def stand(still: bool) -> None:
            stage.stopped = still if bridge else stage.stopped
            stage.watchdog.stopped = still if watchdog else stage.watchdog.stopped

        stand(True)
        return Injection(end=lambda: stand(False))

    return begin


def _disk_full(stage: Stage) -> Injection:
    """Whatever the log writes, the disk has no room for it."""
    with Path("/dev/full").open("wb") as full:
        os.dup2(full.fileno(), stage.log._file)
    return Injection()


def _wall(stage: Stage) -> Injection:
    wall_clock(stage)
    return Injection()


def _other(what: Callable[[Stage, bytes], bytes]) -> Callable[..., Injection]:
    """A second program on the link says something after each message, or after a share of them."""

    def begin(stage: Stage, share: float) -> Injection:
        link, random = stage.link, np.random.default_rng(0)
        link.other = lambda data: what(stage, data) if random.random() < share else b""
        return Injection(end=lambda: setattr(link, "other", lambda data: b""))

    return begin


def _asks(stage: Stage, data: bytes) -> bytes:
    """The same question again."""
    del stage
    return b"" if sticks(data) else data


def _waits(stage: Stage, data: bytes) -> bytes:
    """The sticks of a bridge that waits on the ground, with the throttle closed."""
    held = stage.session.autopilot.sticks
    channels = held.arrange((*(held.centre + offset for offset in PROBE), CLOSED), ())
    return encode(set_raw_rc(channels)) if sticks(data) else b""


def _step(random: np.random.Generator) -> dict[str, float]:
    """A clock is set by 10 ms to 100 s, either way."""
    return {"step": round(float(random.choice([-1.0, 1.0]) * 10 ** random.uniform(-2, 2)), 3)}


GONE = Excuse("the firmware holds the last command while the link's port is gone")
STILL = Excuse("the firmware holds the last command while the process that has the link stands still")
OBEYED = Excuse("the firmware obeys whoever spoke last", unless_grounded=True)
COMPANION = {
    "clock: the pose source's is set": Kind(lambda stage, step: Injection(pose=stepped(step)), _step),
    "clock: the wall clock jumps to and fro": Kind(_wall),
    "link: unplugged": Kind(held("link", "gone", False), excuse=GONE, limited=(0.1, 5.0), watched=True),
    "disk: full": Kind(_disk_full, logged=True),
    "bridge: stopped": Kind(_stopped(True, False), limited=STOOD, watched=True),
    "watchdog: stopped": Kind(_stopped(False, True), excuse=STILL, limited=STOOD, watched=True),
    "bridge and watchdog: stopped": Kind(_stopped(True, True), excuse=STILL, limited=STOOD, watched=True),
    "second bridge: asks": Kind(_other(_asks), uniform(share=(0.1, 1.0))),
    "second bridge: waits on the ground": Kind(
        _other(_waits), one_of("share", 0.02, 0.1, 0.3, 1.0), excuse=OBEYED, limited=(0.1, 2.0)),
}  # fmt: skip
"""Kinds of faults of the companion computer, by name."""
