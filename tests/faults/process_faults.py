"""Faults of the bridge's process, in real time: `e2efly fly` flies the firmware on a rig in another process."""

import json
import math
import os
import queue
import resource
import signal
import socket
import subprocess
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.deploy.betaflight.watchdog import TIMEOUT_S
from e2efly.deploy.log.flight_log import read_log
from tests.faults.tap import Tap

ROOT = Path(__file__).parents[2]
"""Of the repository: the rig process is a module of the tests."""
START_S = 60.0
"""How long a process may take to be ready on a busy machine, s."""
PERIOD_S = 0.01
"""Of the control steps, s."""
FLIGHT_S = 40.0
"""How long each part of a flight may take on a busy machine, s."""
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


class RigClient:
    """A rig process and the pilot's hands on it. Use it as a context manager."""

    def __init__(self, vehicle: str = "vis_r", seed: int = 0) -> None:
        """Start it and wait until the firmware can be armed."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", 0))
            self.pose_port: int = probe.getsockname()[1]
        command = [sys.executable, "-m", "tests.faults.rig_process", "--pose-port", str(self.pose_port)]
        self._process = subprocess.Popen(
            [*command, "--vehicle", vehicle, "--seed", str(seed)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            cwd=ROOT,
        )  # fmt: skip
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise OSError(f"the rig process ended with status {self._process.wait()}")
        told = json.loads(line)
        self.link: str = told["link"]
        self._control = socket.create_connection(("127.0.0.1", told["control"]), timeout=30.0)
        self._lines = self._control.makefile("rb")

    def __enter__(self) -> "RigClient":
        return self

    def __exit__(self, *_: object) -> None:
        self._lines.close()
        self._control.close()
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait(10.0)

    def set(self, **changes: object) -> dict[str, Any]:
        """Move the pilot's sticks and switches, fields of `rig.Transmitter`; the fields of `rig_process.State`."""
        self._control.sendall(json.dumps(changes).encode() + b"\n")
        return json.loads(self._lines.readline())


