"""A running Betaflight SITL: its process, its sockets and its clock."""

import mmap
import os
import random
import re
import select
import socket
import struct
import subprocess
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from e2efly.validation.firmware_program import Firmware

_STATE = struct.Struct("<18d")
_RC = struct.Struct("<d16H")
_MOTORS, _OUTPUTS = struct.Struct("<4f"), struct.Struct("<H2x16f")
"""The packet of four motors, and that of all outputs: the number of motors, and pulses, us, of which theirs are first
(betaflight: `servo_packet_raw` of SIMULATOR/target/SITL/target.h)."""
_TRIES = 5
"""Number of starts with other ports before giving up."""
_PORTS = 12
"""Number of ports: UDP 9001 to 9004 and TCP 5761 to 5768, shifted."""
_CLOCK = struct.Struct("<6Q")
_NOW, _WAITING, _STATES, _FRAMES, _ROUNDS = range(1, 6)
"""Positions of these values in the shared memory, after the horizon; see `sitl_shim.c`."""
IDLE_S = 0.002
"""Time between two states while nothing moves, s."""
_TAKEN = re.compile(rb"bind port .* failed|UDP server .*\.\.\.-")
"""Messages of the firmware when another program has one of its ports."""
_RANDOM = random.SystemRandom()
STOPPED, FULL = 1000.0, 2000.0
"""Pulses of a motor output of 0 and of 1, us."""
BOOT_S = 20.0
"""Longest real time for the firmware to open its ports, or to answer, s."""


def free_ports() -> int:
    """The first of `_PORTS` consecutive ports that are free on loopback.

    They are below the range that systems assign automatically.
    """
    for _ in range(100):
        base = _RANDOM.randrange(10_000, 32_000)
        if all(_free(base + i) for i in range(_PORTS)):
            return base
    raise OSError("no free ports on the loopback interface")


def _free(port: int) -> bool:
    for kind in (socket.SOCK_STREAM, socket.SOCK_DGRAM):
        with socket.socket(socket.AF_INET, kind) as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                return False
    return True


@dataclass(frozen=True)
class FirmwareState:
    """The input of the firmware's sensors, body FLU, SI units."""

    body_rate: np.ndarray
    """(3,) rad/s."""
    specific_force: np.ndarray
    """(3,) m/s^2. Level and at rest: 0, 0, 9.81."""
    quaternion: np.ndarray
    """(4,) wxyz, body to world ENU."""
    velocity: np.ndarray
    """(3,) world, m/s."""
    position: np.ndarray
    """(3,) world, m."""


RESTING = FirmwareState(np.zeros(3), np.array([0, 0, 9.81]), np.array([1.0, 0, 0, 0]), np.zeros(3), np.zeros(3))
"""The state of a level vehicle at rest."""


