"""A thrust stand's record that our own rotor model wrote, with noise."""

from pathlib import Path

import numpy as np
import pytest

from e2efly.alignment import stand_file
from e2efly.alignment.stand import estimates, evaluate
from e2efly.alignment.stand_file import read_stand
from e2efly.logs.csv_file import column_map

MAP = np.array([4.04e-7, 2.56e-5, -2.62e-2])
UP, DOWN, RATIO = 0.03, 0.045, 0.016


def record(noise: float = 0.01, seed: int = 0) -> dict[str, np.ndarray]:
    """A sweep in steps of 0.8 s, by a motor that speeds up faster than it slows down."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, 24, 0.005)
    levels = np.array([0.1, 0.3, 0.2, 0.5, 0.3, 0.7, 0.4, 0.9, 0.5, 1.0, 0.6, 0.8, 0.2, 0.6, 0.1])
    throttle = levels[(t / 0.8).astype(int) % len(levels)]
    volts = 16 - 1.5 * t / 24
    target = 4000 * np.sqrt(throttle) * (volts / 16)
    speed = np.empty_like(t)
    speed[0] = target[0]
    for i in range(1, len(t)):
        tau = UP if target[i] > speed[i - 1] else DOWN
        speed[i] = target[i] + (speed[i - 1] - target[i]) * np.exp(-0.005 / tau)
    thrust = MAP[0] * speed**2 + MAP[1] * speed + MAP[2]
    return {
        "t": t, "throttle": throttle, "voltage": volts, "rpm": speed * 60 / (2 * np.pi),
        "thrust": thrust + noise * rng.standard_normal(len(t)),
        "torque": RATIO * thrust + noise * 0.01 * rng.standard_normal(len(t)),
    }  # fmt: skip


def write(path: Path, columns: dict[str, np.ndarray]) -> Path:
    rows = [",".join(columns), *(",".join(f"{x:.9g}" for x in row) for row in zip(*columns.values(), strict=True))]
    path.write_text("\n".join(rows) + "\n")
    return path


def test_map_ratio_lags_and_voltage_are_found(tmp_path: Path) -> None:
    found = evaluate(write(tmp_path / "stand.csv", record()))
    speeds = np.linspace(1500, 3800, 10)
    powers = np.stack([speeds**2, speeds, np.ones(10)])
    assert np.allclose(found.thrust_map @ powers, MAP @ powers, rtol=2e-3)
    assert np.isclose(found.torque_ratio[0], RATIO, rtol=5e-3)  # type: ignore[index]
    assert np.isclose(np.median(found.lag_up), UP, atol=1e-3)
    assert np.isclose(np.median(found.lag_down), DOWN, atol=1e-3)
    assert np.isclose(found.speed_per_volt, 1.0, atol=0.02)


def test_the_estimates_hold_the_truth_within_their_sigma(tmp_path: Path) -> None:
    said = {e.name: e for e in estimates(write(tmp_path / "stand.csv", record()))}
    assert np.all(np.abs(said["thrust_map"].value - MAP) < 3 * said["thrust_map"].sigma)
    lag = said["motor_time_constant"]
    assert abs(float(lag.value) - (UP + DOWN) / 2) < float(lag.sigma)
    assert float(lag.sigma) >= (DOWN - UP) / 2 * 0.9  # one lag cannot be both


def test_without_times_every_point_counts_and_there_is_no_lag(tmp_path: Path) -> None:
    columns = {k: v[::160][1:] for k, v in record(0.0).items() if k in ("rpm", "thrust")}
    names = [e.name for e in estimates(write(tmp_path / "stand.csv", columns))]
    assert names == ["thrust_map", "rotor_thrust_max", "rotor_speed_max"]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda c: {**c, "motor speed (rpm)": c["rpm"]}, "'rpm' and 'motor speed .rpm.' are both a rotor_speed"),
        (lambda c: {k: v for k, v in c.items() if k != "thrust"}, "has no thrust in its columns t, throttle, .*Thrust"),
        (lambda c: {("Thrust" if k == "thrust" else k): v for k, v in c.items()}, "has no thrust in"),  # of which unit?
        (lambda c: {**c, "throttle": 100 * c["throttle"]}, "throttle is 10 to 100; accepted: 0 to 1"),
        (lambda c: {**c, "thrust": -c["thrust"]}, "does not rise with the speed"),
        (lambda c: {**c, "t": c["t"][::-1]}, "line 3: t does not rise"),
        (lambda c: {k: v[:2] for k, v in c.items()}, "accepted: 6 or more"),
    ],
)
def test_a_wrong_record_is_refused_by_name(tmp_path: Path, change: object, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        evaluate(write(tmp_path / "stand.csv", change(record())))  # type: ignore[operator]


def maker(thrust: str = "Thrust (gf)", scale: float = 9.80665e-3, mark: str = "\ufeff") -> str:
    """A sweep as the program of a maker of stands writes it: thrust 4.0e-7 w^2 N, torque 0.013 m times it."""
    header = (
        f"{mark}Time (s),ESC signal (µs),Servo 1 (µs),Torque (N·m),{thrust},Voltage (V),Motor Electrical Speed (RPM),"
        "Motor Optical Speed (RPM),App message,"
    )
    rows = [header]
    for i, speed in enumerate(np.linspace(1000, 3600, 21)):
        force = 4.0e-7 * speed**2
        rpm = speed * 30 / np.pi
        rows.append(f"{4 * i},{1200 + 40 * i},,{0.013 * force:.7f},{force / scale:.6g},{16 - i / 20},{rpm:.2f},0,,")
    return "\r\n".join(rows) + "\r\n"


def test_a_record_of_a_makers_program_is_read_by_its_units(tmp_path: Path) -> None:
    path, notes = tmp_path / "maker.csv", []
    path.write_text(maker(), encoding="utf-8")
    found = evaluate(path, told=notes.append)
    assert found.thrust_map[0] == pytest.approx(4.0e-7, rel=2e-3)
    assert found.torque_ratio == pytest.approx((0.013, 0.013 * 0.01), rel=1e-3)
    assert notes == ["maker.csv: columns that are not used: Servo 1 (µs), Motor Optical Speed (RPM), App message"]
    assert read_stand(path)["throttle"][[0, -1]] == pytest.approx([0.2, 1.0])


@pytest.mark.parametrize(
    ("header", "scale"),
    [
        ("Thrust (kgf)", 9.80665), ("thrust_N", 1.0), ("Mean thrust [lbf]", 4.4482216), ("thrust, mN", 1e-3),
        ("Propeller Thrust (ozf)", 0.2780139), ("thrust", 1.0),
    ],
)  # fmt: skip
def test_other_units_and_spellings(header: str, scale: float, tmp_path: Path) -> None:
    path = tmp_path / "maker.csv"
    path.write_text(maker(header, scale, "").replace(",", ";").replace(header.replace(",", ";"), header))
    assert evaluate(path).thrust_map[0] == pytest.approx(4.0e-7, rel=2e-3)


@pytest.mark.parametrize(
    ("unit", "size"), [("N·cm", 0.01), ("mN m", 1e-3), ("ozf-in", 0.0070615518), ("in.lbf", 0.1129848)]
)
def test_units_of_torque(unit: str, size: float) -> None:
    assert stand_file._place(0, f"Torque ({unit})") == (0, "torque", pytest.approx(size), 0.0)


def test_columns_of_other_names_by_the_option(tmp_path: Path) -> None:
    path = tmp_path / "maker.csv"
    path.write_text(maker("Load cell (slug)", 2.0).replace("Optical Speed (RPM)", "Load (%)").replace(",0,,", ",7,,"))
    with pytest.raises(ValueError, match=r"has no thrust in its columns .*--columns thrust='THEIRS\*FACTOR'"):
        evaluate(path)
    with pytest.raises(ValueError, match=r"thrust is 'Load cell \(slug\)'; accepted: thrust='.*\*FACTOR', or .* gf"):
        evaluate(path, column_map(["thrust=Load cell (slug)"], stand_file.COLUMNS))
    found = evaluate(path, column_map(["thrust=Load cell (slug)*2", "wx=gyro"], (*stand_file.COLUMNS, "wx")))
    assert found.thrust_map[0] == pytest.approx(4.0e-7, rel=2e-3)
    with pytest.raises(ValueError, match="--columns says that torque is unknown column 'moment'"):
        evaluate(write(path, {k: record()[k] for k in ("rpm", "thrust")}), column_map(["torque=moment"], ["torque"]))


def test_lines_that_lack_an_entry_are_left_out_with_a_note(tmp_path: Path) -> None:
    path, notes = tmp_path / "maker.csv", []
    lines = maker().splitlines()
    lines[5] = ",".join("" if i == 4 else entry for i, entry in enumerate(lines[5].split(",")))
    path.write_text("\n".join([*lines, ",,,,,,,,,"]), encoding="utf-8")
    assert len(read_stand(path, told=notes.append)["thrust"]) == 20
    assert notes[-1] == "maker.csv: 1 of 21 lines lack an entry and are left out"
