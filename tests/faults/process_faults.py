"""Faults of the bridge's process, in real time: `e2efly fly` flies the firmware in a room of another process."""

import math
import resource
import signal
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from e2efly.flight.betaflight.watchdog import TIMEOUT_S
from e2efly.logs.flight_log import read_log
from e2efly.validation.processes import FLIGHT_S, Program, Room, bridge, take_off
from tests.faults.tap import Tap

PERIOD_S = 0.01
"""Of the control steps, s."""
LOG_LIMIT = 400_000
"""Bytes that a full disk takes."""
CLOSED, SINKING = 1000, 0.97
"""Throttle pulse at the lowest, us, and the share of hover's above it with which the vehicle begins to sink."""
FAULTS = ("killed", "stopped", "disk full")
"""SIGKILL, SIGSTOP and a limit of the size of files."""


@dataclass(frozen=True)
class ProcessOutcome:
    """What came of a fault of the bridge's process."""

    fault: str
    reaction: float
    """Until the watchdog's first stick frame left for the controller, s; NaN where nothing was to change."""
    allowed: float
    """What is stated: the watchdog's time-out and a control period, s; NaN. `problems` says nothing of it."""
    touch_speed: float
    """Of the last touch of the ground, m/s; NaN without."""
    touch_tilt: float
    """rad; NaN."""
    largest_tilt: float
    """rad."""
    said: tuple[str, ...]
    """The last lines of the bridge."""
    problems: tuple[str, ...]
    """What was unlike the documented; empty: as it is to be."""


def bridge_of(
    policy: Path,
    room: Room,
    log: Path,
    limit: int | None = None,
    options: tuple[str, ...] = (),
    link: str | None = None,
) -> Program:
    """`e2efly fly` as a process, patient where a busy machine holds up the room; `limit`: bytes of a file."""
    common = ["--flight.takeoff-speed", "0.8", "--flight.land-speed", "0.6"]
    # a busy machine holds up the room, too: not what is looked at here
    common += ["--flight.odometry-timeout", "0.6", "--flight.link-timeout", "1.5"]
    started = bridge(policy, room, log, [*common, *options], link)
    if limit is not None:  # long before it has a log to write
        resource.prlimit(started.process.pid, resource.RLIMIT_FSIZE, (limit, limit))
    return started


def strike(fault: str, policy: Path, folder: Path, seed: int = 0) -> ProcessOutcome:
    """One flight in real time with one of `FAULTS`, in hover."""
    log = folder / f"{fault.replace(' ', '_')}-{seed}.mcap"
    random = np.random.default_rng(seed)
    limit = LOG_LIMIT if fault == "disk full" else None
    with Room(seed=seed) as room, Tap(room.link) as tap, bridge_of(policy, room, log, limit, link=tap.link) as flies:
        return _flight(fault, room, flies, tap, log, float(random.uniform(0.5, 1.5)))


def _flight(fault: str, room: Room, flies: Program, tap: Tap, log: Path, moment: float) -> ProcessOutcome:
    problems: list[str] = []
    reaction = allowed = math.nan
    take_off(room, flies)
    time.sleep(moment)
    if fault == "disk full":
        if not _log_stands(log):
            problems.append("the log went on growing")
        room.set(mission="land")
        if not flies.heard("DONE", FLIGHT_S):
            problems.append(f"it did not land; it said: {flies.said[-3:]}")
        room.set(armed=False)
    else:
        flies.process.send_signal({"killed": signal.SIGKILL, "stopped": signal.SIGSTOP}[fault])
        allowed = (TIMEOUT_S if fault == "stopped" else 0.0) + PERIOD_S
        reaction = _until_descent(tap)
        if not room.until(FLIGHT_S, lambda state: state["standing"]):
            problems.append("it did not land")
        if not room.until(FLIGHT_S, lambda state: max(state["motors"]) < 0.12):
            problems.append("the throttle was not closed")
        flies.process.send_signal(signal.SIGCONT)
        time.sleep(1.0)
        room.set(armed=False)
    if fault == "killed":
        flies.close()
    elif (status := flies.end(FLIGHT_S)) != 0:
        problems.append(f"the bridge ended with status {status}; it said: {flies.said[-3:]}")
    state = room.set()
    read = read_log(log)
    if "hover" not in [message["mode"] for message in read["mode"].values]:
        problems.append("the log lacks the flight")
    if any("Traceback" in line for line in flies.said):
        problems.append(f"an exception escaped: {flies.said}")
    if not state["standing"] or not state["touches"]:
        problems.append("it is not on the ground")
    speed, tilt, _ = state["touches"][-1] if state["touches"] else (math.nan,) * 3
    return ProcessOutcome(
        fault, reaction, allowed, speed, tilt, state["largest_tilt"], tuple(flies.said[-5:]), tuple(problems)
    )  # fmt: skip


def _until_descent(tap: Tap) -> float:
    """Time from now until a stick frame has the throttle of a descent, s; infinite where none has within 5 s."""
    began = time.monotonic()
    hover = float(np.mean([pulse for at, pulse in tap.throttle if at > began - 0.5])) - CLOSED
    seen = len(tap.throttle)
    while time.monotonic() < began + 5.0:
        time.sleep(0.01)
        sinking = (at for at, pulse in tap.throttle[seen:] if pulse - CLOSED < SINKING * hover)
        if (at := next(sinking, None)) is not None:
            return at - began
    return math.inf


def _log_stands(log: Path) -> bool:
    end = time.monotonic() + FLIGHT_S
    before, since = -1, time.monotonic()
    while time.monotonic() < end:
        size = log.stat().st_size
        if size != before:
            before, since = size, time.monotonic()
        elif time.monotonic() - since > 1.5:
            return size <= LOG_LIMIT
        time.sleep(0.1)
    return False
