"""The control loop in real time: an absolute schedule, the watchdog's plan, the log's timing, operator messages."""

import gc
import math
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Protocol

from e2efly.flight.bridge import Bridge
from e2efly.flight.clock import MONOTONIC, Clock
from e2efly.flight.log_record import Log
from e2efly.flight.pilot.flight_state import Mode
from e2efly.flight.process import printable, threads
from e2efly.flight.publish import Live
from e2efly.flight.service import Service

LOWEST_RATE = 100.0
"""The lowest rate of the loop, Hz."""
PLAN_PERIOD = 0.1
"""The period at which the watchdog is given a new plan, s."""
SWITCH_S = 1e-4
"""The longest time for which another thread of the process may delay the loop, s. Python's default is 5 ms."""
LOOP_PRIORITY, POLICY_PRIORITY, OTHER_PRIORITY = 10, 9, 8
"""Real-time priorities. The watchdog's is higher. Every other thread of the process also has one. The reason is that
each thread sometimes holds the interpreter's lock, and the loop would then have to wait while another process uses that
thread's core."""
STATUS_PERIOD = 1.0
"""The period of the status lines, s."""
TAKEN = "; it keeps the link until its landing is over: then end this by Ctrl-C and start it anew"
"""Said once the watchdog has taken over, after the watchdog's reason."""


def loop_rate(control_rate: float) -> float:
    """The lowest multiple of a policy's rate, Hz, that is at least `LOWEST_RATE`. The policy then acts on the loop's
    own grid.
    """
    return control_rate * max(math.ceil(LOWEST_RATE / control_rate - 1e-9), 1)


class Watchdog(Protocol):
    """What lands the vehicle when this process dies."""

    @property
    def taken_over(self) -> str:
        """Why it has taken over. Empty: it has not."""
        ...

    def follow(self, bridge: Bridge) -> None:
        """Learn what to do if the bridge falls silent from now on. It must not block."""
        ...


@dataclass
class Timing:
    """The timing statistics of the loop."""

    rounds: int = 0
    missed: int = 0
    """Rounds that ended after the next round was due."""
    lateness: list[float] = field(default_factory=list)
    """Lateness of each round, s."""


def fly(
    bridge: Bridge,
    rate: float,
    *,
    log: Log | None = None,
    live: Live | None = None,
    watchdog: Watchdog | None = None,
    say: Callable[[str], None] = print,
    stop: Callable[[], bool] = lambda: False,
    identify_again: Callable[[], bool] | None = None,
    service: Service | None = None,
    clock: Clock = MONOTONIC,
) -> Timing:
    """Run the bridge until `stop` is true and the vehicle is on the ground and disarmed, or until the watchdog has
    taken over for good.

    Args:
        bridge: the bridge to run.
        rate: control steps per second, Hz.
        log: the record of the flight.
        live: shows what the policy sees while it flies. It gets its records through `log`.
        watchdog: receives a plan for the case that this process falls silent.
        say: takes lines for people. It must not block. If it raises, the exception and its line are dropped.
        stop: whether to end. A vehicle in the air is landed first.
        identify_again: reads the autopilot's settings again after a reconnection on the ground. Returns whether it
            could.
        service: tells the service manager that the loop is running.
        clock: gives the time.
    """
    timing, period = Timing(), 1 / rate
    due = clock.now() + period
    last_plan = last_status = cpu_at = due
    cpu, told, connection = time.process_time(), "", bridge.autopilot.connections
    previous = clock.now()
    with _no_pauses(bridge):
        while True:
            clock.sleep(due - clock.now())
            now = clock.now()
            late = max(now - due, 0.0)
            if stop():
                if service is not None and not bridge.land_now:
                    service.stopping()
                bridge.land_now = True
                ended = bridge.flight.mode in (Mode.INIT, Mode.DONE)  # not while the pilot flies: the sticks would stay
                if ended and not bridge.inputs.armed:  # or the throttle stick, in its middle, would have the motors
                    return timing
                if watchdog is not None and watchdog.taken_over:  # it goes on landing without this process
                    return timing
            if bridge.autopilot.connections != connection and bridge.flight.mode in (Mode.INIT, Mode.DONE):
                if identify_again is not None and identify_again():
                    connection = bridge.autopilot.connections
                due = now = clock.now()
                late = 0.0
            bridge.tick(now, late, slack=period / 2)
            if service is not None:
                service.stepped(now)
            if live is not None:
                live.show(bridge.seen)
            if watchdog is not None and now - last_plan >= PLAN_PERIOD:
                last_plan = now
                watchdog.follow(bridge)
            if (line := _told(bridge)) != told:
                told = line
                _say(say, _told(bridge, in_full=True))
            elif now - last_status >= STATUS_PERIOD:
                last_status = now
                _say(say, watchdog.taken_over + TAKEN if watchdog and watchdog.taken_over else _status(bridge))
            done = clock.now()
            timing.rounds += 1
            timing.lateness.append(late)
            missed = done > due + period
            timing.missed += missed
            if log is not None:
                load = None
                if now - cpu_at >= STATUS_PERIOD:
                    spent = time.process_time()
                    load, cpu, cpu_at = (spent - cpu) / (now - cpu_at), spent, now
                log.record("timing", now, {
                    "period_s": now - previous, "work_s": done - now, "lateness_s": late, "deadline_missed": missed,
                    **({} if load is None else {"cpu_load": load}),
                })  # fmt: skip
            previous = now
            due += period
            if done > due:  # missed rounds are not made up for: no burst to catch up
                due += math.ceil((done - due) / period) * period


