"""The bridge in real time: `e2efly fly` on one core flies the real firmware on the rig, which has another.

    python benchmarks/bridge_loop.py [--policy FILE] [--seconds 600] [--json FILE]

Lateness of the control steps and the policy's inference come from the flight's own log; the hover error is the rig's
truth. Ten minutes are the soak. Give the machine nothing else to do. Without --policy a hover is trained.
"""

import os
import tempfile
import time
from pathlib import Path

import numpy as np
from common import arguments, table, write
from fault_table import hover_policy

from e2efly.deploy.flight_log import read_log
from e2efly.deploy.settings import FlightSettings
from e2efly.validate.process_faults import BridgeProcess, RigClient, take_off

TARGET = (0.0, 0.0, 2.0)


def main() -> None:
    """Fly, print the table, write the figures."""
    args = arguments(__doc__ or "", policy=None, seconds=600.0)
    cores = sorted(os.sched_getaffinity(0))
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        policy = hover_policy(args.policy, folder)
        log, began = folder / "flight.mcap", time.monotonic()
        os.sched_setaffinity(0, cores[1:] or cores)
        with RigClient() as rig:
            os.sched_setaffinity(0, cores[:1])
            options = ("--flight.takeoff-height", "1.5", "--goal.target", *map(str, TARGET))
            usual = FlightSettings()  # what a busy machine is let off in the tests counts here
            options += ("--flight.odometry-timeout", str(usual.odometry_timeout))
            options += ("--flight.link-timeout", str(usual.link_timeout))
            bridge = BridgeProcess(policy, rig, log, options=options)
            os.sched_setaffinity(0, cores)
            try:
                errors = fly(rig, bridge, args.seconds)
            finally:
                bridge.close()
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
        "work of a step, p50 / p99 / max": _ms(work),
        "inference, p50 / p99 / max": _ms(inference),
        "deadlines missed": str(int(np.nansum(timing.numbers("deadline_missed")))),
    }
    print(table([row]))
    print("modes:", " ".join(modes))
    write("bridge_loop", args.json, {
        "table": [row], "modes": modes, "seconds": args.seconds, "hover_error_m": [np.mean(errors), np.max(errors)],
        "lateness_s": _figures(lateness), "work_s": _figures(work), "inference_s": _figures(inference),
        "not_in_log": content.cut_off,
    })  # fmt: skip


def fly(rig: RigClient, bridge: BridgeProcess, seconds: float) -> list[float]:
    """Take off, let the policy fly for `seconds`, land; the distances to the target, m."""
    take_off(rig, bridge)
    time.sleep(2.0)
    rig.set(mission="policy")
    bridge.wait_for("POLICY", 5.0)
    time.sleep(3.0)
    errors, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(0.1)
        errors.append(float(np.linalg.norm(np.subtract(rig.set()["position"], TARGET))))
    rig.set(mission="land")
    bridge.wait_for("DONE", 20.0)
    rig.set(armed=False)
    bridge.end(10.0)
    return errors


def _figures(values: np.ndarray) -> list[float]:
    known = np.asarray(values, float)
    known = known[np.isfinite(known)]
    return [float(x) for x in np.percentile(known, [50, 99, 100])] if len(known) else []


def _ms(values: np.ndarray) -> str:
    return " / ".join(f"{1e3 * x:.2f}" for x in _figures(values)) + " ms"


if __name__ == "__main__":
    main()
