"""Vehicle files: what the shipped ones say, and what is said of broken ones."""

import dataclasses
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import e2efly.vehicles.vehicle as module
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle, vehicle_names
from e2efly.vehicles.vehicle import Vehicle, allocation_matrix, quantities

SHIPPED = ("crazyflie", "hexa", "octo", "vis_h", "vis_r")


@pytest.fixture
def table() -> dict[str, dict[str, Any]]:
    return tomllib.loads((Path(module.__file__).parent / "vis_r.toml").read_text())


@pytest.fixture
def load(tmp_path: Path) -> Callable[[dict], Vehicle]:
    """Write a table as the TOML file my_quad.toml and load it."""

    def write_and_load(table: dict[str, dict[str, Any]]) -> Vehicle:
        path = tmp_path / "my_quad.toml"
        path.write_text("\n".join(_toml(key, entry) for key, entry in table.items()))
        return load_vehicle(path)

    return write_and_load


def _toml(key: str, entry: Any) -> str:
    if not isinstance(entry, dict):
        return f"{key} = {entry!r}\n"
    lines = (f"{k} = {v!r}" if not isinstance(v, str) else f'{k} = "{v}"' for k, v in entry.items())
    return f"[{key}]\n" + "\n".join(lines) + "\n"


def test_every_shipped_vehicle_loads() -> None:
    assert tuple(vehicle_names()) == SHIPPED
    for name in SHIPPED:
        assert load_vehicle(name).name == name


@pytest.mark.parametrize(("name", "rotor_speed", "thrust_to_weight"), [("vis_r", 2117, 2.78), ("vis_h", 1677, 4.44)])
def test_the_papers_checks(name: str, rotor_speed: float, thrust_to_weight: float) -> None:
    vehicle = load_vehicle(name)
    assert vehicle.hover_rotor_speed == pytest.approx(rotor_speed, abs=0.5)
    assert 4 * vehicle.rotor_thrust(vehicle.hover_rotor_speed) == pytest.approx(vehicle.mass * GRAVITY, rel=1e-12)
    assert vehicle.thrust_to_weight == pytest.approx(thrust_to_weight, abs=0.005)


def test_the_papers_table() -> None:
    r, h = load_vehicle("vis_r"), load_vehicle("vis_h")
    assert (r.mass, h.mass) == (0.75, 0.47)
    np.testing.assert_array_equal(r.inertia, [1.41e-3, 1.53e-3, 2.05e-3])
    np.testing.assert_array_equal(h.inertia, [1.25e-3, 1.28e-3, 2.03e-3])
    assert (r.latency, h.latency) == (0.060, 0.090)
    for vehicle in (r, h):
        np.testing.assert_allclose(np.abs(vehicle.rotor_position), 0.075 / np.sqrt(2), rtol=1e-12)
        np.testing.assert_array_equal(vehicle.thrust_map, [4.04e-7, 2.56e-5, -2.62e-2])
        assert (vehicle.motor_time_constant, vehicle.control_rate, vehicle.torque_ratio) == (0.035, 30.0, 0.016)


@pytest.mark.parametrize("name", ["crazyflie", "vis_h", "vis_r"])
def test_rotor_order_is_betaflights_and_a_level_quad_has_no_torque(name: str) -> None:
    vehicle = load_vehicle(name)
    np.testing.assert_array_equal(np.sign(vehicle.rotor_position), [[-1, -1], [1, -1], [-1, 1], [1, 1]])
    np.testing.assert_array_equal(vehicle.rotor_spin, [1, -1, -1, 1])
    np.testing.assert_allclose(allocation_matrix(vehicle) @ np.ones(4), [4, 0, 0, 0], atol=1e-12)


