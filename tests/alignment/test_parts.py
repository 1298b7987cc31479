"""The digital prototype: solids whose inertia is known, and Monte Carlo against first-order error propagation."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from e2efly.alignment.parts import estimates, prototype, read_parts
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
def test_our_lists_come_near_the_papers_inertia(name: str) -> None:
    mass, inertia = estimates(_HERE / "parts" / f"{name}.toml")
    vehicle = load_vehicle(name)
    assert np.isclose(mass.value, vehicle.mass, rtol=0.01)
    assert np.all(np.abs(inertia.value / vehicle.inertia - 1) < 0.2)


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
