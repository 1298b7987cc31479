"""Families: ranges, the vehicles drawn from them, and what lies outside."""

import dataclasses
import itertools
import re
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import linprog

from e2efly.vehicles import rotor_frames
from e2efly.vehicles.family import OF_FRAMES, Family, family_names, load_family, measured, nominal_vehicle
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle, vehicle_file, vehicle_names
from e2efly.vehicles.vehicle import Vehicle, allocation_matrix, quantities
from e2efly.vehicles.vehicle_rules import check


def family(name: str = "any") -> Family:
    found = load_family(name)
    assert found is not None
    return found


def changed(tmp_path: Path, name: str, value: str) -> Path:
    """The ranges of `any` with another value of one."""
    text, file = vehicle_file("multirotor" if name in OF_FRAMES else "any").read_text(), tmp_path / "mine.toml"
    text, count = re.subn(rf"(\[{name}\]\nvalue = )\[[^]]*\]", rf"\g<1>{value}", text)
    assert count == 1
    file.write_text(text)
    return file


@pytest.mark.parametrize("name", ["any", "multirotor"])
def test_every_draw_is_a_vehicle_that_could_be_loaded_and_lies_within_the_ranges(name: str) -> None:
    for vehicle in family(name).sample(300, seed=3):
        check(vehicle)
        assert family(name).ranges.outside(vehicle) == ()


def test_frames_have_four_to_eight_rotors_and_many_are_tilted_far() -> None:
    drawn = [measured(vehicle) for vehicle in family("multirotor").sample(500, seed=5)]
    assert {each["rotors"][0] for each in drawn} == {4, 5, 6, 7, 8}
    assert np.quantile([each["tilt"][0] for each in drawn], 0.9) > np.radians(20)
    assert np.quantile([each["lopsided"][0] for each in drawn], 0.9) > 0.04


def torques_of(vehicle: Vehicle) -> list[float]:
    """The largest torque about each axis, in both directions, with which a linear programme hovers a vehicle: roll and
    pitch over weight times arm, yaw over weight times torque ratio. NaN: it does not hover.
    """
    arm, weight = measured(vehicle)["arm"][0], vehicle.mass * GRAVITY
    rows = allocation_matrix(vehicle) / (weight * np.array([[1.0], [arm], [arm], [vehicle.torque_ratio]]))
    limits, found = [vehicle.thrust_range] * vehicle.rotor_count, []
    for axis, sign in itertools.product((1, 2, 3), (1, -1)):
        others = [i for i in range(4) if i != axis]
        told = linprog(-sign * rows[axis], A_eq=rows[others], b_eq=[1.0, 0.0, 0.0], bounds=limits)
        found.append(-told.fun if told.status == 0 else np.nan)
    return found


def test_every_frame_hovers_with_torque_to_spare_as_a_linear_programme_sees_it() -> None:
    for vehicle in family("multirotor").sample(100, seed=6):
        assert min(torques_of(vehicle)) >= rotor_frames.MARGIN


def test_frames_that_are_not_straightened_do_not_all_hover() -> None:
    raw = dataclasses.replace(family("multirotor"), straightened=False)
    assert 0.5 < np.mean([min(torques_of(v)) >= rotor_frames.MARGIN for v in raw.sample(100, seed=6)]) < 0.95


def test_the_draws_fill_the_ranges() -> None:
    """Of the quantities that are drawn from end to end, some draws come near to either end."""
    drawn = [measured(vehicle) for vehicle in family().sample(2000, seed=4)]
    for name in ("mass", "arm", "thrust_to_weight", "motor_time_constant", "rate_gain", "latency", "inertia_ratio"):
        low, high = getattr(family().ranges, name)
        values = np.array([each[name][0] for each in drawn])
        assert values.min() < low + 0.06 * (high - low)
        assert values.max() > high - 0.12 * (high - low)


@pytest.mark.parametrize("name", ["any", "multirotor"])
def test_numpy_and_jax_draw_the_same(name: str) -> None:
    u = np.random.default_rng(0).random((6, family(name).drawn))
    here, there = family(name).draw(u), family(name).draw(jnp.asarray(u, jnp.float32))
    for field in quantities(here):
        wanted = getattr(here, field.name)
        assert wanted.shape[0] == 6
        np.testing.assert_allclose(getattr(there, field.name), wanted, rtol=3e-5, atol=1e-9 if name == "any" else 1e-6)