@pytest.mark.parametrize(("name", "count"), [("hexa", 6), ("octo", 8)])
def test_a_wheel_of_rotors_has_no_torque(name: str, count: int, tmp_path: Path) -> None:
    vehicle = load_vehicle(name)
    assert (vehicle.rotor_count, vehicle.mixer_rule) == (count, "qp")
    np.testing.assert_allclose(allocation_matrix(vehicle) @ np.ones(count), [count, 0, 0, 0], atol=1e-6)
    path, text = tmp_path / "mine.toml", (Path(module.__file__).parent / f"{name}.toml").read_text()
    for mixer in ("shift", "betaflight"):
        path.write_text(f'mixer = "{mixer}"\n{text}')
        assert load_vehicle(path).mixer_rule == mixer
        assert load_vehicle(path).hash != vehicle.hash
    for given in ("3", '"quick"'):
        path.write_text(f"mixer = {given}\n{text}")
        with pytest.raises(ValueError, match=r"mine\.toml: mixer is .*; accepted: 'shift', 'betaflight', 'qp', or no"):
            load_vehicle(path)
    spins = f"value = {[int(x) for x in vehicle.rotor_spin]}"
    path.write_text(text.replace(spins, "value = [1, -1, 1, -1]"))
    with pytest.raises(ValueError, match=rf"rotor_position.value has {count} rotors, and rotor_spin.value 4; accepted"):
        load_vehicle(path)
    axes = [[0.0, 0.0, 1.0]] * (count - 1) + [[0.0, 0.6, 0.7]]
    path.write_text(f'{text}\n[rotor_axis]\nvalue = {axes}\nunit = "1"\nsource = "estimated"\n')
    with pytest.raises(ValueError, match=r"rotor_axis.value is .*accepted: for each rotor a vector of length 1"):
        load_vehicle(path)


def test_thrust_torque_signs() -> None:
    """Left rotors roll right side down (+x), rear rotors pitch the nose down (+y), +1 spins yaw left (+z)."""
    allocation = allocation_matrix(load_vehicle("vis_r"))
    np.testing.assert_array_equal(np.sign(allocation @ [0, 0, 1, 1])[:2], [1, 1])
    np.testing.assert_array_equal(np.sign(allocation @ [1, 0, 1, 0])[[0, 2]], [1, 1])
    np.testing.assert_array_equal(np.sign(allocation @ [1, 0, 0, 1])[[0, 3]], [1, 1])


def test_both_thrust_limits_hold_and_the_tighter_binds() -> None:
    vehicle = load_vehicle("vis_r")
    assert vehicle.rotor_thrust(4200.0) == pytest.approx(7.21, abs=0.005)
    assert vehicle.thrust_range[1] == 5.12  # by thrust: 3537 rad/s
    slower = dataclasses.replace(vehicle, rotor_speed_max=3000.0)
    assert slower.thrust_range[1] == pytest.approx(4.04e-7 * 3000**2 + 2.56e-5 * 3000 - 2.62e-2, rel=1e-12)
    assert slower.thrust_range[1] < 5.12


def test_thrust_is_never_negative() -> None:
    vehicle = load_vehicle("vis_r")
    assert vehicle.rotor_thrust(0.0) == vehicle.rotor_thrust(224.0) == 0.0
    assert vehicle.rotor_thrust(226.0) > 0
    assert vehicle.thrust_range[0] == vehicle.rotor_thrust(300.0) > 0


@pytest.mark.parametrize("name", ["VIS-R", "vis_r", "Vis-r"])
def test_a_name_may_be_written_as_in_the_paper(name: str) -> None:
    assert load_vehicle(name).name == "vis_r"


def test_a_users_file_by_path(load: Callable[[dict], Vehicle], table: dict) -> None:
    table["mass"]["value"] = 0.8
    vehicle = load(table)
    assert vehicle.name == "my_quad"
    assert vehicle.mass == 0.8
    assert vehicle.rotor_position.shape == (4, 2)


def test_the_hash_depends_on_every_value_and_not_on_the_name(load: Callable[[dict], Vehicle], table: dict) -> None:
    vehicle = load_vehicle("vis_r")
    assert load(table).hash == vehicle.hash
    assert len(vehicle.hash) == 16
    hashes = {vehicle.hash}
    for f in quantities():
        value = np.array(getattr(vehicle, f.name), np.float64)
        value.flat[-1] = value.flat[-1] * (1 + 1e-9) or 1e-9
        hashes.add(dataclasses.replace(vehicle, **{f.name: value}).hash)
    assert len(hashes) == 1 + len(quantities())