class Sitl:
    """One firmware process, in its own folder with its settings.

    Its time is virtual: it runs only inside `advance`. Use it as a context manager.
    """

    def __init__(self, firmware: Firmware, folder: Path, rotors: int = 4) -> None:
        self.firmware, self.folder = firmware, folder
        self._layout = firmware.layout
        self.base = free_ports()
        self.now = 0.0
        """The firmware's time: seconds since its first start. It goes on while the firmware is off."""
        self._booted = 0.0
        self._process: subprocess.Popen | None = None
        self._rotors, self._motors = rotors, np.zeros(rotors)
        self._clock: mmap.mmap | None = None
        self._go = self._poke = self._done = -1
        folder.mkdir(parents=True, exist_ok=True)
        self._out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._in = self._listening()

    def _listening(self) -> socket.socket:
        """Socket to which the firmware sends its motor outputs: of four motors, or all."""
        found = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        found.bind(("127.0.0.1", self.base + (self._rotors == 4)))
        found.setblocking(False)
        return found

    @property
    def msp(self) -> str:
        """Address of the firmware's MSP port, for a link."""
        return f"tcp:127.0.0.1:{self.base + 4}"

    def __enter__(self) -> "Sitl":
        try:
            self.start()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self._process is not None and self._process.poll() is None

    def start(self) -> None:
        """Start the process and wait for its MSP port. At its first start it uses other ports if one is not free.

        Raises:
            OSError: when it ends or does not listen within `BOOT_S`; after the first start, when another program has
                taken one of its ports.
        """
        for _ in range(_TRIES if self.now == 0.0 else 1):
            if self._launch():
                return
            self.stop()
            self.now = 0.0
            self._in.close()
            self.base = free_ports()
            self._in = self._listening()
        raise OSError(f"the Betaflight SITL in {self.folder} does not start: its ports are taken by others")

    def _launch(self) -> bool:
        """Start the process and wait for its ports. False if one of them is not free."""
        clock = self.folder / "clock"
        clock.write_bytes(bytes(4096))
        with clock.open("r+b") as file:
            self._clock = mmap.mmap(file.fileno(), 4096)
        (go, self._go), (poke, self._poke), (self._done, done) = os.pipe(), os.pipe(), os.pipe()
        environment = os.environ | {
            "LD_PRELOAD": str(self.firmware.shim), "E2EFLY_SITL_BASE": str(self.base), "E2EFLY_SITL_CLOCK": str(clock),
            "E2EFLY_SITL_GO": str(go), "E2EFLY_SITL_POKE": str(poke), "E2EFLY_SITL_DONE": str(done),
        }  # fmt: skip
        self._booted = self.now
        with suppress(BlockingIOError):  # what was sent before, with other settings
            while self._in.recv(_OUTPUTS.size):
                pass
        output = self.folder / "output.txt"
        try:
            with output.open("wb") as log:
                self._process = subprocess.Popen(
                    [str(self.firmware.program)],
                    cwd=self.folder,
                    env=environment,
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=log,
                    pass_fds=(go, poke, done),
                )
        finally:
            for end in (go, poke, done):
                os.close(end)
        latest = time.monotonic() + BOOT_S
        while b"bind port" not in (text := output.read_bytes()):  # a test by connecting would take its only place
            if not self.alive or time.monotonic() > latest:
                raise OSError(
                    f"the Betaflight SITL in {self.folder} does not start:\n{text[-500:].decode(errors='replace')}"
                )
            self.advance(0.01)
        return not _TAKEN.search(text)

    def stop(self) -> None:
        """Kill the process, like a loss of battery power."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None
        for end in (self._go, self._poke, self._done):
            if end >= 0:
                os.close(end)
        self._go = self._poke = self._done = -1
        self._motors = np.zeros(self._rotors)

    def close(self) -> None:
        """Stop it and free its sockets."""
        self.stop()
        self._out.close()
        self._in.close()
        if self._clock is not None:
            self._clock.close()
            self._clock = None

    def send_state(self, state: FirmwareState) -> None:
        """Send the sensors a new state, and wait until the firmware has read it."""
        packet = _STATE.pack(
            self.now - self._booted,
            # the firmware itself changes signs: it expects the rates of a y-right body, and the specific force with the
            # opposite sign
            *(state.body_rate * (1, -1, self._layout.yaw_sign)),
            *(-state.specific_force),
            *(state.quaternion * (1, 1, -1, -1)),
            *state.velocity,
            *state.position,
            101325.0 - 12.0 * state.position[2],
        )
        self._hand(packet, 2, _STATES)

    def send_rc(self, channels: np.ndarray) -> None:
        """Send a frame of the pilot's receiver, 16 channels in us, and wait until the firmware has read it."""
        if self._process is not None:
            self._hand(_RC.pack(self.now - self._booted, *np.asarray(channels, int)), 3, _FRAMES)

    def _hand(self, packet: bytes, port: int, counted: int) -> None:
        seen = self._shared()[counted]
        self._out.sendto(packet, ("127.0.0.1", self.base + port))
        while self._shared()[counted] == seen and self._told():
            pass

    def idle(self, seconds: float, state: FirmwareState = RESTING) -> None:
        """Run for `seconds` in one constant state."""
        for _ in range(round(seconds / IDLE_S)):
            self.send_state(state)
            self.advance(IDLE_S)
        self.exchange()

    def advance(self, dt: float) -> None:
        """Let the firmware run for `dt` s of its time. If it is off, only the time advances."""
        self.now += dt
        if self._process is None:
            return
        assert self._clock is not None
        horizon = round((self.now - self._booted) * 1e9)
        struct.pack_into("<Q", self._clock, 0, horizon)
        self._write(self._go)
        while self._shared()[_WAITING] <= horizon and self._told():
            pass

    def _write(self, pipe: int) -> None:
        with suppress(BrokenPipeError):  # it has ended
            os.write(pipe, b"\0")

    def _told(self) -> bool:
        """Wait until the firmware has a message. False: it has ended."""
        if not select.select([self._done], [], [], BOOT_S)[0]:
            raise OSError(f"the Betaflight SITL in {self.folder} hangs: it said nothing for {BOOT_S:g} s")
        return bool(os.read(self._done, 64))

    def exchange(self) -> None:
        """Wait until the firmware has read what was sent to it, and has sent its outputs."""
        if self._process is None:
            return
        for _ in range(2):  # it reads in the first round and writes in the second
            seen = self._shared()[_ROUNDS]
            self._write(self._poke)
            while self._shared()[_ROUNDS] == seen and self._told():
                pass

    def motors(self) -> np.ndarray:
        """The newest motor outputs, 0 to 1, one for each rotor, in the order of the firmware's mixer. Of four: rear
        right, front right, rear left, front left.

        Raises:
            OSError: when the firmware drives another number of motors.
        """
        while True:
            try:
                packet = self._in.recv(_OUTPUTS.size)
            except BlockingIOError:
                return self._motors
            if self._rotors == 4 and len(packet) == _MOTORS.size:
                self._motors = np.array(_MOTORS.unpack(packet))[list(self._layout.motors)]
            elif self._rotors != 4 and len(packet) == _OUTPUTS.size:
                count, *pulses = _OUTPUTS.unpack(packet)
                if count != self._rotors:
                    raise OSError(f"the firmware drives {count} motors; accepted: {self._rotors}, as its settings say")
                self._motors = np.clip((np.array(pulses[:count]) - STOPPED) / (FULL - STOPPED), 0.0, 1.0)

    def _shared(self) -> tuple[int, ...]:
        assert self._clock is not None
        return _CLOCK.unpack_from(self._clock, 0)
