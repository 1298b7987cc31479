"""The digital prototype: solids whose inertia is known, and Monte Carlo against first-order error propagation."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from e2efly.alignment.parts import estimates, prototype, read_on_the_ground, read_parts
from e2efly.vehicles.loading import _HERE, load_vehicle


def parts(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "parts.toml"
    path.write_text(text)
    return path


ONE = '[[part]]\nname = "a"\nshape = "{shape}"\nsize = {size}\nmass = {mass}\nplace = {place}\n'


@pytest.mark.parametrize(
    ("shape", "size", "inertia"),
    [
        ("box", [0.1, 0.2, 0.3], [0.13 / 12, 0.10 / 12, 0.05 / 12]),
        ("cylinder", [0.2, 0.3], [(0.03 + 0.09) / 12, (0.03 + 0.09) / 12, 0.005]),
        ("tube", [0.2, 0.1, 0.3], [(3 * 0.0125 + 0.09) / 12, (3 * 0.0125 + 0.09) / 12, 0.00625]),
        ("sphere", 0.2, [0.004, 0.004, 0.004]),
    ],
)
def test_a_solid_has_the_inertia_of_the_textbooks(
    tmp_path: Path, shape: str, size: object, inertia: list[float]
) -> None:
    found = prototype(read_parts(parts(tmp_path, ONE.format(shape=shape, size=size, mass=1.0, place=[0, 0, 0]))))
    assert np.allclose(found.inertia, np.diag(inertia), rtol=1e-12)
    assert found.mass == 1.0


def test_a_box_cut_in_two_is_the_box(tmp_path: Path) -> None:
    """The parallel-axis theorem, with the whole away from the origin and turned."""
    turn = "angles = [0.3, -0.4, 0.5]\n"
    whole = ONE.format(shape="box", size=[0.2, 0.1, 0.05], mass=0.4, place=[0.1, 0.2, -0.3]) + turn
    found = prototype(read_parts(parts(tmp_path, whole)))
    r = read_parts(tmp_path / "parts.toml")[0].turn
    halves = [(np.array([0.1, 0.2, -0.3]) + r @ np.array([x, 0, 0])).tolist() for x in (-0.05, 0.05)]
    cut = prototype(
        read_parts(parts(tmp_path, ONE.format(shape="box", size=[0.1, 0.1, 0.05], mass=0.2, place=halves) + turn))
    )
    assert np.allclose(cut.inertia, found.inertia, rtol=1e-9)
    assert np.allclose(cut.centre, [0.1, 0.2, -0.3])


def test_tolerances_spread_as_first_order_theory_says(tmp_path: Path) -> None:
    """Two masses on a rod: J = m d^2 / 2; its relative spread is that of the distance twice, and of the mass."""
    text = ONE.format(shape="sphere", size=1e-3, mass=0.1, place=[[0.1, 0, 0], [-0.1, 0, 0]])
    found = prototype(read_parts(parts(tmp_path, text + "tolerance = { mass = 0.002, place = 0.001 }\n")))
    assert np.isclose(found.mass_sigma, 0.002 * np.sqrt(2), rtol=0.05)
    expected = 0.002 * np.hypot(np.sqrt(2) * 0.01, np.sqrt(2) * 0.02 / 2)
    assert np.isclose(found.inertia_sigma[2, 2], 0.001 * expected / 0.001, rtol=0.06)


def test_a_mesh_is_its_solid(tmp_path: Path) -> None:
    trimesh.creation.box((0.1, 0.2, 0.3)).export(tmp_path / "box.stl")
    text = '[[part]]\nname = "m"\nshape = "mesh"\nfile = "box.stl"\nmass = 1.0\nplace = [0, 0, 0]\n'
    found = prototype(read_parts(parts(tmp_path, text)))
    assert np.allclose(found.inertia, np.diag([0.13 / 12, 0.10 / 12, 0.05 / 12]), rtol=1e-5)
    open_one = trimesh.creation.box((1, 1, 1))
    open_one.update_faces(np.arange(len(open_one.faces)) > 0)
    open_one.export(tmp_path / "box.stl")
    with pytest.raises(ValueError, match=r"part 1 \(m\): .*box.stl is not closed; accepted: a watertight mesh"):
        read_parts(tmp_path / "parts.toml")


@pytest.mark.parametrize("name", ["vis_r", "vis_h"])
def test_every_number_of_our_lists_names_a_page_or_says_that_it_is_an_estimate(name: str) -> None:
    """And what is bought can be told from what is guessed: no part is there to fill a gap of the paper's mass."""
    path = _HERE / "parts" / f"{name}.toml"
    listed = read_parts(path)
    for thing in [part.purchase for part in listed]:
        assert thing.price is not None and {*thing.source, *thing.estimate} >= {"mass", "price_usd"}
    for thing in read_on_the_ground(path):
        assert thing.price is not None and "price_usd" in {*thing.source, *thing.estimate}
    assert all(thing.date for thing in (p.purchase for p in listed) if "price_usd" in thing.source)
    assert sum(part.battery for part in listed) == 1


