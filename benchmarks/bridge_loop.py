"""The bridge in real time: `e2efly fly` on one core flies the real firmware on the rig, which has another.

    python benchmarks/bridge_loop.py [--policy FILE] [--seconds 600] [--live-seconds 120] [--cases CASE ...]
        [--json FILE]

Lateness of the control steps and the policy's inference come from the flight's own log; the hover error is the rig's
truth. Ten minutes are the soak. Give the machine nothing else to do. Without --policy a hover is trained. What the
machine itself does to a loop that only sleeps, at real-time priority on the bridge's core, stands beside.

Further flights publish themselves live: `live`, to Foxglove with a browser that reads everything, to an MCAP file and
to a bag; `stalled`, the same with a browser that reads nothing and the file's process stopped by SIGSTOP. The processes
of `--live` share the bridge's one core, as on a computer that has no other; the browser is on the other core.
"""

import os
import re
import signal
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from common import arguments, table, write
from fault_table import hover_policy
from tests.faults.process_faults import bridge_of
from tests.flight.foxglove_client import FoxgloveClient

from e2efly.flight.flight_loop import LOOP_PRIORITY
from e2efly.flight.outlet import SCRIPT
from e2efly.flight.settings import FlightSettings
from e2efly.logs.channels import CHANNELS
from e2efly.logs.flight_log import read_log
from e2efly.validation.processes import Program, Room, take_off

CASES = ("alone", "live", "stalled")
TARGET = (0.0, 0.0, 2.0)
BARE_S = 30.0
"""How long the bare loop runs, s."""


def main() -> None:
    """Fly, print the table, write the figures."""
    args = arguments(__doc__ or "", policy=None, seconds=600.0, live_seconds=120.0, cases=list(CASES))
    if unknown := set(args.cases) - set(CASES):
        raise SystemExit(f"--cases has {', '.join(sorted(unknown))}; accepted: {', '.join(CASES)}")
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        policy = hover_policy(args.policy, folder)
        alone = bare_loop(sorted(os.sched_getaffinity(0))[0], BARE_S)
        measured = [
            measure(case, policy, folder, args.seconds if case == "alone" else args.live_seconds, alone)
            for case in args.cases
        ]
    rows = [row for row, _ in measured]
    print(table(rows))
    write("bridge_loop", args.json, {
        "table": rows, "bare_lateness_s": _figures(alone), **{case["case"]: case for _, case in measured},
    })  # fmt: skip


def measure(
    case: str, policy: Path, folder: Path, seconds: float, alone: np.ndarray
) -> tuple[dict[str, Any], dict[str, Any]]:
    """One flight: a row of the table, and its figures."""
    cores = sorted(os.sched_getaffinity(0))
    log, began = folder / f"{case}.mcap", time.monotonic()
    os.sched_setaffinity(0, cores[1:] or cores)
    with Room() as room:
        os.sched_setaffinity(0, cores[:1])
        options = ("--flight.takeoff-height", "1.5", "--goal.target", *map(str, TARGET))
        usual = FlightSettings()  # what a busy machine is let off in the tests counts here
        options += ("--flight.odometry-timeout", str(usual.odometry_timeout))
        options += ("--flight.link-timeout", str(usual.link_timeout))
        if case != "alone":
            for target in ("foxglove:0", f"mcap:{folder / case}_live.mcap", f"bag:{folder / case}_live.bag"):
                options += ("--live", target)
        flies = bridge_of(policy, room, log, options=options)
        os.sched_setaffinity(0, cores[1:] or cores)
        stolen = stolen_s()
        try:
            with subscribed(case, flies):
                errors = fly(room, flies, seconds)
        finally:
            flies.close()
        os.sched_setaffinity(0, cores)
        stolen = stolen_s() - stolen
    print(f"{case}: flown for {time.monotonic() - began:.0f} s")
    dropped = [line for line in flies.said if "records were dropped" in line or "came too fast" in line]
    print("\n".join(dropped))
    content = read_log(log)
    timing, asked = content["timing"], content["policy"]
    lateness, work = timing.numbers("lateness_s"), timing.numbers("work_s")
    inference = asked.numbers("inference_s")
    modes = [str(mode) for mode in content["mode"].texts("mode")]
    print("modes:", " ".join(modes))
    row = {
        "published": {"alone": "nothing", "live": "live", "stalled": "live, nobody reads"}[case],
        "policy's flight": f"{seconds:.0f} s",
        "hover error, mean / max": f"{100 * np.mean(errors):.1f} / {100 * np.max(errors):.1f} cm",
        "steps late by, p50 / p99 / max": _ms(lateness),
        "a bare loop's, p50 / p99 / max": _ms(alone),
        "work of a step, p50 / p99 / max": _ms(work),
        "inference, p50 / p99 / max": _ms(inference),
        "taken by the machine's host": f"{100 * stolen / seconds / len(cores):.1f} %",
        "deadlines missed": str(int(np.nansum(timing.numbers("deadline_missed")))),
        "records dropped": str(sum(int(re.findall(r": (\d+) ", line)[-1]) for line in dropped)),
    }
    return row, {
        "case": case, "modes": modes, "seconds": seconds, "hover_error_m": [np.mean(errors), np.max(errors)],
        "lateness_s": _figures(lateness), "work_s": _figures(work), "inference_s": _figures(inference),
        "stolen_s": stolen, "not_in_log": content.cut_off, "dropped": dropped,
    }  # fmt: skip


