"""Every command of docs/identification.md runs, on logs of our own: a vehicle that MuJoCo flies, and its rotors."""

import dataclasses
import re
import shlex
import shutil
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from e2efly.alignment import parts
from e2efly.commands.cli import run
from e2efly.logs.csv_file import write_csv
from e2efly.validation.plant_excitation import Sensors
from e2efly.vehicles.loading import load_vehicle
from tests.alignment.flights import FILE, PERFECT, as_mcap, flown
from tests.alignment.test_stand import write
from tests.logs.flight_formats import MOTIONS, as_blackbox, as_ulog, with_outputs

PAGE = Path(__file__).parents[2] / "docs" / "identification.md"
FIRMWARE = ".BBL"
"""What a command names that needs the firmware's own log of the same flight, as tests/logs/test_blackbox.py
has it."""
EVERY = sorted(set(re.findall(r"(?m)(?:(?<=^    )|(?<=`))e2efly identify [^`\n]+", PAGE.read_text("utf-8"))))
COMMANDS = [command for command in EVERY if FIRMWARE not in command]
SENSORS = Sensors(gaps=0, pose_delay=0.0)


def stand(path: Path) -> None:
    """Steps of the throttle, every 0.8 s, of a rotor as the file has it."""
    t = np.arange(0, 16, 0.005)
    levels = np.array([0.1, 0.3, 0.2, 0.5, 0.3, 0.7, 0.4, 0.9, 0.5, 1.0, 0.6, 0.8, 0.2, 0.6, 0.1])
    target = FILE.rotor_speed_max * np.sqrt(levels[(t / 0.8).astype(int) % len(levels)])
    kept, speed = np.exp(-0.005 / FILE.motor_time_constant), np.empty_like(t)
    speed[0] = target[0]
    for i in range(1, len(t)):
        speed[i] = target[i] + (speed[i - 1] - target[i]) * kept
    rng = np.random.default_rng(0)
    thrust = np.polyval(FILE.thrust_map, speed)
    write(path, {
        "t": t, "rpm": speed * 60 / (2 * np.pi), "thrust": thrust + 0.01 * rng.standard_normal(len(t)),
        "torque": FILE.torque_ratio * thrust + 1e-4 * rng.standard_normal(len(t)),
    })  # fmt: skip


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files that the commands name, of one vehicle."""
    folder = tmp_path_factory.mktemp("bench")
    shutil.copy(str(files("e2efly.vehicles") / "parts" / "vis_r.toml"), folder / "parts.toml")
    weighed = {e.name: e.value for e in parts.estimates(folder / "parts.toml")}
    mass, inertia = float(weighed["mass"]), weighed["inertia"]
    body = dataclasses.replace(FILE, mass=mass, inertia=inertia)
    length, distance = 1.2, 0.15
    text = ""
    for axis, j in zip("xyz", inertia, strict=True):
        period = np.sqrt(16 * np.pi**2 * length * j / (mass * 9.80665 * distance**2))
        text += f"[{axis}]\nmass = {mass}\nmass_sigma = 0.002\nlength = {length}\nlength_sigma = 0.003\n"
        text += f"distance = {distance}\ndistance_sigma = 0.001\ncount = 10\n"
        text += f"periods = {[round(float(10 * period) + x, 3) for x in (0.0, 0.05, -0.05)]}\n"
    (folder / "pendulum.toml").write_text(text)
    stand(folder / "stand.csv")
    record = flown(body, 6.0, SENSORS)
    for name in ("a", "c"):
        write_csv(record if name != "c" else flown(body, 6.0, SENSORS, 2), folder / f"{name}.csv")
    as_mcap(flown(body, 6.0, SENSORS, 1), folder / "b.mcap")
    theirs = (folder / "a.csv").read_text().replace("az", "acc_z", 1).replace("wx", "gyro_x", 1)
    lines = theirs.splitlines()
    column = lines[0].split(",").index("acc_z")
    for i, line in enumerate(lines[1:], 1):
        entries = line.split(",")
        entries[column] = f"{float(entries[column]) / 9.81:.8g}" if entries[column] else ""
        lines[i] = ",".join(entries)
    (folder / "theirs.csv").write_text("\n".join(lines) + "\n")
    driven = with_outputs(record, flown(body, 6.0, PERFECT), body)
    as_ulog(folder / "px4.ulg", driven, (*MOTIONS, "esc_status"), {})
    session = as_blackbox(folder / "LOG00002.TXT", driven, "4.5").read_bytes()
    (folder / "LOG00002.TXT").write_bytes(2 * session)
    return folder


def test_the_page_has_commands_for_every_kind_of_source() -> None:
    words = {word for command in COMMANDS for word in shlex.split(command)}
    assert {"parts", "pendulum", "stand", "flight", "step", "--columns", "--mass"} <= words


@pytest.mark.whole
@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_page_writes_a_vehicle(
    command: str, bench: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for file in bench.iterdir():
        (tmp_path / file.name).symlink_to(file)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("e2efly.viewing.style.DPI", 30)
    words = shlex.split(command)[1:]
    assert run(words) == 0
    out = words[words.index("--out") + 1] if "--out" in words else "identified"
    assert load_vehicle(Path(out) / "vehicle.toml").mass > 0
