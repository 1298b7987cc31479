"""A policy as an app of the Crazyflie's firmware: compiled against headers of ours, and flown."""

import ctypes
import subprocess
from pathlib import Path

import numpy as np
import pytest

from e2efly.commands.export import Export
from e2efly.commands.export import run as export
from e2efly.policy.loader import load_policy
from e2efly.policy.zoo import policy_file
from e2efly.vehicles.loading import load_vehicle
from tests.flight.crazyflie_peer import CrazyflieRig
from tests.policy.c_export.compiled import STRICT, build, compiled, pointer

FIRMWARE = Path(__file__).parent / "crazyflie"
HEADERS = (
    "FreeRTOS.h", "task.h", "app.h", "commander.h", "crtp_commander_high_level.h", "log.h", "param.h",
    "stabilizer_types.h", "supervisor.h",
)  # fmt: skip
VEHICLE = load_vehicle("crazyflie")


@pytest.fixture(scope="module")
def app(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the exported app of the hover, with headers of the firmware that all lead to ours."""
    folder = tmp_path_factory.mktemp("app")
    export(Export(Path("crazyflie/hover"), c=folder, crazyflie=True))
    assert (folder / "Kbuild").read_text() == "obj-y += policy.o policy_app.o\n"
    for name in HEADERS:
        (folder / name).write_text('#include "firmware.h"\n')
    return folder


def arguments(folder: Path) -> list[object]:
    strict = [option for option in STRICT if option != "-std=c99"]
    return ["-std=gnu11", *strict, "-O1", f"-I{folder}", f"-I{FIRMWARE}", FIRMWARE / "flown.c", folder / "policy.c",
            "-lm"]  # fmt: skip


def test_it_flies_in_the_air_alone_and_hands_over_for_each_reason(app: Path) -> None:
    program = build(app / "flown", *arguments(app))
    lines = subprocess.run([program], capture_output=True, text=True, check=True).stdout.splitlines()
    told = [line.split() for line in lines]
    points = [int(words[0]) for words in told if words[1] == "setpoint"]
    ends = [tuple(words[1:]) for words in told if words[1] in ("relax", "land")]
    first = points[0]
    assert 150 <= first <= 160  # asked at 50, it was on the ground
    assert points[:4] == [first, first + 33, first + 66, first + 99]  # 30 Hz
    assert ends == [("relax",), ("land", "0", "2.5")] * 3
    stops = [int(words[0]) for words in told if words[1] == "relax"]
    assert 500 < stops[0] <= 534 and 900 <= stops[1] <= 934 and 1040 <= stops[2] <= 1074
    silent = list(zip(stops, (810, 1000, 9999), strict=True))
    assert not [at for stop, again in silent for at in points if stop <= at < again]
    assert all(words[2:4] == ["3", "1"] for words in told if words[1] == "setpoint")


def test_its_first_set_point_is_the_policys_command(app: Path, tmp_path: Path) -> None:
    program = build(app / "flown", *arguments(app))
    lines = subprocess.run([program], capture_output=True, text=True, check=True).stdout.splitlines()
    roll, pitch, yaw, thrust = (float(word) for word in lines[0].split()[4:])
    made = compiled(policy_file(Path("crazyflie/hover")), tmp_path, "float")
    made.begin()
    seen = np.array([0.3, 0.2, 0.0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0], np.float32)
    status, action = made.act(seen)
    assert status == 0
    force, p, q, r = made.command(action)
    assert (roll, pitch, yaw) == pytest.approx(np.degrees([p, -q, r]), rel=1e-5)
    assert thrust == pytest.approx(65535 * VEHICLE.mass * force / 4 / VEHICLE.rotor_thrust_max, rel=1e-5)
    assert roll < 0 and pitch < 0  # the target is ahead and to the left: nose down, left side down


def test_it_hovers_over_the_rigid_body(app: Path) -> None:
    """The C decides from the true state, and the counterpart's mixer turns the rotors."""
    library = ctypes.CDLL(str(build(app / "flown.so", *arguments(app), "-shared", "-fPIC")))
    rig, rate = CrazyflieRig(VEHICLE), load_policy("crazyflie/hover").contract.control_rate_hz
    state = rig.world.at_rest()
    hover = np.full(4, np.sqrt(VEHICLE.mass * 9.81 / 4 / VEHICLE.rotor_thrust_max) * rig.world.full_speed)
    rig.state = type(state)(np.array([0.0, 0.0, 1.0]), state.velocity, state.quaternion, state.body_rate, hover)
    out, off = np.zeros(4, np.float32), []
    for k in range(round(6 * rate)):
        s = rig.state
        seen = np.concatenate([s.position, s.velocity, s.quaternion, np.degrees(s.body_rate)]).astype(np.float32)
        assert library.flown_step(pointer(seen), int(k == 0), pointer(out)) == 1
        rig.command(np.radians([out[0], -out[1], out[2]]), float(out[3]) / 65535)
        rig.sleep(1 / rate)
        off.append(float(np.linalg.norm(np.subtract(rig.state.position, (0.3, 0.3, 1.0)))))
    assert max(off[-30:]) < 0.05 and rig.log == ["flying"], off[-1]


def test_what_the_app_cannot_fly_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"sees gates, which the app does not know; accepted: .* crazyflie/hover"):
        export(Export(Path("crazyflie/race"), c=tmp_path / "a", crazyflie=True))
    with pytest.raises(ValueError, match=r"--vehicle is 'crazyflie'; accepted: with --web or --crazyflie"):
        export(Export(Path("crazyflie/hover"), c=tmp_path / "b", vehicle="crazyflie"))
    with pytest.raises(ValueError, match=r"--crazyflie is 'True', which has no effect without --c"):
        export(Export(Path("crazyflie/hover"), crazyflie=True))
    assert not list(tmp_path.iterdir())
