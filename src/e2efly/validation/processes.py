"""Programs that fly together in real time, each a process: a room with a vehicle, a bridge, and a pilot."""

import dataclasses
import json
import math
import os
import queue
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal

START_S = 60.0
"""Longest time for a process to be ready on a busy machine, s."""
FLIGHT_S = 40.0
"""Longest time for each part of a flight on a busy machine, s."""
LAST_LINES = 6
"""Number of different lines that are shown of a program that fails. Lines that differ only in numbers count as one."""
_TIME = re.compile(r"^ *[0-9.]+ +")
_NUMBER = re.compile(r"-?[0-9]+[.]?[0-9]*")
URGENT = -15
"""Niceness of an urgent program."""
TAKEN = "the watchdog has taken over"
"""The bridge's message that the watchdog has taken over."""
SINK = 0.5
"""Speed at which a pilot without a bridge descends, m/s."""
_LIFT, _CLIMB_GAIN, _LIFT_GAIN, _BRAKE = 0.1, 0.25, 0.2, 0.12
"""The pilot's throttle stick: its first position; its gain per m/s; its gain per metre, which finds the hover position.
For the other sticks: the gain per m/s."""


Victim = Literal["mocap", "hil", "bridge", "watchdog"]
"""The processes of hardware in the loop that can be killed in flight."""