def test_the_shipped_vehicles_are_of_any() -> None:
    assert family_names() == ["any", "multirotor"]
    assert "any" not in vehicle_names()
    for name in vehicle_names():
        assert family("multirotor").ranges.outside(load_vehicle(name)) == ()
        if load_vehicle(name).rotor_count == 4:
            assert family().ranges.outside(load_vehicle(name)) == ()
        assert load_family(name) is None
        assert nominal_vehicle(name).hash == load_vehicle(name).hash


@pytest.mark.parametrize(
    ("field", "factor", "said"),
    [
        ("mass", 20.0, "mass of vehicle 'vis_r' is 15 kg; accepted: 0.025 to 12 kg"),
        ("rotor_position", 6.0, "arm of vehicle 'vis_r' is 0.45 m; accepted: 0.03 to 0.4 m"),
        ("motor_time_constant", 4.0, "motor_time_constant of vehicle 'vis_r' is 0.14 s; accepted: 0.015 to 0.1 s"),
        ("rate_gain", 0.2, "rate_gain of vehicle 'vis_r' is 5 1/s; accepted: 8 to 120 1/s"),
        ("latency", 3.0, "latency of vehicle 'vis_r' is 0.18 s; accepted: 0 to 0.12 s"),
        ("body_rate_max", 0.4, "roll_rate_max of vehicle 'vis_r' is 4 rad/s; accepted: 5 rad/s or more"),
        ("thrust_map", 0.5, "thrust_to_weight of vehicle 'vis_r' is 1.959; accepted: 2 to 6"),
    ],
)
def test_what_lies_outside_is_named_with_what_is_accepted(field: str, factor: float, said: str) -> None:
    own = load_vehicle("vis_r")
    vehicle = dataclasses.replace(own, **{field: getattr(own, field) * factor})
    ranges = dataclasses.replace(family().ranges, thrust_to_weight=(2.0, 6.0))
    assert said in ranges.outside(vehicle)


def test_a_flight_controller_that_takes_faster_rates_is_no_reason() -> None:
    own = load_vehicle("vis_r")
    assert family().ranges.outside(dataclasses.replace(own, body_rate_max=own.body_rate_max * 3)) == ()


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("thrust_to_weight", "[0.8, 6.0]", r"thrust_to_weight is \[0.8, 6.0\] 1; accepted: two rising numbers above "
         "1.05, at most 20: no other vehicle can hover"),
        ("mass", "[12.0, 0.03]", r"mass is \[12.0, 0.03\] kg; accepted: two rising numbers above 0"),
        ("latency", "[0.0, 2.0]", r"latency is \[0.0, 2.0\] s; accepted: two rising numbers of at least 0, at most 1"),
        ("arm", "0.3", r"arm.value is 0.3; accepted: numbers of shape \(2,\)"),
        ("control_rate", "[30.0, 100.0]", r"control_rate is \[30.0, 100.0\] Hz; accepted: one rate, twice"),
        ("rate_gain", "[80.0, 120.0]", r"rate_gain begins at 80.0 1/s .* product of at most 4"),
        ("rotors", "[4, 9]", r"rotors is \[4.0, 9.0\] 1; accepted: two rising numbers of at least 4, at most 8"),
        ("tilt", "[0.0, 1.0]", r"tilt is \[0.0, 1.0\] rad; accepted: two rising numbers of at least 0, at most 0.785"),
    ],
)  # fmt: skip
def test_ranges_that_no_vehicle_can_meet_are_refused(tmp_path: Path, name: str, value: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        load_family(changed(tmp_path, name, value))


def test_a_family_is_no_vehicle(tmp_path: Path) -> None:
    for name in ("any", changed(tmp_path, "mass", "[0.2, 0.3]")):
        with pytest.raises(
            ValueError, match=r"is a family, the ranges of many vehicles; accepted here: one vehicle: cr"
        ):
            load_vehicle(name)


def test_own_ranges_are_drawn_from(tmp_path: Path) -> None:
    small = load_family(changed(tmp_path, "mass", "[0.2, 0.3]"))
    assert small is not None
    assert {round(vehicle.mass, 1) for vehicle in small.sample(50, seed=0)} == {0.2, 0.3}
    assert small.hash != family().hash


def test_ranges_of_frames_are_given_together(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(vehicle_file("multirotor").read_text().split("[tilt]")[0])
    with pytest.raises(ValueError, match="rotors, tilt, lopsided are not all given; accepted: all three, or none"):
        load_family(file)
