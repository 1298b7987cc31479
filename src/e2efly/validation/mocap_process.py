"""A motion capture system that is not there, as a process of its own: exact poses in, measured ones out, over UDP.

    python -m e2efly.validation.mocap_process --to PORT [PORT ...] [--delay S] [--gaps HZ] [--seed N]

It prints one line of JSON, `{"from": PORT}`: the port of the loopback interface that takes exact poses, as
docs/pose-sources.md has them. Each goes on to every port of `--to`, later and with noise, without velocity and body
rate: cameras see none. Now and then the markers are hidden for a moment. The process ends with its standard input.
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

from e2efly.process import be_punctual

DELAY_S = 0.004
"""What cameras and network take, s."""
JITTER_S = 0.001
"""By how much more it is at most, uniform, s."""
GAPS_HZ = 0.2
"""How often the markers are hidden, Hz."""
GAP_S = 0.03
"""For how long at most, uniform, s."""
POSITION, ATTITUDE = 0.0005, 0.001
"""Noise, m and rad: standard deviations per axis."""
PRIORITY = 8
"""Real-time priority: below the bridge's."""
_LARGEST = 4096


@dataclass(frozen=True)
class Marks:
    """What a motion capture system makes of the truth."""

    delay: float = DELAY_S
    """s."""
    gaps: float = GAPS_HZ
    """Hz; 0: none."""
    rate: float = 200.0
    """Of the poses, Hz."""


def measured(pose: dict[str, Any], random: np.random.Generator) -> dict[str, Any]:
    """A pose as it is measured: position (3,), m, and attitude (4,), wxyz, with noise; the stamp stays."""
    quaternion = np.asarray(pose["quaternion"]) + ATTITUDE / 2 * random.normal(size=4)
    return {
        "position": (np.asarray(pose["position"]) + POSITION * random.normal(size=3)).tolist(),
        "quaternion": (quaternion / np.linalg.norm(quaternion)).tolist(),
        "stamp": pose["stamp"],
    }


@dataclass
class Camera:
    """Delays, blurs and hides poses; `now` is any steady clock, s, the same in both methods."""

    marks: Marks
    random: np.random.Generator

    def __post_init__(self) -> None:
        self._waiting: deque[tuple[float, bytes]] = deque()
        self._hidden_until = -np.inf

    def see(self, pose: dict[str, Any], now: float) -> None:
        """Take in an exact pose."""
        marks, random = self.marks, self.random
        if random.random() < marks.gaps / marks.rate:
            self._hidden_until = now + GAP_S * random.random()
        if now >= self._hidden_until:
            due = now + marks.delay + JITTER_S * random.random()
            self._waiting.append((due, json.dumps(measured(pose, random)).encode()))

    def ready(self, now: float) -> list[bytes]:
        """The poses whose time has come, in the order in which they were seen."""
        ready = []
        while self._waiting and self._waiting[0][0] <= now:
            ready.append(self._waiting.popleft()[1])
        return ready


def serve(inlet: socket.socket, ports: list[int], camera: Camera) -> None:
    """Pass poses on until standard input ends."""
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
    be_punctual(PRIORITY)  # it stands for a machine of its own
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as inlet:
        inlet.bind(("127.0.0.1", 0))
        print(json.dumps({"from": inlet.getsockname()[1]}), flush=True)
        serve(inlet, options.to, Camera(Marks(options.delay, options.gaps), np.random.default_rng(options.seed)))


if __name__ == "__main__":
    main()
