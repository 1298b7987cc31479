"""A room with a vehicle, as a process of its own, in real time: the rig, in which other processes fly the vehicle.

    python -m e2efly.validation.room_process --pose-port PORT [--vehicle NAME] [--folder FOLDER] [--seed N]
        [--at X Y YAW] [--exact] [--record FILE]

It prints one line of JSON: `{"link": "tcp:127.0.0.1:PORT", "control": PORT}`, the firmware's MSP address and the port
of the room's control on the loopback interface. Poses go to UDP 127.0.0.1:POSE_PORT; their form is in
docs/pose-sources.md. A control connection accepts lines of JSON, objects whose keys are fields of `rig.Transmitter`. It
answers each line with a line that gives the true state: see `State`. The process ends when that connection or its
standard input ends.
"""

import argparse
import json
import os
import select
import socket
import sys
import tempfile
import time
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.flight.process import be_punctual
from e2efly.policy.odometry import tilt_of, yaw_of
from e2efly.validation.firmware_program import chosen
from e2efly.validation.firmware_rig import POSE_NOISE, Transmitter
from e2efly.validation.rig import Rig
from e2efly.vehicles.loading import load_vehicle

ROUND_S = 0.004
"""Interval between two checks of the control connection, s."""
PRIORITY = 5
"""Real-time priority, below that of everything that flies in the room."""
RECORDED = (
    "machine_time", "x", "y", "z", "vx", "vy", "vz", "qw", "qx", "qy", "qz", "motor", "behind",
)  # fmt: skip
"""Columns of `--record`: monotonic clock, s; position, m; velocity, m/s; attitude, wxyz; largest output of a motor, 0
to 1; lag of the room behind the machine's clock, s."""


@dataclass(frozen=True)
class RoomState:
    """The true state, and the events since the process began."""

    time: float
    """The firmware's time, s."""
    position: tuple[float, float, float]
    """World, m."""
    velocity: tuple[float, float, float]
    """World, m/s."""
    tilt: float
    """Tilt, rad."""
    yaw: float
    """Heading, rad."""
    motors: tuple[float, ...]
    """(4,) the firmware's outputs, 0 to 1."""
    standing: bool
    """Whether the vehicle stands on the ground."""
    largest_tilt: float
    """Largest tilt so far, rad."""
    touches: tuple[tuple[float, float, float], ...]
    """For each touch of the ground: speed, m/s, tilt, rad, and downward part of the speed, m/s, just before it."""


class _Watch:
    """The events so far."""

    def __init__(self, rig: Rig) -> None:
        self.rig, self.largest_tilt, self.touches = rig, 0.0, []
        self.rows: list[list[float]] = []
        self._feet = rig.world.vehicle.feet_height + 1e-3
        self._before = rig.state

    def look(self, record: bool) -> None:
        rig, state, before = self.rig, self.rig.state, self._before
        self.largest_tilt = max(self.largest_tilt, tilt_of(state.quaternion))
        if state.position[2] <= self._feet < before.position[2]:
            speed, sink = float(np.linalg.norm(before.velocity)), -float(before.velocity[2])
            self.touches.append((speed, tilt_of(before.quaternion), sink))
        self._before = state
        if record:
            at, motor = rig.machine_time(rig.now()), float(rig.sitl.motors().max())
            moving = (*state.position.tolist(), *state.velocity.tolist(), *state.quaternion.tolist())
            self.rows.append([at, *moving, motor, time.monotonic() - at])

    def state(self) -> RoomState:
        rig = self.rig
        s = rig.state
        (x, y, z), (u, v, w) = s.position.tolist(), s.velocity.tolist()
        return RoomState(
            rig.now(), (x, y, z), (u, v, w), tilt_of(s.quaternion), yaw_of(s.quaternion),
            tuple(rig.sitl.motors().tolist()), z <= self._feet, self.largest_tilt, tuple(self.touches),
        )  # fmt: skip


