"""A payload that is fixed to a vehicle: its mass, its place, and the file that names it."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from e2efly.vehicles.loading import load_vehicle, read_sigmas, vehicle_file
from e2efly.vehicles.payload import with_payload
from e2efly.vehicles.vehicle import Vehicle, inertia_tensor, rotor_places

PLACE = (0.02, -0.01, -0.06)
TABLE = """
[payload.mass]
value = {mass}
unit = "kg"
source = "scales"

[payload.position]
value = [0.02, -0.01, -0.06]
unit = "m"
source = "ruler"
"""


def test_it_is_the_body_of_all_its_points(vis_r: Vehicle) -> None:
    """Six points with the vehicle's mass and inertia, and the payload's: the sums over all seven are the body's."""
    half = np.sqrt((vis_r.inertia.sum() / 2 - vis_r.inertia) * 3 / vis_r.mass)
    points = np.concatenate([np.diag(half), -np.diag(half), [PLACE]])
    masses = np.append(np.full(6, vis_r.mass / 6), 0.3)
    loaded = with_payload(vis_r, 0.3, PLACE)
    centre = masses @ points / masses.sum()
    away = points - centre
    tensor = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, away, strict=True))
    assert loaded.mass == pytest.approx(masses.sum())
    np.testing.assert_allclose(loaded.centre_of_mass, centre, atol=1e-12)
    np.testing.assert_allclose(inertia_tensor(loaded), tensor, atol=1e-12)
    np.testing.assert_allclose(rotor_places(loaded), rotor_places(vis_r) - centre, atol=1e-12)
    assert loaded.feet_height == pytest.approx(vis_r.feet_height + centre[2])


def test_two_halves_are_the_whole(vis_r: Vehicle) -> None:
    once, twice = with_payload(vis_r, 0.2, PLACE), with_payload(with_payload(vis_r, 0.1, PLACE), 0.1, PLACE)
    np.testing.assert_allclose(inertia_tensor(twice), inertia_tensor(once), rtol=1e-12)
    np.testing.assert_allclose(twice.centre_of_mass, once.centre_of_mass, rtol=1e-12)


def test_a_vehicle_file_names_it(tmp_path: Path, vis_r: Vehicle) -> None:
    path, text = tmp_path / "vis_r.toml", vehicle_file("vis_r").read_text()
    path.write_text(text + TABLE.format(mass=0.2))
    loaded, expected = load_vehicle(path), with_payload(vis_r, 0.2, PLACE)
    for field in dataclasses.fields(Vehicle):
        np.testing.assert_array_equal(getattr(loaded, field.name), getattr(expected, field.name), err_msg=field.name)
    assert np.isnan(read_sigmas(path)["centre_of_mass"]).all()
    for wrong, named in (
        (TABLE.format(mass=0.2).replace('"kg"', '"g"'), r"payload: mass.unit is 'g'; accepted: 'kg'"),
        (TABLE.format(mass=-0.2), r"payload: mass.value is -0.2; accepted: > 0 kg"),
        (TABLE.format(mass=4.0), r"payload of 4.0 kg at .* puts the centre of mass 0.000526 m under the feet"),
        (TABLE.format(mass=1.5), r"it cannot hover"),
    ):
        path.write_text(text + wrong)
        with pytest.raises(ValueError, match=named):
            load_vehicle(path)
