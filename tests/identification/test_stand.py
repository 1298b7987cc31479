"""A thrust stand's record that our own rotor model wrote, with noise."""

from pathlib import Path

import numpy as np
import pytest

from e2efly.identification.stand import estimates, evaluate

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
        (lambda c: {**c, "rpms": c["rpm"]}, "column 'rpms' is unknown"),
        (lambda c: {k: v for k, v in c.items() if k != "thrust"}, "has no column 'thrust'"),
        (lambda c: {**c, "throttle": 100 * c["throttle"]}, "throttle is up to 100; accepted: 0 to 1"),
        (lambda c: {**c, "thrust": -c["thrust"]}, "does not rise with the speed"),
        (lambda c: {**c, "t": c["t"][::-1]}, "line 3: t does not rise"),
        (lambda c: {k: v[:2] for k, v in c.items()}, "accepted: 6 or more"),
    ],
)
def test_a_wrong_record_is_refused_by_name(tmp_path: Path, change: object, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        evaluate(write(tmp_path / "stand.csv", change(record())))  # type: ignore[operator]
