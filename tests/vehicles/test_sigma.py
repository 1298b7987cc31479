"""Standard deviations in a vehicle's file: optional, and checked where they stand."""

from pathlib import Path

import numpy as np
import pytest

from e2efly.alignment.estimates import Estimate
from e2efly.alignment.vehicle_file import write_vehicle
from e2efly.vehicles.loading import load_vehicle, read_sigmas, vehicle_file

FILE = load_vehicle("vis_r")


def found(name: str, value: object, sigma: object) -> dict[str, Estimate]:
    return {name: Estimate(name, np.array(value, float), np.array(sigma, float), 'a "source" of ours')}


def test_a_written_file_loads_with_what_was_found_and_keeps_the_rest(tmp_path: Path) -> None:
    nan = np.nan
    path = tmp_path / "mine.toml"
    write_vehicle(path, "vis_r", FILE, found("inertia", [1.5e-3, nan, nan], [1e-5, nan, nan]))
    vehicle, sigma = load_vehicle(path), read_sigmas(path)
    assert np.allclose(vehicle.inertia, [1.5e-3, *FILE.inertia[1:] * (1.5e-3 / FILE.inertia[0])])
    assert np.allclose(sigma["inertia"], [1e-5, nan, nan], equal_nan=True)
    assert np.isnan(sigma["mass"])
    assert np.allclose(vehicle.thrust_map, FILE.thrust_map, rtol=1e-5)
    assert (vehicle.mass, vehicle.latency) == (FILE.mass, FILE.latency)
    assert "E2E-Fly, latency compensation" in path.read_text()
    again = tmp_path / "again.toml"  # a second source on top of the first
    write_vehicle(again, str(path), vehicle, found("mass", 0.8, 0.01))
    assert np.allclose(read_sigmas(again)["inertia"], [1e-5, nan, nan], equal_nan=True)


def test_no_file_is_written_that_is_no_vehicle(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"inertia.value is .*the triangle inequality"):
        write_vehicle(tmp_path / "a.toml", "vis_r", FILE, found("inertia", [1e-3, 1e-3, 9e-3], [1e-5] * 3))
    assert not (tmp_path / "a.toml").exists()


@pytest.mark.parametrize("sigma", ["-1.0", "[1.0]", '"small"', "inf"])
def test_a_wrong_sigma_is_refused_by_name(tmp_path: Path, sigma: str) -> None:
    text = vehicle_file("vis_r").read_text().replace("[mass]\n", f"[mass]\nsigma = {sigma}\n", 1)
    (tmp_path / "a.toml").write_text(text)
    with pytest.raises(ValueError, match=r"mass.sigma is .*; accepted: a number of 0 or more for each of the value's"):
        load_vehicle(tmp_path / "a.toml")