def changes_of(line: bytes) -> dict[str, Any]:
    """The changes of the transmitter that a line requests.

    Raises:
        ValueError: naming a key that is not a field of `Transmitter`.
    """
    known = {field.name for field in fields(Transmitter)}
    content = json.loads(line)
    wrong = sorted(content.keys() - known) if isinstance(content, dict) else [content]
    if wrong:
        raise ValueError(f"control: {wrong}; accepted: {sorted(known)}")
    return content


def serve(rig: Rig, poses: int, listener: socket.socket, record: Path | None = None) -> None:
    """Run a started rig in real time, until the control connection or standard input ends.

    The poses go to a UDP port of the loopback interface. `record` is a CSV file that is written at the end, with the
    columns `RECORDED`.
    """
    watch, sender = _Watch(rig), socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        with sender:
            _serve(rig, poses, listener, watch, sender, record is not None)
    finally:
        if record is not None:
            np.savetxt(record, np.array(watch.rows).reshape(-1, len(RECORDED)), "%.10g", ",", header=",".join(RECORDED))


def _serve(rig: Rig, poses: int, listener: socket.socket, watch: _Watch, sender: socket.socket, record: bool) -> None:
    control: socket.socket | None = None
    pending = b""
    while True:
        rig.sleep(ROUND_S)
        watch.look(record)
        for sample in rig.poses(rig.now()):
            pose = {
                name: getattr(sample, name).tolist() for name in ("position", "quaternion", "velocity", "body_rate")
            }
            stamp = rig.machine_time(sample.stamp or sample.received)
            sender.sendto(json.dumps({**pose, "stamp": stamp}).encode(), ("127.0.0.1", poses))
        readable, _, _ = select.select([control or listener, sys.stdin], [], [], 0)
        if sys.stdin in readable and not os.read(sys.stdin.fileno(), 1):
            return
        if not {control, listener} & set(readable):
            continue
        if control is None:
            control, _ = listener.accept()
            continue
        data = control.recv(65536)
        if not data:
            control.close()
            return
        *lines, pending = (pending + data).split(b"\n")
        for line in lines:
            rig.set(**changes_of(line))
            control.sendall(json.dumps(asdict(watch.state())).encode() + b"\n")


def main() -> None:
    """Start the rig and serve."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--pose-port", type=int, required=True, help="UDP port on 127.0.0.1 that takes the poses")
    parser.add_argument("--vehicle", default="vis_r", help="a shipped vehicle or a .toml file")
    parser.add_argument("--folder", type=Path, default=None, help="of the firmware's files; left out: a temporary one")
    parser.add_argument("--seed", type=int, default=0, help="of the poses' noise")
    parser.add_argument("--at", type=float, nargs=3, default=None, help="where it stands: x, y, m, and heading, rad")
    parser.add_argument("--exact", action="store_true", help="poses without noise")
    parser.add_argument("--record", type=Path, default=None, help="CSV file of the true motion, written at the end")
    options = parser.parse_args()
    be_punctual(PRIORITY)  # the world must not wait; this covers all that this thread starts, including the firmware
    noise = (0.0,) * len(POSE_NOISE) if options.exact else POSE_NOISE
    with (
        tempfile.TemporaryDirectory(prefix="e2efly-") as temporary,
        socket.create_server(("127.0.0.1", 0)) as listener,
        Rig(chosen(), options.folder or Path(temporary), load_vehicle(options.vehicle), real_time=True,
            seed=options.seed, pose_noise=noise) as rig,
    ):  # fmt: skip
        be_punctual(PRIORITY)
        if options.at is not None:
            rig.state = rig.world.at_rest(*options.at)
        print(json.dumps({"link": rig.sitl.msp, "control": listener.getsockname()[1]}), flush=True)
        serve(rig, options.pose_port, listener, options.record)


if __name__ == "__main__":
    main()
