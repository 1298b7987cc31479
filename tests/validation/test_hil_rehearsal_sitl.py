"""Hardware in the loop without hardware, in real time: motion capture, HIL node, bridge, watchdog and firmware."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from e2efly.flight.sight.shared import place
from e2efly.validation import firmware_program
from e2efly.validation.candidate import candidate
from e2efly.validation.rehearse_hil import RehearsalPlan, rehearse

PATIENT = (
    "--flight.odometry-timeout", "0.6", "--flight.link-timeout", "1.5", "--flight.lateness", "0.2",
    "--flight.policy-timeout", "0.1",
)  # fmt: skip
"""A busy machine holds up the room, too: not what is looked at here."""


@pytest.fixture(scope="module", autouse=True)
def built() -> None:
    firmware_program.build()


def left_behind(folder: Path, rehearses: int) -> list[str]:
    """Processes whose command names a folder, and the images of the process that rehearses."""
    found = [str(file) for file in place("x").parent.glob(f"e2efly_rehearsal_{rehearses}_*")]
    for process in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            command = process.read_bytes().replace(b"\0", b" ").decode(errors="replace")
        except OSError:
            continue
        if str(folder) in command and str(os.getpid()) != process.parent.name:
            found.append(command)
    return found


def test_a_whole_flight_by_sight(tmp_path: Path) -> None:
    plan = RehearsalPlan(candidate("land_visual"), options=PATIENT)
    lap = rehearse(plan, 1, tmp_path / "flight")
    assert lap.problems == ()
    modes = [change.mode for change in lap.changes]
    assert modes[:3] == ["takeoff", "hover", "policy"] or modes.count("takeoff") > 1  # a busy machine tries again
    assert "policy" in modes and "done" in modes
    assert lap.policy_s > 0.5
    assert lap.truth is not None and len(lap.truth.time) > 1000
    assert 0 < lap.pose_to_image.median < 0.2  # how long, a busy machine decides
    assert 0 <= lap.image_age.median < 0.15
    assert lap.touch_sink < 2.0
    assert left_behind(tmp_path, os.getpid()) == []


def test_an_interrupted_rehearsal_leaves_nothing_behind(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "e2efly", "hil", "land_visual", "--rehearse", "--out", str(tmp_path / "out")]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as running:
        end = time.monotonic() + 100
        while time.monotonic() < end and not any("room_process" in line for line in left_behind(tmp_path, running.pid)):
            time.sleep(0.2)
        running.send_signal(signal.SIGTERM)
        assert running.wait(30.0) != 0
    time.sleep(1.0)
    assert left_behind(tmp_path, running.pid) == []
