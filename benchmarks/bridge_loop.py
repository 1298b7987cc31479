"""The bridge in real time: `e2efly fly` on one core flies the real firmware on the rig, which has the other cores.

    python benchmarks/bridge_loop.py [--policy FILE] [--seconds 30] [--json FILE]

Lateness of the control steps and the policy's inference come from the flight's own log; the hover error is the rig's
truth. With `--seconds 600` it is the soak. Give the machine nothing else to do. Without --policy a hover is trained.
"""

import json
import os
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from common import arguments, table, write

from e2efly.deploy.flight_log import read_log

TARGET = (0.0, 0.0, 2.0)


class Rig:
    """The rig's process and its control port."""

    def __init__(self, core: str, pose_port: int) -> None:
        command = ["taskset", "-c", core, sys.executable, "-m", "e2efly.validate.rig_process"]
        self.process = subprocess.Popen(
            [*command, "--pose-port", str(pose_port)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert self.process.stdout is not None
        told = json.loads(self.process.stdout.readline())
        self.link = told["link"]
        self.file = socket.create_connection(("127.0.0.1", told["control"])).makefile("rw")

    def tell(self, **changes: Any) -> dict[str, Any]:
        """Move the pilot's sticks and switches; returns the true state."""
        self.file.write(json.dumps(changes) + "\n")
        self.file.flush()
        return json.loads(self.file.readline())


def main() -> None:
    """Fly, print the table, write the figures."""
    args = arguments(__doc__ or "", policy=None, seconds=30.0)
    cores = sorted(os.sched_getaffinity(0))
    others = ",".join(map(str, cores[1:] or cores))
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        policy = Path(args.policy) if args.policy else folder / "run" / "policy.onnx"
        if not args.policy:
            train = [sys.executable, "-m", "e2efly", "train", "hover", "--out", str(policy.parent), "--no-plots"]
            subprocess.run(train, check=True, stdout=subprocess.DEVNULL)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        rig, log = Rig(others, port), folder / "flight.mcap"
        began = time.monotonic()
        fly = subprocess.Popen([
            "taskset", "-c", str(cores[0]), sys.executable, "-m", "e2efly", "fly", str(policy), "--link", rig.link,
            "--pose", f"udp:{port}", "--log", str(log), "--flight.battery-unknown", "--flight.takeoff-height", "1.5",
            "--goal.target", *map(str, TARGET),
        ], stdout=subprocess.DEVNULL)  # fmt: skip
        for wait, order in ((2.0, {"override": True}), (1.0, {"armed": True}), (1.5, {"mission": "hover"})):
            time.sleep(wait)
            rig.tell(**order)
        time.sleep(8.0)
        rig.tell(mission="policy")
        time.sleep(3.0)
        errors = []
        end = time.monotonic() + args.seconds
        while time.monotonic() < end:
            time.sleep(0.1)
            errors.append(float(np.linalg.norm(np.subtract(rig.tell()["position"], TARGET))))
        rig.tell(mission="land")
        time.sleep(9.0)
        rig.tell(armed=False)
        fly.terminate()
        fly.wait(10)
        rig.process.kill()
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


def _figures(values: np.ndarray) -> list[float]:
    known = np.asarray(values, float)
    known = known[np.isfinite(known)]
    return [float(x) for x in np.percentile(known, [50, 99, 100])] if len(known) else []


def _ms(values: np.ndarray) -> str:
    return " / ".join(f"{1e3 * x:.2f}" for x in _figures(values)) + " ms"


if __name__ == "__main__":
    main()