class BridgeProcess:
    """`e2efly fly` as a process, and what it says."""

    def __init__(
        self,
        policy: Path,
        rig: RigClient,
        log: Path,
        limit: int | None = None,
        options: tuple[str, ...] = (),
        link: str | None = None,
    ) -> None:
        """Start it.

        Args:
            policy: a policy.onnx.
            rig: the world.
            log: of the flight.
            limit: bytes that a file may have; None: any.
            options: more of the command's; they come last.
            link: to the firmware; None: straight.
        """
        common = ["--flight.battery-unknown", "--flight.takeoff-speed", "0.8", "--flight.land-speed", "0.6"]
        # a busy machine holds up the rig, too: not what is looked at here
        common += ["--flight.odometry-timeout", "0.6", "--flight.link-timeout", "1.5"]
        command = [sys.executable, "-m", "e2efly", "fly", str(policy), "--link", link or rig.link, "--log", str(log)]
        self.process = subprocess.Popen(
            [*command, "--pose", f"udp:{rig.pose_port}", *common, *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**os.environ, "COLUMNS": "400", "PYTHONUNBUFFERED": "1"},
        )
        if limit is not None:  # long before it has a log to write
            resource.prlimit(self.process.pid, resource.RLIMIT_FSIZE, (limit, limit))
        self.said: list[str] = []
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def heard(self, text: str, seconds: float) -> bool:
        """Whether it says something, from now on, within so long."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            try:
                line = self._lines.get(timeout=left)
            except queue.Empty:
                return False
            self.said.append(line)
            if text in line:
                return True
        return False

    def wait_for(self, text: str, seconds: float) -> None:
        """Wait until it says something.

        Raises:
            RuntimeError: when it does not, with its last words.
        """
        if not self.heard(text, seconds):
            raise RuntimeError(f"the bridge did not come to {text}; it said: {self.said[-8:]}")

    def end(self, seconds: float) -> int | None:
        """Ask it to end, as Ctrl-C does; its exit status, or None where it had to be killed."""
        self.process.send_signal(signal.SIGINT)
        try:
            return self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            return None
        finally:
            self.close()

    def close(self) -> None:
        """Kill it, where it still runs, and read the last it has said."""
        self.process.kill()
        self.process.wait()
        self._reader.join(1.0)
        while not self._lines.empty():
            self.said.append(self._lines.get())

    def _read(self) -> None:
        assert self.process.stdout is not None
        with self.process.stdout as stream:
            for line in stream:
                self._lines.put(line.rstrip())


def strike(fault: str, policy: Path, folder: Path, seed: int = 0) -> ProcessOutcome:
    """One flight in real time with one of `FAULTS`, in hover.

    Args:
        fault: one of `FAULTS`.
        policy: a policy.onnx.
        folder: of the flight's record.
        seed: of the moment and of the poses' noise.
    """
    log = folder / f"{fault.replace(' ', '_')}-{seed}.mcap"
    random = np.random.default_rng(seed)
    with RigClient(seed=seed) as rig, Tap(rig.link) as tap:
        bridge = BridgeProcess(policy, rig, log, LOG_LIMIT if fault == "disk full" else None, link=tap.link)
        try:
            return _flight(fault, rig, bridge, tap, log, float(random.uniform(0.5, 1.5)))
        finally:
            bridge.close()


def _flight(fault: str, rig: RigClient, bridge: BridgeProcess, tap: Tap, log: Path, moment: float) -> ProcessOutcome:
    problems: list[str] = []
    reaction = allowed = math.nan
    take_off(rig, bridge)
    time.sleep(moment)
    if fault == "disk full":
        if not _log_stands(log):
            problems.append("the log went on growing")
        rig.set(mission="land")
        if not bridge.heard("DONE", FLIGHT_S):
            problems.append(f"it did not land; it said: {bridge.said[-3:]}")
        rig.set(armed=False)
    else:
        bridge.process.send_signal({"killed": signal.SIGKILL, "stopped": signal.SIGSTOP}[fault])
        allowed = (TIMEOUT_S if fault == "stopped" else 0.0) + PERIOD_S
        reaction = _until_descent(tap)
        if not _until(rig, FLIGHT_S, lambda state: state["standing"]):
            problems.append("it did not land")
        if not _until(rig, FLIGHT_S, lambda state: max(state["motors"]) < 0.12):
            problems.append("the throttle was not closed")
        bridge.process.send_signal(signal.SIGCONT)
        time.sleep(1.0)
        rig.set(armed=False)
    if fault == "killed":
        bridge.close()
    elif (status := bridge.end(FLIGHT_S)) != 0:
        problems.append(f"the bridge ended with status {status}; it said: {bridge.said[-3:]}")
    state = rig.set()
    read = read_log(log)
    if "hover" not in [message["mode"] for message in read["mode"].values]:
        problems.append("the log lacks the flight")
    if any("Traceback" in line for line in bridge.said):
        problems.append(f"an exception escaped: {bridge.said}")
    if not state["standing"] or not state["touches"]:
        problems.append("it is not on the ground")
    speed, tilt = state["touches"][-1] if state["touches"] else (math.nan, math.nan)
    return ProcessOutcome(
        fault, reaction, allowed, speed, tilt, state["largest_tilt"], tuple(bridge.said[-5:]), tuple(problems)
    )  # fmt: skip


def take_off(rig: RigClient, bridge: BridgeProcess) -> None:
    """Hand over, arm, and hover; what a busy machine makes fail, the pilot tries again."""
    bridge.wait_for("INIT", START_S)
    rig.set(override=True, throttle=0.0)
    end = time.monotonic() + START_S
    while True:
        time.sleep(0.5)
        rig.set(armed=True)
        if bridge.heard("ready", 3.0):
            rig.set(mission="hover")
            if bridge.heard("HOVER", 10.0):
                return
        rig.set(mission="land")
        _until(rig, FLIGHT_S, lambda state: state["standing"])
        rig.set(armed=False)
        if time.monotonic() > end:
            raise RuntimeError(f"the bridge did not take off; it said: {bridge.said[-8:]}")


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


def _until(rig: RigClient, seconds: float, good: Any) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if good(rig.set()):
            return True
        time.sleep(0.02)
    return False


def _log_stands(log: Path) -> bool:
    """Whether the log has stopped growing."""
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
