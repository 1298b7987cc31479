"""A Betaflight SITL that the user has built: stored by its content, and asked for its version."""

import dataclasses
import hashlib
import json
import os
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from e2efly.config.storage import cache_folder
from e2efly.flight.betaflight.client import Client, ask
from e2efly.flight.betaflight.messages import ApiVersion, FcVariant, FcVersion, RawImu
from e2efly.flight.betaflight.versions import RELEASES, version_text
from e2efly.flight.link import open_link
from e2efly.validation.firmware_program import IDENTITY, Firmware, identified, shim
from e2efly.validation.sitl import RESTING, Sitl

CALIBRATION_S = 4.0
"""Duration of the calibration of its gyroscope, s."""
YAW_RATE = 1.0
"""Yaw rate at which it is turned to find the sign of its yaw, rad/s."""


def keep(program: Path) -> Firmware:
    """Copy a program into the cache and start it once to ask for its version.

    Raises:
        ValueError: when it is not a program, not Betaflight, of an unknown version, or built for another simulator.
        OSError: when it does not start or does not answer.
    """
    if not program.is_file() or not os.access(program, os.X_OK):
        raise ValueError(f"--binary is {program}; accepted: a program, as make TARGET=SITL leaves it in obj/")
    name = hashlib.sha256(program.read_bytes()).hexdigest()[:12]
    folder = cache_folder() / f"betaflight-binary-{name}"
    if not (folder / IDENTITY).is_file():
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copy2(program, folder / "betaflight")
        draft = folder / f"{IDENTITY}.{os.getpid()}"
        draft.write_text(json.dumps(_asked(folder / "betaflight")), encoding="utf-8")
        draft.replace(folder / IDENTITY)
    found = identified(folder)
    _look_at_yaw(found)
    return found


@dataclass
class _Idle:
    """The clock of a firmware that does not move."""

    sitl: Sitl

    def now(self) -> float:
        return self.sitl.now

    def sleep(self, seconds: float) -> None:
        self.sitl.idle(max(seconds, 0.01))


def _asked(program: Path) -> dict[str, object]:
    """The program's answers about its identity. The layout of its packets does not matter for them."""
    somehow = Firmware(program, shim(), next(r for r in RELEASES if r.sitl))
    with tempfile.TemporaryDirectory(prefix="e2efly-") as text, Sitl(somehow, Path(text)) as sitl:
        clock, client = _Idle(sitl), Client(open_link(sitl.msp))
        try:
            variant = ask(client, FcVariant.CODE, 5.0, clock=clock).variant
            if variant != "BTFL":
                raise ValueError(f"--binary: the firmware is {variant!r}; accepted: 'BTFL' (Betaflight)")
            version: FcVersion = ask(client, FcVersion.CODE, 5.0, clock=clock)
            api = ask(client, ApiVersion.CODE, 5.0, clock=clock).version
        finally:
            client.link.close()
    return {"api": api, "version": version.version, "text": version.text or version_text(version.version)}


def _look_at_yaw(firmware: Firmware) -> None:
    """Find the sign of the yaw rate. The same version can be built for simulators that send it with the other sign."""
    turning = dataclasses.replace(RESTING, body_rate=np.array([0.0, 0.0, YAW_RATE]))
    with tempfile.TemporaryDirectory(prefix="e2efly-") as text, Sitl(firmware, Path(text)) as sitl:
        sitl.idle(CALIBRATION_S)
        clock, client = _Idle(sitl), Client(open_link(sitl.msp))
        try:
            ask(client, RawImu.CODE, 5.0, clock=clock)
            sitl.idle(0.1, turning)
            client.poll(sitl.now)
            client.request(RawImu.CODE, sitl.now)
            for _ in range(10):
                sitl.idle(0.01, turning)
                client.poll(sitl.now)
            yaw = client.latest[RawImu.CODE].message.body_rate[2]
        finally:
            client.link.close()
    if yaw < YAW_RATE / 2:
        raise ValueError(
            f"--binary: turned left at {YAW_RATE:g} rad/s it feels {yaw:.2f}; accepted: {YAW_RATE:g}. "
            "Build it with a plain make TARGET=SITL, without a configuration for another simulator"
        )
