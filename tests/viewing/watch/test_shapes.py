"""What vehicles look like in the viewer."""

import numpy as np

from e2efly.control.vectors import rotate
from e2efly.vehicles.loading import load_vehicle
from e2efly.viewing.watch.triangles import mesh_of, quadrotor, spun


def test_rotors_are_where_the_vehicles_file_has_them_whatever_the_attitude() -> None:
    vehicle = load_vehicle("vis_r")
    shape, rng = quadrotor(vehicle), np.random.default_rng(0)
    attitude = rng.normal(size=(3, 4))
    attitude /= np.linalg.norm(attitude, axis=1, keepdims=True)
    place = rng.normal(size=(3, 3))
    found, _ = spun(shape, place, attitude, np.zeros((3, 4)))
    arms = np.linalg.norm(found.reshape(3, 4, 3) - place[:, None], axis=-1)
    flat = np.linalg.norm(np.asarray(vehicle.rotor_position), axis=-1)
    assert np.allclose(shape.rotors[:, :2], vehicle.rotor_position)
    assert np.allclose(arms, np.hypot(flat, shape.rotors[:, 2]))


def test_a_spun_rotor_turns_about_the_bodys_axis() -> None:
    shape = quadrotor(load_vehicle("vis_r"))
    tilted = np.array([[np.cos(0.3), np.sin(0.3), 0.0, 0.0]])
    _, still = spun(shape, np.zeros((1, 3)), tilted, np.zeros((1, 4)))
    _, quarter = spun(shape, np.zeros((1, 3)), tilted, np.full((1, 4), np.pi / 2))
    axis, blade = np.tile([0.0, 0.0, 1.0], (4, 1)), np.tile([1.0, 0.0, 0.0], (4, 1))
    assert np.allclose(rotate(still, axis), rotate(quarter, axis))
    assert np.allclose(rotate(quarter, blade), rotate(np.repeat(tilted, 4, 0), np.tile([0.0, 1.0, 0.0], (4, 1))))


def test_rotors_that_push_the_body_one_way_turn_the_other() -> None:
    vehicle = load_vehicle("vis_r")
    assert (quadrotor(vehicle).spin == -np.sign(vehicle.rotor_spin)).all()


def test_a_face_that_repeats_a_corner_is_one_triangle() -> None:
    square, triangle = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 0, 1], [1, 0, 1], [1, 1, 1], [1, 1, 1]]
    mesh = mesh_of(np.array([square, triangle], float), (1.0, 0.0, 0.0))
    corners = mesh.vertices[mesh.faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert len(mesh.faces) == 3
    assert np.isclose(areas.sum(), 1.5)
