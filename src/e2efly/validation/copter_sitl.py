"""The real ArduCopter as a program for this machine (SITL), its physics behind ArduPilot's JSON interface.

ArduPilot is under the GPL, version 3. Nothing of it is contained, built, imported or linked here: a user who has its
`arducopter` names the program, and it runs as a separate process. The interface is that of ArduPilot's
`libraries/SITL/examples/JSON/readme.md`: the firmware sends its motor outputs by UDP and waits; a state with a time
stamp comes back and lets its clock go on until then.
"""

import json
import os
import socket
import struct
import subprocess
import time
from pathlib import Path

import numpy as np

from e2efly.validation.sitl import BOOT_S, RESTING, FirmwareState, free_ports

PROGRAM = "E2EFLY_ARDUCOPTER"
"""Environment variable with the path of the program."""
DEFAULTS = "defaults.parm"
"""File with the parameters, in the firmware's folder."""
MAGIC = 18458
SERVOS = struct.Struct("<HHI16H")
"""The firmware's outputs: magic, frame rate, frame count, pulse widths, us."""
RECEIVED = 12
"""Channels of the pilot's receiver that the interface takes."""
HOME = "47.4,8.5,0,0"
"""Where the world's origin is: latitude, longitude, height above the sea, m, and a heading."""
SPEEDUP = 1000
"""The firmware may run this much faster than real time. It waits for the physics anyway."""


def copter_program(named: Path | None = None) -> Path:
    """The user's program: the given path, or that of `E2EFLY_ARDUCOPTER`.

    Raises:
        OSError: none is given, or it is no file that can be run.
    """
    text = str(named or os.environ.get(PROGRAM, ""))
    if not text or not os.access(text, os.X_OK) or not Path(text).is_file():
        raise OSError(f"arducopter is {text!r}; accepted: the path of ArduPilot's SITL program, also in {PROGRAM}")
    return Path(text).absolute()


class CopterSitl:
    """One ArduCopter process, in its own folder. Its time is virtual: it runs only inside `advance`.

    The parameters are those of a fresh start, changed by `DEFAULTS` in the folder.
    """

    def __init__(self, program: Path, folder: Path) -> None:
        self.program, self.folder = program, folder
        self.now = self._booted = 0.0
        self.channels: np.ndarray | None = None
        """(12,) the newest frame of the pilot's receiver, us. None: it hears nothing."""
        self.volts = 15.6
        """Voltage of the battery, V."""
        folder.mkdir(parents=True, exist_ok=True)
        self._ports = free_ports()
        self._state = RESTING
        self._motors, self._frame = np.zeros(4), -1
        self._process: subprocess.Popen | None = None
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._peer: tuple[str, int] | None = None

    @property
    def link(self) -> str:
        """The text of a link to its first serial port: an address of this machine to which it sends."""
        return f"udp:127.0.0.1:{self._ports}"

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self._process is not None and self._process.poll() is None

    def start(self) -> None:
        """Start the process, with a fresh storage, and wait for its first outputs.

        Raises:
            OSError: when it ends or says nothing within `BOOT_S`.
        """
        self._booted, self._frame, self._peer = self.now, -1, None
        address, port = self._socket.getsockname()
        command = [
            str(self.program), "--wipe", "--model", f"json:{address}", "--sim-address", address, "--sim-port-out",
            str(port), "--sim-port-in", str(self._ports + 1), "--speedup", str(SPEEDUP), "--defaults", DEFAULTS,
            "--home", HOME, "--base-port", str(self._ports + 2), "--rc-in-port", str(self._ports + 3), "--serial0",
            f"udpclient:{self.link.removeprefix('udp:')}",
        ]  # fmt: skip
        with (self.folder / "output.txt").open("wb") as log:
            self._process = subprocess.Popen(command, cwd=self.folder, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        self._hear()

    def stop(self) -> None:
        """Kill the process, like a loss of battery power."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None
        self._motors = np.zeros(4)

    def close(self) -> None:
        """Stop it and free its socket."""
        self.stop()
        self._socket.close()

    def send_state(self, state: FirmwareState) -> None:
        """Give the sensors a new state. The firmware has it when its time goes on."""
        self._state = state

    def exchange(self) -> None:
        """Nothing waits: each step of the time takes a state and gives outputs."""

    def advance(self, dt: float) -> None:
        """Let the firmware run for `dt` s of its time, at most 0.1. If it is off, only the time advances.

        Raises:
            OSError: when it ends or hangs.
        """
        self.now += dt
        if self._process is not None and self._peer is not None:
            self._socket.sendto(self._told(), self._peer)
            self._hear()

    def motors(self) -> np.ndarray:
        """(4,) the newest motor outputs, 0 to 1, in the order of the outputs: that of Betaflight in its frame types."""
        return self._motors

    def _told(self) -> bytes:
        """The state as a line of JSON. FRD and NED, our x axis being north."""
        state, flip = self._state, np.array([1.0, -1.0, -1.0])
        told = {
            "timestamp": self.now - self._booted,
            "imu": {"gyro": list(state.body_rate * flip), "accel_body": list(state.specific_force * flip)},
            "position": list(state.position * flip),
            "quaternion": list(state.quaternion * (1, 1, -1, -1)),
            "velocity": list(state.velocity * flip),
            "battery": {"voltage": self.volts, "current": 10.0},
        }
        if self.channels is not None:
            told["rc"] = {f"rc_{i}": int(at) for i, at in enumerate(self.channels[:RECEIVED], 1)}
        return f"\n{json.dumps(told, separators=(',', ':'))}\n".encode()

    def _hear(self) -> None:
        """Wait for the outputs that follow the newest. What is sent again because a state was late is left out."""
        latest = time.monotonic() + BOOT_S
        self._socket.settimeout(0.5)
        while True:
            try:
                packet, self._peer = self._socket.recvfrom(256)
            except TimeoutError:
                if self.alive and time.monotonic() < latest:
                    continue
                end = (self.folder / "output.txt").read_bytes()[-500:].decode(errors="replace")
                raise OSError(f"arducopter in {self.folder} {'hangs' if self.alive else 'has ended'}:\n{end}") from None
            if len(packet) == SERVOS.size and (told := SERVOS.unpack(packet))[0] == MAGIC and told[2] > self._frame:
                self._frame = told[2]
                self._motors = np.clip((np.array(told[3:7]) - 1000) / 1000, 0.0, 1.0)
                return