BROKEN: dict[str, tuple[Callable[[dict], Any], tuple[str, ...]]] = {
    "unknown key": (lambda t: t.update(mas=t.pop("mass")), ("'mas'", "did you mean 'mass'")),
    "unknown key like none": (lambda t: t.update(qqqq=t["mass"]), ("'qqqq'", "accepted: mass, inertia")),
    "missing key": (lambda t: t.pop("radius"), ("missing key 'radius'",)),
    "missing keys": (lambda t: (t.pop("radius"), t.pop("mass")), ("missing key 'mass', 'radius'",)),
    "not a table": (lambda t: t.update(mass=0.75), ("[mass] is 0.75", "value, unit and source")),
    "missing source": (lambda t: t["mass"].pop("source"), ("[mass]", "value, unit and source")),
    "empty source": (lambda t: t["mass"].update(source=" "), ("mass.source is ' '", "where it is from")),
    "more than a source": (lambda t: t["mass"].update(note="x"), ("[mass]", "note", "value, unit and source")),
    "wrong unit": (lambda t: t["mass"].update(unit="g"), ("mass.unit is 'g'", "accepted: 'kg'")),
    "wrong shape": (lambda t: t["inertia"].update(value=[1e-3, 1e-3]), ("inertia.value", "[0.001, 0.001]", "(3,)")),
    "ragged": (
        lambda t: t["rotor_position"].update(value=[[1.0], [1.0, 2.0]]), ("rotor_position.value", "[[1.0], ", "(N, 2)")
    ),
    "list for a number": (lambda t: t["mass"].update(value=[0.75]), ("mass.value is [0.75]", "a number")),
    "text for a number": (lambda t: t["mass"].update(value="heavy"), ("mass.value is 'heavy'", "a number")),
    "negative": (lambda t: t["mass"].update(value=-0.75), ("mass.value is -0.75", "> 0 kg")),
    "zero": (lambda t: t["motor_time_constant"].update(value=0.0), ("motor_time_constant.value is 0.0", "> 0 s")),
    "negative latency": (lambda t: t["latency"].update(value=-0.01), ("latency.value is -0.01", ">= 0 s")),
    "triangle inequality": (
        lambda t: t["inertia"].update(value=[1e-3, 1e-3, 3e-3]), ("inertia.value", "0.003", "triangle inequality")
    ),
    "cannot hover": (lambda t: t["mass"].update(value=2.2), ("mass.value is 2.2 kg", "5.12 N", "cannot hover", "1.05")),
    "hovers below idle": (lambda t: t["rotor_speed_min"].update(value=2500.0), ("cannot hover", "less than 1 at idle")),
    "idle without thrust": (
        lambda t: t["rotor_speed_min"].update(value=200.0), ("rotor_speed_min.value is 200;", "positive and rising")
    ),
    "idle where the thrust begins": (
        lambda t: (t["rotor_speed_min"].update(value=0.0), t["thrust_map"].update(value=[1e-6, 0.0, 0.0])),
        ("rotor_speed_min.value is 0; accepted: 0.1 rad/s or more", "[1e-06, 0.0, 0.0]"),
    ),
    "idle above the top": (
        lambda t: t["rotor_speed_min"].update(value=5e3), ("rotor_speed_min.value is 5000;", "below rotor_speed_max")
    ),
    "falling thrust map": (lambda t: t["thrust_map"].update(value=[-1e-7, 1e-3, 0.0]), ("thrust_map.value", "k2 > 0")),
    "three spins alike": (lambda t: t["rotor_spin"].update(value=[1, 1, 1, -1]), ("rotor_spin.value", "two of +1")),
    "no yaw": (lambda t: t["rotor_spin"].update(value=[1, 1, -1, -1]), ("rotor_spin", "without control")),
    "too large": (lambda t: t["mass"].update(value=1e300), ("mass.value is 1e+300", "at most 1e+06 in size")),
    "rate of an age": (lambda t: t["control_rate"].update(value=1e-9), ("control_rate.value is 1e-09", ">= 0.1 Hz")),
    "no torque ratio": (lambda t: t["torque_ratio"].update(value=0), ("torque_ratio", "without control")),
    "rotors in a line": (
        lambda t: t["rotor_position"].update(value=[[-0.1, 0.0], [0.1, 0.0], [-0.2, 0.0], [0.2, 0.0]]),
        ("rotor_position.value", "without control"),
    ),
    "tilt of a right angle": (lambda t: t["tilt_max"].update(value=1.6), ("tilt_max.value is 1.6", "below pi/2")),
}  # fmt: skip