def free_port() -> int:
    """A free UDP port of the loopback interface."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def flags(prefix: str, options: Any, default: Any = None) -> list[str]:
    """A configuration as options of a command: the fields that differ from the default.

    It is a frozen dataclass of numbers, texts, flags, tuples of them, and such dataclasses. `prefix` begins the names
    of the options. Without a default, it is that of the class.
    """
    default, found = type(options)() if default is None else default, list[str]()
    for field in dataclasses.fields(options):
        value, usual = getattr(options, field.name), getattr(default, field.name)
        name = f"{prefix}.{field.name.replace('_', '-')}"
        if dataclasses.is_dataclass(value):
            found += flags(name, value, usual)
        elif value == usual:
            continue
        elif isinstance(value, bool):
            found.append(f"--{name}" if value else f"--{prefix}.no-{field.name.replace('_', '-')}")
        else:
            found += [f"--{name}", *map(_text, value if isinstance(value, tuple) else (value,))]
    return found


def _text(value: Any) -> str:
    return f"{value:.9g}" if isinstance(value, float) else str(value)


class NotReadyError(RuntimeError):
    """A program was not ready in its time. What it was started for has not begun."""


class Program:
    """A program as a process, with its output.

    Use it as a context manager: a program that still runs at the end is killed.
    """

    def __init__(self, name: str, command: Sequence[str], core: int | None = None, *, urgent: bool = False) -> None:
        """Start `python` with these arguments. The name is for error texts.

        With a core, it may use only that one. `urgent` gives it, with all its threads, priority over ordinary programs,
        where this is allowed.
        """
        self.name = name
        self.process = subprocess.Popen(
            [sys.executable, *command], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True, errors="replace", env={**os.environ, "COLUMNS": "400", "PYTHONUNBUFFERED": "1"},
        )  # fmt: skip
        if core is not None and hasattr(os, "sched_setaffinity"):
            with suppress(OSError):  # it has already ended, which is noticed soon
                os.sched_setaffinity(self.process.pid, {core})
        if urgent:
            with suppress(OSError):
                os.setpriority(os.PRIO_PROCESS, self.process.pid, URGENT)
        self.said: list[str] = []
        """The lines that were read by `heard`."""
        self.told: list[tuple[float, str]] = []
        """All lines, each with its time on the monotonic clock, s."""
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> "Program":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def heard(self, text: str | tuple[str, ...], seconds: float) -> bool:
        """Whether it prints a text within `seconds` from now. Of several texts, one is enough."""
        texts = (text,) if isinstance(text, str) else text
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            try:
                line = self._lines.get(timeout=left)
            except queue.Empty:
                return False
            if line is None:
                self._lines.put(None)
                return False
            self.said.append(line)
            if any(part in line for part in texts):
                return True
        return False

    def wait_for(self, text: str | tuple[str, ...], seconds: float) -> str:
        """Wait until it prints a text. Returns the line.

        Raises:
            RuntimeError: when it does not, with its last lines.
        """
        if not self.heard(text, seconds):
            raise RuntimeError(f"{self.name} did not come to {text!r}{self.end_told()}")
        return self.said[-1]

    def ready(self, text: str, seconds: float = START_S) -> str:
        """Wait until it prints a text, by which it is ready. Returns the line.

        Raises:
            NotReadyError: when it does not, with its time by the clock and by a processor, and its last lines.
        """
        try:
            return self.wait_for(text, seconds)
        except RuntimeError as error:
            had = f"{seconds:g} s, in which it had a processor for {_computed(self.process.pid):.0f} s"
            raise NotReadyError(f"{self.name} was not ready within {had}: {error}") from None

    def end_told(self) -> str:
        """How it has ended, if it has ended, and its last lines."""
        status = self.process.poll()
        ended = "" if status is None else f" and ended with status {status}"
        lines = {_NUMBER.sub("", line): line for line in (_TIME.sub("", line) for _, line in self.told)}
        return f"{ended}; it said: {list(lines.values())[-LAST_LINES:]}"

    def end(self, seconds: float, by: int = signal.SIGINT) -> int | None:
        """Ask it to end, as Ctrl-C does. Returns its exit status, or None if it had to be killed."""
        self.process.send_signal(by)
        return self._status(seconds)

    def leave(self) -> int | None:
        """Close its standard input, which ends the programs of a room.

        Returns its exit status, or None as for `end`.
        """
        assert self.process.stdin is not None
        with suppress(OSError):
            self.process.stdin.close()
        return self._status(10.0)

    def _status(self, seconds: float) -> int | None:
        try:
            return self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            return None
        finally:
            self.close()

    def close(self) -> None:
        """Kill it if it still runs, and read its last output."""
        self.process.kill()
        self.process.wait()
        self._reader.join(1.0)
        assert self.process.stdin is not None
        with suppress(OSError):
            self.process.stdin.close()
        while not self._lines.empty():
            if (line := self._lines.get()) is not None:
                self.said.append(line)
        self._lines.put(None)

    def _read(self) -> None:
        assert self.process.stdout is not None
        with self.process.stdout as stream:
            for line in stream:
                self.told.append((time.monotonic(), line.rstrip()))
                self._lines.put(line.rstrip())
        self._lines.put(None)


def _computed(process: int) -> float:
    """Processor time of a process of Linux, s. NaN: it is not known."""
    try:
        times = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[11:13]
    except OSError:
        return math.nan
    return sum(map(int, times)) / os.sysconf("SC_CLK_TCK")


class Room:
    """A room with a vehicle and its firmware, and a pilot for it. Use it as a context manager."""

    def __init__(
        self, vehicle: str = "vis_r", seed: int = 0, options: Sequence[str] = (), core: int | None = None,
        pose_port: int | None = None,
    ) -> None:  # fmt: skip
        """Start it and wait until the firmware can be armed.

        `options` are further ones of `room_process`. The room and the firmware use only one core, `core` if it is
        given. Without a port, the poses go to a free one.

        Raises:
            NotReadyError: when it does not start, with its last lines.
        """
        self.pose_port = free_port() if pose_port is None else pose_port
        """Port to which its poses go."""
        command = ["-m", "e2efly.validation.room_process", "--pose-port", str(self.pose_port)]
        self.program = Program("the room", [*command, "--vehicle", vehicle, "--seed", str(seed), *options], core)
        try:
            told = json.loads(self.program.ready('"link"'))
            self.link: str = told["link"]
            """Address of the firmware."""
            self._control = socket.create_connection(("127.0.0.1", told["control"]), timeout=30.0)
        except BaseException:
            self.program.close()
            raise
        self._lines = self._control.makefile("rb")

    def __enter__(self) -> "Room":
        return self

    def __exit__(self, *_: object) -> None:
        self._lines.close()
        self._control.close()
        self.program.leave()

    def set(self, **changes: object) -> dict[str, Any]:
        """Move the pilot's sticks and switches.

        They are fields of `rig.Transmitter`. Returns the fields of `room_process.State`.

        Raises:
            RuntimeError: when the room has ended, with its last lines.
        """
        try:
            self._control.sendall(json.dumps(changes).encode() + b"\n")
            return json.loads(self._lines.readline())
        except (OSError, ValueError):
            raise RuntimeError(f"the room does not answer{self.program.end_told()}") from None

    def until(self, seconds: float, good: Callable[[dict[str, Any]], bool]) -> bool:
        """Whether the true state satisfies a condition within `seconds`."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if good(self.set()):
                return True
            time.sleep(0.02)
        return False

    def down(self, seconds: float) -> bool:
        """Whether the vehicle comes to stand, with its throttle closed, within `seconds`.

        A motor then idles. In air mode the integral part of the firmware's rate loop may hold others higher until the
        pilot disarms, with all sticks in the middle and the throttle at its lowest.
        """
        return self.until(seconds, lambda state: state["standing"] and min(state["motors"]) < 0.12)

    def land_by_hand(self, seconds: float) -> bool:
        """Take over the vehicle and land it like a pilot who sees it. Returns whether it stands within `seconds`."""
        last, lift = time.monotonic(), _LIFT
        end = last + seconds
        self.set(override=False, mission="land")
        while (now := time.monotonic()) < end:
            state = self.set()
            if state["standing"]:
                self.set(throttle=-1.0, roll=0.0, pitch=0.0)
                return True
            (u, v, w), yaw = state["velocity"], state["yaw"]
            ahead, left = math.cos(yaw) * u + math.sin(yaw) * v, math.cos(yaw) * v - math.sin(yaw) * u
            lift, last = _stick(lift - _LIFT_GAIN * (w + SINK) * (now - last)), now
            self.set(
                throttle=_stick(lift - _CLIMB_GAIN * (w + SINK)),
                pitch=_stick(-_BRAKE * ahead),
                roll=_stick(_BRAKE * left),
            )
            time.sleep(0.03)
        return False


