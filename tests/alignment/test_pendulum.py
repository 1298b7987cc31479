"""The bifilar pendulum, against an integration of its own equation of motion."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from e2efly.alignment.pendulum import estimates

MASS, LENGTH, DISTANCE, INERTIA = 0.75, 1.2, 0.15, 1.5e-3


def period() -> float:
    """Of small turns: the threads' horizontal pull, by the geometry of a turn; the lift is of second order."""
    half = DISTANCE / 2

    def turn(t: float, y: np.ndarray) -> list[float]:
        reach = 2 * half * np.sin(y[0] / 2)
        height = np.sqrt(LENGTH**2 - reach**2)
        return [y[1], -MASS * 9.81 * half**2 * np.sin(y[0]) / height / INERTIA]

    cross = solve_ivp(turn, (0, 10), [0.02, 0.0], events=lambda t, y: y[0], rtol=1e-10, atol=1e-12).t_events[0]
    return float(np.mean(np.diff(cross)) * 2)


def write(tmp_path: Path, **changed: object) -> Path:
    values = {"mass": MASS, "length": LENGTH, "distance": DISTANCE, "periods": [period()] * 4} | changed
    text = "[x]\n" + "\n".join(f"{k} = {v}" for k, v in values.items() if v is not None)
    path = tmp_path / "pendulum.toml"
    path.write_text(text)
    return path


def test_the_period_of_the_equation_of_motion_gives_its_inertia(tmp_path: Path) -> None:
    (found,) = estimates(write(tmp_path))
    assert np.isclose(found.value[0], INERTIA, rtol=1e-3)
    assert np.isnan(found.value[1:]).all()
    assert np.isclose(found.sigma[0] / INERTIA, 0.01, rtol=0.01)


def test_sigma_holds_the_readings_the_ruler_and_the_scale(tmp_path: Path) -> None:
    ten = (10 * period() * np.array([0.99, 1.01, 0.99, 1.01])).tolist()
    path = write(tmp_path, periods=ten, count=10, mass_sigma=0.0075, length_sigma=0.012, distance_sigma=0.0015)
    inertia, mass = estimates(path)
    timing = 2 * np.std([0.99, 1.01, 0.99, 1.01], ddof=1) / 2
    assert np.isclose(inertia.sigma[0] / INERTIA, np.sqrt(timing**2 + 0.01**2 + 0.01**2 + 0.02**2 + 0.01**2), rtol=0.01)
    assert (float(mass.value), float(mass.sigma)) == (MASS, 0.0075)


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"length": None}, "x: missing key 'length'"),
        ({"length": 0}, "x: length is 0; accepted: a number above 0"),
        ({"periods": [1.0, 1.0]}, "three or more times"),
        ({"periods": [1.0, 1.0, 2.0]}, "differ by more than 10 %"),
        ({"weight": 1}, "accepted: a table of"),
    ],
)
def test_wrong_readings_are_refused_by_name(tmp_path: Path, changed: dict[str, object], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        estimates(write(tmp_path, **changed))