@pytest.mark.parametrize("name", ["vis_r", "vis_h"])
def test_our_lists_with_the_battery_are_vehicles_of_the_papers_kind(name: str) -> None:
    mass, inertia = estimates(_HERE / "parts" / f"{name}.toml")
    vehicle = load_vehicle(name)
    assert np.isclose(mass.value, vehicle.mass, rtol=0.05)
    assert np.all(np.abs(inertia.value / vehicle.inertia - 1) < 0.4)
    parts = read_parts(_HERE / "parts" / f"{name}.toml")
    assert np.isclose(mass.value, sum(len(p.places) * p.mass for p in parts))
    motors = next(part for part in parts if part.name.startswith("motor"))
    assert np.allclose(motors.places[:, :2], vehicle.rotor_position, atol=1e-3), "in the vehicle file's order"


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ("price_usd = -1\n", "price_usd is -1; accepted: 0 or more"),
        ("price_usd = '5'\n", "price_usd is '5'; accepted: a finite number"),
        ("date = 'May'\n", "date is 'May'; accepted: a day, a month or a year"),
        ("source.mas = 'https://a.b'\n", "source: unknown key 'mas'; did you mean 'mass'"),
        ("source.mass = 'a.b'\n", "source.mass is 'a.b'; accepted: the address of a page"),
        ("estimate.mass = ' '\n", "estimate.mass is empty; accepted: a text"),
        ("estimate = 'guess'\n", "estimate is 'guess'; accepted: a table of texts"),
        ("battery = 1\n", "battery is 1; accepted: true or false"),
        ("[[ground]]\nname = 'b'\ncount = 0\n", "ground 1: count is 0; accepted: a whole number, 1 or more"),
        ("[[ground]]\nname = 'b'\nmass = 1\n", "ground 1: unknown key 'mass'"),
        ("[[ground]]\nprice_usd = 1\n", "ground 1: name is None; accepted: a text"),
        ("[[air]]\nname = 'b'\n", r"has the keys part, air; accepted: tables \[\[part\]\], one or more, and"),
    ],
)
def test_what_is_wrong_about_buying_is_refused_by_name(tmp_path: Path, more: str, told: str) -> None:
    path = parts(tmp_path, ONE.format(shape="sphere", size=1, mass=1, place=[0, 0, 0]) + more)
    with pytest.raises(ValueError, match=told):
        read_on_the_ground(path), read_parts(path)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", r"has the keys none; accepted: tables \[\[part\]\]"),
        ("[[part]]\nname = 'a'\n", "part 1: missing key 'shape', 'mass', 'place'"),
        (ONE.format(shape="bx", size=[1, 1, 1], mass=1, place=[0, 0, 0]), "unknown shape 'bx'; did you mean 'box'"),
        (ONE.format(shape="box", size=[1, 1], mass=1, place=[0, 0, 0]), r"part 1 \(a\): size is \[1, 1\]; accepted: 3"),
        (ONE.format(shape="box", size=[1, 1, 1], mass=-1, place=[0, 0, 0]), "mass is -1; accepted: a number above 0"),
        (ONE.format(shape="tube", size=[1, 2, 1], mass=1, place=[0, 0, 0]), "no tube without a wall"),
        (ONE.format(shape="box", size=[1, 1, 1], mass=1, place=[0, 0]), "place is"),
        (ONE.format(shape="box", size=[1, 1, 1], mass=1, place=[0, 0, 0]) + "masss = 2\n", "did you mean 'mass'"),
        (
            ONE.format(shape="box", size=[1, 1, 1], mass=1, place=[0, 0, 0]) + "tolerance = { mass = -1 }\n",
            "tolerance.mass is -1; accepted: 0 or more",
        ),
    ],
)
def test_a_wrong_list_is_refused_by_name(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        read_parts(parts(tmp_path, text))
