"""The bridge in real time: `e2efly fly` on one core flies the real firmware on the rig, which has another.

    python benchmarks/bridge_loop.py [--policy FILE] [--seconds 600] [--json FILE]

Lateness of the control steps and the policy's inference come from the flight's own log; the hover error is the rig's
truth. Ten minutes are the soak. Give the machine nothing else to do. Without --policy a hover is trained. What the
machine itself does to a loop that only sleeps, at real-time priority on the bridge's core, stands beside.
"""

import os
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
from common import arguments, table, write
from fault_table import hover_policy
from tests.faults.process_faults import bridge_of

from e2efly.deploy.flight_loop import LOOP_PRIORITY
from e2efly.deploy.log.flight_log import read_log
from e2efly.deploy.settings import FlightSettings
from e2efly.validation.room import Program, Room, take_off

TARGET = (0.0, 0.0, 2.0)
BARE_S = 30.0
"""How long the bare loop runs, s."""


def main() -> None:
    """Fly, print the table, write the figures."""
    args = arguments(__doc__ or "", policy=None, seconds=600.0)
    cores = sorted(os.sched_getaffinity(0))
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        policy = hover_policy(args.policy, folder)
        log, began = folder / "flight.mcap", time.monotonic()
        alone = bare_loop(cores[0], BARE_S)
        os.sched_setaffinity(0, cores[1:] or cores)
        with Room() as room:
            os.sched_setaffinity(0, cores[:1])
            options = ("--flight.takeoff-height", "1.5", "--goal.target", *map(str, TARGET))
            usual = FlightSettings()  # what a busy machine is let off in the tests counts here
            options += ("--flight.odometry-timeout", str(usual.odometry_timeout))
            options += ("--flight.link-timeout", str(usual.link_timeout))
            flies = bridge_of(policy, room, log, options=options)
            os.sched_setaffinity(0, cores)
            stolen = stolen_s()
            try:
                errors = fly(room, flies, args.seconds)
            finally:
                flies.close()
            stolen = stolen_s() - stolen
        print(f"flown for {time.monotonic() - began:.0f} s")
        content = read_log(log)
    timing, asked = content["timing"], content["policy"]
    lateness, work = timing.numbers("lateness_s"), timing.numbers("work_s")
    inference = asked.numbers("inference_s")
    modes = [str(mode) for mode in content["mode"].texts("mode")]
    row = {
        "policy's flight": f"{args.seconds:.0f} s",
        "hover error, mean / max": f"{100 * np.mean(errors):.1f} / {100 * np.max(errors):.1f} cm",
        "steps late by, p50 / p99 / max": _ms(lateness),
        "a bare loop's, p50 / p99 / max": _ms(alone),
        "work of a step, p50 / p99 / max": _ms(work),
        "inference, p50 / p99 / max": _ms(inference),
        "taken by the machine's host": f"{100 * stolen / args.seconds / len(cores):.1f} %",
        "deadlines missed": str(int(np.nansum(timing.numbers("deadline_missed")))),
    }
    print(table([row]))
    print("modes:", " ".join(modes))
    write("bridge_loop", args.json, {
        "table": [row], "modes": modes, "seconds": args.seconds, "hover_error_m": [np.mean(errors), np.max(errors)],
        "lateness_s": _figures(lateness), "bare_lateness_s": _figures(alone), "work_s": _figures(work),
        "inference_s": _figures(inference), "stolen_s": stolen,
        "not_in_log": content.cut_off,
    })  # fmt: skip


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