@contextmanager
def subscribed(case: str, bridge: Program) -> Iterator[None]:
    """Whoever listens to the flight, or no longer does."""
    if case == "alone":
        yield
        return
    bridge.wait_for("ws://", 120.0)
    browser = FoxgloveClient("127.0.0.1", int(bridge.said[-1].rpartition(":")[2]))
    browser.subscribe(*CHANNELS)
    stopped = None
    if case == "stalled":
        stopped = process_of("mcap:", bridge.process.pid)
        os.kill(stopped, signal.SIGSTOP)
    else:
        threading.Thread(target=_read, args=(browser,), daemon=True).start()
    try:
        yield
    finally:
        browser.close()
        if stopped is not None:
            with suppress(ProcessLookupError):
                os.kill(stopped, signal.SIGKILL)


def process_of(kind: str, bridge: int) -> int:
    """The process that publishes to a kind for a bridge."""
    found = [
        int(folder.name)
        for folder in Path("/proc").iterdir()
        if folder.name.isdigit() and _is_outlet(folder, kind, bridge)
    ]
    return found[0]


def _is_outlet(folder: Path, kind: str, bridge: int) -> bool:
    with suppress(OSError):
        command = (folder / "cmdline").read_text().split("\0")
        parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
        return parent == bridge and str(SCRIPT) in command and f'"kind": "{kind.rstrip(":")}"' in command[-2]
    return False


def _read(browser: FoxgloveClient) -> None:
    with suppress(OSError, AssertionError):
        while True:
            browser.message("odometry")


def bare_loop(core: int, seconds: float) -> np.ndarray:
    """How late a thread of real-time priority wakes on an idle core, s, at 100 Hz."""
    before, lateness = os.sched_getaffinity(0), []
    os.sched_setaffinity(0, {core})
    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(LOOP_PRIORITY))
    due = time.monotonic()
    end = due + seconds
    while due < end:
        due += 0.01
        time.sleep(max(due - time.monotonic(), 0.0))
        lateness.append(max(time.monotonic() - due, 0.0))
    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    os.sched_setaffinity(0, before)
    return np.asarray(lateness)


def stolen_s() -> float:
    """Processor time that a virtual machine's host has taken from all its cores since it began, s."""
    return int(Path("/proc/stat").read_text().split()[8]) / os.sysconf("SC_CLK_TCK")


def fly(room: Room, flies: Program, seconds: float) -> list[float]:
    """Take off, let the policy fly for `seconds`, land; the distances to the target, m."""
    take_off(room, flies)
    time.sleep(2.0)
    room.set(mission="policy")
    flies.wait_for("POLICY", 5.0)
    time.sleep(3.0)
    errors, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(0.1)
        errors.append(float(np.linalg.norm(np.subtract(room.set()["position"], TARGET))))
    room.set(mission="land")
    flies.wait_for("DONE", 20.0)
    room.set(armed=False)
    flies.end(10.0)
    return errors


def _figures(values: np.ndarray) -> list[float]:
    known = np.asarray(values, float)
    known = known[np.isfinite(known)]
    return [float(x) for x in np.percentile(known, [50, 99, 100])] if len(known) else []


def _ms(values: np.ndarray) -> str:
    return " / ".join(f"{1e3 * x:.2f}" for x in _figures(values)) + " ms"


if __name__ == "__main__":
    main()