def _stick(x: float) -> float:
    return min(max(x, -1.0), 1.0)


def bridge(
    policy: Path,
    room: Room,
    log: Path,
    options: Sequence[str] = (),
    link: str | None = None,
    pose: str | None = None,
    *,
    urgent: bool = False,
) -> Program:
    """`e2efly fly` as a process. Further options come last.

    Without a link and a pose source, it connects to the room's own link and takes the room's poses.
    """
    command = ["-m", "e2efly", "fly", str(policy), "--link", link or room.link, "--log", str(log)]
    command += ["--pose", pose or f"udp:{room.pose_port}", "--flight.battery-unknown"]
    return Program("the bridge", [*command, *options], urgent=urgent)


def take_off(room: Room, flies: Program) -> None:
    """Hand over control, arm, and hover. The pilot repeats steps that fail on a busy machine.

    Raises:
        RuntimeError: when the bridge does not take off, with its last lines; `NotReadyError`, when it does not start.
    """
    flies.ready("INIT")
    room.set(override=True, throttle=0.0)
    end = time.monotonic() + START_S
    while True:
        time.sleep(0.5)
        room.set(armed=True)
        if flies.heard("ready", 3.0):
            room.set(mission="hover")
            if flies.heard("HOVER", 10.0):
                return
        room.set(mission="land")
        room.until(FLIGHT_S, lambda state: state["standing"])
        room.set(armed=False)
        if time.monotonic() > end or flies.process.poll() is not None:
            raise RuntimeError(f"the bridge did not take off{flies.end_told()}")
