"""Our end of ArduPilot's JSON interface, against a program that speaks it as its readme says. ArduCopter itself is no
part of the tests: `benchmarks/arducopter.py` flies it.
"""

import json
import stat
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from e2efly.validation.copter_rig import CopterRig, copter_parameters
from e2efly.validation.copter_sitl import PROGRAM, CopterSitl, copter_program
from e2efly.validation.sitl import FirmwareState
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import allocation_matrix

VEHICLE = load_vehicle("vis_r")
FIRMWARE = """#!{python}
import json, socket, struct, sys
at = dict(zip(sys.argv, sys.argv[1:]))
line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
count, last = 0, None
while True:
    packet = struct.pack("<HHI16H", 18458, 400, count, 1100 + count, 1200, 1300, 2100, *[1000] * 12)
    for _ in range(2):  # it sends again when a state is late
        line.sendto(packet, (at["--sim-address"], int(at["--sim-port-out"])))
    told = json.loads(line.recv(65000).decode().strip())
    open("told.json", "a").write(json.dumps(told) + "\\n")
    if told["timestamp"] > 0.5:
        sys.exit("it has had enough")
    count += 1
"""


@pytest.fixture
def program(tmp_path: Path) -> Path:
    file = tmp_path / "arducopter"
    file.write_text(FIRMWARE.format(python=sys.executable), encoding="utf-8")
    file.chmod(file.stat().st_mode | stat.S_IXUSR)
    return file


@pytest.fixture
def sitl(program: Path, tmp_path: Path) -> Iterator[CopterSitl]:
    with_program = CopterSitl(program, tmp_path / "folder")
    yield with_program
    with_program.close()


def told(sitl: CopterSitl) -> list[dict]:
    return [json.loads(line) for line in (sitl.folder / "told.json").read_text(encoding="utf-8").splitlines()]


def test_each_step_takes_a_state_in_frd_and_gives_the_outputs_that_follow_it(sitl: CopterSitl) -> None:
    sitl.start()
    assert sitl.motors() == pytest.approx([0.1, 0.2, 0.3, 1.0])
    state = FirmwareState(
        np.array([1.0, 2.0, 3.0]), np.array([0.1, 0.2, 9.81]), np.array([0.9, 0.1, 0.2, 0.3]),
        np.array([4.0, 5.0, 6.0]), np.array([7.0, 8.0, 9.0]),
    )  # fmt: skip
    sitl.send_state(state)
    sitl.advance(0.001)
    sitl.channels = np.arange(1001, 1017)
    for _ in range(9):
        sitl.advance(0.001)
    assert sitl.motors()[0] == pytest.approx(0.110)  # each packet came twice, and was counted once
    first, last = told(sitl)[0], told(sitl)[-1]
    assert "rc" not in first and list(last["rc"].values()) == list(range(1001, 1013))
    assert first["imu"] == {"gyro": [1, -2, -3], "accel_body": [0.1, -0.2, -9.81]}
    assert (first["position"], first["velocity"]) == ([7, -8, -9], [4, -5, -6])
    assert first["quaternion"] == pytest.approx([0.9, 0.1, -0.2, -0.3])
    assert last["timestamp"] == pytest.approx(0.010)


def test_a_program_that_ends_is_told_with_its_last_words(sitl: CopterSitl) -> None:
    sitl.start()
    with pytest.raises(OSError, match="it has had enough"):
        for _ in range(10):
            sitl.advance(0.09)


def test_the_program_is_the_user_s(program: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(PROGRAM, raising=False)
    with pytest.raises(OSError, match=f"arducopter is ''; accepted: .* {PROGRAM}"):
        copter_program()
    monkeypatch.setenv(PROGRAM, str(program))
    assert copter_program() == program


def test_its_mixer_and_gains_accelerate_the_body_as_the_vehicle_file_says() -> None:
    found = copter_parameters(VEHICLE)
    low, full, bend = VEHICLE.rotor_speed_min, VEHICLE.full_rotor_speed, found["MOT_THST_EXPO"]
    k2, k1, k0 = VEHICLE.thrust_map

    def thrust(share: float) -> float:
        speed = low + share * (full - low)
        return k2 * speed**2 + k1 * speed + k0

    span = thrust(1.0) - thrust(0.0)
    assert found["MOT_SPIN_MIN"] * full == pytest.approx(low)
    assert (thrust(0.4) - thrust(0.0)) / span == pytest.approx((1 - bend) * 0.4 + bend * 0.16)
    arms = np.sign(allocation_matrix(VEHICLE)[1:])
    for axis, gain, arm in zip(("RLL", "PIT", "YAW"), VEHICLE.rate_gain, arms, strict=True):
        thrusts = arm * 0.5 * found[f"ATC_RAT_{axis}_P"] * 0.1 * span  # ArduPilot's share of each rotor for 0.1 rad/s
        torque = np.abs(allocation_matrix(VEHICLE)[1:] @ thrusts).max()
        i = ("RLL", "PIT", "YAW").index(axis)
        assert torque / VEHICLE.inertia[i] == pytest.approx(gain * 0.1)


def test_the_rig_writes_its_parameters_and_the_receiver_s_pitch_is_low_in_front(program: Path, tmp_path: Path) -> None:
    rig = CopterRig(program, tmp_path / "rig", VEHICLE, parameters={"GUID_TIMEOUT": 0.4})
    rig.prepare()
    lines = (tmp_path / "rig" / "defaults.parm").read_text(encoding="utf-8").splitlines()
    assert "GUID_TIMEOUT 0.4" in lines and "FRAME_TYPE 12" in lines
    rig.set(pitch=0.5, mission="policy")
    rig.receive()
    assert rig.sitl.channels is not None and rig.sitl.channels[[1, 7]].tolist() == [1250, 2000]
    rig.heard = False
    rig.receive()
    assert rig.sitl.channels is None
    rig.close()
