"""A simulated motion capture system, as a process of its own: exact poses in, measured poses out, over UDP.

    python -m e2efly.validation.mocap_process --to PORT [PORT ...] [--delay S] [--gaps HZ] [--seed N]

It prints one line of JSON, `{"from": PORT}`: the port of the loopback interface that accepts exact poses, in
the form of docs/pose-sources.md. Each pose goes to every port of `--to`, later and with noise. It has no velocity and
no body rate, because cameras do not measure them. Sometimes the markers are hidden for a moment. The process ends when
its standard input ends.
"""

import argparse
import json
import os
import select
import socket
import sys
import time
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.flight.process import be_punctual

DELAY_S = 0.004
"""Delay of cameras and network, s."""
JITTER_S = 0.001
"""Largest additional random delay, uniform, s."""
GAPS_HZ = 0.2
"""Rate at which the markers are hidden, Hz."""
GAP_S = 0.03
"""Longest time for which they are hidden, uniform, s."""
POSITION, ATTITUDE = 0.0005, 0.001
"""Noise, m and rad: standard deviations per axis."""
PRIORITY = 8
"""Real-time priority, below that of the bridge."""
_LARGEST = 4096


@dataclass(frozen=True)
class Marks:
    """The errors of a motion capture system."""

    delay: float = DELAY_S
    """Delay of the poses, s."""
    gaps: float = GAPS_HZ
    """Rate at which the markers are hidden, Hz. 0: never."""
    rate: float = 200.0
    """Rate of the poses, Hz."""


def measured(pose: dict[str, Any], random: np.random.Generator) -> dict[str, Any]:
    """A measured pose: position (3,), m, and attitude (4,), wxyz, with noise. The stamp does not change."""
    quaternion = np.asarray(pose["quaternion"]) + ATTITUDE / 2 * random.normal(size=4)
    return {
        "position": (np.asarray(pose["position"]) + POSITION * random.normal(size=3)).tolist(),
        "quaternion": (quaternion / np.linalg.norm(quaternion)).tolist(),
        "stamp": pose["stamp"],
    }


@dataclass
class MocapCamera:
    """Delays poses, adds noise to them, and drops some. `now` is any steady clock, s, the same in both methods."""

    marks: Marks
    random: np.random.Generator

    def __post_init__(self) -> None:
        self._waiting: deque[tuple[float, bytes]] = deque()
        self._hidden_until = -np.inf

    def see(self, pose: dict[str, Any], now: float) -> None:
        """Accept an exact pose."""
        marks, random = self.marks, self.random
        if random.random() < marks.gaps / marks.rate:
            self._hidden_until = now + GAP_S * random.random()
        if now >= self._hidden_until:
            due = now + marks.delay + JITTER_S * random.random()
            self._waiting.append((due, json.dumps(measured(pose, random)).encode()))

    def ready(self, now: float) -> list[bytes]:
        """The poses that are due, in the order in which they were accepted."""
        ready = []
        while self._waiting and self._waiting[0][0] <= now:
            ready.append(self._waiting.popleft()[1])
        return ready


def serve(inlet: socket.socket, ports: list[int], camera: MocapCamera) -> None:
    """Forward poses until standard input ends."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        while True:
            readable, _, _ = select.select([inlet, sys.stdin], [], [], 0.001)
            if sys.stdin in readable and not os.read(sys.stdin.fileno(), 1):
                return
            if inlet in readable:
                camera.see(json.loads(inlet.recv(_LARGEST)), time.monotonic())
            for message in camera.ready(time.monotonic()):
                for port in ports:
                    sender.sendto(message, ("127.0.0.1", port))


def main() -> None:
    """Open the port and serve."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--to", type=int, nargs="+", required=True, help="UDP ports on 127.0.0.1 that take the poses")
    parser.add_argument("--delay", type=float, default=DELAY_S, help="s")
    parser.add_argument("--gaps", type=float, default=GAPS_HZ, help="how often the markers are hidden, Hz")
    parser.add_argument("--seed", type=int, default=0, help="of noise and gaps")
    options = parser.parse_args()
    be_punctual(PRIORITY)  # it stands for a separate machine
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as inlet:
        inlet.bind(("127.0.0.1", 0))
        print(json.dumps({"from": inlet.getsockname()[1]}), flush=True)
        serve(inlet, options.to, MocapCamera(Marks(options.delay, options.gaps), np.random.default_rng(options.seed)))


if __name__ == "__main__":
    main()