@pytest.mark.parametrize("kind", BROKEN)
def test_a_broken_file_says_what_is_wrong(kind: str, load: Callable[[dict], Vehicle], table: dict) -> None:
    break_it, words = BROKEN[kind]
    break_it(table)
    with pytest.raises(ValueError, match=re.escape("my_quad.toml: ")) as caught:
        load(table)
    for word in words:
        assert word in str(caught.value)
    assert "np.float64" not in str(caught.value)


@pytest.mark.parametrize("thrust_map", [[1.33e-6, 3.84e-3, -1.77], [1.33e-6, 0.0, 0.0], [1.33e-6, -3e-4, 0.5]])
def test_the_smallest_idle_that_a_refusal_names_is_accepted(
    thrust_map: list[float], load: Callable[[dict], Vehicle], table: dict
) -> None:
    table["thrust_map"]["value"] = thrust_map
    table["rotor_speed_min"]["value"] = 0.0
    with pytest.raises(ValueError, match="positive and rising") as caught:
        load(table)
    least = float(str(caught.value).partition("accepted: ")[2].split()[0])
    assert least == {-1.77: 404.4, 0.0: 0.1, 0.5: 112.8}[thrust_map[2]]
    table["rotor_speed_min"]["value"] = least
    assert load(table).thrust_range[0] > 0


def test_true_is_no_number(tmp_path: Path) -> None:
    text = (Path(module.__file__).parent / "vis_r.toml").read_text()
    path = tmp_path / "my_quad.toml"
    path.write_text(re.sub(r"(\[position_gain\]\s+value = \[)[^,]+", r"\1true", text))
    with pytest.raises(ValueError, match=r"position_gain\.value is \[True, .*; accepted: numbers of shape"):
        load_vehicle(path)


@pytest.mark.parametrize("number", ["nan", "inf", "-inf"])
@pytest.mark.parametrize("key", [f.name for f in quantities()])
def test_no_value_may_be_nan_or_infinite(key: str, number: str, tmp_path: Path, table: dict) -> None:
    value = np.array(table[key]["value"], np.float64)
    value.flat[0] = float(number)
    table[key]["value"] = value.tolist()
    path = tmp_path / "my_quad.toml"
    path.write_text("\n".join(_toml(k, entry) for k, entry in table.items()))
    with pytest.raises(ValueError, match=rf"{key}\.value is .*{number}.*; accepted: .*finite"):
        load_vehicle(path)


@pytest.mark.parametrize("content", [b"mass = = 3", b"\xff\xfe\x00"])
def test_not_a_toml_file(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"bad\.toml: not a TOML file"):
        load_vehicle(path)


def test_a_file_with_a_byte_order_mark(tmp_path: Path) -> None:
    path = tmp_path / "vis_r.toml"
    path.write_text((Path(module.__file__).parent / "vis_r.toml").read_text(), encoding="utf-8-sig")
    assert load_vehicle(path).hash == load_vehicle("vis_r").hash


def test_unknown_name() -> None:
    with pytest.raises(ValueError, match=r"unknown vehicle 'vis_x'; did you mean 'vis_[hr]'.*octo, vis_h, vis_r"):
        load_vehicle("vis_x")
    with pytest.raises(ValueError, match=r"vehicle file 'nowhere/quad\.toml' does not exist"):
        load_vehicle("nowhere/quad.toml")