def _say(say: Callable[[str], None], line: str) -> None:
    with suppress(Exception):  # a lost terminal must not end a flight
        say(line)


def _told(bridge: Bridge, *, in_full: bool = False) -> str:
    """The mode and its reasons. Unless `in_full`, the reasons come without their numbers, which change all the time."""
    flight = bridge.flight
    reasons = [str(reason) if in_full else str(reason).split(": ")[0] for reason in flight.reasons]
    return f"{flight.mode.upper()}: " + "; ".join(map(printable, reasons))


def _status(bridge: Bridge) -> str:
    o, flight = bridge.odometry, bridge.flight
    if bridge.land_now and bridge.inputs.armed and flight.mode in (Mode.INIT, Mode.DONE):
        return f"{flight.mode.upper()}: disarm, then this ends: without it the throttle stick may have the motors"
    if flight.mode is Mode.INIT:
        return "\n".join([f"{flight.mode.upper()}:", *(f"  - {printable(reason)}" for reason in flight.reasons)])
    where = "unknown" if o is None else f"{o.position.round(2).tolist()} m, {o.velocity.round(2).tolist()} m/s"
    return f"{flight.mode.upper()}: {where}, throttle {bridge.sent.throttle:.2f}"


@contextmanager
def _no_pauses(bridge: Bridge) -> Iterator[None]:
    """No garbage collection in flight, fast switching between threads, and real-time scheduling where it is allowed."""
    priorities: dict[int, int | None] = dict.fromkeys(threads(), OTHER_PRIORITY)
    priorities[threading.get_native_id()] = LOOP_PRIORITY
    if bridge.worker is not None and bridge.worker.native_id is not None:
        priorities[bridge.worker.native_id] = POLICY_PRIORITY
    before = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_S)
    gc.collect()
    gc.freeze()
    gc.disable()
    _schedule(priorities)
    try:
        yield
    finally:
        _schedule(dict.fromkeys(threads()))
        gc.enable()
        gc.unfreeze()
        sys.setswitchinterval(before)


def _schedule(priorities: Mapping[int, int | None]) -> None:
    """Set real-time priorities by thread. None: normal scheduling. Without the permission for real-time priorities, a
    process is still punctual enough on an idle core.
    """
    for thread, priority in priorities.items():
        with suppress(OSError, AttributeError):
            policy = os.SCHED_OTHER if priority is None else os.SCHED_FIFO
            os.sched_setscheduler(thread, policy, os.sched_param(priority or 0))
